"""Each archive by itself: valid, and useful without the other."""

import math
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from closed_loop import Unit


@pytest.fixture(params=["plant", "controller"])
def archive(request):
    return request.getfixturevalue(request.param)


def test_fmpy_finds_no_problem(archive):
    assert validate_fmu(archive) == []


def test_archive_is_complete_and_reproducible(archive):
    with zipfile.ZipFile(archive) as files:
        names = files.namelist()
        assert names == sorted(names)
        # Two packs are the same bytes, so no entry may carry the time of packing.
        assert {info.date_time for info in files.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        page = files.read("documentation/index.html").decode()
    assert "modelDescription.xml" in names
    assert any(name.startswith("binaries/linux64/") for name in names)
    variables = fmpy.read_model_description(archive).modelVariables
    missing = [v.name for v in variables if "[" not in v.name and f"<code>{v.name}</code>" not in page]
    assert missing == [] or set(missing) <= {v.name for v in variables if v.causality in ("local", "independent")}


def test_fmpy_simulates_it_with_its_default_experiment(archive):
    result = fmpy.simulate_fmu(archive, stop_time=1.0)
    assert result["time"][-1] == pytest.approx(1.0)
    for name in result.dtype.names:
        assert np.isfinite(result[name]).all(), name


def test_plant_drives_a_circle_at_constant_steering(plant):
    # Kinematic limit: slowly enough, the yaw rate is v delta / (l_f + l_r); at 3 m/s tyre slip changes it by well below 1 %.
    delta, wheelbase = 0.1, 2.8
    with Unit(plant, "alone") as unit:
        unit.initialize(speed=3.0)
        unit.set(delta=delta, a_x=0.15)
        for k in range(200):
            unit.step(k * 0.01, 0.01)
        rate = unit.get("v_x_true") * math.tan(delta) / wheelbase
        assert unit.get("yaw_rate_true") == pytest.approx(rate, rel=0.01)


def test_controller_steers_towards_the_path_and_towards_its_speed(controller):
    with Unit(controller, "alone") as unit:
        unit.initialize(hold_preview=True)
        unit.set(v_x=10.0, e_y=0.2, **{"v_x_ref[1]": 12.0})
        unit.step(0.0, 0.001)
        # Left of the path: steer to the right. Slower than wanted: accelerate.
        assert unit.get("delta") < -0.001
        assert unit.get("a_x") > 0.1
        assert unit.get("status") <= 1

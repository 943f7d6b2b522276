"""Bad input is answered by an error status and a message that names it; nothing crashes and the next instance works."""

import pytest
from fmpy.fmi1 import FMICallException

from closed_loop import Unit

ERROR = 3


def refused(archive, **parameters):
    """The messages of an instance that must refuse these parameters."""
    with Unit(archive, "refusing") as unit:
        with pytest.raises(FMICallException) as refusal:
            unit.initialize(**parameters)
        assert refusal.value.status == ERROR
        messages = [text for category, text in unit.messages if category == "logStatusError"]
        assert messages, "nothing was logged"
    with Unit(archive, "next") as unit:
        unit.initialize()
        unit.step(0.0, 0.001)
    return " ".join(messages)


def test_unknown_road_is_named_with_the_known_ones(plant):
    message = refused(plant, road="autobahn")
    assert "autobahn" in message and "double_lane_change" in message


def test_malformed_csv_is_named_with_line_and_column(plant, tmp_path):
    file = tmp_path / "a road.csv"
    file.write_text("s,kappa,v_x\n0,0,10\n50,fast,10\n")
    message = refused(plant, road=str(file))
    assert "line 3" in message and "column 2" in message and "fast" in message


def test_csv_that_is_missing_is_named(plant, tmp_path):
    assert "nowhere.csv" in refused(plant, road=str(tmp_path / "nowhere.csv"))


@pytest.mark.parametrize("side", ["plant", "controller"])
def test_negative_mass_is_named(request, side):
    message = refused(request.getfixturevalue(side), m=-1575.0)
    assert "m" in message.split() and "-1575" in message


def test_horizon_zero_is_named(controller):
    message = refused(controller, horizon=0)
    assert "horizon" in message and "0" in message


def test_good_csv_is_driven(plant, tmp_path):
    file = tmp_path / "straight road.csv"
    file.write_text("s,kappa,v_x\n0,0,10\n50,0,10\n100,0,10\n")
    with Unit(plant, "driving") as unit:
        unit.initialize(road=str(file))
        assert unit.get("v_x_true") == 10.0

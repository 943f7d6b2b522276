"""The examples run as a user runs them, and what they print is what vehicle dynamics expects."""

import pathlib
import re
import subprocess
import sys

import pytest

EXAMPLES = pathlib.Path(__file__).parent.parent / "tools" / "examples"


@pytest.fixture
def run(plant, tmp_path):
    def run(name, *arguments):
        command = [sys.executable, str(EXAMPLES / name), plant, *arguments]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def test_step_steer_reports_the_gain_of_the_linear_bicycle(run, tmp_path):
    printed = run("step_steer.py", "--speed", "15", "--angle", "0.01")
    gains = [float(gain) for gain in re.findall(r"gain ([\d.]+)", printed)]
    # v / (l + K v^2): the default tyre is neutral (K = 0), and coasting for three seconds costs 0.5 m/s.
    assert gains == [pytest.approx(14.5 / 2.8, rel=0.03)] * 2
    assert (tmp_path / "step_steer.png").stat().st_size > 10_000


def test_handling_diagram_shows_each_tyre_with_its_gradient(run, tmp_path):
    printed = run("handling_diagram.py")
    gradients = {name: float(value) for name, value in re.findall(r"(\w+): understeer gradient ([+-][\d.]+)", printed)}
    # The linear preset in closed form: m / l (l_r / C_f - l_f / C_r) = 0.0135 rad s2/m, times g in degrees.
    assert gradients["linear"] == pytest.approx(7.6, abs=0.3)
    assert abs(gradients["dry_asphalt"]) < 0.1
    assert (tmp_path / "handling_diagram.png").stat().st_size > 10_000


def test_parameter_sweep_finds_the_limit_of_stability(run):
    rows = [line for line in run("parameter_sweep.py").splitlines()[1:]]
    verdicts = {(row.split()[0], row.split()[1]): row.endswith("unstable") for row in rows}
    assert len(verdicts) == 12
    for friction in ("0.50", "0.82", "1.00"):
        assert not verdicts[friction, "0.03"] and verdicts[friction, "0.12"]

"""Tuning from the command line: interrupted and resumed it ends where it would have ended, and its set fits every reader."""

import json
import pathlib
import re
import signal
import subprocess
import time
import zipfile

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssv

from closed_loop import simulate

ROOT = pathlib.Path(__file__).parent.parent
TUNE = ["--step", "0.033", "--evaluations", "40", "--population", "8", "--search", "r_delta=1:1000", "--search", "q_e_psi=0.01:10"]


@pytest.fixture(scope="module")
def fmu():
    """The tools' program; built once, so that signals reach it and not cargo."""
    build = ["cargo", "build", "--release", "--package", "fmu-tools", "--bin", "fmu", "--message-format", "json"]
    lines = subprocess.run(build, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    programs = [message["executable"] for message in map(json.loads, lines) if message.get("executable")]
    return programs[-1]


def run(fmu, *arguments):
    return subprocess.run([fmu, *arguments], cwd=ROOT, check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="module")
def tuned(fmu, tmp_path_factory):
    """A finished tuning: its parameter set and what it printed."""
    file = tmp_path_factory.mktemp("tuned") / "tuned.ssv"
    return file, run(fmu, "tune", *TUNE, "--output", str(file))


def values(file):
    return {parameter.name: float(parameter.value) for parameter in read_ssv(str(file), validate=True).parameters}


def test_the_set_is_valid_and_better_on_what_was_not_seen(tuned):
    file, text = tuned
    assert set(values(file)) == {"r_delta", "q_e_psi"}
    before, after = map(float, re.search(r"^not seen: fitness\s+(\S+)\s+(\S+)", text, re.MULTILINE).groups())
    assert after < before, text
    assert file.with_suffix(".html").stat().st_size > 10_000


def test_simulate_takes_the_set(fmu, tuned):
    file, _ = tuned
    typed = [word for name, value in values(file).items() for word in ("--set", f"controller.{name}={value!r}")]

    def table(*arguments):
        # The first line has the time that it took.
        return run(fmu, "simulate", "--step", "0.033", *arguments).splitlines()[1:]

    assert table("--parameters", str(file)) == table(*typed) != table()


def test_the_system_takes_the_set(tuned, ecos, system, plant, controller, tmp_path):
    file, _ = tuned
    archive = tmp_path / "tuned.ssp"
    with zipfile.ZipFile(system) as source, zipfile.ZipFile(archive, "w") as target:
        for name in source.namelist():
            target.writestr(name, file.read_bytes() if name.endswith("shipped_weights.ssv") else source.read(name))
    step, stop = 0.01, 5.0
    # FMPy's runner of systems leaves parameter sets aside; ecos takes them by their names.
    with ecos.EcosSimulation(ssp_path=str(archive), step_size=step) as simulation:
        simulation.init(parameter_set="tuned_weights")
        e_y = []
        while len(e_y) < round(stop / step):
            simulation.step()
            e_y.append(simulation.get_real("plant::e_y_true"))

    def difference(parameters):
        direct = simulate(plant, controller, step, stop, controller=parameters, sums=True)["e_y_true"]
        return np.abs(direct[: len(e_y)] - e_y[: len(direct)]).max()

    assert difference(values(file)) == 0.0 < difference({})


def test_an_interrupted_tuning_saves_its_best_and_resumes_to_the_same_end(fmu, tuned, tmp_path):
    whole, _ = tuned
    file = tmp_path / "tuned.ssv"
    command = [fmu, "tune", *TUNE, "--output", str(file)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        # Its first generation is done.
        limit = time.monotonic() + 60
        while not file.with_suffix(".checkpoint.json").is_file():
            assert time.monotonic() < limit and process.poll() is None, "no checkpoint"
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        text, _ = process.communicate(timeout=120)
    assert process.returncode == 128 + signal.SIGINT and "--resume goes on" in text, text
    assert values(file)
    assert " of them now, in " in run(fmu, "tune", *TUNE, "--output", str(file), "--resume")
    assert file.read_bytes() == whole.read_bytes()


def test_a_checkpoint_of_other_settings_is_refused(fmu, tuned):
    file, _ = tuned
    other = [fmu, "tune", *TUNE, "--seed", "2", "--output", str(file), "--resume"]
    answer = subprocess.run(other, cwd=ROOT, capture_output=True, text=True)
    assert answer.returncode == 1 and "belongs to a tuning with other settings" in answer.stderr


def test_the_benchmark_speaks_json(fmu):
    said = json.loads(run(fmu, "tune", "--benchmark", "sphere", "--seeds", "6", "--json"))
    assert (said["function"], said["evaluations"], said["seeds"]) == ("sphere", 4550, 6)
    # The paper's hundred iterations of the hybrid.
    assert said["medians"]["guided"] <= said["medians"]["hybrid"] <= 4.24e-8

"""Runs by workers that may die: every task gets its result, the same as without workers, and none is driven twice."""

import argparse
import json
import os
import pathlib
import signal
import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
from fmpy.ssp.ssd import read_ssv

ROOT = pathlib.Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tools" / "distributed"))

import campaign
import drive
import fleet
import tune

STEP = 0.033
LANE_CHANGE = {"name": "lane change", "plant": {"road": "double_lane_change"}}
TEN = {"name": "10 m/s", "plant": {"speed": 10.0}}


@pytest.fixture(scope="module")
def archives(plant, controller):
    folder = pathlib.Path(plant).parent
    assert pathlib.Path(controller).parent == folder
    return folder


@pytest.fixture(scope="module")
def arguments(archives, tmp_path_factory):
    parser = argparse.ArgumentParser()
    fleet.add_arguments(parser)
    results = tmp_path_factory.mktemp("results")
    return parser.parse_args(["--results", str(results), "--archives", str(archives), "--step", str(STEP), "--stop", "60"])


@pytest.fixture(scope="module")
def client(arguments):
    with fleet.connected(arguments) as client:
        yield client


def task(archives=None, controller=None, **plant):
    return {"plant": plant, "controller": controller or {}, "step": STEP, "stop": 60.0, "archives": archives and str(archives)}


def native(*arguments):
    """Columns of the same run by the tools, without FMI."""
    command = ["cargo", "fmu", "simulate", "--step", str(STEP), *arguments]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)


def test_a_run_of_the_archives_has_the_figures_of_the_native_run(archives, tmp_path):
    file = tmp_path / "run.csv"
    native("--set", "controller.r_delta=30", "--csv", str(file))
    table = np.genfromtxt(file, delimiter=",", names=True, skip_header=0, deletechars="")[1:]
    rms = {
        "e_y_rms": np.sqrt(np.mean(table["e_y_true"] ** 2)),
        "e_psi_rms": np.sqrt(np.mean(table["e_psi_true"] ** 2)),
        "v_x_rms": np.sqrt(np.mean((table["v_x_true"] - table["v_x_ref[1]"]) ** 2)),
    }
    result = drive.evaluate(task(archives, {"r_delta": 30.0}))
    assert result["error"] == ""
    # The runs have the same bits; only the order of the sums may differ.
    for name, value in rms.items():
        assert result[name] == pytest.approx(value, rel=1e-12), name


def test_a_hopeless_candidate_gets_a_penalty_and_a_reason(archives):
    lost = drive.evaluate(task(archives, delta_max=0.001))
    assert lost["error"] == "" and drive.LOST < lost["figure"] < 2 * drive.LOST
    refused = drive.evaluate(task(archives, {"q_yaw": 1.0}))
    assert (refused["figure"], refused["error"]) == (2 * drive.LOST, "unknown parameter q_yaw")


def test_a_worker_that_is_killed_in_mid_run_costs_no_result(archives, client):
    weights = [10.0 ** (0.25 * k) for k in range(12)]
    tasks = {weight: task(controller={"r_delta": weight}) for weight in weights}
    found, killed = {}, None
    for key, result in fleet.run(client, tasks):
        found[key] = result
        if killed is None:
            killed = next(iter(client.run(os.getpid).values()))
            os.kill(killed, signal.SIGKILL)
    assert set(found) == set(weights) and None not in found.values()
    # The dead worker is gone and another is there for it.
    client.wait_for_workers(2, timeout=60)
    assert killed not in client.run(os.getpid).values()
    for weight in (weights[0], weights[-1]):
        alone = drive.evaluate(task(archives, {"r_delta": weight}))
        assert found[weight]["figure"] == alone["figure"], weight


def test_what_is_known_is_not_driven_again(arguments, client):
    pairs = [({"r_delta": weight}, situation) for weight in (20.0, 200.0) for situation in (LANE_CHANGE, TEN)]
    with fleet.Store(arguments.results) as store:
        first = fleet.drive_all(client, store, pairs[:3], arguments)
    with fleet.Store(arguments.results) as store:
        assert len(store.rows) == 3

        def run(client, tasks):
            assert len(tasks) == 1, "only the fourth pair is new"
            return original(client, tasks)

        original, fleet.run = fleet.run, run
        try:
            again = fleet.drive_all(client, store, pairs, arguments)
        finally:
            fleet.run = original
    assert again[:3] == first
    rows = pq.read_table(arguments.results).to_pylist()
    assert sorted(row["situation"] for row in rows) == sorted(2 * [LANE_CHANGE["name"], TEN["name"]])
    assert all(row["e_y_max"] < 0.1 and json.loads(row["candidate"]) for row in rows)


def test_a_campaign_follows_its_plan(archives, client, tmp_path, capsys):
    plan = tmp_path / "plan.json"
    plan.write_text(json.dumps({"candidates": [{}, {"r_delta": 30.0}], "situations": [LANE_CHANGE]}), encoding="utf-8")
    common = [str(plan), "--results", str(tmp_path / "results"), "--archives", str(archives), "--step", str(STEP)]
    campaign.main([*common, "--scheduler", client.scheduler.address])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 and lines[1].endswith('lane change  {"r_delta": 30.0}')


def test_the_optimiser_is_told_and_goes_on_after_an_interruption(archives, client, tmp_path, capsys):
    common = ["--results", str(tmp_path), "--archives", str(archives), "--step", str(STEP), "--scheduler", client.scheduler.address]
    optimiser = ["--", "--method", "hybrid", "--population", "4", "--evaluations", "20", "--search", "r_delta=1:1000"]
    score, calls = tune.score, []

    def interrupted(figures):
        calls.append(figures)
        if len(calls) == 12:
            raise KeyboardInterrupt
        return score(figures)

    tune.score = interrupted
    try:
        with pytest.raises(KeyboardInterrupt):
            tune.main([*common, *optimiser])
    finally:
        tune.score = score
    driven = len(fleet.Store(tmp_path).rows)
    capsys.readouterr()
    tune.main([*common, *optimiser])
    end = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert end["evaluations"] == 20
    # Nothing is driven twice: what the first run knew is part of the twenty.
    assert 12 <= driven <= len(fleet.Store(tmp_path).rows) <= 20
    written = {parameter.name: float(parameter.value) for parameter in read_ssv(str(tmp_path / "tuned.ssv"), validate=True).parameters}
    assert written == end["best"]["parameters"]
    figure = drive.evaluate(task(archives, written))["figure"]
    # One situation: half its figure and half its figure.
    assert figure == pytest.approx(end["best"]["value"], rel=1e-15)

"""The wired system: valid, and the same result in two tools as in the direct wiring."""

import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import get_connections, read_ssd, read_ssv

from closed_loop import simulate

STEP = 0.01
STOP = 8.0
# Every runner does the same operations on the same bits, so there is nothing to allow for.
SAME = 0.0


def test_system_is_valid_by_the_schemas(system):
    ssd = read_ssd(system, validate=True)
    assert [c.name for c in ssd.system.elements] == ["plant", "controller"]
    with zipfile.ZipFile(system) as archive:
        sets = [name for name in archive.namelist() if name.endswith(".ssv")]
    roads = ["circuit", "constant_radius", "double_lane_change", "general", "iso_3888_1", "iso_3888_2", "sine_with_dwell", "step_steer", "straight"]
    assert sorted(sets) == sorted(f"resources/{name}.ssv" for name in [*roads, "paper_weights", "shipped_weights"])
    for name in sets:
        assert read_ssv(system, resource=name, validate=True).parameters


def test_last_parameter_set_of_each_component_is_its_default(system, plant, controller):
    # A later binding overrides an earlier one, so a tool that applies all of them must end where the FMUs start.
    archives = {"plant": plant, "controller": controller}
    for component in read_ssd(system).system.elements:
        start = {v.name: v.start for v in fmpy.read_model_description(archives[component.name]).modelVariables}
        sets = [binding.parameterValues[0] for binding in component.parameterBindings]
        names = [sorted(parameter.name for parameter in each.parameters) for each in sets]
        assert len(sets) >= 2 and all(each == names[0] for each in names)
        for parameter in sets[-1].parameters:
            value, default = parameter.value, start[parameter.name]
            assert value == default or float(value) == float(default), parameter.name


def test_every_connector_refers_to_a_variable_of_its_fmu(system, plant, controller):
    archives = {"plant": plant, "controller": controller}
    for component in read_ssd(system).system.elements:
        variables = {v.name: v.causality for v in fmpy.read_model_description(archives[component.name]).modelVariables}
        for connector in component.connectors:
            assert variables[connector.name] == connector.kind, connector.name


def test_every_controller_input_and_both_commands_are_connected(system, controller):
    connections = get_connections(read_ssd(system).system)
    ends = {(b.parent.name, b.name) for _, b in connections}
    inputs = {v.name for v in fmpy.read_model_description(controller).modelVariables if v.causality == "input"}
    assert ends == {("controller", name) for name in inputs} | {("plant", "delta"), ("plant", "a_x")}
    assert all(a.name == b.name for a, b in connections)


def test_packed_fmus_are_those_beside_the_system(system, plant, controller):
    with zipfile.ZipFile(system) as archive:
        for path, name in [(plant, "VehiclePlant"), (controller, "LpvMpcController")]:
            with open(path, "rb") as file:
                assert archive.read(f"resources/{name}.fmu") == file.read()


def test_fmpy_runs_the_system_as_the_direct_wiring(system, plant, controller):
    result = simulate_ssp(system, stop_time=STOP, step_size=STEP)
    # Its first step has all inputs at zero, and it adds up time.
    direct = simulate(plant, controller, STEP, STOP, first_exchange=False, sums=True)
    for ours, theirs in [("e_y_true", "plant.e_y_true"), ("v_x_true", "plant.v_x_true"), ("delta", "controller.delta")]:
        difference = np.abs(result[theirs] - direct[ours]).max()
        assert difference <= SAME, f"{ours} differs by {difference}"
    # Its zeros in the first step show the controller a car that stands; what it expects of the direct wiring holds all the same.
    assert np.abs(result["plant.e_y_true"]).max() < 0.01
    assert np.ptp(result["plant.y"]) > 3.0


@pytest.mark.parametrize("name", [None, "double_lane_change", "general"])
def test_ecos_runs_the_system_as_the_direct_wiring(ecos, system, plant, controller, name):
    names = ["e_y_true", "v_x_true", "wind_speed_actual"]
    direct = simulate(plant, controller, STEP, STOP, plant={"road": name} if name else {}, sums=True)
    with ecos.EcosSimulation(ssp_path=system, step_size=STEP) as simulation:
        simulation.init(parameter_set=name)
        for k, time in enumerate(direct["time"]):
            assert simulation.step() == time
            values = {n: simulation.get_real(f"plant::{n}") for n in names}
            values["delta"] = simulation.get_real("controller::delta")
            for n, value in values.items():
                assert abs(value - direct[n][k]) <= SAME, f"{n} at {time} s: {value} and {direct[n][k]}"
        simulation.terminate()

"""One closed loop of the two packed FMUs, in the process that is asked for it.

The master exchanges values of equal names once a step, as `cargo fmu simulate` does natively, and gives the same bits.
"""

import math
import os
import time
from functools import lru_cache

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

PLANT, CONTROLLER = "VehiclePlant.fmu", "LpvMpcController.fmu"
# Lateral error beyond which a car has left the road [m], and the figure of a run that left it at its very end: the same as in
# `cargo fmu tune`. One that never got going has twice that.
ROAD = 2.0
LOST = 1000.0
# RMSE of lateral error [m], heading error [rad] and speed [m/s] that the paper reports: a run's figure is the mean of its own as
# shares of these.
PAPER = {"e_y": 0.0069, "e_psi": 0.0191, "v_x": 0.0212}
MEASURED = ["e_y_true", "e_psi_true", "v_x_true", "v_x_ref[1]"]


@lru_cache(maxsize=8)
def unpacked(archive, _modified, folder):
    """Folder and description of an archive, unpacked once in each process."""
    target = os.path.join(folder, f"{os.path.basename(archive)}-{os.getpid()}")
    return fmpy.extract(archive, unzipdir=target), fmpy.read_model_description(archive)


class Side:
    """An instance of one of the two."""

    def __init__(self, archive, name, folder):
        unzipped, description = unpacked(archive, os.path.getmtime(archive), folder)
        self.variables = {v.name: v for v in description.modelVariables}
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=unzipped,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.slave.instantiate()

    def start(self, values):
        for name, value in values.items():
            variable = self.variables.get(name)
            if variable is None:
                raise ValueError(f"unknown parameter {name}")
            reference = [variable.valueReference]
            if variable.type == "Real":
                self.slave.setReal(reference, [float(value)])
            elif variable.type == "Boolean":
                self.slave.setBoolean(reference, [bool(value)])
            elif variable.type == "String":
                self.slave.setString(reference, [str(value)])
            else:
                self.slave.setInteger(reference, [int(value)])
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def names(self, causality):
        return [name for name, v in self.variables.items() if v.causality == causality and v.type == "Real"]

    def references(self, names):
        return [self.variables[name].valueReference for name in names]

    def free(self):
        self.slave.freeInstance()


def closed_loop(plant, controller, step, stop):
    """Rows of what is measured, one a step, until the road ends or `stop` [s]; and whether the car stayed on the road."""
    sides = [(plant, controller), (controller, plant)]
    wires = []
    for source, sink in sides:
        outputs = set(source.names("output"))
        names = [name for name in sink.names("input") if name in outputs]
        wires.append((source, source.references(names), sink, sink.references(names)))
    measured, finished = plant.references(MEASURED), plant.references(["finished"])
    rows, k = [plant.slave.getReal(measured)], 0
    while k * step + 0.5 * step <= stop and not plant.slave.getBoolean(finished)[0]:
        values = [(sink, references, source.slave.getReal(read)) for source, read, sink, references in wires]
        for sink, references, seen in values:
            sink.slave.setReal(references, seen)
        for side in (plant, controller):
            side.slave.doStep(currentCommunicationPoint=k * step, communicationStepSize=step)
        k += 1
        rows.append(plant.slave.getReal(measured))
        if not abs(rows[-1][0]) <= ROAD:
            return np.array(rows), False
    return np.array(rows), True


def evaluate(task):
    """Drives a task and says how it went.

    A task is {"plant": {...}, "controller": {...}, "step": s, "stop": s} with parameters by name, and optionally "archives", the
    folder of the two FMUs; without it they are looked for beside this file's worker.
    """
    begin = time.perf_counter()
    folder = working_folder()
    archives = task.get("archives") or folder
    sides = []
    try:
        for name, archive in [("plant", PLANT), ("controller", CONTROLLER)]:
            sides.append(Side(os.path.join(archives, archive), name, folder))
            sides[-1].start(task.get(name, {}))
        rows, on_road = closed_loop(*sides, task["step"], task["stop"])
        result = figures(rows, on_road, task["step"], task["stop"])
    except Exception as error:  # noqa: BLE001 - whatever a library says of a hopeless candidate is its result
        result = {"figure": 2.0 * LOST, "e_y_rms": math.nan, "e_psi_rms": math.nan, "v_x_rms": math.nan, "e_y_max": math.nan}
        result["error"] = str(error)
    finally:
        for side in sides:
            side.free()
    return {"error": "", **result, "seconds": time.perf_counter() - begin}


def figures(rows, on_road, step, stop):
    """RMSE, largest lateral error and the one figure."""
    e_y, e_psi, v_x, v_x_ref = rows.T
    rms = {name: float(np.sqrt(np.mean(np.square(values)))) for name, values in [("e_y", e_y), ("e_psi", e_psi), ("v_x", v_x - v_x_ref)]}
    figure = min(LOST, sum(rms[name] / PAPER[name] for name in PAPER) / len(PAPER))
    if not on_road:
        figure = LOST * (2.0 - min(1.0, (len(rows) - 1) * step / stop))
    return {"figure": figure, **{f"{name}_rms": value for name, value in rms.items()}, "e_y_max": float(np.abs(e_y).max())}


def working_folder():
    """Where a worker keeps its files; it is cleaned away with the worker. Outside of a worker: a folder of this process."""
    try:
        from distributed import get_worker

        return get_worker().local_directory
    except (ImportError, ValueError):
        return own_folder()


@lru_cache(maxsize=1)
def own_folder():
    import atexit
    import shutil
    import tempfile

    folder = tempfile.mkdtemp(prefix="closed-loop-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder

"""Wires the two FMUs with FMPy, as a co-simulation master does: read both, write both, step both."""

import dataclasses
import shutil

import fmpy
import numpy as np
from fmpy.fmi2 import (
    FMU2Slave,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)

RECORDED = {
    "plant": ["x", "y", "s", "v_x_true", "e_y_true", "e_psi_true", "v_x_ref[1]", "wind_speed_actual"],
    "controller": ["delta", "a_x", "status"],
}


class Unit:
    """One instance of an FMU, with its messages."""

    def __init__(self, archive, name):
        self.description = fmpy.read_model_description(archive)
        self.folder = fmpy.extract(archive)
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.messages = []
        self._slave = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        # Kept alive here: the library calls them later.
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = fmi2CallbackLoggerTYPE(self._log)
        self._callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
        self._callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(fmpy.free)
        self._slave.instantiate(callbacks=self._callbacks)

    def _log(self, _environment, _instance, _status, category, message):
        self.messages.append((category.decode(), message.decode()))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._slave.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)

    def set(self, **values):
        """Sets variables by name, each by its type."""
        for name, value in values.items():
            variable = self.variables[name]
            references = [variable.valueReference]
            if variable.type == "Real":
                self._slave.setReal(references, [value])
            elif variable.type == "Boolean":
                self._slave.setBoolean(references, [value])
            elif variable.type == "String":
                self._slave.setString(references, [value])
            else:
                self._slave.setInteger(references, [value])

    def get(self, name):
        """Value of a number."""
        variable = self.variables[name]
        references = [variable.valueReference]
        if variable.type == "Real":
            return self._slave.getReal(references)[0]
        if variable.type == "Boolean":
            return self._slave.getBoolean(references)[0]
        return self._slave.getInteger(references)[0]

    def initialize(self, **parameters):
        self._slave.setupExperiment(startTime=0.0)
        self.set(**parameters)
        self._slave.enterInitializationMode()
        self._slave.exitInitializationMode()

    def references(self, names):
        return [self.variables[name].valueReference for name in names]

    def names(self, causality):
        return [v.name for v in self.description.modelVariables if v.causality == causality]

    def read(self, references):
        return self._slave.getReal(references)

    def write(self, references, values):
        self._slave.setReal(references, values)

    def step(self, time, size):
        self._slave.doStep(currentCommunicationPoint=time, communicationStepSize=size)


@dataclasses.dataclass
class Run:
    """A recorded run: one array a variable."""

    values: dict

    def __getitem__(self, name):
        return self.values[name]

    @property
    def e_y_max(self):
        return np.abs(self["e_y_true"]).max()

    @property
    def e_psi_max(self):
        return np.abs(self["e_psi_true"]).max()

    @property
    def speed_error_max(self):
        return np.abs(self["v_x_true"] - self["v_x_ref[1]"]).max()


def wires(source, sink):
    """References of equal names: outputs of one side, inputs of the other."""
    outputs = set(source.names("output"))
    names = [name for name in sink.names("input") if name in outputs]
    return source.references(names), sink.references(names)


def simulate(plant_archive, controller_archive, step, stop, plant=None, controller=None, first_exchange=True, sums=False):
    """Drives the closed loop until `stop` [s].

    `first_exchange` False leaves all inputs at zero during the first step, as FMPy's runner of systems does; `sums` adds
    up the time step by step, as the runners do.
    """
    with Unit(plant_archive, "plant") as p, Unit(controller_archive, "controller") as c:
        p.initialize(**(plant or {}))
        c.initialize(**(controller or {}))
        measured, measurements = wires(p, c)
        commanded, commands = wires(c, p)
        rows = []
        time, k = 0.0, 0
        while time < stop - (0.0 if sums else 0.5 * step):
            seen, wanted = p.read(measured), c.read(commanded)
            if k == 0 and not first_exchange:
                seen, wanted = [0.0] * len(seen), [0.0] * len(wanted)
            c.write(measurements, seen)
            p.write(commands, wanted)
            p.step(time, step)
            c.step(time, step)
            k += 1
            time = time + step if sums else k * step
            values = [p.get(name) for name in RECORDED["plant"]] + [c.get(name) for name in RECORDED["controller"]]
            rows.append([time, *values])
        names = ["time", *RECORDED["plant"], *RECORDED["controller"]]
        return Run(dict(zip(names, np.array(rows).T)))

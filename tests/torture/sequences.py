"""Random call sequences against the life cycle as FMI 2.0.4, section 4.2.4 draws it."""

import random
from ctypes import byref, c_double, c_uint

from fmu import ERROR, OK, WARNING

H = 0.01


class Model:
    """The life cycle: phase, and which calls are legal in it."""

    def __init__(self):
        self.phase, self.time = "instantiated", 0.0

    def legal(self, call):
        phases = {
            "SetDebugLogging": "any",
            "SetupExperiment": "instantiated",
            "EnterInitializationMode": "instantiated",
            "ExitInitializationMode": "initialization",
            "DoStep": "stepping",
            "Terminate": "stepping",
            "Reset": "any",
            "get": "initialization stepping terminated error",
            "set input": "instantiated initialization stepping",
            "set fixed": "instantiated initialization",
            "rollback": "any",
            "status": "stepping terminated",
            "CancelStep": "",
            "bad step": "",
            "fail": "",
        }[call]
        return phases == "any" or self.phase in phases.split()

    def advance(self, call):
        if call == "fail" and self.phase == "initialization":
            self.phase = "error"
        if not self.legal(call):
            return
        follow = {"EnterInitializationMode": "initialization", "ExitInitializationMode": "stepping", "Terminate": "terminated"}
        self.phase = follow.get(call, self.phase)
        if call == "Reset":
            self.phase, self.time = "instantiated", 0.0
        if call == "DoStep":
            self.time += H


def perform(slave, call, model):
    fmu = slave.fmu
    real = next(v for v in fmu.named("parameter", "Real") if v.variability == "fixed")
    if call == "SetDebugLogging":
        return slave.SetDebugLogging(0, 0, None)
    if call == "SetupExperiment":
        return slave.setup()
    if call == "DoStep":
        return slave.step(model.time, H)
    if call == "bad step":
        return slave.step(model.time, -H)
    if call == "get":
        return slave.get(fmu.outputs()[0].name)[0]
    if call == "set input":
        return slave.set(fmu.named("input", "Real")[0].name, 0.01)
    if call == "set fixed":
        return slave.set(real.name, float(real.attributes["start"]))
    if call == "rollback":
        return slave.restore(slave.serialized())
    if call == "status":
        return slave.GetRealStatus(2, byref(c_double()))
    if call == "fail":
        if model.phase == "initialization":
            slave.spoil()
            return slave.ExitInitializationMode()
        return slave.SetReal(byref(c_uint(2**32 - 1)), 1, byref(c_double()))
    return getattr(slave, call)()


def check_random_call_sequences_follow_the_life_cycle(fmu):
    onward = ["EnterInitializationMode", "ExitInitializationMode", "DoStep", "DoStep", "DoStep"]
    others = ["SetDebugLogging", "SetupExperiment", "Terminate", "Reset", "get", "set input", "set fixed", "rollback", "status", "CancelStep", "bad step", "fail"]
    visited = set()
    for seed in range(40):
        generator = random.Random(seed)
        slave, model, calls = fmu.slave(), Model(), []
        for _ in range(60):
            call = generator.choice(onward if generator.random() < 0.5 else others)
            calls.append(call)
            legal = model.legal(call)
            status = perform(slave, call, model)
            assert (status in (OK, WARNING)) == legal, (seed, model.phase, calls[-8:], status, slave.messages[-2:])
            assert legal or status == ERROR
            model.advance(call)
            visited.add((model.phase, call))
        slave.free()
    # Every phase was reached and every call was made in most of them.
    assert {phase for phase, _ in visited} == {"instantiated", "initialization", "stepping", "terminated", "error"}
    assert len(visited) > 55, len(visited)

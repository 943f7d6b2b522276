"""The C interface through ctypes alone: what a careless importer can do, no binding of a tool in between."""

import ctypes
import math
import os
import pathlib
import struct
import xml.etree.ElementTree as ElementTree
from ctypes import POINTER, byref, c_char_p, c_double, c_int, c_size_t, c_ubyte, c_uint, c_void_p

OK, WARNING, DISCARD, ERROR = range(4)

# The logger is variadic; a callee that reads the five fixed arguments only works with the calling conventions of all platforms.
LOGGER = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p)


class Callbacks(ctypes.Structure):
    _fields_ = [
        ("logger", LOGGER),
        ("allocate", c_void_p),
        ("free", c_void_p),
        ("finished", c_void_p),
        ("environment", c_void_p),
    ]


VALUES = (c_void_p, c_size_t)  # value references and their number
FUNCTIONS = {
    "SetDebugLogging": (c_int, c_size_t, c_void_p),
    "SetupExperiment": (c_int, c_double, c_double, c_int, c_double),
    "EnterInitializationMode": (),
    "ExitInitializationMode": (),
    "Terminate": (),
    "Reset": (),
    "GetReal": (*VALUES, c_void_p),
    "GetInteger": (*VALUES, c_void_p),
    "GetBoolean": (*VALUES, c_void_p),
    "GetString": (*VALUES, c_void_p),
    "SetReal": (*VALUES, c_void_p),
    "SetInteger": (*VALUES, c_void_p),
    "SetBoolean": (*VALUES, c_void_p),
    "SetString": (*VALUES, c_void_p),
    "GetFMUstate": (c_void_p,),
    "SetFMUstate": (c_void_p,),
    "FreeFMUstate": (c_void_p,),
    "SerializedFMUstateSize": (c_void_p, c_void_p),
    "SerializeFMUstate": (c_void_p, c_void_p, c_size_t),
    "DeSerializeFMUstate": (c_void_p, c_size_t, c_void_p),
    "GetDirectionalDerivative": (*VALUES, *VALUES, c_void_p, c_void_p),
    "SetRealInputDerivatives": (*VALUES, c_void_p, c_void_p),
    "GetRealOutputDerivatives": (*VALUES, c_void_p, c_void_p),
    "DoStep": (c_double, c_double, c_int),
    "CancelStep": (),
    "GetStatus": (c_int, c_void_p),
    "GetRealStatus": (c_int, c_void_p),
    "GetIntegerStatus": (c_int, c_void_p),
    "GetBooleanStatus": (c_int, c_void_p),
    "GetStringStatus": (c_int, c_void_p),
}

C_TYPES = {"Real": c_double, "Integer": c_int, "Enumeration": c_int, "Boolean": c_int, "String": c_char_p}


class Variable:
    def __init__(self, element):
        self.name = element.get("name")
        self.reference = int(element.get("valueReference"))
        self.causality = element.get("causality")
        self.variability = element.get("variability")
        typed = element[0]
        self.kind = typed.tag
        # The name of the type in the functions' names: enumerations travel as integers.
        self.family = "Integer" if self.kind == "Enumeration" else self.kind
        self.attributes = dict(typed.attrib)

    def bound(self, side):
        text = self.attributes.get(side)
        return None if text is None else float(text)


class Fmu:
    """An unpacked archive with its library loaded."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.description = ElementTree.parse(self.folder / "modelDescription.xml").getroot()
        self.capabilities = self.description.find("CoSimulation")
        self.guid = self.description.get("guid")
        self.variables = {v.name: v for v in map(Variable, self.description.find("ModelVariables"))}
        self.library_path = self.folder / "binaries" / "linux64" / f"{self.capabilities.get('modelIdentifier')}.so"
        self.library = ctypes.CDLL(str(self.library_path))
        for name, arguments in FUNCTIONS.items():
            function = getattr(self.library, f"fmi2{name}")
            function.argtypes = (c_void_p, *arguments)
            function.restype = c_int
        self.library.fmi2Instantiate.argtypes = (c_char_p, c_int, c_char_p, c_char_p, c_void_p, c_int, c_int)
        self.library.fmi2Instantiate.restype = c_void_p
        self.library.fmi2FreeInstance.argtypes = (c_void_p,)
        self.library.fmi2FreeInstance.restype = None

    def can(self, capability):
        return self.capabilities.get(capability) == "true"

    def named(self, causality, kind=None):
        return [v for v in self.variables.values() if v.causality == causality and kind in (None, v.kind)]

    def outputs(self):
        """The outputs that must repeat bit by bit: all but the one that a clock on the wall measures."""
        return [v for v in self.named("output", "Real") if v.name != "solve_time"]

    def slave(self, **settings):
        return Slave(self, **settings)

    def started(self, start=0.0, stop=None, parameters=None, **settings):
        slave = Slave(self, **settings)
        assert slave.component, slave.messages
        for name, value in (parameters or {}).items():
            assert slave.set(name, value) == OK, slave.messages
        assert slave.setup(start, stop) == OK, slave.messages
        assert slave.initialize() == OK, slave.messages
        return slave


class Slave:
    """One instance and its messages, as (status, category, text)."""

    def __init__(self, fmu, name="one", guid=None, resources="unpacked", logging=False, kind=1):
        self.fmu, self.messages = fmu, []
        self._logger = LOGGER(lambda _environment, _name, *message: self.messages.append(message))
        self._callbacks = Callbacks(logger=self._logger)
        if resources == "unpacked":
            resources = (fmu.folder / "resources").as_uri()
        encode = lambda text: text.encode() if isinstance(text, str) else text
        self.component = fmu.library.fmi2Instantiate(
            encode(name), kind, encode(fmu.guid if guid is None else guid), encode(resources), byref(self._callbacks), 0, int(logging)
        )

    def __getattr__(self, name):
        function = getattr(self.fmu.library, f"fmi2{name}")
        return lambda *arguments: function(self.component, *arguments)

    def spoil(self, text="/nowhere/at all"):
        """Sets parameters that pass the interface and that initialisation refuses: a file that is not there, and the wish to use it."""
        name = self.fmu.named("parameter", "String")[-1].name
        assert self.set(name, text) == OK
        if name == "network_file":
            assert self.set("adaptation", 1) == OK

    def errors(self):
        """The texts of the error messages since the last call."""
        texts = [text.decode() for status, category, text in self.messages if status == ERROR and category == b"logStatusError"]
        self.messages.clear()
        return texts

    def free(self):
        self.fmu.library.fmi2FreeInstance(self.component)
        self.component = None

    def setup(self, start=0.0, stop=None):
        return self.SetupExperiment(0, 0.0, start, int(stop is not None), stop or 0.0)

    def initialize(self):
        return max(self.EnterInitializationMode(), self.ExitInitializationMode())

    def step(self, t, h):
        return self.DoStep(t, h, 1)

    def set(self, name, value):
        variable = self.fmu.variables[name]
        value = value.encode() if isinstance(value, str) else value
        function = getattr(self, f"Set{variable.family}")
        return function(byref(c_uint(variable.reference)), 1, byref(C_TYPES[variable.kind](value)))

    def get(self, name):
        """Status and value."""
        variable = self.fmu.variables[name]
        value = C_TYPES[variable.kind]()
        status = getattr(self, f"Get{variable.family}")(byref(c_uint(variable.reference)), 1, byref(value))
        return status, value.value

    def reals(self, variables):
        """Values of Real variables."""
        references = (c_uint * len(variables))(*(v.reference for v in variables))
        values = (c_double * len(variables))()
        assert self.GetReal(references, len(variables), values) == OK, self.messages
        return list(values)

    def bits(self):
        """The outputs as bytes: equal only if every bit is."""
        return struct.pack(f"<{len(self.fmu.outputs())}d", *self.reals(self.fmu.outputs()))

    def excite(self, t):
        """Sets every Real input to something that moves and that the model can live with."""
        inputs = self.fmu.named("input", "Real")
        references = (c_uint * len(inputs))(*(v.reference for v in inputs))
        values = (c_double * len(inputs))(*(excitation(v.name, t) for v in inputs))
        assert self.SetReal(references, len(inputs), values) == OK, self.messages

    def run(self, first, last, h=0.01, start=0.0):
        """Steps from first to last and returns the bits of all outputs on the way."""
        trace = []
        for k in range(first, last):
            t = start + k * h
            self.excite(t)
            status = self.step(t, h)
            assert status in (OK, WARNING), (status, k, self.messages)
            trace.append(self.bits())
        return trace

    def last_time(self):
        time = c_double(math.nan)
        assert self.GetRealStatus(2, byref(time)) == OK
        return time.value

    def save(self):
        state = c_void_p()
        assert self.GetFMUstate(byref(state)) == OK, self.messages
        return state

    def release(self, state):
        assert self.FreeFMUstate(byref(state)) == OK
        assert not state.value, "a freed state is set to NULL"

    def serialized(self):
        state = self.save()
        size = c_size_t()
        assert self.SerializedFMUstateSize(state, byref(size)) == OK
        data = (c_ubyte * size.value)()
        assert self.SerializeFMUstate(state, data, size) == OK
        self.release(state)
        return bytes(data)

    def restore(self, data):
        """Status of reading the bytes and of setting the state that they hold."""
        state = c_void_p()
        status = self.DeSerializeFMUstate((c_ubyte * max(1, len(data))).from_buffer_copy(data or b"\0"), len(data), byref(state))
        if status == OK:
            status = self.SetFMUstate(state)
            self.release(state)
        return status


def excitation(name, t):
    base = {"v_x": 10.0, "v_x_ref": 10.0, "mu_ref": 0.8, "mu_scale": 1.0}.get(name.split("[")[0], 0.0)
    return base + 0.01 * math.sin(3.0 * t + len(name))


def resident():
    """Memory of this process that is in use [B]."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

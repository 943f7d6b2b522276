"""Wrong arguments, wrong moments, wrong values: an error and a message, never a crash."""

import ctypes
import math
import random
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p

from fmu import C_TYPES, DISCARD, ERROR, FUNCTIONS, OK, WARNING, Callbacks, Slave


def check_null_instance_is_an_error(fmu):
    room = (c_double * 8)()
    for name, arguments in FUNCTIONS.items():
        given = [room if kind is c_void_p else kind(0) for kind in arguments]
        assert getattr(fmu.library, f"fmi2{name}")(None, *given) == ERROR, name
    fmu.library.fmi2FreeInstance(None)


def check_null_arrays_are_refused_with_one_message_each(fmu):
    slave = fmu.started()
    for name, arguments in FUNCTIONS.items():
        if c_void_p not in arguments:
            continue
        slave.messages.clear()
        given = [None if kind is c_void_p else kind(1) for kind in arguments]
        assert getattr(slave, name)(*given) == ERROR, name
        assert len(slave.errors()) == 1, name
    reference = c_uint(fmu.named("input", "Real")[0].reference)
    assert slave.GetReal(byref(reference), 1, None) == ERROR
    assert slave.SetReal(byref(reference), 1, None) == ERROR
    assert slave.SetReal(None, 0, None) == OK, "nothing is asked for"
    assert slave.step(0.0, 0.01) == OK, "refused calls leave the instance as it was"


def check_null_text_is_refused(fmu):
    slave = fmu.slave()
    assert fmu.named("parameter", "String")
    for variable in fmu.named("parameter", "String"):
        slave.messages.clear()
        assert slave.SetString(byref(c_uint(variable.reference)), 1, byref(c_char_p(None))) == ERROR
        assert len(slave.errors()) == 1
        assert slave.SetString(byref(c_uint(variable.reference)), 1, byref(c_char_p(b"\xff\xfe"))) == ERROR, "not UTF-8"


def check_impossible_sizes_are_refused(fmu):
    slave = fmu.started()
    room = (c_double * 8)()
    assert slave.GetReal(room, c_size_t(-1), room) == ERROR
    assert slave.SetReal(room, c_size_t(2**62), room) == ERROR
    assert slave.DeSerializeFMUstate(room, c_size_t(-1), byref(c_void_p())) == ERROR


def check_unknown_value_references_are_refused(fmu):
    slave = fmu.started()
    for reference in (len(fmu.variables), 2**31, 2**32 - 1):
        for family in ("Real", "Integer", "Boolean", "String"):
            room = C_TYPES[family]()
            slave.messages.clear()
            assert getattr(slave, f"Get{family}")(byref(c_uint(reference)), 1, byref(room)) == ERROR
            assert str(reference) in slave.errors()[0]
            assert getattr(slave, f"Set{family}")(byref(c_uint(reference)), 1, byref(room)) == ERROR


def check_references_of_another_type_are_refused(fmu):
    slave = fmu.started()
    for variable in fmu.variables.values():
        for family in {"Real", "Integer", "Boolean", "String"} - {variable.family}:
            room = (C_TYPES[family] * 1)()
            slave.messages.clear()
            assert getattr(slave, f"Get{family}")(byref(c_uint(variable.reference)), 1, room) == ERROR
            assert variable.name in slave.errors()[0]


def check_instantiation_refuses_what_is_wrong(fmu):
    for wrong in ({"guid": "{00000000-0000-0000-0000-000000000000}"}, {"guid": ""}, {"name": ""}, {"name": None}, {"kind": 0}, {"kind": 7}):
        slave = fmu.slave(**wrong)
        assert not slave.component, wrong
        assert len(slave.errors()) == 1, wrong
    library, guid = fmu.library, fmu.guid.encode()
    assert not library.fmi2Instantiate(b"one", 1, guid, None, None, 0, 0), "no callbacks"
    silent = Callbacks()
    assert not library.fmi2Instantiate(b"one", 1, None, None, byref(silent), 0, 0), "no GUID"
    assert not library.fmi2Instantiate(b"one", 1, b"{wrong}", None, byref(silent), 0, 1), "nobody to tell"
    component = library.fmi2Instantiate(b"one", 1, guid, None, byref(silent), 0, 1)
    assert component, "an importer without a logger is served"
    assert library.fmi2DoStep(component, 0.0, 0.1, 1) == ERROR
    library.fmi2FreeInstance(component)


def check_percent_signs_reach_the_logger_doubled(fmu):
    slave = fmu.slave(name="100%s%n")
    slave.spoil("100%s%n%d nowhere")
    slave.setup()
    slave.messages.clear()
    assert slave.initialize() == ERROR
    text = slave.errors()[0]
    assert "100%%s%%n%%d" in text, text
    # What printf makes of it is the message itself.
    printed = ctypes.create_string_buffer(4096)
    ctypes.CDLL(None).snprintf(printed, 4096, text.encode())
    assert b"100%s%n%d nowhere" in printed.value


def check_illegal_calls_name_function_and_phase(fmu):
    slave = fmu.slave()
    slave.messages.clear()
    assert slave.step(0.0, 0.1) == ERROR
    (text,) = slave.errors()
    assert "fmi2DoStep" in text and "Instantiated" in text
    assert slave.CancelStep() == ERROR


def check_impossible_steps_are_refused_at_once(fmu):
    slave = fmu.started()
    assert slave.step(0.0, 0.01) == OK
    for h in (0.0, -0.0, -0.01, math.nan, math.inf, -math.inf, 1e300):
        slave.messages.clear()
        assert slave.step(0.01, h) == ERROR, h
        assert len(slave.errors()) == 1
    for t in (0.0, 0.02, 0.01 + 1e-9, -1.0, math.nan, math.inf):
        assert slave.step(t, 0.01) == ERROR, t
    assert slave.last_time() == 0.01
    assert slave.step(0.01, 0.01) == OK, "refused steps leave the instance as it was"


def check_time_may_be_multiplied_or_summed(fmu):
    for h in (0.001, 1 / 30, 0.1):
        multiplied, summed = fmu.started(stop=50 * h), fmu.started(stop=50 * h)
        total = 0.0
        for k in range(50):
            multiplied.excite(0.0), summed.excite(0.0)
            assert multiplied.step(k * h, h) <= 1, (h, k, multiplied.messages)
            assert summed.step(total, h) <= 1, (h, k, summed.messages)
            total += h
        assert abs(multiplied.last_time() - 50 * h) < 1e-12
        assert summed.last_time() == total
        assert multiplied.step(50 * h, h) == ERROR, "past the stop time"


def check_impossible_experiments_are_refused(fmu):
    slave = fmu.slave()
    for start, stop in ((math.nan, None), (math.inf, None), (1.0, 0.5), (0.0, math.nan)):
        assert slave.setup(start, stop) == ERROR, (start, stop)
    assert slave.setup(3.0, 4.0) == OK
    assert slave.initialize() == OK
    assert slave.last_time() == 3.0
    slave.excite(3.0)
    assert slave.step(3.0, 0.5) <= 1
    assert slave.last_time() == 3.5
    assert slave.step(3.5, 0.6) == ERROR


def check_inputs_that_are_not_finite_are_refused_and_the_next_recovers(fmu):
    slave, calm = fmu.started(), fmu.started()
    for variable in fmu.named("input", "Real"):
        for value in (math.nan, math.inf, -math.inf):
            slave.messages.clear()
            assert slave.set(variable.name, value) == ERROR
            assert variable.name in slave.errors()[0]
    assert slave.run(0, 20) == calm.run(0, 20)


def check_extreme_inputs_are_survived(fmu):
    generator = random.Random(3)
    inputs = fmu.named("input", "Real")
    for _ in range(20):
        slave = fmu.started()
        slave.run(0, 5)
        for k in range(5, 15):
            for variable in inputs:
                low, high = variable.bound("min"), variable.bound("max")
                low, high = -1e300 if low is None else low, 1e300 if high is None else high
                value = generator.choice([0.0, -1e-308, 1e-3, -30.0, low, high])
                assert slave.set(variable.name, min(max(value, low), high)) == OK
            status = slave.step(k * 0.01, 0.01)
            assert status in (OK, WARNING, ERROR)
            if status == ERROR:
                break
            assert not_finite(slave) == []
        else:
            # After inputs that were bad but legal, good ones must be good enough again.
            slave.run(15, 40)
            assert not_finite(slave) == []
        assert slave.Reset() == OK
        slave.free()


def check_irregular_steps_are_taken(fmu):
    generator, slave = random.Random(4), fmu.started()
    t = 0.0
    for _ in range(300):
        h = 10.0 ** generator.uniform(-6, -0.5)
        slave.excite(t)
        assert slave.step(t, h) in (OK, WARNING), (t, h, slave.messages[-1:])
        t += h
        assert slave.last_time() == t
    assert not_finite(slave) == []


def not_finite(slave):
    """Names of the outputs that are no numbers."""
    outputs = slave.fmu.outputs()
    # Without a plan the controller's quality figures are infinite, which is what they mean.
    wanted = {"kkt_residual": (math.inf,), "slack_e_y": (math.inf,)}
    values = zip(outputs, slave.reals(outputs))
    return [output.name for output, value in values if not math.isfinite(value) and value not in wanted.get(output.name, ())]


def check_values_outside_of_their_range_are_refused(fmu):
    slave = fmu.slave()
    checked = 0
    for variable in fmu.variables.values():
        if variable.causality not in ("input", "parameter") or variable.kind not in ("Real", "Integer"):
            continue
        for side, sign in (("min", -1), ("max", 1)):
            bound = variable.bound(side)
            if bound is None:
                continue
            beyond = bound + sign * (1 if variable.kind == "Integer" else max(1.0, abs(bound)) * 1e-6)
            if variable.kind == "Integer":
                beyond = int(beyond)
                if not -(2**31) <= beyond < 2**31:
                    continue
            slave.messages.clear()
            before = slave_value(slave, variable)
            assert slave.set(variable.name, beyond) == ERROR, (variable.name, beyond)
            (text,) = slave.errors()
            assert variable.name in text and "range" in text, text
            assert slave_value(slave, variable) == before
            checked += 1
    assert checked > 10
    for variable in fmu.variables.values():
        if variable.kind == "Enumeration" and variable.causality == "parameter":
            assert slave.set(variable.name, 9999) == ERROR, variable.name


def slave_value(slave, variable):
    """The value that a parameter or input has before initialisation, seen through a copy of the instance."""
    copy = slave.fmu.slave()
    assert copy.restore(slave.serialized()) == OK
    assert copy.EnterInitializationMode() == OK
    status, value = copy.get(variable.name)
    copy.free()
    assert status == OK
    return value


def check_causality_and_variability_are_enforced(fmu):
    fresh, started = fmu.slave(), fmu.started()
    for variable in fmu.variables.values():
        status, value = started.get(variable.name)
        assert status == OK, variable.name
        value = value.decode() if isinstance(value, bytes) else value
        settable = variable.causality in ("input", "parameter")
        assert (fresh.set(variable.name, value) == OK) == settable, (variable.name, fresh.messages)
        settable &= variable.variability != "fixed"
        assert (started.set(variable.name, value) == OK) == settable, (variable.name, started.messages)


def check_status_kinds_have_one_type_each(fmu):
    slave = fmu.started()
    integer, real, text = c_int(), c_double(), c_char_p()
    assert slave.GetStatus(0, byref(integer)) == OK and integer.value == OK
    assert slave.GetRealStatus(2, byref(real)) == OK
    assert slave.GetBooleanStatus(3, byref(integer)) == OK and integer.value == 0
    assert slave.GetStringStatus(1, byref(text)) == OK
    assert slave.GetIntegerStatus(0, byref(integer)) == DISCARD
    assert slave.GetRealStatus(77, byref(real)) == ERROR


def check_log_categories_are_honoured(fmu):
    def categories(on, *names):
        slave = fmu.slave()
        array = (c_char_p * max(1, len(names)))(*names)
        assert slave.SetDebugLogging(on, len(names), array) == OK
        slave.messages.clear()
        slave.setup()
        slave.initialize()
        slave.run(0, 3)
        seen = {category for _, category, _ in slave.messages}
        slave.free()
        return seen

    declared = {element.get("name").encode() for element in fmu.description.find("LogCategories")}
    assert b"logEvents" in declared and b"logStatusError" in declared
    assert b"logEvents" not in categories(0)
    assert b"logEvents" not in categories(1, b"logStatusError")
    assert b"logEvents" in categories(1)
    assert b"logEvents" in categories(1, b"logEvents")
    assert b"logEvents" in categories(1, b"logAll")
    assert categories(1) <= declared
    slave = fmu.slave()
    assert slave.SetDebugLogging(1, 1, (c_char_p * 1)(b"logNonsense")) == ERROR


def check_an_instance_that_is_freed_at_any_phase(fmu):
    for phases in range(5):
        slave = Slave(fmu)
        calls = [slave.setup, slave.EnterInitializationMode, slave.ExitInitializationMode, slave.Terminate]
        for call in calls[:phases]:
            assert call() == OK
        slave.free()

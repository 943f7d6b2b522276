"""Saved states: bit-exact, total, and proof against damage."""

import os
import random
import subprocess
import sys
import tempfile
from ctypes import byref, c_ubyte

from fmu import ERROR, OK, resident


def lively(fmu):
    """Parameters that bring everything into play that a state must hold: noise, delays, lags."""
    wanted = {"noise_scale": 1.0, "seed": 7, "delay_delta": 0.05, "tau_delta": 0.1, "adaptation": 1, "input_delay": 0.05}
    values = {}
    for name, value in wanted.items():
        if name in fmu.variables:
            probe = fmu.slave()
            if probe.set(name, value) == OK:
                values[name] = value
            probe.free()
    return values


def check_rollback_repeats_every_bit_any_number_of_times(fmu):
    slave = fmu.started(parameters=lively(fmu))
    slave.run(0, 30)
    state = slave.save()
    first = slave.run(30, 90)
    for _ in range(5):
        assert slave.SetFMUstate(state) == OK
        assert slave.last_time() == 0.3
        assert slave.run(30, 90) == first
    slave.release(state)


def check_saving_changes_nothing(fmu):
    saving, plain = fmu.started(parameters=lively(fmu)), fmu.started(parameters=lively(fmu))
    trace = []
    for k in range(30):
        data = saving.serialized()
        trace += saving.run(k, k + 1)
        assert len(data) > 100
    assert trace == plain.run(0, 30)


def check_a_state_continues_in_another_instance(fmu):
    slave, other = fmu.started(parameters=lively(fmu)), fmu.slave(name="other")
    slave.run(0, 30)
    state = slave.save()
    assert other.SetFMUstate(state) == OK
    assert slave.run(30, 60) == other.run(30, 60)
    slave.release(state)


def check_a_state_survives_the_instance_that_saved_it(fmu):
    slave, other = fmu.started(parameters=lively(fmu)), fmu.slave(name="other")
    slave.run(0, 10)
    state = slave.save()
    expected = slave.run(10, 20)
    slave.free()
    assert other.SetFMUstate(state) == OK
    assert other.run(10, 20) == expected
    other.release(state)


def check_bytes_continue_in_another_process(fmu):
    slave = fmu.started(parameters=lively(fmu))
    slave.run(0, 30)
    with tempfile.NamedTemporaryFile(suffix=".state") as file:
        file.write(slave.serialized())
        file.flush()
        command = [sys.executable, os.path.join(os.path.dirname(__file__), "continue.py"), str(fmu.folder), file.name, "30", "60"]
        other = subprocess.run(command, capture_output=True, timeout=60, check=True)
    assert other.stdout == b"".join(slave.run(30, 60))


def check_equal_states_have_equal_bytes(fmu):
    slave, other = fmu.started(parameters=lively(fmu)), fmu.started(parameters=lively(fmu))
    measured = "solve_time" in fmu.variables
    slave.run(0, 30), other.run(0, 30)
    # The wall clock's reading is part of the state and the only part that differs.
    assert measured or slave.serialized() == other.serialized()
    data = slave.serialized()
    assert other.restore(data) == OK
    assert other.serialized() == data


def check_a_handle_is_reused(fmu):
    slave = fmu.started(parameters=lively(fmu))
    state = slave.save()
    handle = state.value
    slave.run(0, 5)
    assert slave.GetFMUstate(byref(state)) == OK
    assert state.value == handle
    first = slave.run(5, 10)
    assert slave.SetFMUstate(state) == OK
    assert slave.run(5, 10) == first
    slave.release(state)
    assert slave.FreeFMUstate(byref(state)) == OK, "freeing NULL does nothing"
    assert slave.SetFMUstate(None) == ERROR


def check_initialisation_mode_is_saved_and_restored(fmu):
    parameter = next(v.name for v in fmu.named("parameter", "Real") if v.variability == "fixed")
    slave, other = fmu.slave(), fmu.started()
    assert slave.EnterInitializationMode() == OK
    data = slave.serialized()
    assert other.restore(data) == OK
    assert other.step(0.0, 0.01) == ERROR, "it is in initialisation mode now"
    status, value = other.get(parameter)
    assert status == OK and other.set(parameter, value) == OK
    assert other.ExitInitializationMode() == OK
    assert slave.ExitInitializationMode() == OK
    assert slave.run(0, 10) == other.run(0, 10)


def check_a_state_revives_an_instance_after_an_error(fmu):
    slave = fmu.started(parameters=lively(fmu))
    slave.run(0, 10)
    data = slave.serialized()
    expected = slave.run(10, 20)
    broken = fmu.slave()
    broken.spoil()
    broken.setup()
    assert broken.initialize() == ERROR
    assert broken.step(0.0, 0.01) == ERROR
    assert broken.restore(data) == OK
    assert broken.run(10, 20) == expected


def check_a_terminated_instance_goes_back(fmu):
    slave = fmu.started(parameters=lively(fmu))
    slave.run(0, 10)
    state = slave.save()
    expected = slave.run(10, 20)
    assert slave.Terminate() == OK
    assert slave.bits() == expected[-1], "the last values stay readable"
    assert slave.step(0.2, 0.01) == ERROR
    assert slave.SetFMUstate(state) == OK
    assert slave.run(10, 20) == expected
    slave.release(state)


def check_damaged_bytes_are_refused(fmu):
    slave = fmu.started(parameters=lively(fmu))
    slave.run(0, 10)
    data = slave.serialized()
    expected = slave.run(10, 20)
    assert slave.restore(data) == OK
    random.seed(20)
    damaged = [data[:length] for length in random.sample(range(len(data)), 100)] + [b"", data + b"\0", data + data]
    damaged += [bytes(random.randrange(256) for _ in range(len(data))), b"\0" * len(data), b"\xff" * len(data)]
    for bit in [*range(0, 8 * 120, 7), *random.sample(range(8 * len(data)), 500)]:
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        damaged.append(bytes(flipped))
    for wrong in damaged:
        slave.messages.clear()
        assert slave.restore(wrong) == ERROR, len(wrong)
        assert len(slave.errors()) == 1
    assert slave.run(10, 20) == expected, "refused bytes leave the instance as it was"


def check_a_buffer_that_is_too_small_is_refused(fmu):
    slave = fmu.started()
    size = len(slave.serialized())
    state = slave.save()
    room = (c_ubyte * size)()
    assert slave.SerializeFMUstate(state, room, size - 1) == ERROR
    assert bytes(room) == bytes(size), "nothing was written"
    assert slave.SerializeFMUstate(state, room, size) == OK
    slave.release(state)


def check_memory_that_is_no_state_is_refused(fmu):
    slave = fmu.started()
    for byte in (0x00, 0x55, 0xFF):
        memory = (c_ubyte * 65536)(*[byte] * 65536)
        assert slave.SetFMUstate(memory) == ERROR
        assert slave.SerializeFMUstate(memory, memory, 65536) == ERROR
        assert bytes(memory) == bytes([byte] * 65536)


def check_states_are_not_exchanged_between_different_fmus(fmu):
    slave = fmu.started()
    data = bytearray(slave.serialized())
    place = bytes(data).find(fmu.guid.encode())
    assert place > 0, "a state names the interface that it belongs to"
    data[place + 1 : place + 3] = b"zz"
    assert slave.restore(bytes(data)) == ERROR


def check_reset_in_every_phase_gives_a_bit_equal_rerun(fmu):
    expected = fmu.started(parameters=lively(fmu)).run(0, 30)
    slave = fmu.slave()

    def rerun():
        for name, value in lively(fmu).items():
            assert slave.set(name, value) == OK
        assert slave.setup() == OK
        assert slave.initialize() == OK
        assert slave.run(0, 30) == expected

    assert slave.Reset() == OK
    rerun()
    assert slave.Reset() == OK
    assert slave.EnterInitializationMode() == OK
    assert slave.Reset() == OK
    rerun()
    assert slave.Terminate() == OK
    assert slave.Reset() == OK
    rerun()
    assert slave.Reset() == OK
    slave.spoil()
    slave.setup()
    assert slave.initialize() == ERROR
    assert slave.Reset() == OK
    rerun()


def check_reset_gives_back_the_start_values(fmu):
    slave, fresh = fmu.slave(), fmu.slave()
    for variable in fmu.named("parameter", "Real"):
        if variable.bound("max") is not None:
            slave.set(variable.name, variable.bound("max"))
    assert slave.Reset() == OK
    assert slave.serialized() == fresh.serialized()


def check_states_are_freed(fmu):
    slave = fmu.started()

    def rounds(n):
        for _ in range(n):
            state = slave.save()
            slave.SetFMUstate(state)
            slave.release(state)

    rounds(200)
    before = resident()
    rounds(2000)
    assert resident() - before < 2**20, "memory grows by the states"

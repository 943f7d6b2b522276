"""What an FMU must leave alone, what it must not mind, and how long it must last."""

import ctypes
import locale
import math
import os
import pathlib
import platform
import shutil
import statistics
import subprocess
import tempfile
import threading
import time
import urllib.parse
from ctypes import byref, c_double, c_int, c_uint

from fmu import ERROR, FUNCTIONS, OK, WARNING, Fmu, resident

SOAK_STEPS = int(os.environ.get("SOAK_STEPS", "20000"))


def check_exactly_the_functions_of_the_standard_are_exported(fmu):
    wanted = {f"fmi2{name}" for name in FUNCTIONS} | {"fmi2GetVersion", "fmi2GetTypesPlatform", "fmi2Instantiate", "fmi2FreeInstance"}
    assert len(wanted) == 34
    symbols = subprocess.run(["nm", "-D", "--defined-only", fmu.library_path], capture_output=True, text=True, check=True).stdout
    assert {line.split()[-1].split("@")[0] for line in symbols.splitlines()} == wanted


def check_only_the_system_libraries_are_needed(fmu):
    dynamic = subprocess.run(["readelf", "-d", fmu.library_path], capture_output=True, text=True, check=True).stdout
    needed = {line.split("[")[1].rstrip("]") for line in dynamic.splitlines() if "(NEEDED)" in line}
    assert needed <= {"libc.so.6", "libm.so.6", "libgcc_s.so.1", "libpthread.so.0", "libdl.so.2", "ld-linux-x86-64.so.2"}, needed
    assert "RPATH" not in dynamic and "RUNPATH" not in dynamic


def check_version_and_platform_are_those_of_the_standard(fmu):
    for name, wanted in (("GetVersion", b"2.0"), ("GetTypesPlatform", b"default")):
        function = getattr(fmu.library, f"fmi2{name}")
        function.restype = ctypes.c_char_p
        assert function() == wanted


def check_the_process_stays_as_it_was(fmu):
    library_of_c = ctypes.CDLL(None)

    def surroundings():
        with open("/proc/self/status") as file:
            status = dict(line.split(":", 1) for line in file)
        signals = {name: status[name].strip() for name in ("SigCgt", "SigIgn", "SigBlk")}
        return os.getcwd(), locale.setlocale(locale.LC_ALL), library_of_c.fegetround(), status["Threads"].strip(), signals, dict(os.environ), files()

    def files():
        return sorted(os.readlink(f"/proc/self/fd/{fd}") for fd in os.listdir("/proc/self/fd") if os.path.exists(f"/proc/self/fd/{fd}"))

    before = surroundings()
    slave = fmu.started()
    slave.run(0, 50)
    broken = fmu.slave()
    broken.spoil()
    broken.setup()
    assert broken.initialize() == ERROR
    broken.free(), slave.free()
    assert surroundings() == before


def check_the_floating_point_mode_neither_matters_nor_changes(fmu):
    if platform.machine() != "x86_64":
        return
    # fenv.h of glibc on x86: round up; invalid, division by zero and overflow.
    upward, exceptions, steps, h = 0x800, 0x1 | 0x4 | 0x8, 40, 0.01
    library_of_m = ctypes.CDLL("libm.so.6")
    expected = fmu.started().run(0, steps, h)

    def under(enter, leave, state):
        """Runs with each call, and nothing of Python's own, in another mode."""

        def guarded(call, *arguments):
            enter()
            result = call(*arguments)
            kept = state()
            leave()
            assert kept, "the importer's mode was changed"
            return result

        slave = fmu.slave()
        assert guarded(slave.EnterInitializationMode) == OK
        assert guarded(slave.ExitInitializationMode) == OK
        trace = []
        for k in range(steps):
            slave.excite(k * h)
            assert guarded(slave.DoStep, k * h, h, 1) in (OK, WARNING)
            trace.append(slave.bits())
        return trace

    rounding = lambda mode: lambda: library_of_m.fesetround(mode)
    assert under(rounding(upward), rounding(0), lambda: library_of_m.fegetround() == upward) == expected
    trap = lambda: library_of_m.feenableexcept(exceptions)
    release = lambda: library_of_m.fedisableexcept(exceptions)
    # An exception that is not masked ends this process by a signal.
    assert under(trap, release, lambda: library_of_m.fegetexcept() == exceptions) == expected


def check_every_form_of_resource_location_is_understood(fmu):
    source = fmu.folder / "resources"
    with tempfile.TemporaryDirectory() as top:
        deep = pathlib.Path(top)
        while len(str(deep)) < 950:
            deep /= "a rather long folder name 0123456789"
        for folder in (pathlib.Path(top) / "plain", pathlib.Path(top) / "with blank", pathlib.Path(top) / "über 100% ☂", deep / ("x" * (999 - len(str(deep)) - 11)) / "resources"):
            folder.parent.mkdir(parents=True, exist_ok=True)
            shutil.copytree(source, folder) if source.is_dir() else folder.mkdir()
            quoted = urllib.parse.quote(str(folder))
            for location in (f"file://{quoted}", f"file:{quoted}", f"file://localhost{quoted}", f"file://{quoted}/"):
                slave = fmu.started(resources=location)
                warnings = [text for status, _, text in slave.messages if status == WARNING]
                assert not warnings, warnings
                slave.run(0, 2), slave.free()


def check_unusable_resource_locations_mean_defaults_with_a_warning(fmu):
    expected = fmu.started().run(0, 10)
    for location in (None, "", "file:///does/not/exist", "http://example.com/resources", "file://elsewhere/x", "%%%", "file:///%00", b"file:///\xff\xfe"):
        slave = fmu.started(resources=location)
        assert any(status == WARNING for status, _, _ in slave.messages), location
        assert slave.run(0, 10) == expected, location


def check_a_read_only_folder_serves(fmu):
    with tempfile.TemporaryDirectory() as top:
        folder = pathlib.Path(top) / "unpacked"
        shutil.copytree(fmu.folder, folder)
        entries = [folder, *folder.rglob("*")]
        for entry in entries:
            entry.chmod(0o555 if entry.is_dir() else 0o444)
        try:
            before = {entry: entry.stat().st_mtime_ns for entry in entries}
            Fmu(folder).started().run(0, 20)
            assert {entry: entry.stat().st_mtime_ns for entry in [folder, *folder.rglob("*")]} == before
        finally:
            for entry in entries:
                entry.chmod(0o755)


def check_a_thousand_instances_live_side_by_side(fmu):
    expected = fmu.started().run(0, 3)
    slaves = [fmu.started(name=f"instance {k}") for k in range(1000)]
    traces = [slave.run(0, 1) for slave in slaves]
    traces = [trace + slave.run(1, 3) for trace, slave in zip(traces, slaves)]
    assert all(trace == expected for trace in traces)
    for slave in slaves:
        slave.free()


def check_thousands_of_runs_leave_no_memory_behind(fmu):
    def runs(n):
        for _ in range(n):
            slave = fmu.started()
            slave.run(0, 1)
            slave.Terminate()
            slave.free()

    runs(300)
    before = resident()
    runs(2000)
    assert resident() - before < 2**20, f"{(resident() - before) / 2000} bytes a run"


def check_eight_threads_run_at_once(fmu):
    expected = fmu.started().run(0, 100)
    traces = [None] * 8

    def work(k):
        slave = fmu.started(name=f"thread {k}")
        traces[k] = slave.run(0, 100)
        slave.free()

    join(work)
    assert all(trace == expected for trace in traces)


def check_instances_move_between_threads(fmu):
    expected = fmu.started().run(0, 80)
    slaves, traces = [fmu.started() for _ in range(8)], [[] for _ in range(8)]
    for part in range(8):
        # Every thread ends before the next part, so that anything kept for a thread would be lost.
        join(lambda k: traces[k].extend(slaves[k].run(10 * part, 10 * part + 10)))
    assert all(trace == expected for trace in traces)


def join(work):
    failures = []

    def guarded(k):
        try:
            work(k)
        except BaseException as failure:
            failures.append(failure)

    threads = [threading.Thread(target=guarded, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures, failures


def check_a_long_run_keeps_memory_and_latency(fmu):
    slave, h = fmu.started(), 0.01
    durations = []
    for k in range(SOAK_STEPS):
        if k % 50 == 0:
            slave.excite(k * h)
        before = time.perf_counter_ns()
        status = slave.step(k * h, h)
        durations.append(time.perf_counter_ns() - before)
        assert status in (OK, WARNING), (k, slave.messages[-3:])
        slave.messages.clear()
        if k == SOAK_STEPS // 5:
            memory = resident()
    part = SOAK_STEPS // 5
    # The list of durations itself grows by at most 48 bytes an entry.
    assert resident() - memory < 48 * SOAK_STEPS + 2**20
    early, late = statistics.median(durations[part : 2 * part]), statistics.median(durations[-part:])
    # The machine's own speed wanders by a factor of two while other programs run.
    assert late < 3 * early + 2000, (early, late)
    assert all(abs(value) < 1e12 for value in slave.reals(fmu.outputs()))


def check_input_derivatives_belong_to_one_step(fmu):

    slave = fmu.started()
    variable = fmu.named("input", "Real")[0]
    reference, order, slope = byref(c_uint(variable.reference)), byref(c_int(1)), byref(c_double(0.1))
    possible = fmu.can("canInterpolateInputs")
    assert slave.SetRealInputDerivatives(reference, 1, order, slope) == (OK if possible else ERROR)
    assert slave.SetRealInputDerivatives(reference, 1, byref(c_int(0)), slope) == ERROR
    assert slave.SetRealInputDerivatives(reference, 1, byref(c_int(99)), slope) == ERROR
    output = fmu.named("output", "Real")[0]
    assert slave.SetRealInputDerivatives(byref(c_uint(output.reference)), 1, order, slope) == ERROR
    if possible:
        plain = fmu.started()
        steep, flat = slave.run(0, 3, h=0.1), plain.run(0, 3, h=0.1)
        assert steep != flat, "the derivative acts"


def check_output_derivatives_agree_with_differences(fmu):

    highest = int(fmu.capabilities.get("maxOutputDerivativeOrder", "0"))
    output = fmu.named("output", "Real")[0]
    slave, value = fmu.started(), c_double()
    ask = lambda variable, order: slave.GetRealOutputDerivatives(byref(c_uint(variable.reference)), 1, byref(c_int(order)), byref(value))
    assert ask(output, highest + 1) == ERROR and ask(output, 0) == ERROR
    if highest == 0 or "x" not in fmu.variables:
        return
    slave.run(0, 50)
    h = 1e-4
    for name in ("x", "y", "psi", "s", "v_x_true", "yaw_rate_true", "e_y_true", "e_psi_true"):
        variable = fmu.variables[name]
        state = slave.save()
        before = slave.get(name)[1]
        assert ask(variable, 1) == OK
        slope = value.value
        assert slave.step(0.5, h) == OK
        after = slave.get(name)[1]
        assert slave.SetFMUstate(state) == OK
        slave.release(state)
        # The difference's own error is h / 2 times the second derivative, which is below 100 of any unit here.
        assert abs((after - before) / h - slope) < 1e-2 + 1e-3 * abs(slope), (name, slope, (after - before) / h)


def check_directional_derivatives_are_refused_where_they_do_not_exist(fmu):
    known, unknown = fmu.named("input", "Real")[0], fmu.outputs()[0]
    slave = fmu.started()
    if fmu.can("providesDirectionalDerivative"):
        assert slope(slave, known, known) is None, "an input is no unknown"
        assert slope(slave, unknown, unknown) is None, "an output is no known"
    else:
        assert slope(slave, unknown, known) is None


def check_directional_derivatives_agree_with_differences(fmu):
    if not fmu.can("providesDirectionalDerivative"):
        return
    # The controller's command belongs to the inputs of its last sample; the plant's outputs follow its inputs at once.
    sampled = "t_s" in fmu.variables
    h = float(fmu.variables["t_s"].attributes["start"]) if sampled else 0.01
    # The derivative holds the tyres that a network believes in: it is the total one only without a network.
    parameters = {"adaptation": 0} if sampled else {}
    slave, outputs, t = fmu.started(parameters=parameters), fmu.outputs(), 30 * h
    slave.run(0, 30, h)
    slave.excite(t)
    before = slave.save()

    def react(variable, value):
        assert slave.SetFMUstate(before) == OK
        assert slave.set(variable.name, value) == OK
        if sampled:
            # The measurements of this check belong to no car, so the filter may doubt them.
            assert slave.step(t, h) in (OK, WARNING)
        return slave.reals(outputs)

    acting = 0
    for variable in fmu.named("input", "Real"):
        assert slave.SetFMUstate(before) == OK
        value, small = slave.get(variable.name)[1], 1e-4
        above, below = react(variable, value + small), react(variable, value - small)
        react(variable, value)
        for output, upper, lower in zip(outputs, above, below):
            # How the solver fared is no function that one could differentiate.
            if output.name in ("kkt_residual", "slack_e_y"):
                continue
            difference, exact = (upper - lower) / (2 * small), slope(slave, output, variable)
            # Third derivatives and the solver's tolerance stay below these in the second and the first term.
            close = abs(exact - difference) <= 1e-3 * abs(difference) + 1e-5 * max(1.0, abs(upper))
            assert close, (output.name, variable.name, exact, difference)
            acting += abs(difference) > 1e-3
    assert acting > 5, "nothing was compared"
    slave.release(before)


def slope(slave, unknown, known):
    """Derivative of one variable along another, or None if it is refused."""
    one, sensitivity = c_double(1.0), c_double(math.nan)
    references = byref(c_uint(unknown.reference)), 1, byref(c_uint(known.reference)), 1
    status = slave.GetDirectionalDerivative(*references, byref(one), byref(sensitivity))
    return sensitivity.value if status == OK else None

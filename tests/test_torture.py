"""Each check of torture/ on each archive, in a process of its own, so that a crash is a failure and not the end of the run.

SOAK_STEPS=1000000 makes the soak long."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import zipfile

import pytest

FOLDER = pathlib.Path(__file__).parent / "torture"
CHECKS = sorted(
    name for file in FOLDER.glob("*.py") for name in re.findall(r"^def (check_\w+)", file.read_text(), flags=re.MULTILINE)
)
# The longest check takes a few seconds; one that needs this long hangs.
TIMEOUT = 120 + float(os.environ.get("SOAK_STEPS", "0")) * 1e-3


@pytest.fixture(scope="session", params=["plant", "controller"])
def unpacked(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    with zipfile.ZipFile(request.getfixturevalue(request.param)) as archive:
        archive.extractall(folder)
    # The standard lets an importer expect the folder even if there is nothing in it.
    (folder / "resources").mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def driver(tmp_path_factory):
    """The importer in C."""
    program = tmp_path_factory.mktemp("driver") / "driver"
    subprocess.run(["gcc", "-std=gnu11", "-O1", "-g", "-Wall", "-Werror", FOLDER / "driver.c", "-o", program, "-ldl", "-lpthread"], check=True)
    return program


def drive(unpacked, driver, *under):
    sys.path.insert(0, str(FOLDER))
    from fmu import Fmu

    fmu = Fmu(unpacked)
    references = [str(variable.reference) for variable in fmu.outputs()]
    command = [*under, driver, fmu.library_path, fmu.guid, (unpacked / "resources").as_uri(), *references]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)


@pytest.mark.parametrize("check", CHECKS)
def test_torture(unpacked, check):
    command = [sys.executable, FOLDER / "run.py", unpacked, check]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    assert done.returncode == 0, f"{check} ended with {done.returncode}:\n{done.stderr[-3000:]}"
    assert done.stdout == "", "an FMU prints nothing"
    assert done.stderr == "", "an FMU prints nothing"


def test_an_importer_in_c_with_a_small_stack_runs_and_unloads_it(unpacked, driver):
    done = drive(unpacked, driver)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "" and done.stdout.count("\n") == len(done.stdout.split())


def test_valgrind_finds_no_error_and_no_leak(unpacked, driver):
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        pytest.skip("VALGRIND IS NOT INSTALLED: memory errors and leaks were NOT looked for (Debian: apt install valgrind)")
    done = drive(unpacked, driver, valgrind, "--quiet", "--error-exitcode=9", "--leak-check=full", "--errors-for-leak-kinds=definite,indirect,possible")
    assert done.returncode == 0, done.stderr[-5000:]

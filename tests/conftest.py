"""What every test of the archives shares: their paths, and libraries that tools expect on the system."""

import ctypes
import importlib.metadata
import os
import pathlib
import shlex
import shutil
import sys

import pytest

ROOT = pathlib.Path(__file__).parent.parent
ARCHIVES = ROOT / os.environ.get("FMU_ARCHIVES", "target/fmu")
# What ecos runs to unpack an archive: unzip -o ARCHIVE -d FOLDER.
UNZIP = f"""#!/bin/sh
exec {shlex.quote(sys.executable)} -m zipfile -e "$2" "$4"
"""


def _archive(name):
    path = ARCHIVES / name
    assert path.is_file(), f"{path} is missing: run cargo fmu pack"
    return str(path)


@pytest.fixture(scope="session")
def controller():
    """Path of the controller's FMU."""
    return _archive("LpvMpcController.fmu")


@pytest.fixture(scope="session")
def plant():
    """Path of the plant's FMU."""
    return _archive("VehiclePlant.fmu")


@pytest.fixture(scope="session")
def system():
    """Path of the wired system."""
    return _archive("ClosedLoop.ssp")


@pytest.fixture(scope="session")
def ecos(tmp_path_factory):
    """The ecospy module, with what it takes from the system and a bare one lacks: unzip, and the threading library that its own
    library is linked against."""
    if shutil.which("unzip") is None:
        program = tmp_path_factory.mktemp("programs") / "unzip"
        program.write_text(UNZIP)
        program.chmod(0o755)
        os.environ["PATH"] = f"{program.parent}{os.pathsep}{os.environ['PATH']}"
    name = "libtbb.so.12"
    found = [file for file in importlib.metadata.files("tbb") or [] if file.name == name]
    # A library that is loaded already satisfies the later one by its name, wherever it lies.
    ctypes.CDLL(str(found[0].locate()) if found else name, mode=ctypes.RTLD_GLOBAL)
    import ecospy

    return ecospy

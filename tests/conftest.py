"""What every test of the archives shares: their paths, and libraries that tools expect on the system."""

import ctypes
import importlib.metadata
import os
import pathlib

import pytest

ROOT = pathlib.Path(__file__).parent.parent
ARCHIVES = ROOT / os.environ.get("FMU_ARCHIVES", "target/fmu")


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
def ecos():
    """The ecospy module, with the threading library that its own library is linked against."""
    name = "libtbb.so.12"
    found = [file for file in importlib.metadata.files("tbb") or [] if file.name == name]
    # A library that is loaded already satisfies the later one by its name, wherever it lies.
    ctypes.CDLL(str(found[0].locate()) if found else name, mode=ctypes.RTLD_GLOBAL)
    import ecospy

    return ecospy

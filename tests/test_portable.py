"""The libraries for Windows, run under Wine and held against those for Linux. What is missing for it is said in capitals."""

import os
import pathlib
import shutil
import struct
import subprocess
import sys
import zipfile

import pytest

FOLDER = pathlib.Path(__file__).parent / "torture"
MINGW = "x86_64-w64-mingw32-gcc"
STEPS, H = 300, 0.01
# Windows has its own sine and arctangent, which round otherwise than those of Linux; closed through neither loop nor chaos, the
# difference stays at some hundred roundings.
TOLERANCE = 1e-11


def wine():
    """Debian's package wine64 leaves its program outside of the PATH."""
    found = shutil.which("wine64") or shutil.which("wine") or shutil.which("/usr/lib/wine/wine64")
    if found is None:
        pytest.skip("WINE IS NOT INSTALLED: the libraries for Windows were NOT run (Debian: apt install wine64)")
    return found


def compiled(compiler, output, *arguments):
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} IS NOT INSTALLED: the libraries for Windows were NOT run (tools/cross-toolchain)")
    subprocess.run([compiler, "-std=gnu11", "-O1", "-Wall", "-Werror", *arguments, "-o", output], check=True)
    return output


@pytest.fixture(params=["plant", "controller"])
def unpacked(request, tmp_path):
    with zipfile.ZipFile(request.getfixturevalue(request.param)) as archive:
        if not any(name.startswith("binaries/win64/") for name in archive.namelist()):
            pytest.skip("NO win64 IN THIS ARCHIVE: built by cargo fmu pack --portable where tools/cross-toolchain found MinGW")
        archive.extractall(tmp_path / "fmu")
    return tmp_path / "fmu"


def written_plan(fmu, path):
    """Steps with inputs that move, for both programs."""
    sys.path.insert(0, str(FOLDER))
    from fmu import excitation

    inputs, outputs = fmu.named("input", "Real"), fmu.outputs()
    references = [variable.reference for variable in [*inputs, *outputs]]
    plan = struct.pack(f"<3I{len(references)}I", len(inputs), len(outputs), STEPS, *references)
    for k in range(STEPS):
        t = k * H
        plan += struct.pack(f"<{2 + len(inputs)}d", t, H, *(excitation(variable.name, t) for variable in inputs))
    path.write_bytes(plan)
    return outputs


def test_the_library_for_windows_computes_what_that_for_linux_does(unpacked, tmp_path):
    sys.path.insert(0, str(FOLDER))
    from fmu import Fmu

    program = wine()
    fmu = Fmu(unpacked)
    outputs = written_plan(fmu, tmp_path / "plan")
    windows = compiled(MINGW, tmp_path / "steps.exe", FOLDER / "steps.c")
    compiled(MINGW, tmp_path / "bcryptprimitives.dll", "-shared", FOLDER / "bcryptprimitives.c", "-ladvapi32")
    linux = compiled("gcc", tmp_path / "steps", FOLDER / "steps.c", "-ldl")
    library = unpacked / "binaries" / "win64" / fmu.library_path.with_suffix(".dll").name
    resources = (unpacked / "resources").as_uri()

    subprocess.run([linux, fmu.library_path, fmu.guid, resources, tmp_path / "plan", tmp_path / "linux"], check=True, timeout=60)
    # Drive Z is the root of the file system. The prefix, a folder with a registry, takes Wine some seconds to make.
    command = [program, windows, f"Z:{library}", fmu.guid, resources.replace("file:///", "file:///Z:/"), f"Z:{tmp_path}/plan", f"Z:{tmp_path}/windows"]
    environment = {**os.environ, "WINEPREFIX": str(tmp_path / "prefix"), "WINEDEBUG": "-all"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=180, check=False)
    assert done.returncode == 0, done.stderr[-3000:]

    values = []
    for system in ("linux", "windows"):
        data = (tmp_path / system).read_bytes()
        assert len(data) == 8 * STEPS * len(outputs), system
        values.append(struct.unpack(f"<{STEPS * len(outputs)}d", data))
    worst, name = 0.0, ""
    for place, (one, other) in enumerate(zip(*values)):
        difference = abs(one - other) / max(1.0, abs(one))
        # Written so that NaN is a difference.
        if not difference <= worst:
            worst, name = difference, outputs[place % len(outputs)].name
    print(f"{fmu.library_path.stem}: largest relative difference {worst:.1e} {name}")
    assert worst <= TOLERANCE, f"{name} differs by {worst:.1e}"
    assert any(value != 0.0 for value in values[0]), "something must have moved"

"""What an archive carries besides the library: checked by the tools that read it, and by replaying its reference."""

import pathlib
import struct
import subprocess
import sys
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv
from lxml import etree

REFERENCE = "extra/org.fmi-standard.fmi-ls-ref/"


@pytest.fixture(params=["plant", "controller"])
def archive(request):
    return request.getfixturevalue(request.param)


@pytest.fixture
def files(archive):
    with zipfile.ZipFile(archive) as opened:
        yield opened


def test_fmutool_finds_no_problem(archive):
    command = [sys.executable, "-m", "fmu_manipulation_toolbox.cli.fmutool", "-input", archive, "-check"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    log = done.stdout + done.stderr
    assert done.returncode == 0, log
    assert "compliant with FMI-2.0" in log and "No semantic error" in log, log
    assert not any(word in log for word in ("ERROR", "WARNING", "Traceback")), log


def test_terminals_are_valid_and_name_variables(archive, files):
    schema = etree.XMLSchema(file=str(pathlib.Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"))
    terminals = etree.fromstring(files.read("terminalsAndIcons/terminalsAndIcons.xml"))
    assert schema.validate(terminals), schema.error_log
    variables = {v.name for v in fmpy.read_model_description(archive).modelVariables}
    members = [member.get("variableName") for member in terminals.iter("TerminalMemberVariable")]
    assert members and set(members) <= variables


def test_icon_is_a_square_png(files):
    icon = files.read("model.png")
    assert icon[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", icon[16:24])
    assert width == height >= 64


def test_licences_travel_with_the_binary(files):
    folder = "documentation/licenses/"
    page = files.read(folder + "third-party.txt").decode()
    assert "serde" in page and "Apache License" in page and "Permission is hereby granted" in page
    assert {folder + "LICENSE-MIT.txt", folder + "LICENSE-APACHE.txt"} <= set(files.namelist())


def test_no_path_of_the_builder_is_in_a_text(files):
    for name in files.namelist():
        if name.startswith("binaries/"):
            continue
        assert b"/home/" not in files.read(name) and b"/root/" not in files.read(name), name


def test_manifest_of_the_reference_names_files_that_exist(files):
    manifest = etree.fromstring(files.read(REFERENCE + "fmi-ls-manifest.xml"))
    related = [pathlib.PurePosixPath(REFERENCE, entry.get("source")) for entry in manifest.iter("Related")]
    assert len(related) >= 3
    for path in related:
        parts = []
        for part in path.parts:
            parts = parts[:-1] if part == ".." else [*parts, part]
        assert "/".join(parts) in files.namelist(), path


def test_reference_is_replayed_to_its_result(archive, files, tmp_path):
    for name in ("lane_change_in.csv", "lane_change_ref.csv"):
        (tmp_path / name).write_bytes(files.read(REFERENCE + name))
    experiment = etree.fromstring(files.read(REFERENCE + "experiments.xml")).find("Experiment")
    stop, step = float(experiment.get("stopTime")), float(experiment.get("stepSize"))
    given = read_csv(str(tmp_path / "lane_change_in.csv"))
    wanted = read_csv(str(tmp_path / "lane_change_ref.csv"))
    names = [name for name in wanted.dtype.names if name != "time"]
    result = fmpy.simulate_fmu(archive, stop_time=stop, output_interval=step, input=given, output=names)
    assert len(result) == len(wanted)
    for name in names:
        # FMPy interpolates the inputs between the rows that it is given, which differs by rounding at the rows themselves.
        scale = max(1.0, np.abs(wanted[name]).max())
        difference = np.abs(result[name] - wanted[name]).max() / scale
        assert difference < 1e-9, f"{name} differs by {difference} of its size"

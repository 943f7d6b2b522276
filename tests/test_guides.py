"""The guides of tools/guide, run as they stand: what a user copies must work."""

import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parent.parent
GUIDES = ROOT / "tools" / "guide"
BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(guide):
    """Language and text of each block that is meant to be run."""
    return BLOCK.findall((GUIDES / guide).read_text())


def run(language, text):
    # The interpreter of the tests has FMPy; a user's python3 in a shell block has what the guide asked for.
    search = f"{pathlib.Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    # -u: a variable that an earlier block forgot to set is the guide's mistake.
    command = ["bash", "-euc", text] if language == "sh" else [sys.executable, "-c", text]
    done = subprocess.run(command, cwd=ROOT, env={**os.environ, "PATH": search}, capture_output=True, text=True)
    assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.mark.parametrize("guide", ["fmpy.md", "c.md", "own_vehicle.md"])
def test_guide_runs_as_it_stands(guide, plant, controller):
    found = blocks(guide)
    assert found, f"{guide} has nothing to run"
    said = [run(language, text) for language, text in found]
    assert "largest lateral error" in said[-1]


def test_guide_for_ssp_runs_as_it_stands(system, ecos):
    said = [run(language, text) for language, text in blocks("omsimulator.md")]
    assert "resources/general.ssv" in said[0] and "largest lateral error" in said[1]


def test_every_guide_is_listed_and_tested():
    guides = {path.name for path in GUIDES.glob("*.md")} - {"README.md"}
    listed = set(re.findall(r"\]\((\w+\.md)\)", (GUIDES / "README.md").read_text()))
    assert guides == listed == {"fmpy.md", "c.md", "own_vehicle.md", "omsimulator.md"}


def test_program_in_c_reports_what_is_wrong(plant, controller, tmp_path):
    program = tmp_path / "closed_loop"
    source = GUIDES / "closed_loop.c"
    subprocess.run([shutil.which("gcc"), "-O2", "-o", program, source, "-ldl", "-lm"], check=True)
    done = subprocess.run([program, tmp_path / "nowhere", tmp_path], capture_output=True, text=True)
    assert done.returncode == 1 and "no such folder" in done.stderr and "nowhere" in done.stderr

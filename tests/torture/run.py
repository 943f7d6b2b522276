"""Runs one check on one unpacked archive: run.py FOLDER CHECK. A crash ends this process only."""

import faulthandler
import sys

import arguments
import sequences
import states
import surroundings
from fmu import Fmu

CHECKS = {
    name: function
    for module in (arguments, states, sequences, surroundings)
    for name, function in vars(module).items()
    if name.startswith("check_")
}

if __name__ == "__main__":
    faulthandler.enable()
    folder, check = sys.argv[1:]
    CHECKS[check](Fmu(folder))

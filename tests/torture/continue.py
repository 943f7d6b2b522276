"""Continues a run from saved bytes in a process of its own: continue.py FOLDER BYTES FIRST LAST; the outputs go to stdout."""

import pathlib
import sys

from fmu import OK, Fmu

folder, file, first, last = sys.argv[1:]
slave = Fmu(folder).slave()
assert slave.restore(pathlib.Path(file).read_bytes()) == OK, slave.messages
sys.stdout.buffer.write(b"".join(slave.run(int(first), int(last))))

"""Drives sets of parameters in situations as packed FMUs, by any number of workers.

    python tools/distributed/campaign.py plan.json --results target/campaign/fleet

The plan is {"candidates": [{"r_delta": 30, ...}, {}], "situations": [{"name": ..., "plant": {...}, "controller": {...}}]}; an empty
candidate is the controller as shipped. Results are Parquet files, one row for each pair. The same command again drives what is missing.
"""

import argparse
import json
import pathlib
import sys

import fleet


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plan", type=pathlib.Path, help="JSON file")
    fleet.add_arguments(parser)
    return parser.parse_args(arguments)


def main(arguments):
    arguments = parse(arguments)
    plan = json.loads(arguments.plan.read_text(encoding="utf-8"))
    pairs = [(candidate, situation) for candidate in plan["candidates"] for situation in plan["situations"]]
    with fleet.connected(arguments) as client, fleet.Store(arguments.results) as store:
        known = len(store.rows)
        figures = fleet.drive_all(client, store, pairs, arguments)
        print(f"{len(store.rows) - known} of {len(pairs)} runs driven, the others were known", file=sys.stderr)
    for (candidate, situation), figure in zip(pairs, figures):
        print(f"{figure:12.4f}  {situation['name']}  {json.dumps(candidate)}")


if __name__ == "__main__":
    main(sys.argv[1:])

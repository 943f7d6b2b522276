"""Tunes the controller with the optimiser of `cargo fmu tune`, its candidates driven as packed FMUs by any number of workers.

    python tools/distributed/tune.py --results target/tune/fleet
    python tools/distributed/tune.py --results target/tune/fleet --scheduler tcp://HOST:8786 -- --method hybrid --iterations 30

What follows -- goes to the optimiser. It asks on its standard output and is told on its standard input, one line of JSON each; the
protocol is described in tools/src/tune/ask_tell.rs. The same command again goes on where an earlier one stopped.
"""

import argparse
import json
import subprocess
import sys

import fleet


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    fleet.add_arguments(parser)
    parser.add_argument("--situations", metavar="FILE", help='list of {"name", "plant": {...}, "controller": {...}} that a candidate drives')
    parser.add_argument("--fmu", default="cargo fmu", help="how to start the project's tools")
    parser.add_argument("optimiser", nargs="*", metavar="-- ARGUMENTS", help="arguments of cargo fmu tune")
    return parser.parse_args(arguments)


def score(figures):
    """Half the mean and half the worst: with one situation its figure."""
    return 0.5 * (sum(figures) / len(figures) + max(figures))


def main(arguments):
    arguments = parse(arguments)
    parameters = arguments.results / "tuned.ssv"
    command = [*arguments.fmu.split(), "tune", "--ask-tell", "--output", str(parameters), *arguments.optimiser]
    if parameters.with_suffix(".checkpoint.json").is_file():
        command.append("--resume")
    driven = fleet.situations(arguments.situations)
    with fleet.connected(arguments) as client, fleet.Store(arguments.results) as store:
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as optimiser:
            for line in optimiser.stdout:
                said = json.loads(line)
                if "ask" not in said:
                    print(json.dumps(said))
                    break
                questions = said["ask"]
                pairs = [(question["parameters"], situation) for question in questions for situation in driven]
                figures = fleet.drive_all(client, store, pairs, arguments)
                count = len(driven)
                values = [score(figures[count * k : count * (k + 1)]) for k in range(len(questions))]
                answers = [{"id": question["id"], "value": value} for question, value in zip(questions, values)]
                optimiser.stdin.write(json.dumps({"tell": answers}) + "\n")
                optimiser.stdin.flush()
                print(f"generation {said['generation']}: best {min(values):.4f} of {len(values)}", file=sys.stderr)
        if optimiser.returncode != 0:
            raise SystemExit(f"the optimiser ended with {optimiser.returncode}")
    print(f"parameter set: {parameters}", file=sys.stderr)


if __name__ == "__main__":
    main(sys.argv[1:])

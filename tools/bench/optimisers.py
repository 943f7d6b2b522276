"""Optimisers of pymoo and pyswarms beside those of `cargo fmu tune --benchmark`: the same functions, boxes and numbers of evaluations.

    pip install pymoo pyswarms
    python tools/bench/optimisers.py                     all five functions, 30 seeds, table
    python tools/bench/optimisers.py --functions sphere --seeds 5 --json

Every optimiser runs as its documentation shows it, with its own population; a search counts the least of its first evaluations.
"""

import argparse
import contextlib
import io
import json
import logging
import subprocess
import sys

import numpy as np

SIDES = 5


def sphere(x):
    return np.sum(x**2)


def rosenbrock(x):
    return np.sum(100.0 * (x[1:] - x[:-1] ** 2) ** 2 + (1.0 - x[:-1]) ** 2)


def rastrigin(x):
    return np.sum(x**2 + 10.0 * (1.0 - np.cos(2.0 * np.pi * x)))


def ackley(x):
    # Differences first, as in the other implementation: at the optimum they vanish to the last bit.
    return 20.0 * (1.0 - np.exp(-0.2 * np.sqrt(np.mean(x**2)))) + (np.e - np.exp(np.mean(np.cos(2.0 * np.pi * x))))


def griewank(x):
    return np.sum(x**2) / 4000.0 + (1.0 - np.prod(np.cos(x / np.sqrt(np.arange(1, len(x) + 1)))))


# The boxes of the other implementation.
FUNCTIONS = {"sphere": (sphere, 5.12), "rosenbrock": (rosenbrock, 2.048), "rastrigin": (rastrigin, 5.12), "ackley": (ackley, 32.768), "griewank": (griewank, 600.0)}


class Meter:
    """A function that remembers its least value within the budget."""

    def __init__(self, function, budget):
        self.function, self.left, self.least = function, budget, np.inf

    def __call__(self, x):
        value = self.function(np.asarray(x, dtype=float))
        if self.left > 0:
            self.left -= 1
            self.least = min(self.least, value)
        return value


def pymoo(algorithm):
    """A search of pymoo, its own tolerances off."""

    def search(meter, bound, seed):
        from pymoo.core.problem import ElementwiseProblem
        from pymoo.optimize import minimize

        class Problem(ElementwiseProblem):
            def __init__(self):
                super().__init__(n_var=SIDES, n_obj=1, xl=-bound, xu=bound)

            def _evaluate(self, x, out, *_, **__):
                out["F"] = meter(x)

        minimize(Problem(), algorithm(), ("n_eval", meter.left), seed=seed, verbose=False)

    return search


def cma():
    from pymoo.algorithms.soo.nonconvex.cmaes import CMAES

    return CMAES(tolfun=0.0, tolx=0.0, tolfunhist=0.0)


def differential_evolution():
    from pymoo.algorithms.soo.nonconvex.de import DE

    return DE()


def particles():
    from pymoo.algorithms.soo.nonconvex.pso import PSO

    return PSO()


def genetic():
    from pymoo.algorithms.soo.nonconvex.ga import GA

    return GA()


def pyswarms(meter, bound, seed):
    """The example of its front page, with as many particles as the paper has."""
    from pyswarms.single import GlobalBestPSO

    count = 25
    np.random.seed(seed)
    bounds = (np.full(SIDES, -bound), np.full(SIDES, bound))
    swarm = GlobalBestPSO(n_particles=count, dimensions=SIDES, options={"c1": 0.5, "c2": 0.3, "w": 0.9}, bounds=bounds)
    swarm.optimize(lambda points: np.array([meter(x) for x in points]), iters=-(-meter.left // count), verbose=False)


PEERS = {"pymoo_cmaes": pymoo(cma), "pymoo_de": pymoo(differential_evolution), "pymoo_pso": pymoo(particles), "pymoo_ga": pymoo(genetic), "pyswarms_pso": pyswarms}


def medians(name, seeds, evaluations):
    """Median of each peer on one function."""
    function, bound = FUNCTIONS[name]
    found = {}
    for peer, search in PEERS.items():
        ends = []
        for seed in range(seeds):
            meter = Meter(function, evaluations)
            # Some of them talk.
            with contextlib.redirect_stdout(io.StringIO()):
                search(meter, bound, seed)
            ends.append(float(meter.least))
        found[peer] = float(np.median(ends))
    return found


def ours(command, name, seeds, evaluations):
    """Medians of the project's own, and of the peers in Rust."""
    words = [*command.split(), "tune", "--benchmark", name, "--seeds", str(seeds), "--evaluations", str(evaluations), "--peers", "--json"]
    return json.loads(subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout)["medians"]


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--functions", nargs="*", choices=list(FUNCTIONS), default=list(FUNCTIONS))
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--evaluations", type=int, default=4550, help="those of the paper's hundred iterations of the hybrid")
    parser.add_argument("--fmu", default="cargo fmu", help="how to start the project's tools")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args(arguments)
    logging.disable(logging.INFO)
    table = {}
    for name in arguments.functions:
        table[name] = {
            **ours(arguments.fmu, name, arguments.seeds, arguments.evaluations),
            **medians(name, arguments.seeds, arguments.evaluations),
        }
    if arguments.json:
        print(json.dumps({"evaluations": arguments.evaluations, "seeds": arguments.seeds, "medians": table}))
        return
    print(f"median of {arguments.seeds} seeds, {arguments.evaluations} evaluations, {SIDES} variables")
    print(f"{'':14}" + "".join(f"{name:>12}" for name in table))
    for optimiser in next(iter(table.values())):
        print(f"{optimiser:14}" + "".join(f"{table[name][optimiser]:12.2e}" for name in table))


if __name__ == "__main__":
    main(sys.argv[1:])

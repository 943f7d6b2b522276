"""Solves recorded quadratic programmes with the solvers that PyPI offers, for `cargo fmu bench`.

Reads requests as lines of JSON from standard input, answers each with one line:

    {"solver": NAME, "file": PATH, "horizon": N, "first": K, "count": M, "restart": BOOL}
    {"seconds": [...], "u": [[delta, a_x], ...], "solved": [BOOL, ...]}

The times are those that the solvers report of themselves; forming their matrices is not in them. A first line lists the
solvers that could be imported. Files are in the format of fmu-controller/lpv-mpc/benches/qp/README.md.
"""

import json
import os
import sys
from functools import lru_cache

import numpy as np

NX, NU, E_Y = 5, 2, 3
HEADER = 26
# Tolerance of the solvers that have one; at their defaults they are faster and wrong.
TOLERANCE = 1e-8
ITERATIONS_MAX = 20000


class File:
    def __init__(self, path):
        data = np.fromfile(path, dtype="<f8")
        head = data[:HEADER]
        self.horizon = int(head[1])
        self.q, self.q_terminal, self.r = head[6:11], head[11:16], head[16:18]
        self.u_min, self.u_max, self.du_max = head[18:20], head[20:22], head[22:24]
        self.soft_bound, self.soft = head[24], head[25]
        self.records = data[HEADER:].reshape(int(head[2]), -1)


@lru_cache(maxsize=16)
def load(path):
    return File(path)


class Condensed:
    """minimise 1/2 u' H u + f' u, bounds on u, on du and, softly, on e_y."""

    def __init__(self, file, record, horizon):
        N, M = file.horizon, horizon
        x, u_prev = record[:5], np.clip(record[5:7], file.u_min, file.u_max)
        speeds = record[9 + N + 1 : 9 + 2 * (N + 1)]
        model = record[9 + 2 * (N + 1) + 7 * N :].reshape(N, 35)
        effect, free, row = np.zeros((NX * M, NU * M)), np.zeros(NX * M), np.zeros((NX, NU * M))
        for i in range(M):
            A, B = model[i, :25].reshape(NX, NX), model[i, 25:].reshape(NX, NU)
            x, row = A @ x, A @ row
            row[:, NU * i : NU * i + NU] += B
            effect[NX * i : NX * i + NX], free[NX * i : NX * i + NX] = row, x
        weights = np.concatenate([file.q] * (M - 1) + [file.q_terminal])
        error = free.copy()
        error[0::NX] -= speeds[1 : M + 1]
        self.D = np.eye(NU * M) - np.eye(NU * M, k=-NU)
        r, before = np.tile(file.r, M), np.zeros(NU * M)
        before[:NU] = u_prev
        self.H = 2 * (effect.T * weights @ effect + self.D.T * r @ self.D)
        self.f = 2 * (effect.T @ (weights * error) - self.D.T @ (r * before))
        self.S = effect[E_Y::NX]
        self.low, self.high = np.tile(file.u_min, M), np.tile(file.u_max, M)
        self.d_low, self.d_high = before - np.tile(file.du_max, M), before + np.tile(file.du_max, M)
        self.s_low, self.s_high = -file.soft_bound - free[E_Y::NX], file.soft_bound - free[E_Y::NX]

    def with_slacks(self, soft):
        """Slacks of the soft bound as variables, for solvers that have no soft constraints of their own."""
        n, m = self.H.shape[0], self.S.shape[0]
        H = np.block([[self.H, np.zeros((n, m))], [np.zeros((m, n)), 2 * soft * np.eye(m)]])
        f = np.concatenate([self.f, np.zeros(m)])
        zero, one, inf = np.zeros((n, m)), np.eye(m), np.full(m, np.inf)
        G = np.block([[self.D, zero], [self.S, -one], [self.S, one]])
        low = np.concatenate([self.d_low, -inf, self.s_low])
        high = np.concatenate([self.d_high, self.s_high, inf])
        return H, f, G, low, high, np.concatenate([self.low, -inf]), np.concatenate([self.high, inf])


@lru_cache(maxsize=2000)
def condensed(path, horizon, index):
    file = load(path)
    return Condensed(file, file.records[index], horizon)


class Daqp:
    """Dual active set, warm started from the previous multipliers moved on by one sample."""

    def __init__(self):
        import daqp

        self.solve_qp, self.warm = daqp.solve, None

    def solve(self, file, qp):
        # Its own soft constraints weigh the violation of scaled rows, which is another problem.
        H, f, G, low, high, x_low, x_high = qp.with_slacks(file.soft)
        n, m = qp.H.shape[0], qp.S.shape[0]
        low, high = np.concatenate([x_low, low]), np.concatenate([x_high, high])
        low, high = np.maximum(low, -1e30), np.minimum(high, 1e30)
        sense = np.zeros(len(low), dtype=np.int32)
        warm = {} if self.warm is None else {"dual_start": self.warm}
        u, _, flag, info = self.solve_qp(H, f, G, high, low, sense, **warm)
        self.warm = np.array(info["lam"])
        rates = n + m
        blocks = ((0, n, NU), (rates, rates + n, NU), (rates + n, rates + n + m, 1), (rates + n + m, rates + n + 2 * m, 1))
        for first, last, step in blocks:
            self.warm[first : last - step] = info["lam"][first + step : last]
        return info["setup_time"] + info["solve_time"], u[:NU], flag == 1


class Piqp:
    """Proximal interior point method, dense, data updated."""

    def __init__(self):
        import piqp

        self.piqp, self.solver = piqp, None

    def solve(self, file, qp):
        H, f, G, low, high, x_low, x_high = qp.with_slacks(file.soft)
        data = {"P": np.asfortranarray(H), "c": f, "G": np.asfortranarray(G), "h_l": low, "h_u": high}
        data |= {"x_l": x_low, "x_u": x_high}
        if self.solver is None:
            self.solver = self.piqp.DenseSolver()
            self.solver.settings.compute_timings = True
            self.solver.setup(**data)
            prepared = self.solver.result.info.setup_time
        else:
            self.solver.update(**data)
            prepared = self.solver.result.info.update_time
        status = self.solver.solve()
        result = self.solver.result
        return prepared + result.info.solve_time, result.x[:NU], status == self.piqp.PIQP_SOLVED


class Proxqp:
    """Proximal augmented Lagrangian method, dense, warm started."""

    def __init__(self):
        from proxsuite import proxqp

        self.proxqp, self.solver = proxqp, None

    def solve(self, file, qp):
        H, f, G, low, high, x_low, x_high = qp.with_slacks(file.soft)
        C = np.vstack([G, np.eye(len(f))[: qp.H.shape[0]]])
        low, high = np.concatenate([low, x_low[: qp.H.shape[0]]]), np.concatenate([high, x_high[: qp.H.shape[0]]])
        low, high = np.maximum(low, -1e20), np.minimum(high, 1e20)
        if self.solver is None:
            self.solver = self.proxqp.dense.QP(len(f), 0, len(low))
            self.solver.settings.compute_timings = True
            self.solver.settings.eps_abs = TOLERANCE
            # Where it solves a problem it needs some fifty; at its default, 10000, it tries the others for up to minutes.
            self.solver.settings.max_iter = self.solver.settings.max_iter_in = 200
            self.solver.settings.initial_guess = self.proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
            self.solver.init(H, f, None, None, C, low, high)
        else:
            self.solver.update(H, f, None, None, C, low, high)
        self.solver.solve()
        info = self.solver.results.info
        solved = info.status == self.proxqp.QPSolverOutput.PROXQP_SOLVED
        # ProxQP reports microseconds.
        return (info.setup_time + info.solve_time) * 1e-6, self.solver.results.x[:NU], solved


class Osqp:
    """Operator splitting, sparse, data updated, warm started by itself."""

    def __init__(self):
        import osqp
        from scipy import sparse

        self.osqp, self.sparse, self.solver = osqp, sparse, None

    def solve(self, file, qp):
        H, f, G, low, high, x_low, x_high = qp.with_slacks(file.soft)
        # The condensed problem is dense; its pattern is stored whole, so that an update never changes it.
        A = np.vstack([G, np.eye(len(f))])
        low, high = np.concatenate([low, x_low]), np.concatenate([high, x_high])
        rows, columns = np.triu_indices(len(f))
        order = np.lexsort((rows, columns))
        rows, columns = rows[order], columns[order]
        if self.solver is None:
            P = self.sparse.csc_matrix((np.ones(len(rows)), (rows, columns)), shape=H.shape)
            full = self.sparse.csc_matrix(np.ones(A.shape))
            P.data, full.data = H[rows, columns].copy(), A.flatten(order="F")
            self.solver = self.osqp.OSQP()
            self.solver.setup(
                P, f, full, low, high, verbose=False, eps_abs=1e-6, eps_rel=1e-6, max_iter=ITERATIONS_MAX, polishing=True
            )
            prepared = 0.0
        else:
            self.solver.update(Px=H[rows, columns], Ax=A.flatten(order="F"), q=f, l=low, u=high)
            prepared = None
        result = self.solver.solve()
        prepared = result.info.setup_time if prepared == 0.0 else result.info.update_time
        seconds = prepared + result.info.solve_time + result.info.polish_time
        return seconds, result.x[:NU], result.info.status == "solved"


def available():
    solvers = {}
    for name, solver in (("osqp", Osqp), ("daqp", Daqp), ("piqp", Piqp), ("proxqp", Proxqp)):
        try:
            solver()
            solvers[name] = solver
        except ImportError:
            continue
    return solvers


def main():
    # Some solvers print to standard output whatever they are told; answers get a channel of their own.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    solvers, running = available(), {}
    print(json.dumps(sorted(solvers)), file=answers, flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        name, path, horizon = request["solver"], request["file"], request["horizon"]
        key = (name, path, horizon)
        if request["restart"] or key not in running:
            running[key] = solvers[name]()
        file = load(path)
        answer = {"seconds": [], "u": [], "solved": []}
        for index in range(request["first"], request["first"] + request["count"]):
            try:
                seconds, u, solved = running[key].solve(file, condensed(path, horizon, index))
            except Exception as error:  # A peer that breaks down on one problem is counted, not followed.
                print(f"{name}: {error}", file=sys.stderr)
                running[key] = solvers[name]()
                seconds, u, solved = 0.0, [0.0] * NU, False
            answer["seconds"].append(float(seconds))
            answer["u"].append([float(value) if np.isfinite(value) else 0.0 for value in u])
            answer["solved"].append(bool(solved))
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()

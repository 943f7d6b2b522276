"""The ceiling that the report compares with: nonlinear MPC that knows the plant exactly, solved offline.

Every 33 ms IPOPT (through CasADi) plans 30 samples ahead on the plant's own equations, with its tyre, its friction and the
wind, and with the weights and bounds that the controller's FMU declares. The plant FMU is driven with the first command at
once: no time passes while the plan is made. No controller in a car can have any of this.

Of the wind it foresees what is going to blow, or it feels what blows now and expects that to go on, or it is told nothing.

Its increments of steering are weighed against zero, the textbook cost that the paper has. The runs named ideal weigh them, as
the controller does, against those of a car that follows the path exactly.

The runs are stored in nmpc.zip beside this script, one table for each, with the weights that they were made with:

    cargo fmu pack
    pip install casadi fmpy
    python tools/reference/nmpc.py                 solves all runs again and writes nmpc.zip
    python tools/reference/nmpc.py --run general --seconds 3 --output piece.zip
"""

import argparse
import csv
import io
import os
import pathlib
import shutil
import time
import zipfile

# Threads that wait for each other on a busy machine would be counted as computing.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import casadi as ca  # noqa: E402
import fmpy  # noqa: E402
import numpy as np  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
HERE = pathlib.Path(__file__).resolve().parent
T_S = 0.033
HORIZON = 30
# Communication steps per sample: the wind of the lane change is an input, held over each of them.
SUBSTEPS = 33
STATES = ["v_x", "v_y", "yaw_rate", "e_y", "e_psi", "psi"]
WEIGHTS = ["q_v_x", "q_v_y", "q_yaw_rate", "q_e_y", "q_e_psi", "r_delta", "r_a_x"]
BOUNDS = ["delta_max", "delta_rate_max", "a_x_min", "a_x_max", "a_x_rate_max"]
BODY = ["m", "i_z", "l_f", "l_r", "g", "mu", "c_d", "area", "rho", "c_s", "area_side", "arm_side", "c_rr"]
RECORDED = [
    "x", "y", "psi", "s", "v_x_true", "v_y_true", "yaw_rate_true", "e_y_true", "e_psi_true", "v_x_ref[1]", "kappa_ref[1]",
    "a_lat", "alpha_f", "alpha_r", "delta_actual", "a_x_actual", "grip_usage", "wind_speed_actual",
]  # fmt: skip
# The tyre dry_asphalt of the plant: magic formula with B 10, C 1.4, E 0.
TYRE_B, TYRE_C = 10.0, 1.4


def general_wind(_time, s):
    """Speed [m/s] of the general track's own wind at arc length `s` [m], as fmu-plant/vehicle/src/road/general.rs has it."""
    tau = 2 * np.pi
    return 35.0 - 10.0 * np.cos(tau * s / 800.0) - 5.0 * np.cos(tau * s / 160.0)


def lane_change_wind(time_, _s):
    """Speed [m/s] of the wind that the report lets blow during the lane change, as tools/src/report/runs.rs has it."""
    return 35.0 - 15.0 * np.cos(2 * np.pi * time_ / 7.0)


def calm(_time, _s):
    return 0.0


# Road, whether the wind is an input of the plant, its speed over time and place, what the planner knows of it, and what its
# increments of steering are weighed against.
RUNS = {
    "lane_change": ("double_lane_change", False, calm, "foreseen", "zero"),
    "lane_change_ideal": ("double_lane_change", False, calm, "foreseen", "ideal car"),
    "lane_change_wind": ("double_lane_change", True, lane_change_wind, "foreseen", "zero"),
    "lane_change_wind_felt": ("double_lane_change", True, lane_change_wind, "felt", "zero"),
    "lane_change_wind_felt_ideal": ("double_lane_change", True, lane_change_wind, "felt", "ideal car"),
    "general": ("general", False, general_wind, "foreseen", "zero"),
    "general_felt": ("general", False, general_wind, "felt", "zero"),
    "general_felt_ideal": ("general", False, general_wind, "felt", "ideal car"),
    "general_untold": ("general", False, general_wind, "untold", "zero"),
}


class Plant:
    """The packed plant FMU on a road."""

    def __init__(self, archive, road):
        self.description = fmpy.read_model_description(archive)
        self.folder = fmpy.extract(archive)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.starts = {v.name: v.start for v in self.description.modelVariables}
        self.slave = fmpy.instantiate_fmu(self.folder, self.description, "CoSimulation")
        self.slave.setupExperiment(startTime=0.0)
        self.slave.setString([self.references["road"]], [road])
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def close(self):
        self.slave.terminate()
        self.slave.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)

    def get(self, names):
        return np.array(self.slave.getReal([self.references[name] for name in names]))

    def set(self, **values):
        self.slave.setReal([self.references[name] for name in values], list(values.values()))

    def finished(self):
        return bool(self.slave.getBoolean([self.references["finished"]])[0])

    def parameters(self, names):
        return {name: float(self.starts[name]) for name in names}


def peaks(body):
    """Largest lateral forces of the front and of the rear axle [N]."""
    per_metre = body["mu"] * body["m"] * body["g"] / (body["l_f"] + body["l_r"])
    return per_metre * body["l_r"], per_metre * body["l_f"]


def tyre(alpha, peak):
    """Lateral force of an axle [N]."""
    return peak * ca.sin(TYRE_C * ca.atan(TYRE_B * alpha))


def air(body, v_x, v_y, psi, wind):
    """Forces of the air along the car and across it [N]."""
    p = body
    air_x, air_y = -wind * ca.cos(psi) - v_x, wind * ca.sin(psi) - v_y
    speed = ca.sqrt(air_x**2 + air_y**2 + 1e-12)
    return 0.5 * p["rho"] * p["c_d"] * p["area"] * speed * air_x, 0.5 * p["rho"] * p["c_s"] * p["area_side"] * speed * air_y


def derivative(body, x, u, kappa, wind):
    """The plant's equations above walking speed, all extras off; the wind blows against the first heading of the road."""
    p = body
    v_x, v_y, yaw_rate, e_y, e_psi, psi = ca.vertsplit(x)
    delta, a_x = ca.vertsplit(u)
    peak_f, peak_r = peaks(body)
    f_f = tyre(delta - ca.atan((v_y + p["l_f"] * yaw_rate) / v_x), peak_f)
    f_r = tyre(-ca.atan((v_y - p["l_r"] * yaw_rate) / v_x), peak_r)
    drag, side = air(body, v_x, v_y, psi, wind)
    progress = (v_x * ca.cos(e_psi) - v_y * ca.sin(e_psi)) / (1 - e_y * kappa)
    f_lateral = f_f * ca.cos(delta)
    return ca.vertcat(
        a_x - p["c_rr"] * p["g"] + (drag - f_f * ca.sin(delta)) / p["m"] + yaw_rate * v_y,
        (f_lateral + f_r + side) / p["m"] - yaw_rate * v_x,
        (f_lateral * p["l_f"] - f_r * p["l_r"] + side * p["arm_side"]) / p["i_z"],
        v_x * ca.sin(e_psi) + v_y * ca.cos(e_psi),
        yaw_rate - kappa * progress,
        yaw_rate,
    )


def sample(body, pieces=2):
    """One sample by the method of Runge and Kutta; the curvature goes in a straight line from one end to the other."""
    x, u = ca.SX.sym("x", len(STATES)), ca.SX.sym("u", 2)
    kappa, wind = ca.SX.sym("kappa", 2), ca.SX.sym("wind")
    h, end = T_S / pieces, x
    for i in range(pieces):
        bend = [kappa[0] + (kappa[1] - kappa[0]) * (i + part) / pieces for part in (0.0, 0.5, 1.0)]
        k_1 = derivative(body, end, u, bend[0], wind)
        k_2 = derivative(body, end + h / 2 * k_1, u, bend[1], wind)
        k_3 = derivative(body, end + h / 2 * k_2, u, bend[1], wind)
        k_4 = derivative(body, end + h * k_3, u, bend[2], wind)
        end = end + h / 6 * (k_1 + 2 * k_2 + 2 * k_3 + k_4)
    return ca.Function("sample", [x, u, kappa, wind], [end])


def steady(body, stiffness_r, v_x, kappa):
    """Lateral velocity of steady cornering at small slip, the reference that the controller has too."""
    p = body
    return kappa * v_x * (p["l_r"] - p["m"] * p["l_f"] * v_x**2 / (stiffness_r * (p["l_f"] + p["l_r"])))


class IdealCar:
    """A car that follows the path exactly at the speed wanted, by inverse dynamics at small angles.

    Its motion is the sideslip angle [rad] and the rate of that, called turn [rad/s]: without a lateral error the heading error
    is the sideslip angle reversed, and the yaw rate is what the path turns by less the turn.
    """

    def __init__(self, body, bounds):
        self.body, self.increment_max = body, bounds["delta_rate_max"] * T_S
        self.peak_f, self.peak_r = peaks(body)
        # Of the first stage of the sample before: motion at its beginning, curvature at both ends, speed and wind.
        self.stage_before = None

    def stage(self, motion, course, v, kappa, wind):
        """Motion at the end of a stage that begins on the course [rad], and the steering angle in the middle of it [rad]."""
        p = self.body

        def balance(part, motion):
            """Rate of the motion and the steering angle [rad], at a part of the stage."""
            beta, turn = motion
            bend = kappa[0] + part * (kappa[1] - kappa[0])
            bend_rate = (kappa[1] - kappa[0]) / T_S
            psi = course + part * T_S * v * 0.5 * (kappa[0] + bend) - beta
            _, side = air(p, v, v * beta, psi, wind)
            yaw_rate = v * bend - turn
            f = p["m"] * v**2 * bend - side
            f_r = tyre(p["l_r"] * yaw_rate / v - beta, self.peak_r)
            f_f = f - f_r
            moment = p["l_f"] * f_f - p["l_r"] * f_r + p["arm_side"] * side
            # The tyre inverted, held just short of its peak.
            alpha_f = np.tan(np.arcsin(np.clip(f_f / self.peak_f, -0.99, 0.99)) / TYRE_C) / TYRE_B
            return np.array([turn, v * bend_rate - moment / p["i_z"]]), alpha_f + beta + p["l_f"] * yaw_rate / v

        h = T_S / 2
        for begin in (0.0, 0.5):
            # What remains of the steering angles is that of the second half's beginning.
            k_1, delta = balance(begin, motion)
            k_2, _ = balance(begin + 0.25, motion + h / 2 * k_1)
            k_3, _ = balance(begin + 0.25, motion + h / 2 * k_2)
            k_4, _ = balance(begin + 0.5, motion + h * k_3)
            motion = motion + h / 6 * (k_1 + 2 * k_2 + 2 * k_3 + k_4)
        return motion, delta

    def increments(self, start, kappa, wind, v_ref):
        """Increments of its steering angle from stage to stage [rad], the first of them since the sample before."""
        v_x, v_y, _, _, e_psi, psi = start
        course, before = psi - e_psi, None
        if self.stage_before is None:
            motion = np.array([v_y / v_x, 0.0])
        else:
            motion, bend, v, blew = self.stage_before
            motion, before = self.stage(motion, course - T_S * v * 0.5 * (bend[0] + bend[1]), v, bend, blew)
        self.stage_before = motion, kappa[:2].copy(), v_ref[0], wind[0]
        deltas = []
        for i in range(len(kappa) - 1):
            motion, delta = self.stage(motion, course, v_ref[i], kappa[i : i + 2], wind[i])
            deltas.append(delta)
            course += T_S * v_ref[i] * 0.5 * (kappa[i] + kappa[i + 1])
        steps = np.diff(deltas, prepend=deltas[0] if before is None else before)
        largest = np.abs(steps).max()
        # What the steering cannot do is no reference: the further beyond, the less of it is left.
        return steps * (self.increment_max / largest) ** 2 if largest > self.increment_max else steps


class Planner:
    """The receding-horizon problem, by multiple shooting."""

    def __init__(self, body, weights, bounds, horizon=HORIZON):
        self.body, self.weights, self.bounds, self.horizon = body, weights, bounds, horizon
        nx = len(STATES)
        model = sample(body)
        x, u = ca.SX.sym("x", nx, horizon + 1), ca.SX.sym("u", 2, horizon)
        start, before = ca.SX.sym("start", nx), ca.SX.sym("before", 2)
        kappa, wind, v_ref = (ca.SX.sym(name, horizon + 1) for name in ("kappa", "wind", "v_ref"))
        increments = ca.SX.sym("increments", horizon)
        stiffness_r = TYRE_B * TYRE_C * body["mu"] * body["m"] * body["g"] * body["l_f"] / (body["l_f"] + body["l_r"])
        cost, constraints = 0, [x[:, 0] - start]
        for i in range(horizon):
            step = u[:, i] - (before if i == 0 else u[:, i - 1])
            constraints += [x[:, i + 1] - model(x[:, i], u[:, i], kappa[i : i + 2], wind[i])]
            v_y = steady(body, stiffness_r, v_ref[i + 1], kappa[i + 1])
            wanted = ca.vertcat(v_ref[i + 1], v_y, kappa[i + 1] * v_ref[i + 1], 0, -v_y / v_ref[i + 1])
            error = x[:5, i + 1] - wanted
            cost += ca.dot(ca.DM([weights[name] for name in WEIGHTS[:5]]), error**2)
            unwanted = step - ca.vertcat(increments[i], 0)
            cost += ca.dot(ca.DM([weights[name] for name in WEIGHTS[5:]]), unwanted**2)
        steps = ca.diff(ca.horzcat(before, u), 1, 1)
        problem = {
            "x": ca.vertcat(ca.vec(x), ca.vec(u)),
            "p": ca.vertcat(start, before, kappa, wind, v_ref, increments),
            "f": cost,
            "g": ca.vertcat(*constraints, ca.vec(steps)),
        }
        options = {
            "print_time": False,
            "ipopt": {
                "print_level": 0,
                "sb": "yes",
                "tol": 1e-9,
                "max_iter": 200,
                "mu_init": 1e-4,
                "warm_start_init_point": "yes",
            },
        }
        self.solver = ca.nlpsol("planner", "ipopt", problem, options)
        free = np.full(nx * (horizon + 1), np.inf)
        upper = np.tile([bounds["delta_max"], bounds["a_x_max"]], horizon)
        lower = np.tile([-bounds["delta_max"], bounds["a_x_min"]], horizon)
        rates = np.tile([bounds["delta_rate_max"] * T_S, bounds["a_x_rate_max"] * T_S], horizon)
        none = np.zeros(nx * (horizon + 1))
        self.limits = {
            "lbx": np.concatenate([-free, lower]),
            "ubx": np.concatenate([free, upper]),
            "lbg": np.concatenate([none, -rates]),
            "ubg": np.concatenate([none, rates]),
        }
        self.guess = None

    def plan(self, start, before, kappa, wind, v_ref, increments):
        """First command, processor time that it took [s], iterations, and whether IPOPT was content."""
        n, nx = self.horizon, len(STATES)
        if self.guess is None:
            x = np.tile(start, (n + 1, 1))
            x[:, 0], x[:, 2] = v_ref, kappa * v_ref
            u = np.column_stack([kappa[:-1] * (self.body["l_f"] + self.body["l_r"]), np.zeros(n)])
        else:
            x, u = self.guess
            x, u = np.vstack([x[1:], x[-1:]]), np.vstack([u[1:], u[-1:]])
        x[0] = start
        parameters = np.concatenate([start, before, kappa, wind, v_ref, increments])
        begin = time.process_time()
        answer = self.solver(x0=np.concatenate([x.ravel(), u.ravel()]), p=parameters, **self.limits)
        taken = time.process_time() - begin
        solution = np.array(answer["x"]).ravel()
        self.guess = solution[: nx * (n + 1)].reshape(n + 1, nx), solution[nx * (n + 1) :].reshape(n, 2)
        stats = self.solver.stats()
        return self.guess[1][0], taken, stats["iter_count"], stats["success"]


def blow(wind, known, now, s, v_ref):
    """Speed of the wind [m/s] that the planner expects in each stage."""
    if known == "untold":
        return np.zeros(HORIZON + 1)
    if known == "felt":
        return np.full(HORIZON + 1, wind(now, s))
    # In the middle of each stage, where the reference is going to be.
    place = s + np.concatenate([[0.0], np.cumsum(T_S * 0.5 * (v_ref[:-1] + v_ref[1:]))])
    time_ = now + (np.arange(HORIZON + 1) + 0.5) * T_S
    return wind(time_, place + 0.5 * T_S * v_ref) * np.ones(HORIZON + 1)


def drive(plant_archive, controller_archive, run, seconds=np.inf):
    """Rows of one run, and the weights that it was made with."""
    road, wind_is_input, wind, known, against = RUNS[run]
    plant = Plant(plant_archive, road)
    starts = {v.name: v.start for v in fmpy.read_model_description(controller_archive).modelVariables}
    weights, bounds = ({name: float(starts[name]) for name in names} for names in (WEIGHTS, BOUNDS))
    planner, ideal = Planner(plant.parameters(BODY), weights, bounds), IdealCar(plant.parameters(BODY), bounds)
    ahead = np.arange(HORIZON + 1)
    kappa_names, speed_names = ([f"{name}[{i + 1}]" for i in ahead] for name in ("kappa_ref", "v_x_ref"))
    state_names = ["v_x_true", "v_y_true", "yaw_rate_true", "e_y_true", "e_psi_true", "psi"]
    rows, before, sample_number = [], np.zeros(2), 0
    try:
        while not plant.finished() and sample_number * T_S < seconds:
            now = sample_number * T_S
            start, kappa, v_ref = plant.get(state_names), plant.get(kappa_names), plant.get(speed_names)
            blowing = blow(wind, known, now, plant.get(["s"])[0], v_ref)
            increments = ideal.increments(start, kappa, blowing, v_ref) if against == "ideal car" else np.zeros(HORIZON)
            command, taken, iterations, content = planner.plan(start, before, kappa, blowing, v_ref, increments)
            if not content:
                raise RuntimeError(f"no optimal plan at {now:.3f} s: {planner.solver.stats()['return_status']}")
            rows.append([now, *plant.get(RECORDED), *command, taken, iterations])
            plant.set(delta=command[0], a_x=command[1])
            for k in range(SUBSTEPS):
                t = now + k * T_S / SUBSTEPS
                if wind_is_input:
                    plant.set(wind_speed=wind(t, 0.0), wind_direction=np.pi)
                plant.slave.doStep(currentCommunicationPoint=t, communicationStepSize=T_S / SUBSTEPS)
            before = command
            sample_number += 1
    finally:
        plant.close()
    return np.array(rows), weights


def table(rows):
    """A run as text; seven digits are finer than anything the report shows."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["t", *RECORDED, "delta", "a_x", "solve_time", "iterations"])
    writer.writerows([[f"{value:.7g}" for value in row] for row in rows])
    return text.getvalue()


def save(output, runs, weights):
    """One archive with a table for each run and the weights; the same runs give the same bytes."""
    files = {f"{name}.csv": table(rows) for name, rows in runs.items()}
    files["weights.csv"] = ",".join(weights) + "\n" + ",".join(repr(value) for value in weights.values()) + "\n"
    with zipfile.ZipFile(output, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, text in sorted(files.items()):
            archive.writestr(zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0)), text, zipfile.ZIP_DEFLATED, 9)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", action="append", choices=sorted(RUNS), help="a run; all of them without it")
    parser.add_argument("--seconds", type=float, default=np.inf, help="end of each run [s]")
    parser.add_argument("--archives", type=pathlib.Path, default=ROOT / "target" / "fmu", help="folder of the packed FMUs")
    parser.add_argument("--output", type=pathlib.Path, default=HERE / "nmpc.zip")
    arguments = parser.parse_args()
    runs = {}
    for run in arguments.run or RUNS:
        archives = [str(arguments.archives / name) for name in ("VehiclePlant.fmu", "LpvMpcController.fmu")]
        rows, weights = drive(*archives, run, arguments.seconds)
        runs[run] = rows
        columns = dict(zip(["t", *RECORDED, "delta", "a_x", "solve_time", "iterations"], rows.T))
        e_y, speed = columns["e_y_true"], columns["v_x_true"] - columns["v_x_ref[1]"]
        print(
            f"{run}: {len(rows)} samples, "
            f"lateral error {100 * np.abs(e_y).max():.3f} cm, rms {100 * np.sqrt(np.mean(e_y**2)):.3f} cm, "
            f"speed error rms {np.sqrt(np.mean(speed**2)):.5f} m/s, {1e3 * np.median(columns['solve_time']):.1f} ms a sample"
        )
    save(arguments.output, runs, weights)


if __name__ == "__main__":
    main()

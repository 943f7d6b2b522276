"""The plant against two implementations that are not ours: the single-track model of commonroad-vehicle-models, and the
same equations written down again here and integrated by SciPy's DOP853."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from vehiclemodels.vehicle_dynamics_st import vehicle_dynamics_st

from closed_loop import Unit

DURATION = 10.0


def rates_of(unit, **rates):
    """Sets how fast inputs change during the next step."""
    references = unit.references(list(rates))
    unit._slave.setRealInputDerivatives(vr=references, order=[1] * len(rates), value=list(rates.values()))


def commonroad(plant):
    """The plant's defaults as commonroad-vehicle-models writes them, with one stiffness over load for both axles."""
    tire = SimpleNamespace(p_dy1=plant["mu"], p_ky1=-plant["tyre_b_f"] * plant["tyre_c"] * plant["mu"])
    steering = SimpleNamespace(min=-1.0, max=1.0, v_min=-10.0, v_max=10.0)
    longitudinal = SimpleNamespace(v_min=-50.0, v_max=100.0, v_switch=50.0, a_max=20.0)
    return SimpleNamespace(
        a=plant["l_f"], b=plant["l_r"], m=plant["m"], I_z=plant["i_z"], h_s=0.0,
        tire=tire, steering=steering, longitudinal=longitudinal,
    )


@pytest.mark.parametrize("speed", [8.0, 20.0])
def test_small_angles_agree_with_the_single_track_model_of_commonroad(plant, speed):
    # Their tyres and angles are linear. At steering angles of 1e-5 rad ours are too: cubes are 1e-10 of the angles.
    parameters = {"mu": 1.05, "tyre_b_f": 20.0, "tyre_b_r": 20.0, "tyre_c": 1.0, "m": 1575.0, "i_z": 2875.0, "l_f": 1.2, "l_r": 1.6}
    amplitude, omega, step = 1e-5, 2 * math.pi * 0.4, 0.01
    model = commonroad(parameters)

    state = np.array([0.0, 0.0, 0.0, speed, 0.0, 0.0, 0.0])
    theirs, ours = [state], [[0.0] * 5]
    with Unit(plant, "validated") as unit:
        unit.initialize(road="straight", speed=speed, tyre="custom", c_d=0.0, c_s=0.0, c_rr=0.0, **parameters)
        delta = 0.0
        for k in range(round(DURATION / step)):
            rate = amplitude * omega * math.cos(omega * (k + 0.5) * step)
            unit.set(delta=delta)
            rates_of(unit, delta=rate)
            unit.step(k * step, step)
            delta += rate * step
            ours.append([unit.get(name) for name in ("x", "y", "psi", "yaw_rate_true", "v_y_true")])
            right_hand_side = lambda _, x, rate=rate: vehicle_dynamics_st(x, [rate, 0.0], model)
            solution = solve_ivp(right_hand_side, (0, step), state, method="DOP853", rtol=1e-12, atol=1e-18)
            state = solution.y[:, -1]
            theirs.append(state)
    x, y, psi, yaw_rate, v_y = np.array(ours).T
    theirs = np.array(theirs).T
    for name, got, want in [
        ("x", x, theirs[0]),
        ("y", y, theirs[1]),
        ("psi", psi, theirs[4]),
        ("yaw_rate", yaw_rate, theirs[5]),
        ("v_y", v_y, speed * theirs[6]),
    ]:
        error = np.abs(got - want).max() / np.abs(want).max()
        assert error < 1e-6, f"{name}: relative error {error:.1e}"


def test_input_set_again_after_a_ramp_acts_at_once(plant):
    with Unit(plant, "again") as unit:
        unit.initialize(road="straight")
        unit.set(delta=0.01)
        rates_of(unit, delta=0.5)
        unit.step(0.0, 0.1)
        assert unit.get("delta_actual") == pytest.approx(0.06, abs=1e-12)
        unit.set(delta=0.01)
        assert unit.get("delta_actual") == 0.01


def test_inputs_that_change_stay_in_their_ranges(plant):
    with Unit(plant, "ranges") as unit:
        unit.initialize(road="straight")
        unit.set(wind_speed=100.0, mu_scale=0.1)
        rates_of(unit, wind_speed=1e4, mu_scale=-1e100, delta=1e100, a_x=-1e300, wind_direction=1e308)
        unit.step(0.0, 1.0)
        assert unit.get("wind_speed_actual") == pytest.approx(100.0, rel=1e-12)
        unit.step(1.0, 0.1)


def test_preview_shows_the_friction_that_was_set_from_the_start(plant):
    with Unit(plant, "friction") as unit:
        unit.set(mu_scale=0.5)
        unit.initialize(road="straight")
        before = unit.get("mu_ref[1]")
        unit.step(0.0, 0.01)
        assert before == unit.get("mu_ref[1]") == 0.5 * 0.82


def bicycle(p, kappa, delta, a_x, wind):
    """The corrected equations of the paper's plant, written down once more."""
    front, rear = (p.mu * p.m * p.g * arm / (p.l_f + p.l_r) for arm in (p.l_r, p.l_f))
    tyre = lambda alpha, peak: peak * math.sin(1.4 * math.atan(10.0 * alpha))

    def right_hand_side(_, state):
        v_x, v_y, w, s, e_y, e_psi, x, y, psi = state
        f_yf = tyre(delta - math.atan2(v_y + p.l_f * w, v_x), front)
        f_yr = tyre(-math.atan2(v_y - p.l_r * w, v_x), rear)
        rel = complex(*wind) * complex(math.cos(psi), -math.sin(psi)) - complex(v_x, v_y)
        drag = 0.5 * p.rho * abs(rel) * p.c_d * p.area * rel.real
        side = 0.5 * p.rho * abs(rel) * p.c_s * p.area_side * rel.imag
        s_dot = (v_x * math.cos(e_psi) - v_y * math.sin(e_psi)) / (1 - e_y * kappa)
        return [
            a_x + w * v_y + (drag - f_yf * math.sin(delta)) / p.m - p.c_rr * p.g,
            (f_yf * math.cos(delta) + f_yr + side) / p.m - w * v_x,
            (p.l_f * f_yf * math.cos(delta) - p.l_r * f_yr + p.arm_side * side) / p.i_z,
            s_dot,
            v_x * math.sin(e_psi) + v_y * math.cos(e_psi),
            w - kappa * s_dot,
            v_x * math.cos(psi) - v_y * math.sin(psi),
            v_x * math.sin(psi) + v_y * math.cos(psi),
            w,
        ]

    return right_hand_side


def test_scipy_finds_the_same_motion(plant, tmp_path):
    kappa = 0.004
    road = tmp_path / "circle.csv"
    road.write_text(f"s,kappa,v_x\n0,{kappa},20\n500,{kappa},20\n")
    names = ("v_x_true", "v_y_true", "yaw_rate_true", "s", "e_y_true", "e_psi_true", "x", "y", "psi")
    known = "m i_z l_f l_r g mu rho c_d area c_s area_side arm_side c_rr".split()
    with Unit(plant, "validated") as unit:
        unit.initialize(road=str(road), e_y_0=0.5, e_psi_0=-0.05)
        p = SimpleNamespace(**{name: unit.get(name) for name in known})
        state = [unit.get(name) for name in names]
        # Sharp turns to either side with braking: up to the peak of the tyres.
        for k, (delta, a_x) in enumerate([(0.05, 0.5), (-0.08, -1.0), (0.1, 0.0), (0.02, 1.0), (-0.05, -2.0)] * 2):
            speed, direction = 10.0 + k, 0.7 * k
            unit.set(delta=delta, a_x=a_x, wind_speed=speed, wind_direction=direction)
            unit.step(k * 1.0, 1.0)
            wind = (speed * math.cos(direction), speed * math.sin(direction))
            right_hand_side = bicycle(p, kappa, delta, a_x, wind)
            state = solve_ivp(right_hand_side, (0, 1), state, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        assert state[0] > 3.0, "the kinematic blend took part"
        for name, want in zip(names, state):
            # Both methods err by about 1e-10 over 10 s; positions of 200 m add their rounding.
            assert unit.get(name) == pytest.approx(want, abs=1e-8), name

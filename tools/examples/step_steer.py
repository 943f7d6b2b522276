"""A step steer: how fast and how well the car answers the steering wheel (ISO 7401).

    python tools/examples/step_steer.py target/fmu/VehiclePlant.fmu --speed 25 --angle 0.02

The manoeuvre steers by itself, so the plant is simulated alone. Prints the figures of the standard and writes a plot.
"""

import argparse
import pathlib

import fmpy
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

STEER_FROM = 1.0


def simulate(archive, speed, angle, **parameters):
    """The answer to a step of the steering angle [rad] at a speed [m/s]."""
    start_values = {"road": "step_steer", "speed": speed, "steer_amplitude": angle, **parameters}
    outputs = ["delta_actual", "yaw_rate_true", "a_lat", "v_x_true", "v_y_true", "x", "y"]
    return fmpy.simulate_fmu(
        archive, start_values=start_values, output=outputs, stop_time=5.0, output_interval=0.002
    )


def figures(result):
    """Steady yaw rate gain [1/s], time to 90 % of it [s] and overshoot [1]."""
    time, yaw_rate = result["time"], result["yaw_rate_true"]
    # Coasting costs a little speed; the second after the transient serves as the steady state.
    steady = yaw_rate[(time > 3.0) & (time < 4.0)].mean()
    reached = time[np.abs(yaw_rate) > 0.9 * abs(steady)][0] - STEER_FROM
    overshoot = np.abs(yaw_rate).max() / abs(steady) - 1.0
    return steady / result["delta_actual"][-1], reached, overshoot


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("archive")
    parser.add_argument("--speed", type=float, default=25.0, help="[m/s]")
    parser.add_argument("--angle", type=float, default=0.02, help="[rad]")
    parser.add_argument("--plot", type=pathlib.Path, default="step_steer.png")
    options = parser.parse_args()

    figure, axes = plt.subplots(3, sharex=True, figsize=(7, 7))
    for label, extras in [("ideal", {}), ("relaxation length 0.4 m", {"relaxation_length": 0.4})]:
        result = simulate(options.archive, options.speed, options.angle, **extras)
        gain, reached, overshoot = figures(result)
        print(f"{label}: yaw rate gain {gain:.2f} 1/s, 90 % after {reached:.3f} s, overshoot {overshoot:.1%}")
        slip = np.degrees(np.arctan2(result["v_y_true"], result["v_x_true"]))
        for axis, values in zip(axes, [np.degrees(result["yaw_rate_true"]), result["a_lat"], slip]):
            axis.plot(result["time"], values, label=label)
    for axis, name in zip(axes, ["yaw rate [deg/s]", "lateral acceleration [m/s2]", "side slip [deg]"]):
        axis.set_ylabel(name)
        axis.grid(True)
    axes[0].legend()
    axes[-1].set_xlabel("time [s]")
    figure.tight_layout()
    figure.savefig(options.plot)
    print(f"plot: {options.plot}")


if __name__ == "__main__":
    main()

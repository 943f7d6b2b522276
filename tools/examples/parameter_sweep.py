"""A parameter sweep: which steering amplitudes does the car survive without stability control (sine with dwell, FMVSS 126)?

    python tools/examples/parameter_sweep.py target/fmu/VehiclePlant.fmu

For every friction and amplitude: the yaw rate 1.00 s and 1.75 s after the steering has ended, over its peak. The rule wants at most
35 % and 20 %.
"""

import argparse
import shutil

import fmpy
import numpy as np

# One second of straight, a sine of 0.7 Hz with a dwell of 0.5 s.
STEER_END = 1.0 + 1.0 / 0.7 + 0.5
LIMITS = {1.0: 0.35, 1.75: 0.20}


def lasting_yaw(archive, folder, **parameters):
    """Share of the peak yaw rate that is left at each time of the rule after the steering has ended."""
    result = fmpy.simulate_fmu(
        folder,
        model_description=fmpy.read_model_description(archive),
        start_values={"road": "sine_with_dwell", **parameters},
        output=["yaw_rate_true"],
        stop_time=5.0,
        output_interval=0.005,
    )
    time, yaw_rate = result["time"], result["yaw_rate_true"]
    # The peak after the steering has changed its direction, as the rule says.
    peak = np.abs(yaw_rate[(time > 1.0 + 0.5 / 0.7) & (time < STEER_END)]).max()
    return [abs(np.interp(STEER_END + after, time, yaw_rate)) / peak for after in LIMITS]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("archive")
    parser.add_argument("--speed", type=float, default=22.2, help="[m/s]; the rule: 80 km/h")
    options = parser.parse_args()

    folder = fmpy.extract(options.archive)
    try:
        print("friction  amplitude  after 1.00 s  after 1.75 s")
        for mu in [0.5, 0.82, 1.0]:
            for amplitude in [0.03, 0.06, 0.09, 0.12]:
                left = lasting_yaw(options.archive, folder, mu=mu, steer_amplitude=amplitude, speed=options.speed)
                verdict = "" if all(l <= limit for l, limit in zip(left, LIMITS.values())) else "  unstable"
                print(f"{mu:8.2f} {amplitude:6.2f} rad {left[0]:12.1%} {left[1]:13.1%}{verdict}")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()

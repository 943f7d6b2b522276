"""The handling diagram: how much more steering a curve needs as the lateral acceleration grows.

    python tools/examples/handling_diagram.py target/fmu/VehiclePlant.fmu

At a constant speed the steering angle rises slowly; steering minus the angle of the path, delta - l w / v, is drawn over the lateral
acceleration. Rising lines are understeer, falling lines oversteer. The speed is held by driving the plant step by step.
"""

import argparse
import pathlib
import shutil

import fmpy
import matplotlib
import numpy as np
from fmpy.fmi2 import FMU2Slave

matplotlib.use("Agg")
import matplotlib.pyplot as plt

STEP = 0.02
WHEELBASE = 2.8


def sweep(archive, speed=20.0, rate=0.003, stop=0.1, **parameters):
    """Lateral acceleration [m/s2] and steering beyond the path's angle [rad] while the steering rises at `rate` [rad/s]."""
    description = fmpy.read_model_description(archive)
    references = {v.name: v.valueReference for v in description.modelVariables}
    kinds = {v.name: v.type for v in description.modelVariables}
    folder = fmpy.extract(archive)
    plant = FMU2Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="plant",
    )
    plant.instantiate()
    try:
        plant.setupExperiment(startTime=0.0)
        for name, value in {"road": "straight", "speed": speed, **parameters}.items():
            setter = {"Real": plant.setReal, "String": plant.setString, "Boolean": plant.setBoolean}[kinds[name]]
            setter([references[name]], [value])
        plant.enterInitializationMode()
        plant.exitInitializationMode()
        inputs = [references["delta"], references["a_x"]]
        outputs = [references[name] for name in ("v_x_true", "yaw_rate_true", "a_lat")]
        rows = []
        for k in range(round(stop / rate / STEP)):
            v_x, yaw_rate, a_lat = plant.getReal(outputs)
            delta = rate * k * STEP
            rows.append((a_lat, delta - WHEELBASE * yaw_rate / v_x))
            # A fast speed controller, so that only steering changes.
            plant.setReal(inputs, [delta, 8.0 * (speed - v_x)])
            plant.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
    finally:
        plant.freeInstance()
        shutil.rmtree(folder, ignore_errors=True)
    a_lat, beyond = np.array(rows).T
    # Beyond the peak the car spins or slides: no steady state any more.
    end = a_lat.argmax() + 1
    return a_lat[:end], beyond[:end]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("archive")
    parser.add_argument("--plot", type=pathlib.Path, default="handling_diagram.png")
    options = parser.parse_args()

    figure, axis = plt.subplots(figsize=(7, 5))
    for tyre in ["dry_asphalt", "alcala", "linear"]:
        a_lat, beyond = sweep(options.archive, tyre=tyre)
        mild = (a_lat > 0.5) & (a_lat < 2.0)
        gradient = np.degrees(np.polyfit(a_lat[mild], beyond[mild], 1)[0]) * 9.81
        print(f"{tyre}: understeer gradient {gradient:+.2f} deg/g, largest lateral acceleration {a_lat.max():.2f} m/s2")
        axis.plot(a_lat, np.degrees(beyond), label=tyre)
    axis.set_xlabel("lateral acceleration [m/s2]")
    axis.set_ylabel("steering beyond the path's angle [deg]")
    axis.grid(True)
    axis.legend()
    figure.tight_layout()
    figure.savefig(options.plot)
    print(f"plot: {options.plot}")


if __name__ == "__main__":
    main()

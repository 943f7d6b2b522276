"""Cars that are not ours: the single-track drift model and the multi-body model of commonroad-vehicle-models, behind a steering
servo, because they take the rate of the steering angle."""

import math

from vehiclemodels.init_mb import init_mb
from vehiclemodels.init_std import init_std
from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
from vehiclemodels.vehicle_dynamics_std import vehicle_dynamics_std

# Time constant of the servo [s]: a proportional loop of 3 Hz around an electric power steering.
SERVO = 0.05
# Longest step of the classic Runge-Kutta method [s]. The wheels' spin is the fastest mode, 22 slip stiffnesses per radian of
# 3 kN on a wheel of 0.344 m and 1.7 kg m2 at 10 m/s: 500 1/s. The method is stable up to 2.78 over that.
STEP = 0.001
# Neither model has air or rolling resistance.
RESISTANCE = {"c_d": 0.0, "c_rr": 0.0}


class Car:
    """One of the models, driven by a steering angle and an acceleration."""

    def __init__(self, parameters, rates, state):
        self.parameters, self._rates, self.state = parameters, rates, list(state)

    def known(self):
        """What a user of the controller writes into its parameters: the data sheet of this car."""
        p, g = self.parameters, 9.81
        stiffness = -p.tire.p_ky1 * p.m * g / (p.a + p.b)
        return {
            "m": p.m, "i_z": p.I_z, "l_f": p.a, "l_r": p.b, **RESISTANCE,
            "c_f_nominal": stiffness * p.b, "c_r_nominal": stiffness * p.a,
            "mu": p.tire.p_dy1, "delta_rate_max": p.steering.v_max, "tau_delta": SERVO,
        }

    def advance(self, duration, delta, a_x):
        """Drives on while both commands hold."""

        def right_hand_side(x):
            return self._rates(list(x), [(delta - x[2]) / SERVO, a_x], self.parameters)

        def along(x, slope, h):
            return [a + h * b for a, b in zip(x, slope)]

        count = math.ceil(duration / STEP - 1e-9)
        h = duration / count
        for _ in range(count):
            x = self.state
            k1 = right_hand_side(x)
            k2 = right_hand_side(along(x, k1, 0.5 * h))
            k3 = right_hand_side(along(x, k2, 0.5 * h))
            k4 = right_hand_side(along(x, k3, h))
            mean = [(a + 2 * (b + c) + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4)]
            self.state = along(x, mean, h)

    @property
    def delta(self):
        return self.state[2]

    @property
    def pose(self):
        """Place of the centre of gravity and heading."""
        return self.state[0], self.state[1], self.state[4]

    @property
    def yaw_rate(self):
        return self.state[5]


class SingleTrackDrift(Car):
    """Two wheels that spin and slip in both directions, load transfer."""

    def __init__(self, parameters, x, y, psi, speed):
        super().__init__(parameters, vehicle_dynamics_std, init_std([x, y, 0.0, speed, psi, 0.0, 0.0], parameters))

    @property
    def velocity(self):
        """Velocity in the frame of the body, forward and to the left."""
        speed, slip = self.state[3], self.state[6]
        return speed * math.cos(slip), speed * math.sin(slip)


class MultiBody(Car):
    """A sprung mass on two axles that roll, pitch and yield, four wheels with camber: 29 states."""

    def __init__(self, parameters, x, y, psi, speed):
        super().__init__(parameters, vehicle_dynamics_mb, init_mb([x, y, 0.0, speed, psi, 0.0, 0.0], parameters))

    @property
    def velocity(self):
        """Velocity in the frame of the body, forward and to the left."""
        return self.state[3], self.state[10]

//! The vehicle at walking pace: wheels that roll where they point to.
//!
//! Slip angles lose their meaning at standstill, where they divide by zero. Below [`BLEND_FROM`] the kinematic
//! single-track model takes over: lateral velocity and yaw rate follow `v_x tan(delta)` within [`TAU`], and the
//! longitudinal motion carries the inertia of all three. In between, both models' rates are mixed by a smooth step of
//! `v_x`, so that the right-hand side is twice continuously differentiable. commonroad-vehicle-models and VDSim change
//! over to the same model, the former at 0.1 m/s and with a jump.

use crate::{Scalar, smooth};

/// Below this speed the motion is kinematic [m/s]: the tyres would settle within 10 ms there, so that rolling is all that
/// remains of them.
pub const BLEND_FROM: f64 = 1.0;
/// From this speed on it is dynamic, exactly [m/s]: walking pace, and above [`super::V_GUARD`], so that the guard is never
/// seen outside of the mixture.
pub const BLEND_TO: f64 = 3.0;
/// How fast lateral velocity and yaw rate join the rolling motion [s]: the time in which tyres do it at 2 m/s.
pub const TAU: f64 = 0.02;

/// Constants of the rolling motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kinematic {
    pub mass: f64,
    pub i_z: f64,
    pub l_f: f64,
    pub l_r: f64,
}

/// What pushes the rolling vehicle, the tyres' lateral forces aside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Push<D> {
    /// Longitudinal force over the mass [m/s2].
    pub a_x: D,
    /// Lateral force over the mass [m/s2].
    pub a_y: D,
    /// Yaw moment [N m].
    pub moment: D,
}

/// Rates of `v_x`, `v_y` and the yaw rate, and the lateral forces [N] that make them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Motion<D> {
    pub rates: [D; 3],
    pub f_yf: D,
    pub f_yr: D,
}

impl Kinematic {
    /// Share of the dynamic model at a speed [1].
    pub fn share<D: Scalar>(v_x: D) -> D {
        smooth::step((v_x - BLEND_FROM) * (1.0 / (BLEND_TO - BLEND_FROM)))
    }

    /// The motion at velocities `v` under `push`, with the sine and cosine of the steering angle.
    pub fn motion<D: Scalar>(&self, [v_x, v_y, w]: [D; 3], push: &Push<D>, (sin, cos): (D, D)) -> Motion<D> {
        let Self { mass, i_z, l_f, l_r } = *self;
        let wheelbase = l_f + l_r;
        // w = k v_x and v_y = l_r k v_x: the energy is that of a mass (1 + (l_r^2 + I/m) k^2) m on a line, and every
        // force works along that line.
        let k = sin / cos * (1.0 / wheelbase);
        let inertia = k * k * (l_r * l_r + i_z / mass) + 1.0;
        let v_x_dot = (push.a_x + (push.a_y * l_r + push.moment * (1.0 / mass)) * k) / inertia;
        let w_roll = k * v_x;
        let v_y_dot = k * v_x_dot * l_r + (w_roll * l_r - v_y) * (1.0 / TAU);
        let w_dot = k * v_x_dot + (w_roll - w) * (1.0 / TAU);
        let lateral = (v_y_dot + w * v_x - push.a_y) * mass;
        let turning = w_dot * i_z - push.moment;
        Motion {
            rates: [v_x_dot, v_y_dot, w_dot],
            f_yf: (lateral * l_r + turning) / (cos * wheelbase),
            f_yr: (lateral * l_f - turning) * (1.0 / wheelbase),
        }
    }
}

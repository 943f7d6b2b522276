//! The zero dynamics of the path: how a car slips that does not leave it.

use serde::{Deserialize, Serialize};

use crate::Scalar;
use crate::model::{Body, Disturbance, Tyres, V_GUARD};

/// Sideslip of a car that does not leave the path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Sideslip<T = f64> {
    /// Sideslip angle [rad].
    pub beta: T,
    /// Its rate [rad/s].
    pub rate: T,
}

impl<T: Scalar> Sideslip<T> {
    /// Steering angle of the ideal car in the middle of a stage [rad], to the end of which it moves on.
    #[inline(always)]
    pub fn advance(
        &mut self,
        v_x: T,
        kappa: &[T; 2],
        disturbance: &Disturbance<T>,
        tyres: &Tyres<T>,
        body: &Body,
        period: f64,
    ) -> T {
        let Body { m, i_z, l_f, l_r, .. } = *body;
        let Tyres { c_f, c_r, f_f0, f_r0 } = *tyres;
        let (l, v) = (l_f + l_r, v_x.larger(V_GUARD));
        let per_v = v.recip();
        let bend = (kappa[0] + kappa[1]) * 0.5;
        let force = (v * v * bend - disturbance[1]) * m;
        let turn = v * (kappa[1] - kappa[0]) * period.recip() - disturbance[2];
        // The trapezoidal rule is stable for every damping, and the dynamics of slow cars are stiff.
        let inertia = i_z / (l * period);
        let damping = c_r * (per_v * (0.5 * l_r) + 0.25 * period);
        let drive = c_r * (bend * l_r - self.beta) + f_r0 - (force * l_f - turn * i_z) * l.recip();
        let rate = (self.rate * (-damping + inertia) + drive) * (damping + inertia).recip();
        let mean = (self.rate + rate) * 0.5;
        let beta = self.beta + mean * (0.5 * period);
        let yaw = bend - mean * per_v;
        let f_f = force - (c_r * (yaw * l_r - beta) + f_r0);
        *self = Self { beta: self.beta + mean * period, rate };
        (f_f - f_f0) / c_f + beta + yaw * l_f
    }
}

//! Where the force of tyres ends that are known by their nominal stiffness alone.

use serde::{Deserialize, Serialize};

use crate::Parameters;
use crate::model::{Body, DELTA, Input, State, Tyres, slip_angles};

/// Smallest tangent stiffness, as a share of the secant one [1].
///
/// Beyond the peak the tangent is negative, and a plan with such a model runs away from what it was made around. The
/// trained network needs no floor in `cargo fmu campaign --untold` and `cargo fmu robustness --case grip_range`: without one
/// nothing changes there. One of 0.4 promises too much: `--case grip_17` grows from 3.3 to 3.9 cm.
pub const TANGENT_FLOOR: f64 = 0.05;

/// What the nominal tyres hold: the slope at small slip, bent towards friction times load.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Grip {
    body: Body,
    /// Static load of the front and the rear axle [N].
    load: [f64; 2],
    /// Friction that the nominal stiffnesses belong to [1].
    mu: f64,
}

impl Grip {
    /// Of these parameters.
    pub fn new(p: &Parameters) -> Self {
        let per_metre = p.m * p.g / (p.l_f + p.l_r);
        Self { body: p.body(), load: [per_metre * p.l_r, per_metre * p.l_f], mu: p.mu }
    }

    /// Friction that the nominal stiffnesses belong to [1].
    pub fn friction(&self) -> f64 {
        self.mu
    }

    /// Secants and tangents of `F = mu F_z tanh(C alpha / (mu_0 F_z))`, with the nominal slope at the friction `mu_0` that it
    /// belongs to, and the limit of friction; up to the peak of the default magic formula within 2 % of the grip.
    pub fn tyres(&self, nominal: &Tyres, x: &State, u: &Input, mu: f64) -> (Tyres, Tyres) {
        let (alpha_f, alpha_r) = slip_angles(x, u[DELTA], &self.body);
        let axle = |c: f64, alpha: f64, load: f64| {
            let c = c * mu / self.mu;
            let most = mu * load;
            let used = (c * alpha / most).tanh();
            // Below 1e-4 of the grip the curve is its slope to 3e-9.
            let secant = if used.abs() > 1e-4 { most * used / alpha } else { c };
            let slope = (c * (1.0 - used * used)).max(TANGENT_FLOOR * secant);
            (secant, slope, (secant - slope) * alpha)
        };
        let (secant_f, c_f, f_f0) = axle(nominal.c_f, alpha_f, self.load[0]);
        let (secant_r, c_r, f_r0) = axle(nominal.c_r, alpha_r, self.load[1]);
        (Tyres::secant(secant_f, secant_r), Tyres { c_f, c_r, f_f0, f_r0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Front force of the default tyre, the magic formula with B 10, C 1.4, E 0 [N].
    fn magic(alpha: f64, mu: f64, load: f64) -> f64 {
        mu * load * (1.4 * (10.0 * alpha).atan()).sin()
    }

    #[test]
    fn nominal_tyres_end_at_the_grip_and_resemble_the_default_tyre() {
        let p = Parameters::default();
        let (grip, nominal) = (Grip::new(&p), p.nominal_tyres());
        let x = State::from([15.0, 0.0, 0.0, 0.0, 0.0]);
        for mu in [0.4, 0.82] {
            for k in 0..=20 {
                let alpha = 0.01 * f64::from(k);
                let (secant, tangent) = grip.tyres(&nominal, &x, &Input::from([alpha, 0.0]), mu);
                let force = secant.c_f * alpha;
                assert!((force - (tangent.f_f0 + tangent.c_f * alpha)).abs() < 1e-6, "one force, two forms");
                let most = mu * grip.load[0];
                assert!(force <= most && (force - magic(alpha, mu, grip.load[0])).abs() < 0.02 * most, "{mu} {alpha}");
            }
        }
    }

    #[test]
    fn the_slope_is_the_derivative_of_the_force() {
        let p = Parameters::default();
        let (grip, nominal) = (Grip::new(&p), p.nominal_tyres());
        let x = State::from([15.0, 0.3, 0.1, 0.0, 0.0]);
        let force = |delta: f64| {
            let u = Input::from([delta, 0.0]);
            let (alpha, _) = slip_angles(&x, delta, &grip.body);
            grip.tyres(&nominal, &x, &u, 0.82).0.c_f * alpha
        };
        for delta in [0.0, 0.03, 0.08] {
            let slope = (force(delta + 1e-6) - force(delta - 1e-6)) / 2e-6;
            let (_, tangent) = grip.tyres(&nominal, &x, &Input::from([delta, 0.0]), 0.82);
            assert!((tangent.c_f - slope).abs() < 1e-5 * slope.abs(), "{delta}: {} for {slope}", tangent.c_f);
        }
    }
}

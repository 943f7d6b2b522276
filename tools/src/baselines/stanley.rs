//! Stanley's law with the extensions for a car at speed.

use lpv_mpc::{Inputs, Parameters};

use super::Law;

/// Gain on the front axle's lateral error [1/s]: the default of MathWorks' Lateral Controller Stanley for forward motion.
const GAIN: f64 = 2.5;
/// Speed that is added in the denominator [m/s], [Hoffmann]: 1 m/s, also MathWorks'.
const SOFTENING: f64 = 1.0;
/// Gain on the yaw rate's error [s]: the default of MathWorks' Lateral Controller Stanley with the dynamic model.
const YAW_DAMPING: f64 = 0.2;

/// [Hoffmann, eq. (9) and section V]: heading error and lateral error of the front axle, damping of the yaw rate, and the slip
/// angle of steady cornering. The term on the steering servo's delay has nothing to do here: the servo is ideal.
#[derive(Clone, Debug)]
pub struct Stanley {
    l_f: f64,
    /// Slip angle of the front axle per lateral acceleration, `m l_r / (C_f L)` [rad s2/m].
    slip: f64,
}

impl Stanley {
    /// The law for the car that the parameters describe.
    pub fn new(p: &Parameters) -> Self {
        Self { l_f: p.l_f, slip: p.m * p.l_r / (p.c_f_nominal * (p.l_f + p.l_r)) }
    }
}

impl Law for Stanley {
    fn steer(&mut self, seen: &Inputs, _latency: f64, _delta: f64) -> f64 {
        let Inputs { v_x, yaw_rate, e_y, e_psi, .. } = *seen;
        let kappa = seen.kappa_ref[0];
        let e_front = e_y + self.l_f * e_psi.sin();
        let heading = e_psi - kappa * self.l_f;
        let wanted_yaw_rate = v_x * kappa;
        let correction = (GAIN * e_front / (SOFTENING + v_x.max(0.0))).atan();
        -heading - correction - YAW_DAMPING * (yaw_rate - wanted_yaw_rate) + self.slip * v_x * wanted_yaw_rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steers_back_to_the_path_from_both_sides() {
        let p = Parameters::default();
        let mut law = Stanley::new(&p);
        let mut at = |e_y| law.steer(&Inputs { v_x: 10.0, e_y, ..Inputs::default() }, 0.0, 0.0);
        assert!(at(0.5) < 0.0);
        assert_eq!(at(0.5), -at(-0.5));
        assert_eq!(at(0.0), 0.0);
    }

    #[test]
    fn on_a_circle_the_steering_is_that_of_steady_cornering() {
        let p = Parameters::default();
        let (v_x, kappa) = (12.0, 1e-3);
        // Linear bicycle, [Rajamani, eq. (3.13)]: geometry plus understeer.
        let l = p.l_f + p.l_r;
        let understeer = p.m * (p.l_r / p.c_f_nominal - p.l_f / p.c_r_nominal) / l;
        let want = kappa * (l + understeer * v_x * v_x);
        // The front axle runs on the path; the body points where the rear axle's slip lets it.
        let alpha_r = p.m * p.l_f * v_x * v_x * kappa / (p.c_r_nominal * l);
        let v_y = kappa * v_x * p.l_r - alpha_r * v_x;
        let e_psi = -v_y / v_x;
        let e_y = -p.l_f * e_psi;
        let mut seen = Inputs { v_x, v_y, yaw_rate: kappa * v_x, e_y, e_psi, ..Inputs::default() };
        seen.kappa_ref.fill(kappa);
        let got = Stanley::new(&p).steer(&seen, 0.0, 0.0);
        assert!((got / want - 1.0).abs() < 1e-6, "{got} rad for {want} rad");
    }
}

//! A command held over a step, behind first-order lags: what of it a power of the system matrix sees.

use serde::{Deserialize, Serialize};

use crate::model::NU;

/// Terms of the series of the matrix exponential.
pub const ORDER: usize = 4;

/// What depends on the step and the lags alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hold {
    /// Step [s].
    pub step: f64,
    /// Time constants of the actuators [s].
    pub(crate) tau: [f64; NU],
    /// What is left of a lag's distance to its command after the step [1].
    pub decay: [f64; NU],
    /// Moments of what is held over the whole step.
    pub(crate) held: [f64; ORDER],
    /// Moments of the actuators' decaying distances to their commands.
    pub(crate) distant: [[f64; ORDER]; NU],
    /// What these leave of the held ones.
    pub(crate) reached: [[f64; ORDER]; NU],
}

impl Hold {
    /// A hold over `step` [s] behind lags with time constants `tau` [s]; 0 is no lag.
    pub fn new(step: f64, tau: [f64; NU]) -> Self {
        let h = step;
        let held = [h, h * h / 2.0, h * h * h / 6.0, h * h * h * h / 24.0];
        let distant = tau.map(|tau| moments(step, tau));
        let reached = distant.map(|distant| std::array::from_fn(|k| held[k] - distant[k]));
        Self { step, tau, decay: tau.map(|tau| decay(step, tau)), held, distant, reached }
    }
}

/// `exp(-step / tau)`, 0 without a lag.
pub(crate) fn decay(step: f64, tau: f64) -> f64 {
    if tau > 0.0 { (-step / tau).exp() } else { 0.0 }
}

/// The moments `m_k = integral of (h - s)^k / k! exp(-s / tau)`.
fn moments(step: f64, tau: f64) -> [f64; ORDER] {
    if tau <= 0.0 {
        return [0.0; ORDER];
    }
    let z = step / tau;
    // m_k = h^(k+1) sum_j (-z)^j / (k + 1 + j)!: the forward recursion loses all digits for slow lags, the series does so for
    // fast ones, and both hold around z = 1.
    let mut moments = [0.0_f64; ORDER];
    if z < 1.0 {
        for (k, moment) in moments.iter_mut().enumerate() {
            let mut term = (1..=k + 1).fold(1.0, |product, i| product * step / i as f64);
            let mut j = k + 1;
            while term.abs() > 1e-18 * moment.abs() {
                *moment += term;
                j += 1;
                term *= -z / j as f64;
            }
        }
    } else {
        moments[0] = tau * (1.0 - (-z).exp());
        let mut power = 1.0;
        for k in 1..ORDER {
            power *= step / k as f64;
            moments[k] = tau * (power - moments[k - 1]);
        }
    }
    moments
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Independent route: Simpson's rule on 4000 pieces.
    fn integral(step: f64, f: impl Fn(f64) -> f64) -> f64 {
        let h = step / 4000.0;
        let piece = |k: u32| {
            let s = f64::from(k) * h;
            (f(s) + 4.0 * f(s + 0.5 * h) + f(s + h)) * (h / 6.0)
        };
        (0..4000).map(piece).sum()
    }

    #[test]
    fn moments_are_their_integrals() {
        let step = 0.033;
        // Slow, of the step's length on both sides of the change of series, and fast.
        for tau in [10.0, 0.1, 0.0331, 0.0329, 0.01, 0.001] {
            let hold = Hold::new(step, [tau, 0.0]);
            for (k, factorial) in [1.0, 1.0, 2.0, 6.0].into_iter().enumerate() {
                let power = |s: f64| (0..k).fold(1.0, |power, _| power * (step - s)) / factorial;
                let distant = integral(step, |s| power(s) * (-s / tau).exp());
                let held = integral(step, power);
                // Simpson's rule leaves (h / tau)^4 / 2880 of it, 2e-12 for the fastest.
                assert!(
                    (hold.distant[0][k] - distant).abs() < 1e-11 * held,
                    "{tau} {k}: {:e} {distant:e}",
                    hold.distant[0][k]
                );
                assert!((hold.reached[0][k] + distant - held).abs() < 1e-11 * held, "{tau} {k}");
                assert_eq!(hold.distant[1][k], 0.0, "without a lag nothing is distant");
            }
        }
    }
}

//! Sensor noise: Gaussian, white from one sample time to the next and held in between.
//!
//! The noise of sample k is drawn from a generator that is seeded with the seed and k, so it depends on time alone and
//! not on the communication steps that led there, and going back to a saved state repeats it.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::{Pcg64Mcg, rand_core::SeedableRng};
use serde::{Deserialize, Serialize};

/// What the controller sees of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Measurement {
    /// Longitudinal velocity, body frame [m/s].
    pub v_x: f64,
    /// Lateral velocity, body frame [m/s].
    pub v_y: f64,
    /// Yaw rate [rad/s].
    pub yaw_rate: f64,
    /// Lateral error, positive to the left of the path [m].
    pub e_y: f64,
    /// Heading error, vehicle minus path [rad].
    pub e_psi: f64,
}

/// Standard deviations at `noise_scale` 1, of a good inertial and satellite navigation unit.
const SIGMA: Measurement = Measurement { v_x: 0.03, v_y: 0.03, yaw_rate: 0.002, e_y: 0.01, e_psi: 0.002 };

/// The noise of one sample.
#[must_use]
pub fn sample(seed: i32, index: u64, scale: f64) -> Measurement {
    // The seed fills the upper half and the index the lower one; `seed_from_u64` spreads neighbouring values apart.
    let key = (u64::from(seed.cast_unsigned()) << 32) ^ index;
    let mut generator = Pcg64Mcg::seed_from_u64(key);
    let mut draw = |sigma: f64| -> f64 {
        let normal: f64 = StandardNormal.sample(&mut generator);
        scale * sigma * normal
    };
    Measurement {
        v_x: draw(SIGMA.v_x),
        v_y: draw(SIGMA.v_y),
        yaw_rate: draw(SIGMA.yaw_rate),
        e_y: draw(SIGMA.e_y),
        e_psi: draw(SIGMA.e_psi),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_white_with_the_stated_deviation() {
        let n = 20_000_u32;
        let draws: Vec<f64> = (0..n).map(|k| sample(7, u64::from(k), 1.0).v_x / SIGMA.v_x).collect();
        let mean = draws.iter().sum::<f64>() / f64::from(n);
        let variance = draws.iter().map(|d| d * d).sum::<f64>() / f64::from(n);
        let lag_one = draws.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / f64::from(n);
        // Standard errors are 0.007 for mean and correlation and 0.010 for the variance: five of each.
        assert!(mean.abs() < 0.035, "mean {mean}");
        assert!((variance - 1.0).abs() < 0.05, "variance {variance}");
        assert!(lag_one.abs() < 0.035, "correlation of neighbours {lag_one}");
    }

    #[test]
    fn another_seed_gives_other_noise() {
        assert_ne!(sample(1, 3, 1.0), sample(2, 3, 1.0));
        assert_eq!(sample(1, 3, 1.0), sample(1, 3, 1.0));
        assert_eq!(sample(1, 3, 0.0).e_y.abs(), 0.0);
    }
}

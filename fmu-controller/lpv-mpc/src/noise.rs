//! How noisy the sensors really are, found out from what the filter did not expect.
//!
//! A filter that assumes noise where there is none follows wind and tyres later than it could; one that assumes none where
//! there is some steers after it. What a measurement adds to its prediction, squared and divided by the variance that the
//! filter expects, is one in the mean when the assumption is right. The level here goes to where that holds, between sensors
//! that are nearly exact and those that the parameter tells.

use serde::{Deserialize, Serialize};

/// Time over which the level is averaged [s]: 30 samples of the sensors. With 0.3 or 3 s nothing with a limit in
/// `cargo fmu robustness --cases` changes by more than a twentieth.
const MEMORY: f64 = 1.0;

/// Samples that the first level counts for [1]: as in a mean, so that sensors without noise are known as such soon.
const FIRST: f64 = 2.0;

/// Smallest share of the told variance [1]: a tenth of the deviation, where the general track is followed as well as with a
/// hundredth (`cargo fmu simulate --road general`: to 0.6 mm, with the noise taken as told to 1.2 mm).
const SHARE_MIN: f64 = 0.01;

/// Squared innovation over its variance beyond which it counts no more [1]: three standard deviations. A gust or a stone on the
/// road is no noise.
const SURPRISE_MAX: f64 = 9.0;

/// How many times more a sensor counts that is worse than the level than one that is better [1].
///
/// One noisy sensor among four exact ones holds the level at half of its variance; counted alike it would be at a fifth.
/// Where all are alike the level is at most five times their variance, twice their deviation.
const CAUTION: f64 = 4.0;

/// Level of the noise of all sensors together, beside what is told of them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseLevel {
    /// Share of the told variance [1].
    share: f64,
    /// Samples seen.
    samples: u32,
    /// What the measurements of the present sample say.
    surprise: f64,
}

impl NoiseLevel {
    /// As told.
    pub fn new() -> Self {
        Self { share: 1.0, samples: 0, surprise: 0.0 }
    }

    /// Share of the told variance that the sensors have [1].
    pub fn share(&self) -> f64 {
        self.share
    }

    /// One measurement: its innovation, the variance that the filter expects of it, and the sensor's part of that.
    ///
    /// Where the model is less certain than the sensor the innovation says little of the sensor, and counts as little.
    pub fn observe(&mut self, innovation: f64, expected: f64, of_sensor: f64) {
        let excess = (innovation * innovation / expected).min(SURPRISE_MAX) - 1.0;
        let counted = if excess > 0.0 { CAUTION * excess } else { excess };
        self.surprise += of_sensor / expected * counted;
    }

    /// Takes over what the measurements of a sample say, which is `duration` [s] after the one before.
    pub fn update(&mut self, duration: f64) {
        let gain = (duration / MEMORY).max(1.0 / (f64::from(self.samples) + FIRST)).min(1.0);
        self.samples = self.samples.saturating_add(1);
        let share = self.share * (gain * self.surprise).exp();
        // What is no number must not stay: it would be the level of all samples to come.
        self.share = if share.is_nan() { 1.0 } else { share.clamp(SHARE_MIN, 1.0) };
        self.surprise = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    const PERIOD: f64 = 0.033;

    /// Mean share of the told variance that a filter finds in the last half of a minute. Each of its sensors has its own
    /// share of it, and sees its own random walk, which is as told.
    fn found(true_shares: &[f64], seed: u64) -> f64 {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        // Twelve uniform numbers have variance one.
        let mut normal = || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
        let walk = 0.1_f64;
        let mut filters: Vec<_> = true_shares.iter().map(|share| (*share, 0.0, 0.0, 1.0)).collect();
        let mut level = NoiseLevel::new();
        let (mut sum, mut count) = (0.0, 0.0);
        for k in 0..2000 {
            let of_sensor = level.share();
            for (true_share, x, estimate, variance) in &mut filters {
                *x += walk.sqrt() * normal();
                *variance += walk;
                let innovation = *x + true_share.sqrt() * normal() - *estimate;
                level.observe(innovation, *variance + of_sensor, of_sensor);
                let gain = *variance / (*variance + of_sensor);
                *estimate += gain * innovation;
                *variance *= 1.0 - gain;
            }
            level.update(PERIOD);
            if k >= 1000 {
                sum += level.share();
                count += 1.0;
            }
        }
        sum / count
    }

    fn mean(true_shares: &[f64]) -> f64 {
        (0..10).map(|seed| found(true_shares, seed)).sum::<f64>() / 10.0
    }

    #[test]
    fn better_sensors_are_recognised_and_not_taken_for_better_than_they_are() {
        for share in [0.03, 0.1, 0.25] {
            let mean = mean(&[share; 5]);
            assert!(mean > share && mean < 5.0 * share, "{mean} for {share}");
        }
    }

    #[test]
    fn one_noisy_sensor_among_exact_ones_holds_the_level() {
        let mean = mean(&[1.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(mean > 0.4 && mean < 0.9, "{mean}");
    }

    #[test]
    fn noise_as_told_or_worse_is_taken_as_told() {
        for share in [1.0, 9.0] {
            let mean = mean(&[share; 5]);
            assert!(mean > 0.9, "{mean} for {share}");
        }
    }

    #[test]
    fn exact_sensors_are_known_within_a_second() {
        let mut level = NoiseLevel::new();
        for _ in 0..30 {
            // Five sensors, half of the expected variance theirs.
            for _ in 0..5 {
                level.observe(0.0, 1.0, 0.5);
            }
            level.update(PERIOD);
        }
        assert!(level.share() < 0.03, "{}", level.share());
    }

    #[test]
    fn what_is_no_number_leaves_the_noise_as_told() {
        let mut level = NoiseLevel { share: 0.1, samples: 1000, surprise: 0.0 };
        level.observe(f64::NAN, f64::NAN, 0.1);
        level.update(PERIOD);
        assert_eq!(level.share(), 1.0);
        level.update(PERIOD);
        assert_eq!(level.share(), 1.0);
    }

    #[test]
    fn one_gust_is_no_noise() {
        let mut level = NoiseLevel { share: 0.1, samples: 1000, surprise: 0.0 };
        level.observe(1e6, 1.0, 0.1);
        level.update(PERIOD);
        assert!(level.share() < 0.12, "{}", level.share());
    }
}

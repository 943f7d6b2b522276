//! What a sample costs, on the machine that makes the report.

use std::time::Instant;

use anyhow::Result;
use lpv_mpc::Inputs;

use super::runs::{Situation, drive, prepare};
use crate::baselines::Baseline;
use crate::simulate::native::{Driver, Shown};

/// Runs of which each sample's shortest time counts: what else the machine did is not the controller's.
const REPEATS: usize = 3;

/// A driver that is timed.
struct Timed<D> {
    driver: D,
    /// Time of each communication step [s].
    times: Vec<f64>,
}

impl<D: Driver> Driver for Timed<D> {
    fn advance(&mut self, t: f64, h: f64, seen: &Inputs) -> Result<()> {
        let begin = Instant::now();
        let result = self.driver.advance(t, h, seen);
        self.times.push(begin.elapsed().as_secs_f64());
        result
    }

    fn shown(&self) -> Shown {
        self.driver.shown()
    }
}

/// Computing times of all samples of a drive over the general track, one sample in each communication step [s]; without a
/// baseline it is our controller's.
pub fn times(baseline: Option<Baseline>) -> Result<Vec<f64>> {
    let mut best: Vec<f64> = Vec::new();
    for _ in 0..REPEATS {
        let (mut plant, controller, settings) = prepare(Situation::General, &[])?;
        let step = settings.controller.t_s;
        let times = match baseline {
            Some(baseline) => {
                let mut driver =
                    Timed { driver: baseline.driver(&settings.controller, plant.road()), times: Vec::new() };
                drive(Situation::General, &mut plant, &mut driver, step)?;
                driver.times
            }
            None => {
                let mut driver = Timed { driver: controller, times: Vec::new() };
                drive(Situation::General, &mut plant, &mut driver, step)?;
                driver.times
            }
        };
        best = if best.is_empty() { times } else { best.iter().zip(&times).map(|(a, b)| a.min(*b)).collect() };
    }
    Ok(best)
}

/// Value that a share of the samples does not exceed.
pub fn quantile(times: &[f64], share: f64) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the count, 0 to 1")]
    let index = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(index).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::quantile;

    #[test]
    fn quantiles_of_the_numbers_to_a_hundred() {
        let times: Vec<f64> = (0..=100).rev().map(f64::from).collect();
        assert_eq!([0.0, 0.5, 0.99, 1.0].map(|share| quantile(&times, share)), [0.0, 50.0, 99.0, 100.0]);
    }
}

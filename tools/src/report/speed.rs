//! Where the gains of the baselines' speed controller come from.

use anyhow::{Context, Result};

use super::runs::{STEP, Situation, drive, prepare};
use crate::baselines::{Baseline, Gains};
use crate::optimise::search::{Method, minimise};
use crate::optimise::{Dimension, Space};
use crate::recording::{Recording, Tracking};

/// Evaluations: the paper's 25 particles over its 15 iterations, and the first swarm.
const EVALUATIONS: usize = 25 * 16;
/// Seed of the swarm.
const SEED: u64 = 1;

/// Finds the gains again by the paper's swarm: least rms speed error on the general track in its wind.
pub fn tune(tick: impl Fn() + Sync) -> Result<(Gains, f64)> {
    let names = ["proportional", "integral", "derivative"];
    let sides = names.iter().zip(Gains::BOX).map(|(name, high)| Dimension::linear(name, 0.0, high)).collect();
    let fitness = |x: &[f64]| {
        tick();
        let gains = Gains { proportional: x[0], integral: x[1], derivative: x[2] };
        error(gains).unwrap_or(f64::INFINITY)
    };
    let (x, least) =
        minimise(fitness, &Space::new(sides)?, Method::Pso, EVALUATIONS, SEED).context("nothing was found")?;
    Ok((Gains { proportional: x[0], integral: x[1], derivative: x[2] }, least))
}

/// Root mean square of the speed error with these gains [m/s].
fn error(gains: Gains) -> Result<f64> {
    let (mut plant, _, settings) = prepare(Situation::General, &[])?;
    let mut driver = Baseline::LinearMeasured.with_gains(&settings.controller, plant.road(), gains);
    let recording: Recording = drive(Situation::General, &mut plant, &mut driver, STEP)?;
    Ok(Tracking::of(&recording).speed_rms)
}

/// Evaluations of a search, for a bar.
pub fn evaluations() -> u64 {
    EVALUATIONS as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_neighbour_in_the_box_is_better_than_the_tuned_gains() {
        let tuned = error(Gains::TUNED).unwrap();
        let Gains { proportional, integral, derivative } = Gains::TUNED;
        let gains = [proportional, integral, derivative];
        for (i, high) in Gains::BOX.into_iter().enumerate() {
            for factor in [-0.1, 0.1] {
                let mut moved = gains;
                moved[i] = (moved[i] + factor * high).clamp(0.0, high);
                let other = error(Gains { proportional: moved[0], integral: moved[1], derivative: moved[2] }).unwrap();
                // At a bound of the box the clamped neighbour is the point itself; a flat valley may differ by rounding.
                assert!(other >= tuned * (1.0 - 1e-3), "{moved:?}: {other} m/s is less than {tuned} m/s");
            }
        }
    }
}

//! The default recipe: random starts, second-order steps on the free run, the iterate that validates best.

use lpv_mpc::jordan::{Envelope, FEEDBACK, Range, Scaling};
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::data::Run;
use super::marquardt::{self, Marquardt};
use super::recipe::{RHO, Recipe};
use super::stack::{Sequence, Shape};

/// Means, deviations and ranges of a training set.
#[derive(Clone, Debug, PartialEq)]
pub struct Scales {
    /// Of the inputs.
    pub inputs: Vec<Scaling>,
    /// Of the outputs.
    pub outputs: [Scaling; FEEDBACK],
    /// What was covered.
    pub envelope: Envelope,
}

/// Mean and deviation of some values; a quantity that never changes keeps its own unit.
fn scaling(values: impl Iterator<Item = f64> + Clone) -> Scaling {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let variance = values.map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    let still = 1e-9 * mean.abs().max(1.0);
    Scaling { mean, deviation: if variance.sqrt() > still { variance.sqrt() } else { mean.abs().max(1.0) } }
}

impl Scales {
    /// Of all samples of some runs, which hold their mirror images.
    pub fn new(runs: &[Run], inputs: usize) -> Self {
        let samples = || runs.iter().flat_map(|run| &run.samples);
        let range = |value: &dyn Fn(&super::data::Sample) -> f64| {
            let mut range = Range::EMPTY;
            samples().for_each(|sample| range.include(value(sample)));
            range
        };
        Self {
            inputs: (0..inputs).map(|i| scaling(samples().map(move |s| s.measured.values()[i]))).collect(),
            outputs: std::array::from_fn(|o| scaling(samples().map(move |s| s.c[o]))),
            envelope: Envelope {
                inputs: (0..inputs).map(|i| range(&|s| s.measured.values()[i])).collect(),
                alpha_f: range(&|s| s.alpha[0]),
                alpha_r: range(&|s| s.alpha[1]),
            },
        }
    }

    /// A run in the network's units; `error` is what the memory begins wrong by.
    pub fn sequence(&self, run: &Run, error: [f64; FEEDBACK]) -> Sequence {
        let answer =
            |c: [f64; FEEDBACK]| std::array::from_fn(|o| (c[o] - self.outputs[o].mean) / self.outputs[o].deviation);
        let answers: Vec<[f64; FEEDBACK]> = run.samples.iter().map(|sample| answer(sample.c)).collect();
        let start = std::array::from_fn(|o| answers.first().map_or(0.0, |first| first[o]) + error[o]);
        let inputs = run
            .samples
            .iter()
            .flat_map(|sample| {
                let values = sample.measured.values();
                self.inputs.iter().zip(values).map(|(s, value)| (value - s.mean) / s.deviation)
            })
            .collect();
        Sequence { inputs, answers, start }
    }

    /// All runs; every second one begins with a memory that is wrong by about one deviation.
    pub fn sequences(&self, runs: &[Run], rng: &mut Pcg64Mcg) -> Vec<Sequence> {
        runs.iter()
            .enumerate()
            .map(|(i, run)| {
                let mut error = || if i % 2 == 0 { 0.0 } else { rng.random_range(-1.7..1.7) };
                self.sequence(run, [error(), error()])
            })
            .collect()
    }
}

/// One random start on its way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Its number.
    pub index: usize,
    method: Marquardt,
    /// Parameters that validated best.
    pub best: DVector<f64>,
    /// Their mean squared error on the validation set, in the network's units.
    pub validation: f64,
    /// Attempted steps.
    pub steps: usize,
    /// Training and validation error after each step that was taken, with the number of the attempt.
    pub curve: Vec<(usize, f64, f64)>,
}

impl Start {
    fn attempt(&mut self, shape: &Shape, training: &[Sequence], validation: &[Sequence]) {
        self.steps += 1;
        if self.method.finished() || !self.method.step(shape, training, RHO) {
            return;
        }
        let error = marquardt::error(shape, &self.method.theta, validation);
        self.curve.push((self.steps, self.method.error, error));
        if error < self.validation {
            self.validation = error;
            self.best.clone_from(&self.method.theta);
        }
    }
}

/// Training in progress.
#[derive(Clone, Debug)]
pub struct Training {
    shape: Shape,
    training: Vec<Sequence>,
    validation: Vec<Sequence>,
    /// Starts that are still in the race.
    pub starts: Vec<Start>,
    /// Steps after which the best start goes on alone, and steps in all.
    heat: usize,
    total: usize,
}

impl Training {
    /// Draws the random starts, or takes those of an earlier session.
    pub fn new(
        recipe: &Recipe,
        scales: &Scales,
        [training, validation]: [&[Run]; 2],
        earlier: Option<Vec<Start>>,
    ) -> Self {
        let shape = recipe.shape();
        let mut rng = Pcg64Mcg::seed_from_u64(recipe.seed);
        let training = scales.sequences(training, &mut rng);
        let validation = scales.sequences(validation, &mut rng);
        let starts = earlier.unwrap_or_else(|| {
            let thetas: Vec<DVector<f64>> = (0..recipe.starts).map(|_| shape.random(&mut rng)).collect();
            let start = |(index, mut theta): (usize, DVector<f64>)| {
                shape.contract(&mut theta, RHO);
                Start {
                    index,
                    best: theta.clone(),
                    validation: f64::MAX,
                    method: Marquardt::new(&shape, theta, &training),
                    steps: 0,
                    curve: Vec::new(),
                }
            };
            thetas.into_par_iter().enumerate().map(start).collect()
        });
        // Without a rival there is no heat.
        let heat = if recipe.starts > 1 { recipe.steps.div_ceil(4) } else { recipe.steps };
        Self { shape, training, validation, starts, heat, total: recipe.steps }
    }

    /// Attempted steps of the whole training, and how many of them are done.
    pub fn progress(&self, recipe: &Recipe) -> (u64, u64) {
        let whole = recipe.starts * self.heat + (self.total - self.heat);
        let steps: usize = self.starts.iter().map(|start| start.steps).sum();
        let alone = self.starts.len() == 1 && recipe.starts > 1;
        let done = steps + if alone { (recipe.starts - 1) * self.heat } else { 0 };
        (done as u64, whole as u64)
    }

    /// Whether the winner is through.
    pub fn finished(&self) -> bool {
        self.starts.iter().all(|start| start.steps >= self.total)
    }

    /// Attempts a few steps of every start that is still in the race.
    pub fn advance(&mut self, count: usize) {
        let Self { shape, training, validation, starts, heat, total } = self;
        let limit = if starts.len() > 1 { *heat } else { *total };
        starts.par_iter_mut().for_each(|start| {
            for _ in start.steps..limit.min(start.steps + count) {
                start.attempt(shape, training, validation);
            }
        });
        // The race is mostly decided after a quarter of the way; the others would only cost time.
        if starts.len() > 1 && starts.iter().all(|start| start.steps >= *heat) {
            starts.sort_by(|a, b| a.validation.total_cmp(&b.validation));
            starts.truncate(1);
        }
    }

    /// The start that validates best.
    pub fn best(&self) -> &Start {
        self.starts
            .iter()
            .min_by(|a, b| a.validation.total_cmp(&b.validation))
            .expect("a validated recipe has at least one start")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::data;
    use crate::train::recipe::{Preset, Purpose, T_S};

    /// A training that takes a second.
    fn small() -> Recipe {
        Recipe { manoeuvres: 6, starts: 2, steps: 16, hidden: [3, 2], ..Recipe::new(Preset::PaperSize, 3) }
    }

    fn prepared(recipe: &Recipe) -> (Scales, Vec<Run>, Vec<Run>) {
        let drive = |purpose: Purpose| {
            let manoeuvres = recipe.draw(purpose, recipe.counts(purpose).0, false);
            data::drive(&recipe.plant().unwrap(), T_S, &manoeuvres, || ()).unwrap()
        };
        let (training, validation) = (drive(Purpose::Training), drive(Purpose::Validation));
        (Scales::new(&training, recipe.shape().inputs), training, validation)
    }

    fn trained(threads: usize, stop: usize) -> Vec<Start> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let recipe = small();
            let (scales, training, validation) = prepared(&recipe);
            let mut session = Training::new(&recipe, &scales, [&training, &validation], None);
            for _ in 0..stop {
                session.advance(2);
            }
            // Written and read, as between two sessions.
            let text = serde_json::to_string(&session.starts).unwrap();
            let starts = serde_json::from_str(&text).unwrap();
            let mut session = Training::new(&recipe, &scales, [&training, &validation], Some(starts));
            while !session.finished() {
                session.advance(2);
            }
            session.starts
        })
    }

    #[test]
    fn neither_threads_nor_interruptions_change_a_bit() {
        let whole = trained(1, 0);
        assert!(!whole[0].curve.is_empty(), "nothing was learned");
        assert_eq!(trained(2, 0), whole, "another number of threads");
        assert_eq!(trained(2, 1), whole, "interrupted in the heat");
        assert_eq!(trained(2, 6), whole, "interrupted in the rest");
    }

    #[test]
    fn progress_ends_with_the_training() {
        let recipe = small();
        let (scales, training, validation) = prepared(&recipe);
        let mut session = Training::new(&recipe, &scales, [&training, &validation], None);
        while !session.finished() {
            let (done, whole) = session.progress(&recipe);
            assert!(done < whole, "{done} of {whole} with steps to come");
            session.advance(2);
        }
        let (done, whole) = session.progress(&recipe);
        assert_eq!(done, whole);
    }
}

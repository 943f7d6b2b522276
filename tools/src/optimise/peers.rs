//! Other people's optimisers on the same functions with the same number of evaluations: CMA-ES of the crate cmaes, once and with
//! its restarts (BIPOP), and the particle swarm of argmin. The only file that knows these crates.

use std::cell::Cell;

use anyhow::{Context, Result};
use argmin::core::{CostFunction, Executor};
use argmin::solver::particleswarm::ParticleSwarm;
use cmaes::restart::{BIPOP, RestartOptions, RestartStrategy};
use cmaes::{CMAESOptions, DVector};
use rand::SeedableRng as _;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as OldSeedable;

use super::functions::{Function, SIDES};
use super::random::{self, Random};

/// Names of the peers.
pub const NAMES: [&str; 3] = ["cmaes", "cmaes_bipop", "argmin_pso"];

/// First step size of CMA-ES as a share of the box: 0.3 is what its author recommends, and the crate's own restarts take.
const STEP: f64 = 0.3;
/// Particles of argmin's swarm, from its documentation.
const PARTICLES: usize = 40;

/// A function that remembers its least value within the budget; what is asked for beyond is not counted.
struct Meter {
    function: Function,
    left: Cell<usize>,
    least: Cell<f64>,
}

impl Meter {
    fn new(function: Function, budget: usize) -> Self {
        Self { function, left: Cell::new(budget), least: Cell::new(f64::INFINITY) }
    }

    /// The value at a point of the unit cube; CMA-ES also looks outside, where the functions go on.
    fn at(&self, point: &[f64]) -> f64 {
        let [low, high] = self.function.bounds();
        let x: Vec<f64> = point.iter().map(|place| low + place * (high - low)).collect();
        let value = self.function.value(&x);
        if self.left.get() > 0 {
            self.left.set(self.left.get() - 1);
            self.least.set(self.least.get().min(value));
        }
        value
    }
}

impl CostFunction for &Meter {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, point: &Self::Param) -> Result<f64> {
        Ok(self.at(point))
    }
}

/// Least value that a peer finds.
///
/// # Errors
/// If the peer refuses its options.
pub fn least(peer: &str, function: Function, budget: usize, seed: u64) -> Result<f64> {
    let meter = Meter::new(function, budget);
    match peer {
        "cmaes" => {
            let start = random::point(&mut Random::seed_from_u64(seed), SIDES);
            // It would stop at differences of 1e-12; here the evaluations decide.
            let mut run = CMAESOptions::new(start, STEP)
                .seed(seed)
                .max_function_evals(budget)
                .tol_fun(0.0)
                .tol_fun_hist(0.0)
                .tol_fun_rel(0.0)
                .tol_x(0.0)
                .build(|x: &DVector<f64>| meter.at(x.as_slice()))
                .map_err(|error| anyhow::anyhow!("{error:?}"))?;
            run.run();
        }
        "cmaes_bipop" => {
            let strategy = RestartStrategy::BIPOP(BIPOP::default());
            let restarter = RestartOptions::new(SIDES, 0.0..=1.0, strategy)
                .seed(seed)
                .max_function_evals(budget)
                .build()
                .map_err(|error| anyhow::anyhow!("{error:?}"))?;
            restarter.run(|| |x: &DVector<f64>| meter.at(x.as_slice()));
        }
        "argmin_pso" => {
            let swarm = ParticleSwarm::new((vec![0.0; SIDES], vec![1.0; SIDES]), PARTICLES)
                .with_rng_generator(<Xoshiro256PlusPlus as OldSeedable>::seed_from_u64(seed));
            Executor::new(&meter, swarm)
                .configure(|state| state.max_iters((budget / PARTICLES) as u64))
                .run()
                .context("argmin stopped")?;
        }
        other => anyhow::bail!("there is no peer {other}"),
    }
    Ok(meter.least.get())
}

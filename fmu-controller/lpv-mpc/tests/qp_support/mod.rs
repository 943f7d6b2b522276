//! Random quadratic programmes for the tests of the solvers.
#![allow(dead_code, reason = "every test binary uses its own part")]
#![allow(non_snake_case, reason = "matrices keep the paper's capitals")]

use lpv_mpc::qp::{Problem, Solution, Stage};
use nalgebra::{DMatrix, SMatrix, SVector};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// What makes a random problem hard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stress {
    /// Seed of all that is not said below.
    pub seed: u64,
    /// Samples.
    pub horizon: usize,
    /// By which power of ten the free system grows over the horizon; negative: it decays.
    pub growth: f64,
    /// Half the decades that the weights span.
    pub decades: f64,
    /// How far the reference lies from where the input can reach.
    pub demand: f64,
    /// Bounds are multiples of each other and the data sits exactly on them.
    pub degenerate: bool,
    /// The input applied before lies outside of its bounds.
    pub outside: bool,
}

/// Uniform number in a range, for generators that are given by their seed.
fn uniform(random: &mut Pcg64Mcg, low: f64, high: f64) -> f64 {
    low + (high - low) * random.random::<f64>()
}

pub fn random_problem<const NX: usize, const NU: usize>(stress: &Stress) -> Problem<NX, NU> {
    let mut random = Pcg64Mcg::seed_from_u64(stress.seed);
    let random = &mut random;
    let N = stress.horizon;
    let mut problem = Problem::<NX, NU>::new(N);
    let drift = uniform(random, 0.0, 0.1);
    let A = DMatrix::from_fn(NX, NX, |_, _| uniform(random, -1.0, 1.0));
    let radius = A.complex_eigenvalues().iter().map(|value| value.norm()).fold(0.0, f64::max);
    let A = A * (10f64.powf(stress.growth / N as f64) / radius);
    let A = SMatrix::<f64, NX, NX>::from_fn(|row, column| A[(row, column)]);
    let B = SMatrix::<f64, NX, NU>::from_fn(|_, _| uniform(random, -1.0, 1.0));
    for stage in &mut problem.stages {
        *stage = Stage {
            A: A.map(|a| a * (1.0 + drift * uniform(random, -1.0, 1.0))),
            B: B.map(|b| b * (1.0 + drift * uniform(random, -1.0, 1.0))),
            d: SVector::from_fn(|_, _| uniform(random, -0.1, 0.1)),
            x_ref: SVector::from_fn(|_, _| stress.demand * uniform(random, -1.0, 1.0)),
            du_ref: SVector::zeros(),
        };
    }
    let decades = stress.decades;
    let weight = |random: &mut Pcg64Mcg| 10f64.powf(uniform(random, -decades, decades));
    problem.x_0 = SVector::from_fn(|_, _| stress.demand * uniform(random, -1.0, 1.0));
    problem.q = SVector::from_fn(|_, _| if uniform(random, 0.0, 1.0) < 0.1 { 0.0 } else { weight(random) });
    problem.r = SVector::from_fn(|_, _| weight(random).min(10.0));
    let scale = problem.q.max().sqrt();
    let root = SMatrix::<f64, NX, NX>::from_fn(|_, _| scale * uniform(random, -1.0, 1.0));
    problem.q_terminal =
        if uniform(random, 0.0, 1.0) < 0.5 { SMatrix::from_diagonal(&problem.q) } else { root.tr_mul(&root) };
    for j in 0..NU {
        let range = if stress.degenerate { 1.0 } else { 10f64.powf(uniform(random, -1.0, 1.0)) };
        let middle = if stress.degenerate { 0.0 } else { range * uniform(random, -0.3, 0.3) };
        problem.u_min[j] = middle - range;
        problem.u_max[j] = middle + range;
        // The powers of two make corners meet exactly; rounding takes care of those that nearly do.
        problem.du_max[j] = match random.random_range(0..8) {
            0 => f64::INFINITY,
            1 if stress.degenerate => 0.0,
            2 if stress.degenerate => {
                problem.u_max[j] = problem.u_min[j];
                0.5
            }
            k if stress.degenerate => 2.0 / f64::from(k),
            _ => range * uniform(random, 0.02, 1.5),
        };
        let inside = uniform(random, 0.0, 1.0);
        problem.u_prev[j] = problem.u_min[j] + inside * (problem.u_max[j] - problem.u_min[j]);
        if stress.degenerate {
            problem.u_prev[j] = if inside < 0.5 { problem.u_min[j] } else { problem.u_max[j] };
        }
        if stress.outside {
            problem.u_prev[j] += 3.0 * range * uniform(random, -1.0, 1.0);
        }
        if uniform(random, 0.0, 1.0) < 0.05 && !stress.degenerate {
            problem.u_max[j] = f64::INFINITY;
        }
    }
    problem.soft_state = random.random_range(0..NX);
    problem.soft_bound = uniform(random, 0.0, 1.0) * stress.demand;
    problem.soft = if uniform(random, 0.0, 1.0) < 0.3 { 0.0 } else { 10f64.powf(uniform(random, 0.0, decades)) };
    for stage in &mut problem.stages {
        stage.du_ref = SVector::from_fn(|_, _| 0.1 * stress.demand * uniform(random, -1.0, 1.0));
    }
    problem
}

/// Largest violation of the bounds by a plan [input's unit], and of the prediction [state's unit over its magnitude].
pub fn violation<const NX: usize, const NU: usize>(
    problem: &Problem<NX, NU>,
    solution: &Solution<NX, NU>,
) -> (f64, f64) {
    let mut bounds: f64 = 0.0;
    let mut prediction: f64 = 0.0;
    let mut u_prev = problem.u_prev_clamped();
    for (i, stage) in problem.stages.iter().enumerate() {
        let u = solution.u[i];
        for j in 0..NU {
            bounds = bounds
                .max(u[j] - problem.u_max[j])
                .max(problem.u_min[j] - u[j])
                .max((u[j] - u_prev[j]).abs() - problem.du_max[j]);
        }
        let x = stage.A * solution.x[i] + stage.B * u + stage.d;
        let magnitude = 1.0 + (stage.A.abs() * solution.x[i].abs() + stage.B.abs() * u.abs()).max();
        prediction = prediction.max((x - solution.x[i + 1]).abs().max() / magnitude);
        u_prev = u;
    }
    (bounds, prediction)
}

/// Whether a plan holds numbers only.
pub fn is_finite<const NX: usize, const NU: usize>(solution: &Solution<NX, NU>) -> bool {
    solution.u.iter().flatten().chain(solution.x.iter().flatten()).all(|value| value.is_finite())
}

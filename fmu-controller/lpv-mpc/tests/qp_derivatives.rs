//! Derivatives of the solution against differences of solutions.

mod qp_support;

use lpv_mpc::qp::{Outcome, Perturbation, Problem, Solution, Stage, Structured};
use nalgebra::{SMatrix, SVector};
use qp_support::{Stress, random_problem};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Step of the central differences, relative to data of order one. On one active set the solution is a smooth function, so
/// the error is the square of the step plus rounding over the step.
const STEP: f64 = 1e-6;
const TOLERANCE: f64 = 1e-5;

fn solve<const NX: usize>(problem: &Problem<NX, 2>) -> (Structured<NX, 2>, Solution<NX, 2>) {
    let mut solver = Structured::new(problem.stages.len());
    let mut solution = Solution::new(problem.stages.len());
    solver.solve(problem, &mut solution);
    (solver, solution)
}

fn problem<const NX: usize>(seed: u64) -> Problem<NX, 2> {
    random_problem(&Stress {
        seed,
        horizon: 3 + usize::try_from(seed % 20).expect("a number below twenty fits"),
        growth: 0.3,
        decades: 1.5,
        demand: 2.0,
        degenerate: false,
        outside: seed.is_multiple_of(7),
    })
}

/// Which multipliers are not zero: the active set, as far as a solution shows it.
fn signs<const NX: usize>(solution: &Solution<NX, 2>, problem: &Problem<NX, 2>) -> Vec<i8> {
    let sign = |mu: f64| {
        if mu > 0.0 {
            1
        } else if mu < 0.0 {
            -1
        } else {
            0
        }
    };
    let inputs = solution.mu_u.iter().flatten().chain(solution.mu_du.iter().flatten()).map(|mu| sign(*mu));
    let states = solution.x.iter().map(|x| i8::from(problem.excess(x) > 0.0));
    inputs.chain(states).collect()
}

fn perturbed<const NX: usize>(problem: &Problem<NX, 2>, change: &Perturbation<NX, 2>, step: f64) -> Problem<NX, 2> {
    let mut moved = problem.clone();
    moved.x_0 += change.x_0 * step;
    moved.u_prev += change.u_prev * step;
    for (stage, d) in moved.stages.iter_mut().zip(&change.stages) {
        stage.A += d.A * step;
        stage.B += d.B * step;
        stage.d += d.d * step;
        stage.x_ref += d.x_ref * step;
        stage.du_ref += d.du_ref * step;
    }
    moved
}

fn tangent_matches_differences<const NX: usize>() {
    let mut compared = 0;
    let mut with_active_bounds = 0;
    for seed in 0..200 {
        let problem = problem::<NX>(seed);
        let (solver, solution) = solve(&problem);
        assert_eq!(solution.outcome, Outcome::Optimal, "seed {seed}");
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut number = || 2.0 * random.random::<f64>() - 1.0;
        let change = Perturbation {
            stages: (0..problem.stages.len())
                .map(|_| Stage {
                    A: SMatrix::from_fn(|_, _| number()),
                    B: SMatrix::from_fn(|_, _| number()),
                    d: SVector::from_fn(|_, _| number()),
                    x_ref: SVector::from_fn(|_, _| number()),
                    du_ref: SVector::from_fn(|_, _| number()),
                })
                .collect(),
            x_0: SVector::from_fn(|_, _| number()),
            u_prev: SVector::from_fn(|_, _| number()),
        };
        let tangent = solver.tangent(&problem, &solution, &change);
        let (_, ahead) = solve(&perturbed(&problem, &change, STEP));
        let (_, behind) = solve(&perturbed(&problem, &change, -STEP));
        let active = signs(&solution, &problem);
        if signs(&ahead, &problem) != active || signs(&behind, &problem) != active {
            // There is no derivative where the active set changes.
            continue;
        }
        compared += 1;
        with_active_bounds += usize::from(active.iter().any(|sign| *sign != 0));
        for i in 0..problem.stages.len() {
            let u = (ahead.u[i] - behind.u[i]) / (2.0 * STEP);
            let x = (ahead.x[i + 1] - behind.x[i + 1]) / (2.0 * STEP);
            let scale = 1.0 + u.amax().max(x.amax());
            let error = (tangent.u[i] - u).amax().max((tangent.x[i + 1] - x).amax());
            assert!(error < TOLERANCE * scale, "seed {seed}, sample {i}: off by {error:e} of {scale:e}");
        }
    }
    assert!(compared > 150 && with_active_bounds > 50, "{compared} compared, {with_active_bounds} with active bounds");
}

#[test]
fn tangent_of_five_states_matches_differences() {
    tangent_matches_differences::<5>();
}

#[test]
fn tangent_of_seven_states_matches_differences() {
    tangent_matches_differences::<7>();
}

#[test]
fn gain_is_the_tangent_with_respect_to_the_state() {
    for seed in 0..50 {
        let problem = problem::<5>(seed);
        let (solver, solution) = solve(&problem);
        for k in 0..5 {
            let mut change = Perturbation::new(problem.stages.len());
            change.x_0[k] = 1.0;
            let column = solver.tangent(&problem, &solution, &change).u[0];
            let error = (column - solution.gain.column(k)).amax();
            // The same recursion, with another affine part.
            assert!(error < 1e-12 * (1.0 + column.amax()), "seed {seed}: off by {error:e}");
        }
    }
}

//! The structured solver against Clarabel and against the conditions of optimality, on random problems.
//!
//! `QP_CASES` sets the number of problems per shape; the long run is `QP_CASES=50000`, with two shapes 1e5 problems.

mod qp_support;

use lpv_mpc::qp::{Clarabel, Outcome, Solution, Structured, optimality};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use qp_support::{Stress, is_finite, random_problem, violation};
use std::cell::Cell;

/// Clarabel's own tolerance; its answer is moved into the bounds, so its cost is a true upper bound whatever it reached.
const ORACLE_TOLERANCE: f64 = 1e-10;

fn cases() -> u32 {
    std::env::var("QP_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(500)
}

fn stress() -> impl Strategy<Value = Stress> {
    let horizon = prop_oneof![Just(10usize), 1usize..=12, 1usize..=80];
    // Growth by more than three decades leaves too few digits of the end of the horizon to compare anything.
    (any::<u64>(), horizon, -2.0..3.0f64, 0.0..5.0f64, 0.0..1.0f64, any::<bool>(), any::<bool>()).prop_map(
        |(seed, horizon, growth, decades, demand, degenerate, outside)| Stress {
            seed,
            horizon,
            growth,
            decades,
            demand: 10f64.powf(2.0 * demand - 1.0),
            degenerate,
            outside,
        },
    )
}

#[derive(Default)]
struct Tally {
    optimal: Cell<u32>,
    interior: Cell<u32>,
    flagged: Cell<u32>,
    oracle_failed: Cell<u32>,
}

fn count(cell: &Cell<u32>) {
    cell.set(cell.get() + 1);
}

#[allow(clippy::print_stdout, reason = "the tally belongs to the report of a long run")]
fn agrees_with_clarabel<const NX: usize, const NU: usize>() {
    let tally = Tally::default();
    let mut runner = TestRunner::new_with_rng(
        Config { cases: cases(), failure_persistence: None, max_shrink_iters: 0, ..Config::default() },
        // Fixed, so that a run can be repeated; the long run covers other problems by its length.
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    );
    let result = runner.run(&stress(), |stress| {
        let problem = random_problem::<NX, NU>(&stress);
        let mut solution = Solution::new(stress.horizon);
        Structured::new(stress.horizon).solve(&problem, &mut solution);
        prop_assert!(solution.outcome.has_plan(), "{:?}", solution.outcome);
        prop_assert!(is_finite(&solution));
        let (bounds, prediction) = violation(&problem, &solution);
        prop_assert!(bounds <= 1e-9, "bound violated by {bounds:e}");
        prop_assert!(prediction <= 1e-9, "prediction off by {prediction:e}");
        match solution.outcome {
            Outcome::Optimal => count(&tally.optimal),
            Outcome::InteriorPoint => count(&tally.interior),
            _ => count(&tally.flagged),
        }
        let residual = optimality::residual(&problem, &solution);
        match solution.outcome {
            // Two orders above what the solver calls rounding, for its sums run in another order.
            Outcome::Optimal => prop_assert!(residual <= 1e-7, "residual {residual:e}"),
            Outcome::InteriorPoint => prop_assert!(residual <= 1e-6, "residual {residual:e}"),
            _ => return Ok(()),
        }
        let mut reference = Solution::new(stress.horizon);
        Clarabel::new(ORACLE_TOLERANCE).solve(&problem, &mut reference);
        if !reference.outcome.has_plan() {
            count(&tally.oracle_failed);
            return Ok(());
        }
        let cost = problem.cost(&solution.x, &solution.u);
        let upper = problem.cost(&reference.x, &reference.u);
        let scale = upper + problem.cost(&solution.x, &vec![problem.u_prev_clamped(); stress.horizon]);
        // Any plan within the bounds costs at least the optimum; 1e-9 covers the sums' rounding.
        prop_assert!(cost <= upper + 1e-9 * scale, "cost {cost:e}, Clarabel {upper:e}");
        // The other way round only Clarabel's accuracy is at stake: both plans are within the bounds, so the cheaper one is
        // the better one. Where it is far off it is no reference.
        if upper > cost + 1e-6 * scale {
            count(&tally.oracle_failed);
        }
        Ok(())
    });
    let Tally { optimal, interior, flagged, oracle_failed } = tally;
    println!(
        "NX = {NX}: optimal {}, interior point {}, flagged {}, Clarabel no reference {}",
        optimal.get(),
        interior.get(),
        flagged.get(),
        oracle_failed.get()
    );
    if let Err(failure) = result {
        panic!("{failure}");
    }
    assert!(oracle_failed.get() * 10 <= cases(), "Clarabel is no reference for {} of {}", oracle_failed.get(), cases());
    // Flagged is honest but must stay rare.
    assert!(flagged.get() * 1000 <= cases(), "{} of {} not converged", flagged.get(), cases());
}

#[test]
fn five_states_agree_with_clarabel() {
    agrees_with_clarabel::<5, 2>();
}

#[test]
fn seven_states_agree_with_clarabel() {
    agrees_with_clarabel::<7, 2>();
}

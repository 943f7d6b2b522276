//! Structured solver: block active set on the Riccati recursion.
//!
//! 1. A sweep solves the problem on a given active set exactly: one recursion backwards, in which inputs at a bound are fixed
//!    and active soft bounds are in the cost, and one pass forwards. On the way forwards the inputs stop at their bounds, so
//!    every plan can be executed; bounds that were met enter the active set, bounds with wrong multipliers leave it, all at
//!    once. The first active set is the previous one moved on by one sample, and mostly it stands.
//! 2. A sweep that raises the cost is replaced by a step to the first bound on the straight way: the cost never rises, which
//!    cuts the cycles of plain block methods ([`descent`]).
//! 3. What has not settled after a few sweeps goes to a method that cannot cycle: a dual active set that changes one bound at a
//!    time ([`dual`]), or, on long horizons, interior points on the same recursion ([`interior`]), with the dual active set
//!    behind them for vertices too degenerate for interior points to tell the bounds. Either way a sweep makes the answer exact.
//!
//! Where the range of an input is a multiple of its rate, vertices at which both bounds of an input meet are common; such a
//! corner fixes the inputs linked to it from its far end ([`active`]).
//!
//! # Thresholds
//!
//! Where comments on thresholds speak of random problems, these are the 10 000 that
//! `QP_CASES=5000 cargo test --release -p lpv-mpc --test qp_oracle -- --nocapture` compares with Clarabel; in the end it prints
//! how they came out: 9999 optimal, one flagged. The recorded ones are the 2533 samples of which `benches/qp` has excerpts, for
//! `cargo fmu bench --qp`.
//!
//! # References
//!
//! - \[Goldfarb\] D. Goldfarb, A. Idnani, "A numerically stable dual method for solving strictly convex quadratic programs",
//!   Math. Program. 27, 1983.
//! - \[Hintermueller\] M. Hintermueller, K. Ito, K. Kunisch, "The primal-dual active set strategy as a semismooth Newton method",
//!   SIAM J. Optim. 13, 2002: the block changes.
//! - \[Mehrotra\] S. Mehrotra, "On the implementation of a primal-dual interior point method", SIAM J. Optim. 2, 1992.
//! - \[Rao\] C. V. Rao, S. J. Wright, J. B. Rawlings, "Application of interior-point methods to model predictive control",
//!   J. Optim. Theory Appl. 99, 1998: the Riccati recursion inside such methods.

use super::{Outcome, Problem, Solution, Stage};
use active::{Active, Hold};
use dual::Dual;
use interior::Interior;
use nalgebra::SVector;
use policy::Policy;
use serde::{Deserialize, Serialize};
use warm_start::WarmStart;

mod active;
mod descent;
mod dual;
mod interior;
mod policy;
mod riccati;
mod rollout;
mod sweep;
mod tangent;
mod warm_start;

pub use tangent::{Perturbation, Tangent};

/// Sweeps of block changes before single changes take over. On the recorded problems at the limit of grip and saturated the 99th
/// percentile is lowest with 4 (`cargo fmu bench`, N = 10): with 5 it is up to a fifth higher, with 8 up to two fifths.
const SWEEPS_BEFORE_ROWS: u32 = 4;
/// Sweeps before interior points, which are dearer: with 4 or 8 what these settle of the recorded problems with N = 20 and 40
/// takes 3 to 9 % longer.
const SWEEPS_BEFORE_INTERIOR: u32 = 5;
/// Sweeps in which a set found otherwise has to stand; the second one mends what rounding left.
const CONFIRMING_SWEEPS: u32 = 3;
/// Inputs and soft bounds of all samples up to which single changes come before interior points. There are more changes on a
/// longer horizon, and each is dearer: at 60, `N = 20`, hard ones among the recorded problems take a quarter longer by them.
const DENSE_ROWS_MAX: usize = 45;
/// Scaled multiplier of the wrong sign that is rounding. By the same scale rounding leaves less than 1e-12 to free inputs, but
/// for 61 of the random problems; of the 237 000 wrong signs in their sweeps one is below 1e-7. With 1e-12 to 1e-8 they come out
/// alike.
const WRONG_SIGN: f64 = 1e-10;
/// Scaled stationarity up to which a plan is called optimal. Recorded problems settle below 1e-11, and so do the random ones but
/// for 15: twelve below 1e-8, three above 1e-7, which another method settles then. With 1e-7 they come out alike; with 1e-9 one
/// is left to interior points, with 1e-10 two more are flagged.
const STATIONARY: f64 = 1e-8;

/// Solver of [`Problem`] with its buffers and its warm start, which is all that is saved of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(into = "WarmStart", try_from = "WarmStart")]
pub struct Structured<const NX: usize, const NU: usize> {
    horizon: usize,
    /// Active set; between solves the warm start.
    active: Vec<[Active; NU]>, // N
    /// Sides of the soft bound on which the states lie.
    sides: Vec<i8>, // N
    /// Inputs of the last plan, where interior points start.
    inputs: Vec<[f64; NU]>, // N
    policies: Vec<Policy<NX, NU>>, // N
    /// Inputs that cannot move: always at a bound, whatever the sign of its multiplier.
    frozen: [bool; NU],
    /// Inputs that went from one of their bounds to the other in this solve.
    toggled: Vec<[bool; NU]>, // N
    /// Active set of the plan at hand before bounds were left, and after.
    kept: Vec<[Active; NU]>, // N
    left: Vec<[Active; NU]>, // N
    /// Sides of the plan at hand.
    left_sides: Vec<i8>, // N
    /// Where a sweep leads.
    x_target: Vec<SVector<f64, NX>>, // N + 1
    u_target: Vec<SVector<f64, NU>>, // N
    interior: Interior<NX, NU>,
    dual: Dual<NX, NU>,
}

impl<const NX: usize, const NU: usize> Structured<NX, NU> {
    /// Solver of problems with exactly `horizon` stages, without a warm start.
    #[must_use]
    pub fn new(horizon: usize) -> Self {
        Self {
            horizon,
            active: vec![[Active::NONE; NU]; horizon],
            sides: vec![0; horizon],
            inputs: vec![[0.0; NU]; horizon],
            policies: vec![Policy::ZERO; horizon],
            frozen: [false; NU],
            toggled: vec![[false; NU]; horizon],
            kept: vec![[Active::NONE; NU]; horizon],
            left: vec![[Active::NONE; NU]; horizon],
            left_sides: vec![0; horizon],
            x_target: vec![SVector::zeros(); horizon + 1],
            u_target: vec![SVector::zeros(); horizon],
            interior: Interior::new(horizon),
            dual: Dual::new(horizon),
        }
    }

    /// Solves the problem from the warm start at hand, which the solution replaces. Does not allocate when `solution` has
    /// room for the horizon.
    ///
    /// The outcome says what the answer is worth; without a plan the numbers of `solution` mean nothing.
    pub fn solve(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) {
        solution.resize(self.horizon);
        solution.iterations = 0;
        solution.residual = f64::INFINITY;
        solution.outcome = Outcome::Invalid;
        if problem.stages.len() != self.horizon || !problem.is_sensible() {
            return;
        }
        solution.x[0] = problem.x_0;
        for j in 0..NU {
            self.frozen[j] = problem.is_frozen(j);
        }
        // Numbers that are not finite always reach the residual, so only a solve that fails has to look for them.
        let sweeps = if self.is_dense() { SWEEPS_BEFORE_ROWS } else { SWEEPS_BEFORE_INTERIOR };
        if !self.descend(problem, solution, sweeps) {
            if !problem.is_valid() {
                solution.outcome = Outcome::Invalid;
                self.reset();
                return;
            }
            self.settle_otherwise(problem, solution);
        }
        if !solution.outcome.has_plan() {
            self.reset();
            return;
        }
        for (input, u) in self.inputs.iter_mut().zip(&solution.u) {
            *input = u.data.0[0];
        }
        let policy = &self.policies[0];
        solution.gain.data.0 = policy.K;
        solution.gain_u_prev.data.0 = policy.L;
    }

    /// Whether single changes come before interior points.
    fn is_dense(&self) -> bool {
        self.horizon * (NU + 1) <= DENSE_ROWS_MAX
    }

    /// Solves what block changes have not settled.
    fn settle_otherwise(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) {
        // The first sweep leaves a plan within the bounds and none of the following ones a worse one.
        if solution.iterations > 1 {
            for (input, u) in self.inputs.iter_mut().zip(&solution.u) {
                *input = u.data.0[0];
            }
        }
        if !self.is_dense() || !self.settle_by_rows(problem, solution) {
            self.solve_interior(problem, solution);
        }
    }

    /// Solves by the dual active set, from the active set at hand. Returns whether a sweep confirms what it finds.
    fn settle_by_rows(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) -> bool {
        self.find_active_set(problem, solution) && self.descend(problem, solution, CONFIRMING_SWEEPS)
    }
}

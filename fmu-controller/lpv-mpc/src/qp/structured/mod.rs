//! Structured solver: block active set on the Riccati recursion.

use super::{Outcome, Problem, Solution, Stage};
use active::{Active, Hold};
use interior::Interior;
use nalgebra::SVector;
use riccati::{Factor, Policy, Value};
use serde::{Deserialize, Serialize};

mod active;
mod descent;
mod interior;
mod riccati;
mod rollout;
mod sweep;

/// Solver of [`Problem`] with its buffers and its warm start.
#[derive(Clone, Debug)]
pub struct Structured<const NX: usize, const NU: usize> {
    horizon: usize,
    /// Active set; between solves the warm start.
    active: Vec<[Active; NU]>, // N
    /// Sides of the soft bound on which the states lie.
    sides: Vec<i8>, // N
    /// Inputs of the last plan, where interior points start.
    inputs: Vec<[f64; NU]>, // N
    policies: Vec<Policy<NX, NU>>,
    /// Inputs that went from one of their bounds to the other in this solve.
    toggled: Vec<[bool; NU]>,
    /// Active set of the plan at hand before bounds were left, and after.
    kept: Vec<[Active; NU]>,
    left: Vec<[Active; NU]>,
    /// Sides of the plan at hand.
    left_sides: Vec<i8>,
    /// Where a sweep leads.
    x_target: Vec<SVector<f64, NX>>, // N + 1
    u_target: Vec<SVector<f64, NU>>, // N
    interior: Interior<NX, NU>,
    pub limit: u32,
    pub stats: [u32; 8],
    pub trace: bool,
}

/// Small change of a problem's data, for [`Structured::tangent`]: each field is the differential of its namesake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Perturbation<const NX: usize, const NU: usize> {
    /// Change of prediction and reference, one element per sample of the horizon.
    pub stages: Vec<Stage<NX, NU>>,
    /// Change of the state now.
    pub x_0: SVector<f64, NX>,
    /// Change of the input applied before.
    pub u_prev: SVector<f64, NU>,
}

/// Scaled multiplier of the wrong sign that is rounding.
const WRONG_SIGN: f64 = 1e-9;
/// Scaled stationarity up to which a plan is called optimal.
const STATIONARY: f64 = 1e-8;

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
            toggled: vec![[false; NU]; horizon],
            kept: vec![[Active::NONE; NU]; horizon],
            left: vec![[Active::NONE; NU]; horizon],
            left_sides: vec![0; horizon],
            x_target: vec![SVector::zeros(); horizon + 1],
            u_target: vec![SVector::zeros(); horizon],
            interior: Interior::new(horizon),
            limit: 20,
            stats: [0; 8],
            trace: false,
        }
    }

    /// Solves the problem.
    pub fn solve(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) {
        solution.resize(self.horizon);
        solution.iterations = 0;
        if problem.stages.len() != self.horizon || !problem.is_valid() {
            solution.outcome = Outcome::Invalid;
            return;
        }
        solution.x[0] = problem.x_0;
        solution.outcome = Outcome::MaxIterations;
        if !self.descend(problem, solution, self.limit) {
            self.stats[0] += 1;
            self.solve_interior(problem, solution);
        }
        for i in 0..self.horizon {
            self.inputs[i] = solution.u[i].data.0[0];
        }
        let policy = &self.policies[0];
        solution.gain.data.0 = policy.K;
        solution.gain_u_prev.data.0 = policy.L;
    }

    /// Derivative of the first input along a small change of the problem just solved, on its final active set.
    #[must_use]
    pub fn tangent(
        &mut self,
        _problem: &Problem<NX, NU>,
        _solution: &Solution<NX, NU>,
        _perturbation: &Perturbation<NX, NU>,
    ) -> SVector<f64, NU> {
        SVector::zeros()
    }

    /// Moves the warm start on by one sample.
    pub fn shift(&mut self) {
        if self.horizon > 0 {
            self.active.copy_within(1.., 0);
            self.sides.copy_within(1.., 0);
            self.inputs.copy_within(1.., 0);
        }
    }

    /// Forgets the warm start.
    pub fn reset(&mut self) {
        self.active.fill([Active::NONE; NU]);
        self.sides.fill(0);
        self.inputs.fill([0.0; NU]);
    }
}

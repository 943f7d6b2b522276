//! Adaptive LPV model predictive control of steering and speed, after [Kebbati].
//!
//! The controller holds beliefs about a vehicle (its [`Parameters`]) and a prediction model that is a linear
//! parameter-varying embedding of the nonlinear single-track equations ([`model`]). Every `t_s` it predicts the measured
//! state over the latency that stands between measurement and action ([`latency`]), lines the model up along the previous
//! prediction, discretises it ([`discretise`]), solves one quadratic programme ([`qp`]) and gives the first command of the
//! optimal plan. [`Controller`] is the whole of it, one communication step at a time.
//!
//! Signs: x forward, y left, z up; yaw, steering and curvature positive to the left; `e_y` is the lateral position relative
//! to the path, positive to the left; `e_psi` is vehicle heading minus path heading. SI units and radians throughout.
//!
//! # References
//!
//! - \[Kebbati\] Y. Kebbati, N. Ait-Oufroukh, D. Ichalal, V. Vigneron, "RNN-based linear parameter varying adaptive model
//!   predictive control for autonomous driving". Its printed equations contain errors; where the code differs, the doc
//!   comment says so.
//! - \[Chu\] E. K.-W. Chu, H.-Y. Fan, W.-W. Lin, C.-S. Wang, "Structure-preserving algorithms for periodic discrete-time
//!   algebraic Riccati equations", International Journal of Control 77 (2004).
//! - \[Pacejka\] H. B. Pacejka, "Tire and Vehicle Dynamics", 3rd ed., Butterworth-Heinemann 2012: the similarity method, section
//!   4.2.
//! - \[Rajamani\] R. Rajamani, "Vehicle Dynamics and Control", 2nd ed., Springer 2012: steady-state cornering, section 3.3.
#![forbid(unsafe_code)]
#![allow(non_snake_case, reason = "matrices keep the paper's capitals")]

// What the tests of this crate share with those beside it names the crate from outside.
#[cfg(test)]
extern crate self as lpv_mpc;

pub mod adaptation;
mod ahead;
mod angles;
mod caution;
pub mod controller;
pub mod discretise;
mod error;
pub mod estimator;
mod feedforward;
mod friction;
mod grip;
mod guide;
pub mod hold;
mod horizon;
pub mod jordan;
mod ladder;
mod lanes;
pub mod latency;
mod lateness;
pub mod model;
mod modes;
pub mod mpc;
mod noise;
pub mod parameters;
mod plan;
pub mod preview;
pub mod qp;
#[cfg(test)]
#[path = "../tests/qp_support/mod.rs"]
mod qp_support;
mod recovery;
mod scalar;
mod sensitivity;
pub mod signals;
mod terminal;
pub mod trend;

pub use controller::Controller;
pub use error::Error;
pub use ladder::Status;
pub use modes::{Adaptation, Backend, Estimation, TerminalCost};
pub use parameters::Parameters;
pub use scalar::Scalar;
pub use signals::{Inputs, Output};

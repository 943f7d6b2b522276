//! The plant as mathematics: a nonlinear single-track vehicle on a road, with its actuators, its sensors and the wind.
//!
//! A [`Vehicle`] is built from [`Parameters`] and a [`Road`] and advanced one communication step at a time. It knows
//! nothing of FMI, files, clocks or threads; the same inputs give the same bits.
//!
//! # Signs and units
//! x forward, y left, z up; yaw, steering and curvature are positive to the left. `e_y` is the lateral position relative
//! to the path, positive to the left; `e_psi` is the vehicle's heading minus the path's. SI units and radians everywhere.
//!
//! # Where the paper is corrected
//! The printed equations of [Kebbati] diverge. The rows of its errata that concern the plant are corrected in
//! [`dynamics`] (slip angles, the factor kappa in `e_psi'`) and [`parameters`] (rolling resistance instead of `mu m g`).
//!
//! # References
//! - [Kebbati] Y. Kebbati et al., RNN-based linear parameter varying adaptive model predictive control for autonomous
//!   driving.
//! - [Pacejka] H. B. Pacejka, Tire and Vehicle Dynamics, 3rd edition, 2012.
//! - [Hucho] W.-H. Hucho (editor), Aerodynamics of Road Vehicles, 4th edition, 1998.
//! - [Hairer] E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd edition, 1993.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "citation keys stand in brackets, as the references list them")]

pub mod actuators;
pub mod aero;
mod cones;
pub mod dynamics;
mod error;
pub mod events;
pub mod integrate;
pub mod noise;
pub mod parameters;
mod plant;
pub mod road;
mod scalar;
mod show;
mod signals;
mod smooth;
pub mod tyre;

pub use error::Error;
pub use noise::Measurement;
pub use parameters::Parameters;
pub use plant::{STEP_MAX, State, Vehicle};
pub use road::{PREVIEW, Preview, Road};
pub use scalar::Scalar;
pub use signals::{Inputs, Outputs};

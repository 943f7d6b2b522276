//! A search for the least value of any function over a box: the paper's genetic algorithm, swarm and hybrid, and our default.
//!
//! A strategy is asked for points of the unit cube and told their values. All random draws happen in between evaluations, on
//! one stream, and results come back in the order of the points: a seed gives the same search for any number of threads. The
//! whole search is serialisable after each generation, which is what a checkpoint is.
//!
//! # References
//! - `[Kebbati]`: the paper; see README.md.
//! - `[Tanabe]`: R. Tanabe, A. Fukunaga: Improving the search performance of SHADE using linear population size reduction, 2014.
//! - `[Conn]`: A. R. Conn, K. Scheinberg, L. N. Vicente: Introduction to derivative-free optimization, 2009.
//! - `[Molga]`: M. Molga, C. Smutnicki: Test functions for optimization needs, 2005.

pub mod benchmark;
pub mod evolution;
pub mod functions;
pub mod genetic;
pub mod guided;
pub mod hybrid;
#[cfg(feature = "peers")]
pub mod peers;
pub mod quadratic;
pub mod random;
pub mod search;
pub mod space;
pub mod swarm;

use serde::{Deserialize, Serialize};

pub use search::Search;
pub use space::{Dimension, Space};

/// A point of the unit cube with its value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Where.
    pub point: Vec<f64>,
    /// What was found there.
    pub value: f64,
}

/// The first of the least.
fn best_of(candidates: &[Candidate]) -> Option<&Candidate> {
    candidates.iter().min_by(|a, b| a.value.total_cmp(&b.value))
}

//! The choices among methods that the user has.

use serde::{Deserialize, Serialize};

/// Where the axle stiffnesses of the prediction model come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Adaptation {
    /// The nominal stiffnesses, always.
    #[default]
    Constant,
    /// The network's answer at the measurement, held along the horizon, as in the paper.
    NetworkNow,
    /// The network rolled along the previous plan, one stage at a time.
    NetworkHorizon,
}

/// Where the state that the plan starts from comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Estimation {
    /// The measurement as it is, as in the paper.
    Measured,
    /// A Kalman filter, which also estimates the accelerations that the model cannot explain.
    #[default]
    Kalman,
}

/// Which solver answers first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Backend {
    /// The structured active-set solver of this crate.
    #[default]
    Structured,
    /// Clarabel, a general conic solver: slower by two orders of magnitude, useful as an independent check.
    Clarabel,
}

/// What the state at the end of the horizon costs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TerminalCost {
    /// The stage's weights times `terminal_factor`, as in the paper.
    #[default]
    StageWeights,
    /// What driving on costs, by the Riccati equation, times `terminal_factor`.
    Riccati,
}

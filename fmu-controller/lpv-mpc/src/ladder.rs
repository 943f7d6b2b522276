//! What is done when no optimal plan can be had, in steps of growing severity.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::Parameters;
use crate::model::{A_X, DELTA, Input};
use crate::qp::Outcome;

/// Deceleration of the safe stop [m/s2]: firm, yet half of what a dry road gives, so that a car whose state is unknown keeps
/// grip for the steering that it holds.
const SAFE_STOP_DECELERATION: f64 = 4.0;

/// How good the present command is: the first step of the ladder that held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The plan is optimal to rounding.
    #[default]
    Optimal,
    /// The plan is optimal to the tolerance of an interior point method, in the structured solver or in Clarabel.
    InteriorPoint,
    /// The plan is optimal, but some measurement was missing or not finite and its estimate was used instead.
    Estimated,
    /// No new plan; the previous one is executed further.
    PreviousPlan,
    /// Nothing of the previous plan is left: steering is held, the car brakes.
    SafeStop,
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Optimal => "optimal",
            Self::InteriorPoint => "optimal to the tolerance of an interior point method",
            Self::Estimated => "optimal for an estimate, a measurement is missing",
            Self::PreviousPlan => "the previous plan is executed further",
            Self::SafeStop => "safe stop, steering held",
        })
    }
}

impl Status {
    /// The status of a plan, made from a `complete` measurement or from an estimate.
    pub(crate) fn of(outcome: Outcome, complete: bool) -> Self {
        match outcome {
            Outcome::Optimal | Outcome::InteriorPoint if !complete => Self::Estimated,
            Outcome::Optimal => Self::Optimal,
            Outcome::InteriorPoint => Self::InteriorPoint,
            _ => Self::PreviousPlan,
        }
    }
}

/// The command of the safe stop: steering held, acceleration led to a firm braking at its rate limit, and to zero once the
/// car is known to stand.
pub(crate) fn safe_stop(u_prev: &Input, v_x: f64, p: &Parameters) -> Input {
    let stands = v_x.is_finite() && v_x <= 0.0;
    let wanted = if stands { 0.0 } else { (-SAFE_STOP_DECELERATION).max(p.a_x_min) };
    let step = p.a_x_rate_max * p.t_s;
    let a_x = u_prev[A_X] + (wanted - u_prev[A_X]).clamp(-step, step);
    Input::from([u_prev[DELTA], a_x])
}

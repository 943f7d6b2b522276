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
    /// The plan is optimal to the tolerance of an interior point method; a vertex where too many bounds meet has no other.
    InteriorPoint,
    /// The plan is optimal to the tolerance of Clarabel: it is the chosen solver, or the structured one found no plan, and the
    /// answer took some hundred times as long.
    SecondSolver,
    /// The plan is optimal, but some measurement was missing, not finite or unbelievable, and its estimate was used instead.
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
            Self::SecondSolver => "optimal to the tolerance of the second solver",
            Self::Estimated => "optimal for an estimate, a measurement is missing or not believed",
            Self::PreviousPlan => "the previous plan is executed further",
            Self::SafeStop => "safe stop, steering held",
        })
    }
}

impl Status {
    /// The status of a plan, made from a `complete` measurement or from an estimate.
    pub(crate) fn of(outcome: Outcome, complete: bool) -> Self {
        match outcome {
            outcome if outcome.is_solved() && !complete => Self::Estimated,
            Outcome::Optimal => Self::Optimal,
            Outcome::InteriorPoint => Self::InteriorPoint,
            Outcome::SecondSolver => Self::SecondSolver,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preview::Preview;
    use crate::{Adaptation, Backend, Controller, Inputs};

    #[test]
    fn statuses_grow_with_what_went_wrong() {
        let of = |outcome| Status::of(outcome, true);
        let ladder = [Outcome::Optimal, Outcome::InteriorPoint, Outcome::SecondSolver, Outcome::MaxIterations].map(of);
        assert!(ladder.is_sorted() && ladder[3] == Status::PreviousPlan, "{ladder:?}");
        assert_eq!([Outcome::Breakdown, Outcome::Invalid].map(of), [Status::PreviousPlan; 2]);
        // An estimate weighs more than which solver answered, and less than that none did.
        for solved in [Outcome::Optimal, Outcome::InteriorPoint, Outcome::SecondSolver] {
            assert_eq!(Status::of(solved, false), Status::Estimated);
            assert!(of(solved) < Status::Estimated && Status::Estimated < Status::PreviousPlan);
        }
        assert_eq!(Status::of(Outcome::Breakdown, false), Status::PreviousPlan);
    }

    #[test]
    fn the_second_solver_says_that_it_answered() {
        for (backend, expected) in [(Backend::Structured, Status::Optimal), (Backend::Clarabel, Status::SecondSolver)] {
            let parameters = Parameters { backend, adaptation: Adaptation::Constant, ..Parameters::default() };
            let mut controller = Controller::new(parameters, 0.0).unwrap();
            let inputs = Inputs { v_x: 15.0, v_x_ref: Preview::repeat(15.0), ..Inputs::default() };
            controller.advance(0.0, 0.033, &inputs).unwrap();
            assert_eq!(controller.output().status, expected);
        }
    }
}

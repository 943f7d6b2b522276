//! Predicted states and commands: to be executed, or to line the model up along.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use crate::model::{DELTA, Input};

/// Change of the planned steering from one sample to the next at which half of the new plan is scheduled [rad]. Lane change at
/// 20 m/s and 17 m/s: 4.9 and 1.8 cm; with 0.05: 5.6 and 3.0 cm; with 0.003: 49 and 6.4 cm, and starts far off the path are lost.
///
/// Where tyres saturate, or far off the path, the plan may alternate between two that contradict each other, each made around
/// the other; smaller changes are the ordinary ones.
const DAMPED: f64 = 0.01;

/// A plan that may be executed: predicted states and commands, and how many samples ago it was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan<const N_X: usize> {
    /// States, from the moment the first command acts to the end of the horizon.
    pub x: Vec<SVector<f64, N_X>>, // N + 1
    /// Commands.
    pub u: Vec<Input>, // N
    /// Samples since the plan was optimal; beyond the horizon nothing of it is left.
    pub age: usize,
}

impl<const N_X: usize> Plan<N_X> {
    /// Room for `horizon` samples, and nothing to execute.
    pub fn none(horizon: usize) -> Self {
        Self { x: vec![SVector::zeros(); horizon + 1], u: vec![Input::zeros(); horizon], age: horizon }
    }

    /// Whether something of the plan is left to execute.
    pub fn is_left(&self) -> bool {
        self.age < self.u.len()
    }

    /// Nothing of it is left any more.
    pub fn forget(&mut self) {
        self.age = self.u.len();
    }

    /// Moves on by one sample; the end is repeated.
    pub fn shift(&mut self) {
        self.x.rotate_left(1);
        self.u.rotate_left(1);
        if let [.., before, last] = &mut self.x[..] {
            *last = *before;
        }
        if let [.., before, last] = &mut self.u[..] {
            *last = *before;
        }
        self.age += 1;
    }

    /// Becomes `plan`, and less of it the more its steering differs from what stands here.
    #[inline(always)]
    pub fn take(&mut self, plan: &Self) {
        let steering = plan.u.iter().zip(&self.u).map(|(planned, scheduled)| (planned - scheduled)[DELTA].abs());
        let largest = steering.fold(0.0, |largest, change| if change > largest { change } else { largest });
        let share = if self.is_left() { (1.0 + largest / DAMPED).recip() } else { 1.0 };
        // Written so that all of the plan is the plan, to the last bit and whatever was scheduled before.
        let mix = |before: f64, planned: f64| if share < 1.0 { before + share * (planned - before) } else { planned };
        for (scheduled, planned) in self.x.iter_mut().zip(&plan.x) {
            scheduled.zip_apply(planned, |scheduled, planned| *scheduled = mix(*scheduled, planned));
        }
        for (scheduled, planned) in self.u.iter_mut().zip(&plan.u) {
            scheduled.zip_apply(planned, |scheduled, planned| *scheduled = mix(*scheduled, planned));
        }
        self.x[0] = plan.x[0];
        self.age = 0;
    }
}

//! How the steering of a car moves that follows the path exactly: the increments that cost nothing.
//!
//! [Kebbati] weighs the increments of the steering against zero. On a winding path the cheapest plan then steers late and too
//! little, and leaves the path by as much as that saves. Weighed against the increments that the path itself asks for, the weight
//! damps what comes on top of them alone, noise and corrections, and the path is followed whatever the weight is. (Lane
//! change at 15.5 m/s: 0.1 cm instead of 1.2; general track: root mean square 0.01 cm instead of 0.04.)
//!
//! The ideal car has no lateral error. Its heading error then is minus its sideslip angle `beta`, its yaw rate is
//! `v kappa - beta'`, and force and moment on it are known from the curvature and its rate. The rear tyres give their part of
//! the force at a slip that follows from `beta` alone, which leaves the zero dynamics of the path:
//!
//! ```text
//! i_z beta'' + C_r l_r (l_f + l_r) / v beta' + C_r (l_f + l_r) beta
//!     = C_r l_r (l_f + l_r) kappa + F_r0 (l_f + l_r) - l_f F + i_z (v kappa' - d_r),    F = m (v^2 kappa - d_y)
//! ```
//!
//! with the affine tyres of the stages and the unexplained accelerations `d`; what braking adds, `m v' beta` and `i_z v' kappa`,
//! is left out, a thousandth of a radian at 5 m/s2. The dynamics are stable: followed along the plan, they give the slip of the
//! front tyres, and with it the steering.

mod sideslip;

use serde::{Deserialize, Serialize};

use crate::Scalar;
use crate::guide::Path;
use crate::model::{Body, Disturbance, State, Tyres, V_GUARD, V_X, V_Y};
use sideslip::Sideslip;

/// Difference of the sideslip angles from which on the car is not the ideal one [rad].
///
/// A car that slides is not helped by what an ideal one would steer: with 0.05 the lane change at 17 m/s and a steering rate of
/// 0.5 rad/s (`cargo fmu robustness --case grip_17`) grows from 3.3 to 4.2 cm. With 0.01 it falls to 2.5, and the general track
/// with delays that are assumed wrong grows from 29.5 to 30.3 (`--case fast_wrong`).
const APART: f64 = 0.02;

/// The stage before the present sample's first one, for the first increment.
///
/// Driven again with what is believed now: a change of belief is no increment that the path asks for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Past {
    /// At its beginning.
    sideslip: Sideslip,
    /// Curvature at its beginning and end [1/m].
    kappa: [f64; 2],
    /// Increment of the steering that led to it [rad].
    increment: f64,
}

impl Past {
    /// Nothing, if a number is none: one bad sample must not spoil the next.
    fn checked(self) -> Option<Self> {
        let Self { sideslip: Sideslip { beta, rate }, kappa: [from, to], increment } = self;
        [beta, rate, from, to, increment].iter().all(|value| value.is_finite()).then_some(self)
    }
}

/// What holds in the stage before a plan's first one, as far as it is known now.
#[derive(Clone, Copy, Debug)]
pub struct Before<T: Scalar> {
    /// Speed [m/s].
    pub v_x: T,
    /// Accelerations that the model cannot explain.
    pub disturbance: Disturbance<T>,
}

/// Follows the path along the stages of a plan.
pub struct FeedForward<'a, T: Scalar> {
    body: &'a Body,
    /// Period of the plan [s].
    period: f64,
    past: Option<Past>,
    before: Before<T>,
    sideslip: Sideslip<T>,
    /// Steering angle in the stage before [rad]; none before the first one.
    steering: Option<T>,
    /// Sideslip of the real car, and what the ideal one has over it at the beginning [rad].
    beta: T,
    apart: T,
    /// True speed over the guarded one of the slip angles [1].
    ratio: T,
    next: Option<Past>,
}

impl<'a, T: Scalar> FeedForward<'a, T> {
    /// Before the first stage of a plan from the state `x`. Without a `past` the ideal car begins with its sideslip.
    pub fn new(body: &'a Body, period: f64, x: &State<T>, past: Option<Past>, before: Before<T>) -> Self {
        let guarded = x[V_X].larger(V_GUARD);
        let beta = x[V_Y] / guarded;
        let sideslip = Sideslip { beta, rate: T::zero() };
        let (apart, ratio) = (T::zero(), x[V_X] / guarded);
        Self { body, period, past, before, sideslip, steering: None, beta, apart, ratio, next: None }
    }

    /// Increment of the steering from the stage before to the next one, which is driven at `v_x` [m/s] with these tyres [rad].
    #[inline(always)]
    pub fn advance(&mut self, v_x: T, path: &Path<T>, tyres: &Tyres<T>) -> T {
        let Self { body, period, .. } = *self;
        let first = self.next.is_none();
        if let Some(Past { sideslip, kappa, .. }) = self.past.filter(|_| first) {
            self.sideslip = Sideslip { beta: T::from(sideslip.beta), rate: T::from(sideslip.rate) };
            let kappa = kappa.map(T::from);
            let Before { v_x, disturbance } = &self.before;
            self.steering = Some(self.sideslip.advance(*v_x, &kappa, disturbance, tyres, body, period));
            self.apart = self.sideslip.beta * self.ratio - self.beta;
        }
        let Sideslip { beta, rate } = self.sideslip;
        let steering = self.sideslip.advance(v_x, &path.kappa, &path.disturbance, tyres, body, period);
        let before = self.steering.replace(steering).unwrap_or(steering);
        let increment = steering - before;
        if first {
            let sideslip = Sideslip { beta: beta.re(), rate: rate.re() };
            let kappa = path.kappa.map(|kappa| kappa.re());
            self.next = Some(Past { sideslip, kappa, increment: increment.re() });
        }
        increment
    }

    /// Makes increments of commands from those of all stages, when steering leaves `decay` of its distance to the command after a
    /// period and moves by at most `bound` in it [rad]. Returns what the next sample needs.
    ///
    /// What the steering cannot follow is no reference. By the square of the share that makes the largest increment possible all
    /// are reduced, and again from the first impossible one on by that of the largest so far. (Lane change with a steering rate
    /// of 0.5 rad/s at 16 and 17 m/s: 1.8 and 3.3 cm; with the first reduction alone 2.9 and 7.5, with the second alone 3.8 and
    /// 16.4; with the fourth power of the first one 1.3 and 3.3, but the network that is held over the plan falls behind
    /// constant stiffness in two situations of `cargo fmu campaign`.)
    pub fn executable(self, increments: &mut [T], decay: f64, bound: f64) -> Option<Past> {
        if decay > 0.0 {
            // What is delivered moves in the mean of the stages before and after.
            let mut before = self.past.map_or(increments[0], |past| (increments[0] + past.increment) * 0.5);
            for i in 0..increments.len() {
                let next = if i + 1 < increments.len() { increments[i + 1] } else { increments[i] };
                let delivered = (increments[i] + next) * 0.5;
                increments[i] = (delivered - before * decay) * (1.0 - decay).recip();
                before = delivered;
            }
        }
        let larger = |largest: T, next: &T| if next.re().abs() > largest.re() { next.abs() } else { largest };
        let possible = |largest: T| if largest.re() > bound { (T::from(bound) / largest).powi(2) } else { T::one() };
        let near = (self.apart * self.apart * (APART * APART).recip() + 1.0).recip();
        let share = near * possible(increments.iter().fold(T::zero(), larger));
        let mut largest = T::zero();
        for increment in increments {
            largest = larger(largest, increment);
            *increment *= share * possible(largest);
        }
        self.next.and_then(Past::checked)
    }
}

#[cfg(test)]
mod tests;

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
//! with the affine tyres of the stages and the unexplained accelerations `d`. They are stable: followed along the plan, they give
//! the slip of the front tyres, and with it the steering.

use serde::{Deserialize, Serialize};

use crate::Scalar;
use crate::guide::Path;
use crate::model::{Body, Disturbance, State, Tyres, V_GUARD, V_X, V_Y};

/// Difference of the sideslip angles from which on the car is not the ideal one [rad].
///
/// A car that slides is not helped by what an ideal one would steer: with 0.05 the lane change at 17 m/s and a steering rate of
/// 0.5 rad/s grows from 5.0 to 6.7 cm; with 0.01 the network that is held over the plan falls behind constant stiffness in one of
/// the 34 situations of `cargo fmu campaign`.
const APART: f64 = 0.02;

/// Sideslip of a car that does not leave the path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Sideslip<T = f64> {
    /// Sideslip angle [rad].
    beta: T,
    /// Its rate [rad/s].
    rate: T,
}

/// The stage before the present sample's first one, for the first increment.
///
/// Driven again with what is believed now: a change of belief is no increment that the path asks for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Past {
    /// At its beginning.
    sideslip: Sideslip,
    /// Curvature at its beginning and end [1/m].
    kappa: [f64; 2],
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
    period: f64,
    past: Option<Past>,
    before: Before<T>,
    sideslip: Sideslip<T>,
    /// Steering angle in the stage before [rad]; none before the first one.
    steering: Option<T>,
    /// Sideslip of the ideal car over that of the real one at the beginning [rad].
    apart: T,
    next: Option<Past>,
}

impl<'a, T: Scalar> FeedForward<'a, T> {
    /// Before the first stage of a plan from the state `x`. Without a `past` the ideal car begins with its sideslip.
    pub fn new(body: &'a Body, period: f64, x: &State<T>, past: Option<Past>, before: Before<T>) -> Self {
        let beta = x[V_Y] / x[V_X].larger(V_GUARD);
        let sideslip = Sideslip { beta, rate: T::zero() };
        Self { body, period, past, before, sideslip, steering: None, apart: beta, next: None }
    }

    /// Increment of the steering from the stage before to the next one, which is driven at `v_x` [m/s] with these tyres [rad].
    #[inline(always)]
    pub fn advance(&mut self, v_x: T, path: &Path<T>, tyres: &Tyres<T>) -> T {
        let Self { body, period, .. } = *self;
        let first = self.next.is_none();
        if let Some(Past { sideslip, kappa }) = self.past.filter(|_| first) {
            self.sideslip = Sideslip { beta: T::from(sideslip.beta), rate: T::from(sideslip.rate) };
            let kappa = kappa.map(T::from);
            let Before { v_x, disturbance } = &self.before;
            self.steering = Some(self.sideslip.advance(*v_x, &kappa, disturbance, tyres, body, period));
        }
        if first {
            self.apart = self.sideslip.beta - self.apart;
            let Sideslip { beta, rate } = self.sideslip;
            let sideslip = Sideslip { beta: beta.re(), rate: rate.re() };
            self.next = Some(Past { sideslip, kappa: path.kappa.map(|kappa| kappa.re()) });
        }
        let steering = self.sideslip.advance(v_x, &path.kappa, &path.disturbance, tyres, body, period);
        let before = self.steering.replace(steering).unwrap_or(steering);
        steering - before
    }

    /// Makes increments of commands from those of all stages, when steering leaves `decay` of its distance to the command after a
    /// period and moves by at most `bound` in it [rad]. Returns what the next sample needs.
    ///
    /// What the steering cannot follow is no reference: as little of all increments as makes the largest one possible, squared.
    /// (Lane change at 17 m/s with a steering rate of 0.5 rad/s: 5.0 cm; not squared 10.4, cut off one by one 14.1.)
    pub fn executable(self, increments: &mut [T], decay: f64, bound: f64) -> Option<Past> {
        if decay > 0.0 {
            let mut before = increments[0];
            for i in 0..increments.len() {
                let next = if i + 1 < increments.len() { increments[i + 1] } else { increments[i] };
                let delivered = (increments[i] + next) * 0.5;
                increments[i] = (delivered - before * decay) * (1.0 - decay).recip();
                before = delivered;
            }
        }
        let larger = |largest: T, next: &T| if next.re().abs() > largest.re() { next.abs() } else { largest };
        let largest = increments.iter().fold(T::zero(), larger);
        let mut share = (self.apart * self.apart * (APART * APART).recip() + 1.0).recip();
        if largest.re() > bound {
            share *= (largest.recip() * bound).powi(2);
        }
        for increment in increments {
            *increment *= share;
        }
        self.next
    }
}

impl<T: Scalar> Sideslip<T> {
    /// Steering angle of the ideal car in the middle of a stage [rad], to the end of which it moves on.
    #[inline(always)]
    fn advance(
        &mut self,
        v_x: T,
        kappa: &[T; 2],
        disturbance: &Disturbance<T>,
        tyres: &Tyres<T>,
        body: &Body,
        period: f64,
    ) -> T {
        let Body { m, i_z, l_f, l_r, .. } = *body;
        let Tyres { c_f, c_r, f_f0, f_r0 } = *tyres;
        let (l, v) = (l_f + l_r, v_x.larger(V_GUARD));
        let per_v = v.recip();
        let bend = (kappa[0] + kappa[1]) * 0.5;
        let force = (v * v * bend - disturbance[1]) * m;
        let turn = v * (kappa[1] - kappa[0]) * period.recip() - disturbance[2];
        // The trapezoidal rule is stable for every damping, and the dynamics of slow cars are stiff.
        let inertia = i_z / (l * period);
        let damping = c_r * (per_v * (0.5 * l_r) + 0.25 * period);
        let drive = c_r * (bend * l_r - self.beta) + f_r0 - (force * l_f - turn * i_z) * l.recip();
        let rate = (self.rate * (-damping + inertia) + drive) / (damping + inertia);
        let mean = (self.rate + rate) * 0.5;
        let beta = self.beta + mean * (0.5 * period);
        let yaw = bend - mean * per_v;
        let f_f = force - (c_r * (yaw * l_r - beta) + f_r0);
        *self = Self { beta: self.beta + mean * period, rate };
        (f_f - f_f0) / c_f + beta + yaw * l_f
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parameters;
    use crate::model::{E_Y, Input, derivative};

    const PERIOD: f64 = 0.033;
    const V: f64 = 15.0;

    fn body() -> Body {
        Parameters::default().body()
    }

    fn tyres() -> Tyres {
        Tyres::secant(1.0e5, 7.6e4)
    }

    /// Curvature of a slalom that asks for 2.2 m/s2 [1/m].
    fn slalom(t: f64) -> f64 {
        0.01 * (0.5 * t).min(1.0).powi(3) * (2.5 * t).sin()
    }

    /// Ends of a stage on a road of this curvature.
    fn ends(kappa: impl Fn(f64) -> f64, i: usize) -> [f64; 2] {
        [i, i + 1].map(|i| kappa(i as f64 * PERIOD))
    }

    fn path(kappa: [f64; 2]) -> Path<f64> {
        Path { kappa, mu: 0.82, wanted: V, v_x: V, disturbance: Disturbance::zeros() }
    }

    fn straight_ahead(past: Option<Past>, body: &Body) -> FeedForward<'_, f64> {
        let x = State::from([V, 0.0, 0.0, 0.0, 0.0]);
        FeedForward::new(body, PERIOD, &x, past, Before { v_x: V, disturbance: Disturbance::zeros() })
    }

    /// Increments for a car that begins straight ahead.
    fn increments(kappa: impl Fn(f64) -> f64, stages: usize) -> Vec<f64> {
        let body = body();
        let mut ideal = straight_ahead(None, &body);
        (0..stages).map(|i| ideal.advance(V, &path(ends(&kappa, i)), &tyres())).collect()
    }

    /// Largest lateral error [m] of the model on the slalom when it is steered by increments alone, at constant speed.
    fn open_loop(increments: &[f64]) -> f64 {
        const PIECES: usize = 100;
        let (body, h) = (body(), PERIOD / PIECES as f64);
        let mut x = State::from([V, 0.0, 0.0, 0.0, 0.0]);
        let (mut delta, mut worst) = (0.0, 0.0_f64);
        for (i, increment) in increments.iter().enumerate() {
            delta += increment;
            let [from, to] = ends(slalom, i);
            for k in 0..PIECES {
                let rate = |x: &State, part: f64| {
                    let kappa = from + (to - from) * (k as f64 + part) / PIECES as f64;
                    let mut rate =
                        derivative(x, &Input::from([delta, 0.0]), kappa, &body, &tyres(), &Disturbance::zeros());
                    rate[V_X] = 0.0;
                    rate
                };
                let middle = x + rate(&x, 0.0) * (0.5 * h);
                x += rate(&middle, 0.5) * h;
            }
            worst = worst.max(x[E_Y].abs());
        }
        worst
    }

    #[test]
    fn a_car_that_is_steered_by_the_increments_alone_stays_on_the_path() {
        let stages = 120;
        let wheelbase = body().l_f + body().l_r;
        let geometry = |i: usize| {
            let [from, to] = ends(slalom, i);
            wheelbase * (to - from)
        };
        // The trapezoidal rule on the preview's straight lines; the large angles that the ideal car does not know are 0.1 rad.
        let (ideal, geometric) =
            (open_loop(&increments(slalom, stages)), open_loop(&(0..stages).map(geometry).collect::<Vec<_>>()));
        assert!(ideal < 1e-3, "{ideal} m");
        assert!(geometric > 0.1, "the slalom must be one: {geometric} m");
    }

    #[test]
    fn a_steady_turn_takes_the_angle_of_the_understeer_gradient() {
        let kappa = 0.01;
        let total: f64 = increments(|t| kappa * (0.5 * t).min(1.0).powi(3), 200).iter().sum();
        let (Body { m, l_f, l_r, .. }, Tyres { c_f, c_r, .. }) = (body(), tyres());
        let l = l_f + l_r;
        let expected = kappa * (l + m * V * V * (l_r / c_f - l_f / c_r) / l);
        // The first stage's own angle is no increment: a part in 10^5 of the curvature, and in 10^4 of its rate.
        assert!((total - expected).abs() < 1e-3 * expected, "{total} for {expected}");
    }

    #[test]
    fn plans_of_two_samples_agree_on_their_common_stages() {
        let (body, stages) = (body(), 20);
        let plan = |first: usize, past: Option<Past>| {
            let mut ideal = straight_ahead(past, &body);
            let all: Vec<f64> =
                (first..first + stages).map(|i| ideal.advance(V, &path(ends(slalom, i)), &tyres())).collect();
            (all, ideal.next)
        };
        let mut past = None;
        let mut before = Vec::new();
        for first in 0..40 {
            let (now, next) = plan(first, past);
            for (before, now) in before.iter().skip(1).zip(&now) {
                // The same operations on the same numbers.
                assert_eq!(before, now, "plan {first}");
            }
            (past, before) = (next, now);
        }
    }

    #[test]
    fn wind_that_is_steady_asks_for_no_increment() {
        let body = body();
        let gale = Disturbance::from([0.0, 2.0, 0.3]);
        let x = State::from([V, 0.0, 0.0, 0.0, 0.0]);
        let mut past = None;
        for _ in 0..200 {
            let mut ideal = FeedForward::new(&body, PERIOD, &x, past, Before { v_x: V, disturbance: gale });
            let increment = ideal.advance(V, &Path { disturbance: gale, ..path([0.0; 2]) }, &tyres());
            let next = ideal.next;
            if past.is_some_and(|past| next.is_some_and(|next| (past.sideslip.beta - next.sideslip.beta).abs() < 1e-9))
            {
                assert!(increment.abs() < 1e-7, "{increment}");
                return;
            }
            past = next;
        }
        panic!("the sideslip must settle");
    }

    #[test]
    fn what_the_steering_cannot_follow_is_reduced_as_a_whole() {
        let body = body();
        let mut all = increments(slalom, 40);
        let whole = all.clone();
        let largest = all.iter().fold(0.0_f64, |largest, increment| largest.max(increment.abs()));
        straight_ahead(None, &body).executable(&mut all, 0.0, 2.0 * largest);
        assert_eq!(all, whole);
        straight_ahead(None, &body).executable(&mut all, 0.0, 0.5 * largest);
        for (reduced, whole) in all.iter().zip(&whole) {
            assert!((reduced - 0.25 * whole).abs() < 1e-15);
        }
    }

    #[test]
    fn commands_behind_a_lag_deliver_the_ideal_steering_in_the_mean_of_each_stage() {
        let body = body();
        let ideal = increments(slalom, 60);
        let mut commands = ideal.clone();
        let decay = (-PERIOD / 0.1_f64).exp();
        straight_ahead(None, &body).executable(&mut commands, decay, f64::INFINITY);
        let (mut wanted, mut command, mut delivered) = (0.0, 0.0, 0.0);
        for (i, (ideal, increment)) in ideal.iter().zip(&commands).enumerate() {
            wanted += ideal;
            command += increment;
            let end = command + (delivered - command) * decay;
            // From its nodes to its middle a stage differs by an eighth of the second difference of the steering: 1 % of it here.
            assert!((0.5 * (delivered + end) - wanted).abs() < 1e-3, "stage {i}: {delivered} to {end} for {wanted}");
            delivered = end;
        }
    }

    #[test]
    fn a_car_that_slides_is_not_helped() {
        let body = body();
        let x = State::from([V, 3.0, 0.0, 0.0, 0.0]);
        let past = Past { sideslip: Sideslip { beta: 0.0, rate: 0.0 }, kappa: [0.0; 2] };
        let mut ideal =
            FeedForward::new(&body, PERIOD, &x, Some(past), Before { v_x: V, disturbance: Disturbance::zeros() });
        let whole = ideal.advance(V, &path([0.0, 1e-3]), &tyres());
        let mut increments = [whole];
        ideal.executable(&mut increments, 0.0, 1.0);
        // 0.2 rad apart: one in 1 + 10^2.
        assert!((increments[0] - whole / 101.0).abs() < 1e-12 && whole.abs() > 1e-3, "{increments:?} of {whole}");
    }
}

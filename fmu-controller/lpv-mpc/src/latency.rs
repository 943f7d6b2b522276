//! What happens between a measurement and the action of the command that it leads to.
//!
//! A co-simulation importer shows a command at the end of the step that begins at the measurement, and the actuators add
//! their own delay. Until then the car is driven by commands that are already on their way. [`Latency`] remembers them,
//! follows the actuators' lags, and moves the measured state on to the moment at which the next command acts.

use serde::{Deserialize, Serialize};

use crate::Scalar;
use crate::hold::decay;
use crate::lateness::LATE_MAX;
use crate::model::{Body, DELTA, Input, NU, Point, State, Tyres, V_X, fastest_rate};
use crate::trend::Trend;

/// Largest product of an integration step and the rate of the fastest mode [1]: a step then leaves 0.5^5 / 5! = 3e-4 of
/// that mode, and far less of the slow ones that carry the car.
const STEP_RATE_MAX: f64 = 0.5;

/// Most integration steps of a prediction [1], a millisecond's work. The stiffest tyre preset takes one for each 12 ms. A car
/// whose modes need more than this is not followed any more; its plan is refused where that shows.
const STEPS_MAX: f64 = 1e4;

/// Times closer than this are one [s]: importers add up steps in floating point.
const SAME_TIME: f64 = 1e-9;

/// Commands on their way and the state of the actuators.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Latency {
    /// Delay of the actuators [s].
    delay: f64,
    /// How much later than that the steering acts [s].
    late: f64,
    /// Time constants of the actuators [s].
    tau: [f64; NU],
    /// Commands and the times at which they begin to act, oldest first [s].
    commands: Vec<(f64, Input)>,
    /// What the actuators deliver.
    actual: Input,
    /// Time to which `actual` belongs [s].
    time: f64,
}

/// A predicted state with what the actuators deliver then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted<T = f64> {
    /// Vehicle state.
    pub x: State<T>,
    /// Way along the path since the measurement [m].
    pub distance: T,
    /// Actual steering angle [rad] and acceleration [m/s2].
    pub actual: Input,
}

impl Latency {
    /// No command yet, actuators at rest at time `start` [s]; `period` [s] bounds how many commands can be on their way.
    pub fn new(start: f64, delay: f64, tau: [f64; NU], period: f64) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a delay of at most 1.15 s in periods"
        )]
        let on_their_way = ((delay + LATE_MAX) / period).ceil() as usize;
        Self {
            delay,
            late: 0.0,
            tau,
            // One acts, one has just been given, one rounds.
            commands: Vec::with_capacity(on_their_way + 3),
            actual: Input::zeros(),
            time: start,
        }
    }

    /// From now on the steering acts `late` [s] after its delay, at most [`LATE_MAX`].
    pub fn set_late(&mut self, late: f64) {
        self.late = late;
    }

    /// Time from a measurement until the command that it leads to acts, when it becomes visible after `step` [s].
    pub fn until_acting(&self, step: f64) -> f64 {
        step + self.delay + self.late
    }

    /// A command becomes visible at time `t` [s].
    pub fn send(&mut self, t: f64, command: Input) {
        let acts = t + self.delay;
        // A sample within the same communication step replaces what nobody has seen yet.
        if let Some(last) = self.commands.last_mut().filter(|(time, _)| *time >= acts - SAME_TIME) {
            *last = (acts, command);
        } else {
            self.commands.push((acts, command));
        }
    }

    /// Moves the actuators on to time `t` [s] and forgets commands that no longer matter.
    ///
    /// Returns how long that was [s] and what the actuators delivered in the mean.
    pub fn advance(&mut self, t: f64) -> (f64, Input) {
        let duration = t - self.time;
        let mut sum = Input::zeros();
        let mut now = self.time;
        while now < t - SAME_TIME {
            let (command, until) = self.acting(now, f64::INFINITY);
            let next = until.min(t);
            sum += lag_integral(&self.actual, &command, next - now, &self.tau);
            self.actual = lag(&self.actual, &command, next - now, &self.tau);
            now = next;
        }
        self.time = t;
        let acting = self.commands.iter().rposition(|(acts, _)| *acts <= t - LATE_MAX + SAME_TIME);
        self.commands.drain(..acting.unwrap_or(0));
        let mean = if now > t - duration { sum / duration } else { self.actual };
        (duration, mean)
    }

    /// What acts at time `t` [s] and the time at which something else takes over [s], of the commands that are due before the time
    /// `known` [s].
    fn acting(&self, t: f64, known: f64) -> (Input, f64) {
        let (mut command, mut until) = if t < known - SAME_TIME {
            let (command, until) = self.due(t);
            (command, until.min(known))
        } else {
            (self.due(known - 2.0 * SAME_TIME).0, f64::INFINITY)
        };
        if self.late > 0.0 {
            let (steering, next) = self.due(t - self.late);
            command[DELTA] = steering[DELTA];
            // At times of 1e9 s, as clocks have, the sum may round to no later than now.
            until = until.min((next + self.late).max(t.next_up()));
        }
        (command, until)
    }

    /// The command that is due at time `t` [s] and the time at which the next one is [s].
    fn due(&self, t: f64) -> (Input, f64) {
        let next = self.commands.partition_point(|(acts, _)| *acts <= t + SAME_TIME);
        let command = match next {
            0 => Input::zeros(),
            _ => self.commands[next - 1].1,
        };
        (command, self.commands.get(next).map_or(f64::INFINITY, |(acts, _)| *acts))
    }

    /// Moves the state `x` at the time of the last [`advance`](Self::advance) on by `step` [s] and the delay.
    ///
    /// `kappa` gives the curvature [1/m] at a distance from the place of the measurement [m].
    #[inline(always)]
    pub fn predict<T: Scalar>(
        &self,
        x: &State<T>,
        step: f64,
        kappa: impl Fn(T) -> T,
        body: &Body,
        tyres: &Tyres<T>,
        trend: &Trend<T>,
    ) -> Predicted<T> {
        // The next command is due before late steering acts; the drive is held until then, as it is not known yet.
        let known = self.time + step + self.delay;
        let end = known + self.late;
        let rate = fastest_rate(x[V_X].re(), body, tyres).min(STEPS_MAX * STEP_RATE_MAX / (end - self.time));
        let mut at = Predicted { x: *x, distance: T::zero(), actual: self.actual };
        let mut now = self.time;
        while now < end - SAME_TIME {
            let (command, until) = self.acting(now, known);
            let piece = until.min(end) - now;
            let steps = (piece * rate / STEP_RATE_MAX).ceil().max(1.0);
            let h = piece / steps;
            let mut done = 0.0;
            while done < steps {
                let disturbance = trend.after(now - self.time + (done + 0.5) * h);
                let f = |x: &State<T>, u: &Input, distance: T| {
                    let kappa = kappa(distance);
                    Point::new(*x, u.map(T::from), body).motion(kappa, tyres, &disturbance)
                };
                at = self.runge_kutta(&at, &command, h, f);
                done += 1.0;
            }
            now += piece;
        }
        at
    }

    /// One classic Runge-Kutta step of state and distance, `(x', s') = f(x, u, s)`, behind the lags.
    #[inline(always)]
    fn runge_kutta<T: Scalar>(
        &self,
        at: &Predicted<T>,
        command: &Input,
        h: f64,
        f: impl Fn(&State<T>, &Input, T) -> (State<T>, T),
    ) -> Predicted<T> {
        let left = self.tau.map(|tau| decay(h / 2.0, tau));
        let middle = follow(&at.actual, command, left);
        let end = follow(&at.actual, command, left.map(|left| left * left));
        // Without a lag the command acts from the first moment on.
        let start = follow(&at.actual, command, self.tau.map(|tau| if tau > 0.0 { 1.0 } else { 0.0 }));
        let rate =
            |slope: (State<T>, T), h: f64, u: &Input| f(&(at.x + slope.0 * T::from(h)), u, at.distance + slope.1 * h);
        let k1 = f(&at.x, &start, at.distance);
        let k2 = rate(k1, h / 2.0, &middle);
        let k3 = rate(k2, h / 2.0, &middle);
        let k4 = rate(k3, h, &end);
        Predicted {
            x: at.x + (k1.0 + (k2.0 + k3.0) * T::from(2.0) + k4.0) * T::from(h / 6.0),
            distance: at.distance + (k1.1 + (k2.1 + k3.1) * 2.0 + k4.1) * (h / 6.0),
            actual: end,
        }
    }
}

/// What first-order lags deliver in the sum over `h` [s] [rad s, m/s].
fn lag_integral(actual: &Input, command: &Input, h: f64, tau: &[f64; NU]) -> Input {
    Input::from_fn(|j, _| {
        let distance = if tau[j] > 0.0 { (actual[j] - command[j]) * -(-h / tau[j]).exp_m1() * tau[j] } else { 0.0 };
        command[j] * h + distance
    })
}

/// First-order lags over `h` [s], exact for a held command.
fn lag(actual: &Input, command: &Input, h: f64, tau: &[f64; NU]) -> Input {
    follow(actual, command, tau.map(|tau| decay(h, tau)))
}

/// Lags after a while that leaves these shares of their distances to the command.
fn follow(actual: &Input, command: &Input, left: [f64; NU]) -> Input {
    Input::from_fn(|j, _| command[j] + (actual[j] - command[j]) * left[j])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parameters;
    use crate::model::Disturbance;

    fn predict(latency: &Latency, step: f64) -> Predicted {
        let p = Parameters::default();
        let x = State::from([15.0, 0.1, 0.05, 0.2, 0.02]);
        latency.predict(&x, step, |_| 0.01, &p.body(), &p.nominal_tyres(), &Trend::steady(Disturbance::zeros()))
    }

    #[test]
    fn a_delay_shifts_when_commands_act() {
        let mut latency = Latency::new(0.0, 0.05, [0.0; 2], 0.033);
        latency.send(0.001, Input::from([0.1, 1.0]));
        let acting = |latency: &Latency, t| latency.acting(t, f64::INFINITY).0;
        assert_eq!(acting(&latency, 0.050), Input::zeros());
        assert_eq!(acting(&latency, 0.051), Input::from([0.1, 1.0]));
        latency.send(0.034, Input::from([0.2, 2.0]));
        latency.advance(0.09);
        assert_eq!(acting(&latency, 0.09), Input::from([0.2, 2.0]));
        // The steering may be late.
        assert_eq!(latency.commands.len(), 2);
        latency.advance(0.09 + LATE_MAX);
        assert_eq!(latency.commands.len(), 1);
    }

    #[test]
    fn late_steering_acts_later_and_the_drive_does_not() {
        let mut latency = Latency::new(0.0, 0.05, [0.0; 2], 0.033);
        latency.send(0.0, Input::from([0.1, 1.0]));
        latency.send(0.033, Input::from([0.2, 2.0]));
        latency.set_late(0.04);
        let acting = |t| latency.acting(t, f64::INFINITY);
        assert_eq!(acting(0.045), (Input::zeros(), 0.05));
        for (t, command, until) in [(0.06, [0.0, 1.0], 0.083), (0.085, [0.0, 2.0], 0.09), (0.1, [0.1, 2.0], 0.123)] {
            assert_eq!(acting(t).0, Input::from(command), "{t}");
            assert!((acting(t).1 - until).abs() < 1e-15, "{t}: {}", acting(t).1);
        }
        assert_eq!(acting(0.13), (Input::from([0.2, 2.0]), f64::INFINITY));
        assert_eq!(latency.until_acting(0.033), 0.033 + 0.05 + 0.04);
        // What is due at 0.083 s is not known before: until the plan begins the drive is held.
        assert_eq!(latency.acting(0.06, 0.083), (Input::from([0.0, 1.0]), 0.083));
        assert_eq!(latency.acting(0.1, 0.083).0, Input::from([0.1, 1.0]));
        // Between 0.05 and 0.15 s: 40 ms at 0, 33 ms at 0.1 and 27 ms at 0.2 rad; 33 ms at 1 and 67 ms at 2 m/s2.
        latency.advance(0.05);
        let (_, mean) = latency.advance(0.15);
        assert!((mean - Input::from([0.087, 1.67])).norm() < 1e-12, "{mean}");
    }

    #[test]
    fn late_steering_is_followed_at_the_times_of_clocks_too() {
        let late_from = |start: f64| {
            let mut latency = Latency::new(start, 0.05, [0.0; 2], 0.033);
            for k in 0..9 {
                let t = start + 0.033 * f64::from(k);
                latency.advance(t);
                latency.set_late(0.0123 * f64::from(k));
                latency.send(t + 0.033, Input::from([0.01 * f64::from(k), 0.0]));
            }
            predict(&latency, 0.033).x
        };
        // Times have steps of 2.4e-7 s there, over which steering of 0.1 rad gives 1e-5 rad/s at most.
        let difference = late_from(1.7e9) - late_from(0.0);
        assert!(difference.norm() < 1e-4, "{difference}");
    }

    #[test]
    fn prediction_in_one_go_equals_prediction_in_pieces() {
        let p = Parameters::default();
        let mut latency = Latency::new(0.0, 0.066, [0.1, 0.2], 0.033);
        latency.send(0.0, Input::from([0.05, 1.0]));
        latency.send(0.033, Input::from([0.03, -1.0]));
        latency.advance(0.033);
        let whole = predict(&latency, 0.033);
        let mut later = latency.clone();
        later.advance(0.066);
        // A step that takes back half of the delay ends half-way.
        let half = latency.predict(
            &State::from([15.0, 0.1, 0.05, 0.2, 0.02]),
            -0.033,
            |_| 0.01,
            &p.body(),
            &p.nominal_tyres(),
            &Trend::steady(Disturbance::zeros()),
        );
        let rest =
            later.predict(&half.x, 0.0, |_| 0.01, &p.body(), &p.nominal_tyres(), &Trend::steady(Disturbance::zeros()));
        assert!((rest.x - whole.x).norm() < 1e-12, "{} {}", rest.x, whole.x);
        assert!((rest.actual - whole.actual).norm() < 1e-12);
    }

    #[test]
    fn mean_delivery_is_the_integral_of_the_lag() {
        let mut latency = Latency::new(0.0, 0.0, [0.1, 0.0], 0.033);
        latency.send(0.01, Input::from([0.05, 2.0]));
        let (duration, mean) = latency.advance(0.04);
        assert_eq!(duration, 0.04);
        // Nothing for 10 ms, then the response of the lag, by the trapezoidal rule on 3000 pieces.
        let response = |t: f64| 0.05 * (1.0 - (-t / 0.1).exp());
        let sum: f64 =
            (0..3000).map(|k| 0.5e-5 * (response(f64::from(k) * 1e-5) + response(f64::from(k + 1) * 1e-5))).sum();
        assert!((mean[0] - sum / 0.04).abs() < 1e-10, "{mean}");
        assert!((mean[1] - 2.0 * 0.75).abs() < 1e-12, "{mean}");
    }

    #[test]
    fn an_impossible_car_does_not_hold_the_step_up() {
        // 1e10 1/s: without a limit nothing would come of this within minutes.
        let p = Parameters { c_f_nominal: 1e10, c_r_nominal: 1e10, m: 1.0, i_z: 1.0, ..Parameters::default() };
        let latency = Latency::new(0.0, 0.5, [0.0; 2], 0.033);
        let calls = std::cell::Cell::new(0);
        let kappa = |_| {
            calls.set(calls.get() + 1);
            0.01
        };
        let x = State::from([15.0, 0.1, 0.05, 0.2, 0.02]);
        let trend = Trend::steady(Disturbance::zeros());
        latency.predict(&x, 0.5, kappa, &p.body(), &p.nominal_tyres(), &trend);
        assert_eq!(calls.get(), 4 * 10_000, "four evaluations a step");
    }

    #[test]
    fn prediction_follows_the_lag_in_closed_form() {
        let mut latency = Latency::new(0.0, 0.0, [0.1, 0.3], 0.033);
        latency.send(0.0, Input::from([0.05, 2.0]));
        let at = predict(&latency, 0.2);
        let expected = Input::from([0.05 * (1.0 - (-2.0f64).exp()), 2.0 * (1.0 - (-0.2f64 / 0.3).exp())]);
        assert!((at.actual - expected).norm() < 1e-14, "{} {expected}", at.actual);
    }

    #[test]
    fn speed_under_a_lagged_acceleration_is_analytic() {
        // Straight, no drag, no rolling resistance: v = v_0 + a (t - tau (1 - exp(-t / tau))).
        let p = Parameters { c_d: 0.0, c_rr: 0.0, ..Parameters::default() };
        let mut latency = Latency::new(0.0, 0.0, [0.0, 0.3], 0.033);
        latency.send(0.0, Input::from([0.0, 2.0]));
        let x = State::from([15.0, 0.0, 0.0, 0.0, 0.0]);
        let at = latency.predict(&x, 0.2, |_| 0.0, &p.body(), &p.nominal_tyres(), &Trend::steady(Disturbance::zeros()));
        let expected = 15.0 + 2.0 * (0.2 - 0.3 * (1.0 - (-0.2f64 / 0.3).exp()));
        // Simpson's rule on an exponential, 40 ms steps: (h / tau)^4 / 2880 of the 0.4 m/s.
        assert!((at.x[0] - expected).abs() < 1e-7, "{} {expected}", at.x[0]);
    }
}

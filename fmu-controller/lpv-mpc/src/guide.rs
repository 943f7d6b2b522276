//! What the plan meets: the path under each of its stages, a speed that the car can drive there, and the accelerations that the
//! model cannot explain.
//!
//! The wanted speed is lowered to what grip permits ([`crate::ahead`]), and to what drive and brakes reach from the present
//! speed. A speed that cannot be reached would be an error that the quadratic programme reduces by other means: through the
//! tyres' resistance it would steer.

use crate::Scalar;
use crate::ahead::Road;
use crate::hold::Hold;
use crate::latency::Predicted;
use crate::model::{A_X, Body, Disturbance, Input, V_GUARD, V_X};
use crate::parameters::Parameters;
use crate::trend::{Course, Trend};

/// The path under one stage.
#[derive(Clone, Copy)]
pub struct Path<T: Scalar> {
    /// Curvature at the beginning and at the end of the stage [1/m].
    pub kappa: [T; 2],
    /// Friction in the middle of the stage [1].
    pub mu: T,
    /// Speed that is wanted at the end of the stage, whether it can be had or not [m/s].
    pub wanted: T,
    /// The same, no faster than the road and the way back to it permit [m/s].
    pub permitted: T,
    /// Speed to be followed at the end of the stage [m/s].
    pub v_x: T,
    /// Acceleration that the model cannot explain, in the middle of the stage.
    pub disturbance: Disturbance<T>,
}

/// Goes along the road with the plan, one stage after the other.
#[derive(Clone)]
pub struct Guide<'a, T: Scalar> {
    road: &'a Road<T>,
    /// Distance of the stage's beginning [m], and the preview's element before it.
    s: T,
    before: usize,
    /// Curvature [1/m] and friction [1] there.
    kappa: T,
    mu: T,
    /// Time on the reference [s].
    time: f64,
    /// Speed that is not to be exceeded for other reasons than grip [m/s].
    pace: f64,
    /// The fastest and the slowest that the car can be.
    reach: [Reach<T>; 2],
    course: Course<T>,
    /// Period of the plan [s].
    period: f64,
}

/// Speed under full use of drive or brakes.
#[derive(Clone, Copy)]
struct Reach<T> {
    /// Speed [m/s].
    v_x: T,
    /// Command and what the actuator delivers [m/s2].
    command: f64,
    actual: f64,
    /// Bound of the command [m/s2] and its change per period towards it [m/s2].
    bound: f64,
    step: f64,
    /// What is left of the actuator's distance to its command after a period [1].
    decay: f64,
    /// Acceleration without drive and brakes but for the air [m/s2], and drag over mass [1/m].
    free: T,
    drag: f64,
}

impl<T: Scalar> Reach<T> {
    #[inline(always)]
    fn advance(&mut self, period: f64) {
        let to_bound = self.bound - self.command;
        self.command += to_bound.clamp(-self.step, self.step);
        let next = self.command + (self.actual - self.command) * self.decay;
        // A first-order lag passes its mean a little later than half-way; the difference is a fraction of a period's.
        let mean = if self.decay > 0.0 { 0.5 * (self.actual + next) } else { self.command };
        self.actual = next;
        let slowed = self.free - self.v_x * self.v_x * self.drag;
        self.v_x = (self.v_x + (slowed + mean) * period).larger(0.0);
    }
}

impl<'a, T: Scalar> Guide<'a, T> {
    /// At the beginning of a plan from `at`, which is `latency` [s] after the measurement, with the command `u_prev`.
    pub fn new(
        road: &'a Road<T>,
        at: &Predicted<T>,
        u_prev: &Input,
        latency: f64,
        (p, body, hold): (&Parameters, &Body, &Hold),
        trend: &Trend<T>,
    ) -> Self {
        let ratio = at.x[V_X] / at.x[V_X].larger(V_GUARD);
        let reach = [p.a_x_max, p.a_x_min].map(|bound| Reach {
            v_x: at.x[V_X],
            command: u_prev[A_X],
            actual: at.actual[A_X],
            bound,
            step: p.a_x_rate_max * p.t_s,
            decay: hold.decay[A_X],
            free: trend.now[0] - ratio * body.rolling,
            drag: body.drag / body.m,
        });
        let place = road.find(at.distance, 0);
        let (kappa, mu, _) = road.at(&place);
        Self {
            road,
            s: at.distance,
            before: place.before(),
            kappa,
            mu,
            time: latency,
            pace: f64::INFINITY,
            reach,
            course: trend.along(latency, p.t_s),
            period: p.t_s,
        }
    }

    /// Time between the measurement and the present stage [s].
    pub fn latency(&self) -> f64 {
        self.time
    }

    /// Acceleration that the model cannot explain, in the middle of the stage before the next one.
    pub fn disturbance_before(&self) -> Disturbance<T> {
        self.course.before()
    }

    /// The same, no faster than `pace` [m/s].
    pub fn no_faster_than(self, pace: f64) -> Self {
        Self { pace, ..self }
    }

    /// The path under the next stage, on which the car makes way at `pace` [m/s].
    #[inline(always)]
    pub fn advance(&mut self, pace: impl FnOnce(T) -> T) -> Path<T> {
        self.s += pace(self.kappa) * self.period;
        self.time += self.period;
        let place = self.road.find(self.s, self.before);
        self.before = place.before();
        let (kappa, mu, limit) = self.road.at(&place);
        for reach in &mut self.reach {
            reach.advance(self.period);
        }
        let wanted = self.road.wanted(self.time);
        let permitted = if limit.re() < wanted.re() { limit } else { wanted };
        let permitted = if self.pace < permitted.re() { T::from(self.pace) } else { permitted };
        let [fastest, slowest] = &self.reach;
        let v_x = if !wanted.re().is_finite() {
            // No speed to drive at; the solver refuses it.
            wanted
        } else if fastest.v_x.re() < permitted.re() {
            fastest.v_x
        } else if slowest.v_x.re() > permitted.re() {
            slowest.v_x
        } else {
            permitted
        };
        let disturbance = self.course.advance();
        let path = Path { kappa: [self.kappa, kappa], mu: (self.mu + mu) * 0.5, wanted, permitted, v_x, disturbance };
        (self.kappa, self.mu) = (kappa, mu);
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::State;
    use crate::preview::PREVIEW;

    /// Speeds that the guide gives over `stages` to a car at 20 m/s that wants `wanted` [m/s].
    fn speeds(p: &Parameters, wanted: f64, stages: usize) -> Vec<f64> {
        let road = Road::new([[0.0; PREVIEW], [wanted; PREVIEW], [0.0; PREVIEW]], p);
        let at = Predicted { x: State::from([20.0, 0.0, 0.0, 0.0, 0.0]), distance: 0.0, actual: Input::zeros() };
        let hold = Hold::new(p.t_s, [p.tau_delta, p.tau_a_x]);
        let given = (p, &p.body(), &hold);
        let mut guide = Guide::new(&road, &at, &Input::zeros(), 0.0, given, &Trend::steady(Disturbance::zeros()));
        (0..stages).map(|_| guide.advance(|_| 20.0).v_x).collect()
    }

    fn without_resistance() -> Parameters {
        Parameters { c_d: 0.0, c_rr: 0.0, ..Parameters::default() }
    }

    #[test]
    fn a_wanted_speed_in_reach_is_followed() {
        let p = without_resistance();
        assert!(speeds(&p, 20.0, 40).iter().all(|v| *v == 20.0));
    }

    #[test]
    fn the_fastest_rise_is_the_integral_of_the_ramp_and_the_bound() {
        let p = without_resistance();
        let rise = speeds(&p, 50.0, 40);
        // Command after k periods: k times the rate, at most the bound.
        let mut v_x = 20.0;
        for (k, got) in rise.iter().enumerate() {
            v_x += p.t_s * ((k + 1) as f64 * p.a_x_rate_max * p.t_s).min(p.a_x_max);
            assert!((got - v_x).abs() < 1e-12, "stage {k}: {got} for {v_x}");
        }
    }

    #[test]
    fn a_slow_drive_is_given_time() {
        let p = Parameters { tau_a_x: 0.5, a_x_rate_max: 1e4, ..without_resistance() };
        let rise = speeds(&p, 50.0, 40);
        // Behind a first-order lag: v = v_0 + a (t - tau (1 - exp(-t / tau))).
        let t = 40.0 * p.t_s;
        let exact = 20.0 + p.a_x_max * (t - p.tau_a_x * (1.0 - (-t / p.tau_a_x).exp()));
        // The mean over a period is taken half-way: (t_s / tau)^2 / 12 of the lag's share.
        assert!((rise[39] - exact).abs() < 1e-3, "{} for {exact}", rise[39]);
    }

    #[test]
    fn no_reference_is_slower_than_the_brakes_allow_or_than_standing() {
        let p = without_resistance();
        let fall = speeds(&p, 0.0, 40);
        assert!(fall.windows(2).all(|v| v[0] - v[1] <= -p.a_x_min * p.t_s + 1e-12));
        assert!(fall.iter().all(|v| *v >= 0.0));
    }
}

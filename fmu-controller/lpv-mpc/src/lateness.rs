//! How much later the steering acts than the controller is told.
//!
//! Importers do not always tell the lag of their steering. A plan that counts on an angle which comes later steers too much, then
//! back too much, and swings up: with a lag of 0.1 s that is not told the general track is left by 94 m without this, with it by
//! 6 cm (`cargo fmu robustness --case late_untold`).
//!
//! Late steering shows: what it gives the car is missing while the angle grows and too much while it falls, in proportion to how
//! fast it moves. Wind and wrongly believed tyres ([`crate::friction`]) have no such course, or almost: a car whose tyres give
//! less answers more slowly as well. So what the tyres explain is taken off first, and tyres that are never learnt
//! ([`crate::Adaptation::Constant`]) leave nothing to judge by. A Kalman filter explains the rest of the yaw acceleration by a
//! random walk, which is the wind, and by the lateness times what the moving steering gives. A lag and a delay, of the steering
//! or of the sensors, are the same to it; the plan then begins as much later ([`crate::latency`]).

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

use crate::estimator;
use crate::model::YAW_RATE;

/// Largest lateness [s]: with it a lag of 0.2 s costs the lane change at 14 m/s 6 cm (`cargo fmu simulate --set
/// plant.tau_delta=0.2`).
pub const LATE_MAX: f64 = 0.15;

/// Lateness that is left alone, and twice of which counts whole [s]. With 0.03 s a lag of 0.05 s costs the lane change at 17 m/s
/// 3.8 cm instead of 0.8 (`--case late_untold`); with 0.01 untold tyres change more lane changes of `cargo fmu campaign --untold
/// --step 0.033`, by up to 3 mm.
const IGNORED: f64 = 0.02;

/// Time that the estimator takes to follow an acceleration [s]. In regressions of what it leaves on what late steering gives,
/// filtered by 0 to 0.2 s, the correlation is largest with it: 0.98 and more on the lane change with lags of 0.05 and 0.1 s.
const FOLLOWS: f64 = 0.05;

/// Standard deviations before anything is known, of the unexplained yaw acceleration [rad/s2] as the estimator takes it, and of
/// the lateness [s], beyond which time does not make it less certain. With 0.02 s a lag of 0.05 s costs the lane change at 17 m/s
/// 15 cm; with 0.1 untold tyres cost more (`linear` on the general track 19 cm instead of 0.6).
const INITIAL: [f64; 2] = [estimator::INITIAL[YAW_RATE], 0.05];

/// Intensities of the random walks [rad/s2 and s per root second], the first that of [`crate::friction`]. With four times as much
/// wind a lag of 0.1 s costs the general track 11 cm instead of 6, and so it does with a lateness that walks by 0.003; with 0.03
/// friction of 0.4 that is not told costs 4 to 6 cm instead of 1.5 at 11.4 m/s.
const WALK: [f64; 2] = [0.25, 0.01];

/// Standard deviation of the unexplained yaw acceleration [rad/s2]. With 0.3, which is what the sensors make of it, tyres and
/// friction that are not told are taken for lateness before they are learnt (`cargo fmu campaign --untold --step 0.033`: 7.6 cm
/// instead of 1.5 at friction 0.4 and 11.4 m/s, 15 instead of 0.6 on the general track with `linear`); with 1.5 a lag of 0.1 s
/// costs 9 cm there instead of 6. Steering that swings shows itself in either case.
const DEVIATION: f64 = 1.0;

/// The filter of wind and lateness.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lateness {
    /// Yaw acceleration that stays [rad/s2], and lateness [s].
    estimate: Vector2<f64>,
    P: Matrix2<f64>,
    /// Steering angle at the last sample [rad].
    steering: f64,
    /// What each second of lateness gives, as the estimator sees it [rad/s3].
    late: f64,
}

impl Lateness {
    /// Steering that acts when it is told to.
    pub fn new() -> Self {
        let P = Matrix2::from_diagonal(&Vector2::from(INITIAL.map(|deviation| deviation * deviation)));
        Self { estimate: Vector2::zeros(), P, steering: 0.0, late: 0.0 }
    }

    /// The lateness to be counted with [s].
    pub fn seconds(&self) -> f64 {
        let found = self.estimate[1].clamp(0.0, LATE_MAX);
        found * ((found - IGNORED) / IGNORED).clamp(0.0, 1.0)
    }

    /// Takes in the steering angle of the last sample [rad], the yaw acceleration that it gives [1/s2] and what is unexplained
    /// besides [rad/s2], and the time since the sample before [s].
    pub fn learn(&mut self, steering: f64, gives: f64, unexplained: f64, duration: f64) {
        let kept = (-duration / FOLLOWS).exp();
        self.late = self.late * kept - (1.0 - kept) * gives * (steering - self.steering) / duration;
        self.steering = steering;
        for (i, walk) in WALK.iter().enumerate() {
            self.P[(i, i)] += walk * walk * duration;
        }
        self.P[(1, 1)] = self.P[(1, 1)].min(INITIAL[1] * INITIAL[1]);
        let h = Vector2::new(1.0, self.late);
        let column = self.P * h;
        let gain = column / (h.dot(&column) + DEVIATION * DEVIATION);
        let missing = unexplained + self.late * self.seconds();
        self.estimate += gain * (missing - h.dot(&self.estimate));
        self.P -= gain * column.transpose();
        self.estimate[1] = self.estimate[1].clamp(-LATE_MAX, LATE_MAX);
        if !self.estimate.iter().chain(&self.P).all(|value| value.is_finite()) {
            // The numbers were too large: nothing is known any more.
            *self = Self::new();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 0.033;
    /// Yaw acceleration per steering angle of the default car [1/s2].
    const GIVES: f64 = 42.0;

    fn slalom(t: f64) -> f64 {
        0.05 * (4.0 * t).sin()
    }

    /// A slalom of `duration` [s] with steering that is `late` [s], and besides an unexplained yaw acceleration [rad/s2] that
    /// depends on time and steering angle; `see` sees every sample.
    fn drive(late: f64, duration: f64, besides: impl Fn(f64, f64) -> f64, mut see: impl FnMut(&Lateness)) -> Lateness {
        let (mut lateness, mut t) = (Lateness::new(), 0.0);
        let mut followed = 0.0;
        while t < duration {
            // The angle that is counted with is that of a moment ago.
            let steering = slalom(t - lateness.seconds());
            let missing = GIVES * (slalom(t - late) - steering);
            followed += (missing + besides(t, steering) - followed) * (1.0 - (-PERIOD / FOLLOWS).exp());
            lateness.learn(steering, GIVES, followed, PERIOD);
            see(&lateness);
            t += PERIOD;
        }
        lateness
    }

    #[test]
    fn late_steering_is_found() {
        for late in [0.05, 0.08, 0.12] {
            let found = drive(late, 20.0, |_, _| 0.4, |_| {}).seconds();
            // The missing acceleration is taken for linear in the lateness: the sine of 4 rad/s times 0.12 s is 4 % less.
            assert!((found - late).abs() < 0.12 * late, "{found} for {late}");
        }
    }

    #[test]
    fn wind_soft_tyres_and_noise_are_hardly_taken_for_it() {
        let gust = |t: f64, _: f64| if t > 3.0 { 0.8 } else { 0.0 };
        let soft = |_: f64, steering: f64| -0.3 * GIVES * steering;
        let noise = |t: f64, _: f64| 0.3 * (1e3 * t).sin();
        for besides in [&gust as &dyn Fn(f64, f64) -> f64, &soft, &noise] {
            // Tyres that give a third less before that is learnt, in the moment in which nothing is known of the wind.
            drive(0.0, 30.0, besides, |lateness| assert!(lateness.seconds() < 0.005, "{lateness:?}"));
        }
    }

    #[test]
    fn steering_that_comes_early_or_hardly_late_is_left_alone() {
        for late in [-0.1, 0.0, 0.01] {
            drive(late, 20.0, |_, _| 0.0, |lateness| assert_eq!(lateness.seconds(), 0.0, "{lateness:?}"));
        }
    }

    #[test]
    fn what_counts_rises_without_a_step() {
        let counted = |found: f64| Lateness { estimate: Vector2::new(0.0, found), ..Lateness::new() }.seconds();
        let mut before = 0.0;
        for k in 0..=2000 {
            let now = counted(f64::from(k) * 1e-4);
            // The slope is at most 3, between one and two times what is ignored.
            assert!(now >= before && now <= before + 3.01e-4, "{k}: {before} to {now}");
            before = now;
        }
        assert_eq!((counted(IGNORED), counted(2.0 * IGNORED), before), (0.0, 2.0 * IGNORED, LATE_MAX));
    }

    #[test]
    fn numbers_beyond_all_bounds_are_forgotten() {
        let mut lateness = Lateness::new();
        lateness.learn(1e300, 1e300, -1e300, PERIOD);
        assert!(lateness.estimate.iter().chain(&lateness.P).all(|value| value.is_finite()));
        assert!((0.0..=LATE_MAX).contains(&lateness.seconds()));
    }
}

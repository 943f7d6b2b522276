//! How stiff the tyres are and how much grip there is, told from how the car answers.
//!
//! What the filter cannot explain ([`crate::estimator`]) holds wind and wrongly believed tyres alike. Their course tells them
//! apart: wind pushes whatever the tyres do, while wrong tyres are missing in proportion to their own forces and turn round
//! with them. A Kalman filter explains the accelerations by four random walks: wind on the lateral velocity and on the yaw
//! rate, a factor on the stiffness of all tyres, and one on their grip.
//!
//! The factors are those of the similarity method, [Pacejka, section 4.2]: `F = g F_0(k alpha / g)` keeps the form of the
//! believed tyre `F_0`, has `k` times its slope at small slip and ends at `g` times its force. Its derivatives are
//! the two parts of the tangent model `F = C alpha + F_offset` of the prediction: along `k` the part with the slope, along `g`
//! the offset. So at small slip a car shows how stiff its tyres are, near their peak how much grip there is; in
//! between each follows the other in part, because a slippery road takes both.

use nalgebra::{Matrix4, Vector2, Vector4};
use serde::{Deserialize, Serialize};

use crate::estimator;
use crate::model::{V_Y, YAW_RATE};
pub use similarity::{Factors, Given};

mod similarity;

/// Smallest and largest factor on the stiffness [1].
///
/// A tyre of half the believed stiffness, and friction of 0.4 where 0.82 is believed, lie at the lower end. With 0.4 the lane
/// change at 13.8 m/s on the `linear` tyre grows from 0.4 to 1.0 cm, and that at friction 0.4 and 10.8 m/s falls from 0.4 to
/// 0.3 cm (`cargo fmu campaign --untold`, `network_horizon`).
const STIFFNESS: [f64; 2] = [0.5, 1.5];

/// Smallest and largest factor on the grip [1].
///
/// Friction of 1 where 0.82 is believed is 1.22. A soft tyre must not be taken for a road on which nothing holds: with 0.7 and
/// 1.3 the same lane change grows from 0.4 to 1.1 cm and that on `alcala` from 0.2 to 0.4 cm, while that at friction 0.4 and
/// 11.4 m/s falls from 0.7 to 0.5 cm.
const GRIP: [f64; 2] = [0.8, 1.25];

/// Standard deviations before anything is known, of wind [m/s2, rad/s2] as the estimator takes it, and of the factors [1]: those
/// of friction between 0.4 and 1.
const INITIAL: [f64; 4] = [estimator::INITIAL[V_Y], estimator::INITIAL[YAW_RATE], 0.3, 0.3];

/// Intensities of the random walks [m/s2, rad/s2, 1, 1 per root second]: gusts of the general track, and roads that change within
/// seconds. With twice the wind's most lane changes of `cargo fmu campaign --untold` with other tyres or friction grow by a
/// fifth to a half (`linear` at 13.8 m/s from 0.4 to 0.6 cm); with half of it many shrink, by up to 0.4 mm, and `network_now` on
/// that tyre grows from 1.1 to 1.3 cm.
///
/// Those of the factors end where they would make them less certain than at first: a long straight tells nothing.
const WALK: [f64; 4] = [0.5, 0.25, 0.1, 0.1];

/// Largest rate of the forces that is remembered [m/s3, rad/s3]: 20 m/s2, twice what tyres give, within a sample.
const RATE_MAX: f64 = 600.0;

/// How far stiffness and grip go together [1]: a road changes both alike, another tyre each in its own way. With 0.4 or
/// 0.9 no lane change of `cargo fmu campaign --untold` changes by more than 1.5 mm, and nothing in `cargo fmu robustness --cases`
/// with a limit by more than a twentieth.
const TOGETHER: f64 = 0.7;

/// Standard deviations of the unexplained accelerations [m/s2, rad/s2]: twice what the estimator's own covariance settles to
/// under one unit of sensor noise, because its errors last for two samples. With half of that
/// no lane change of `cargo fmu campaign --untold` changes by more than 1.6 mm; with twice most of those with other tyres or
/// friction grow, by up to 1.9 mm (`linear` at 13.8 m/s from 0.4 to 0.6 cm).
const DEVIATION: [f64; 2] = [1.5, 0.3];

/// Time by which a force may be off [s]: while the tyres' accelerations change, this times their rate adds to [`DEVIATION`].
///
/// A delay that is assumed wrong by a sample, or ice that begins under the car, shows as an acceleration that looks like wrong
/// tyres. Without this the lane change with lag, delay 20 ms wrong and noise grows from 2.6 to 3.9 cm and that onto ice from 6.3
/// to 8.5 cm (`cargo fmu robustness --case slow_noise`, `--case patch`). With 0.3 s the gust at 25 m/s costs 6.4 cm instead of
/// 6.0 (`--case fast_gust`); with 1 s other tyres are learnt later: the lane change at 13.8 m/s on `linear` grows from 0.4 to
/// 0.6 cm (`cargo fmu campaign --untold`).
const LATE: f64 = 0.5;

/// Time over which a change of the forces is remembered [s]: the estimator takes that long to settle after it.
const MEMORY: f64 = 0.2;

/// Indices of the factors' excess over 1; before them stands the wind.
const K: usize = 2;
const G: usize = 3;

/// The filter of wind and factors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Friction {
    estimate: Vector4<f64>,
    P: Matrix4<f64>,
    /// What the tyres gave at the last sample [m/s2, rad/s2], and how fast that changed lately [m/s3, rad/s3].
    given: Vector2<f64>,
    rate: Vector2<f64>,
}

impl Friction {
    /// Tyres and road as they are believed.
    pub fn new() -> Self {
        let (given, rate) = (Vector2::zeros(), Vector2::zeros());
        Self { estimate: Vector4::zeros(), P: covariance(INITIAL), given, rate }
    }

    /// What is found so far.
    pub fn factors(&self) -> Factors {
        Factors { stiffness: 1.0 + self.estimate[K], grip: 1.0 + self.estimate[G] }
    }

    /// Takes in what the tyres give with the present factors, what is unexplained besides [m/s2, rad/s2], and the time since the
    /// last sample [s]. Returns what the new factors explain of it.
    pub fn learn(&mut self, given: &Given, unexplained: &Vector2<f64>, duration: f64) -> Vector2<f64> {
        let before = self.factors();
        let (by_stiffness, by_grip) = (given.slope / before.stiffness, given.offset / before.grip);
        self.notice(given.slope + given.offset, duration);
        self.forget(duration);
        let missing = unexplained + by_stiffness * self.estimate[K] + by_grip * self.estimate[G];
        for (i, deviation) in DEVIATION.iter().enumerate() {
            let mut h = Vector4::zeros();
            (h[i], h[K], h[G]) = (1.0, by_stiffness[i], by_grip[i]);
            let column = self.P * h;
            let variance = deviation * deviation + (LATE * self.rate[i]).powi(2);
            let gain = column / (h.dot(&column) + variance);
            self.estimate += gain * (missing[i] - h.dot(&self.estimate));
            self.P -= gain * column.transpose();
        }
        if !self.estimate.iter().chain(&self.P).all(|value| value.is_finite()) {
            // The numbers were too large: nothing is known any more.
            *self = Self::new();
        }
        for (i, [least, most]) in [(K, STIFFNESS), (G, GRIP)] {
            self.estimate[i] = self.estimate[i].clamp(least - 1.0, most - 1.0);
        }
        let after = self.factors();
        by_stiffness * (after.stiffness - before.stiffness) + by_grip * (after.grip - before.grip)
    }

    /// What was found becomes less certain with time.
    fn forget(&mut self, duration: f64) {
        let certain = [K, G].map(|i| 1.0 - (self.P[(i, i)] / (INITIAL[i] * INITIAL[i])).powi(2));
        let share = certain[0].min(certain[1]).max(0.0) * duration;
        let [wind, yaw, stiffness, grip] = WALK;
        let scale = [duration, duration, share, share].map(f64::sqrt);
        self.P += covariance([wind * scale[0], yaw * scale[1], stiffness * scale[2], grip * scale[3]]);
    }

    /// How fast the forces change.
    fn notice(&mut self, given: Vector2<f64>, duration: f64) {
        let kept = (-duration / MEMORY).exp();
        let now = (given - self.given) / duration;
        self.rate = self.rate.zip_map(&now, |lately, now| (lately * kept).max(now.abs()).min(RATE_MAX));
        self.given = given;
    }
}

/// Covariance of wind and factors with these standard deviations.
fn covariance(deviations: [f64; 4]) -> Matrix4<f64> {
    let deviations = Vector4::from(deviations);
    let mut P = Matrix4::from_diagonal(&deviations.component_mul(&deviations));
    P[(K, G)] = TOGETHER * deviations[K] * deviations[G];
    P[(G, K)] = P[(K, G)];
    P
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 0.033;

    /// What believed tyres give in a slalom by their slope and by their offset, which grows with the cube of the slip.
    fn slalom(t: f64) -> [Vector2<f64>; 2] {
        let (s, c) = (2.0 * t).sin_cos();
        [Vector2::new(4.0 * s, 1.5 * c), Vector2::new(2.0 * s.powi(3), 0.5 * c.powi(3))]
    }

    /// Drives for `duration` [s] on tyres with the `truth` in a wind, with an estimator that is exact; `see` sees every sample.
    fn drive(truth: Factors, wind: Vector2<f64>, duration: f64, mut see: impl FnMut(&Friction)) -> Friction {
        let mut friction = Friction::new();
        let mut t = 0.0;
        while t < duration {
            let [slope, offset] = slalom(t);
            let all = slope * truth.stiffness + offset * truth.grip + wind;
            let given = |by: Factors| Given { slope: slope * by.stiffness, offset: offset * by.grip };
            let before = given(friction.factors());
            let unexplained = all - before.slope - before.offset;
            let explained = friction.learn(&before, &unexplained, PERIOD);
            let after = given(friction.factors());
            let accounted = after.slope + after.offset + unexplained - explained;
            assert!((accounted - all).norm() < 1e-12, "{t}: {accounted} of {all}");
            see(&friction);
            t += PERIOD;
        }
        friction
    }

    fn is_near(found: Factors, truth: Factors, tolerance: f64) -> bool {
        (found.stiffness - truth.stiffness).abs() < tolerance && (found.grip - truth.grip).abs() < tolerance
    }

    #[test]
    fn stiffness_and_grip_are_told_from_each_other_and_from_wind() {
        let wind = Vector2::new(1.5, -0.4);
        for (stiffness, grip) in [(1.0, 1.0), (0.6, 1.0), (1.2, 1.2), (0.85, 0.85), (1.1, 0.9)] {
            let truth = Factors { stiffness, grip };
            let found = drive(truth, wind, 60.0, |_| {});
            // Stiffness is known to 0.03 after six periods of the slalom; grip, which shows in a quarter of the forces, after
            // twenty.
            assert!(is_near(found.factors(), truth, 0.03), "{:?} for {truth:?}", found.factors());
            assert!((found.estimate.fixed_rows::<2>(0) - wind).norm() < 0.1, "{}", found.estimate);
        }
    }

    #[test]
    fn wind_is_not_taken_for_grip() {
        let truth = Factors { stiffness: 1.0, grip: 1.0 };
        // A side wind of 33 m/s from the first moment on, when nothing is known: 1.5 m/s2 of the 6 m/s2 of the tyres.
        drive(truth, Vector2::new(1.5, 0.4), 20.0, |friction| {
            assert!(is_near(friction.factors(), truth, 0.12), "{:?}", friction.factors());
        });
    }

    #[test]
    fn a_straight_road_tells_nothing_of_tyres() {
        let mut friction = Friction::new();
        let nothing = Given { slope: Vector2::zeros(), offset: Vector2::zeros() };
        for k in 0..600 {
            let gust = Vector2::new((0.1 * f64::from(k)).sin(), 0.3);
            assert_eq!(friction.learn(&nothing, &gust, PERIOD), Vector2::zeros());
        }
        assert_eq!(friction.factors(), Factors { stiffness: 1.0, grip: 1.0 });
    }

    #[test]
    fn after_a_long_straight_wind_is_taken_for_tyres_no_more_than_at_first() {
        let worst = |straight: u32| {
            let mut friction = Friction::new();
            let nothing = Given { slope: Vector2::zeros(), offset: Vector2::zeros() };
            for _ in 0..straight {
                friction.learn(&nothing, &Vector2::zeros(), PERIOD);
            }
            let mut worst = 0.0_f64;
            // A gentle bend in which a wind comes up with the forces of the tyres, which are as believed.
            for k in 0..100 {
                let share = (f64::from(k) * PERIOD).min(1.0);
                let Factors { stiffness, .. } = friction.factors();
                let given = Given { slope: Vector2::new(1.0, 0.3) * share * stiffness, offset: Vector2::zeros() };
                let all = Vector2::new(1.5, 0.4) * share;
                friction.learn(&given, &(all - given.slope), PERIOD);
                worst = worst.max((friction.factors().stiffness - 1.0).abs());
            }
            worst
        };
        // A quarter of an hour.
        let (at_first, later) = (worst(30), worst(27_000));
        assert!(later < at_first + 0.02, "{later}, at first {at_first}");
    }

    #[test]
    fn numbers_beyond_all_bounds_are_forgotten() {
        let mut friction = Friction::new();
        let huge = Given { slope: Vector2::new(1e300, 1e300), offset: Vector2::new(-1e300, 1e200) };
        friction.learn(&huge, &Vector2::new(1e300, -1e300), PERIOD);
        let Factors { stiffness, grip } = friction.factors();
        assert!((STIFFNESS[0]..=STIFFNESS[1]).contains(&stiffness) && (GRIP[0]..=GRIP[1]).contains(&grip));
        assert!(friction.P.iter().all(|value| value.is_finite()));
    }

    #[test]
    fn forces_that_come_late_are_hardly_taken_for_other_forces() {
        let (mut friction, mut worst) = (Friction::new(), 0.0_f64);
        for k in 0..600 {
            let t = f64::from(k) * PERIOD;
            let [slope, offset] = slalom(t);
            let [slope_then, offset_then] = slalom(t - 0.02);
            let Factors { stiffness, grip } = friction.factors();
            let given = Given { slope: slope * stiffness, offset: offset * grip };
            friction.learn(&given, &(slope_then + offset_then - given.slope - given.offset), PERIOD);
            worst = worst.max((friction.factors().stiffness - 1.0).abs()).max((friction.factors().grip - 1.0).abs());
        }
        // At 2 rad/s the forces are wrong by 4 % of their largest value.
        assert!(worst < 0.02, "{worst}");
    }

    #[test]
    fn what_differs_too_much_ends_at_the_bounds() {
        let found = |factor| {
            let truth = Factors { stiffness: factor, grip: factor };
            drive(truth, Vector2::zeros(), 10.0, |_| {}).factors()
        };
        assert!(is_near(found(0.1), Factors { stiffness: STIFFNESS[0], grip: GRIP[0] }, 1e-12));
        assert!(is_near(found(4.0), Factors { stiffness: STIFFNESS[1], grip: GRIP[1] }, 1e-12));
    }
}

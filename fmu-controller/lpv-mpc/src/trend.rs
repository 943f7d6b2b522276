//! Where the accelerations are going that the model cannot explain.
//!
//! A wind turns against the car as the car turns, gusts rise over tenths of a second, a tyre comes nearer to its limit. A plan
//! that took the present estimate for all of its stages would lag behind each of them: on the general track by 1 to 2 mm in
//! most bends (`cargo fmu simulate --road general`; with the trend the root mean square falls from 0.07 to 0.01 cm), at the limit
//! of grip by far more (`cargo fmu robustness --case grip_17`: 13 cm instead of 3.3). So the estimate's own change over the last
//! moments is carried on, for a short time only: a trend that fades.

use serde::{Deserialize, Serialize};

use crate::Scalar;
use crate::model::Disturbance;

/// Time over which the change is averaged [s].
///
/// Longer, the trend comes too late (`cargo fmu robustness --case slow_wrong`: 1.3 cm, with 0.3 s 1.6, without a trend 1.8);
/// shorter, noise steers (root mean square of the steering increments on the general track in one unit of sensor noise,
/// `cargo fmu simulate --road general --set plant.noise_scale=1 --csv run.csv`: 5.6 mrad, with 0.08 s 6.1, with 0.3 s 5.2,
/// without a trend 4.6).
const MEMORY: f64 = 0.15;

/// Time after which the trend has faded [s]: that of a gust's rise. With 0.2 or 1 s nothing with a limit in
/// `cargo fmu robustness --cases` or on the general track changes by more than an eighth, but the way made while standing with
/// 1 s: 3.6 mm instead of 1.4.
const REACH: f64 = 0.3;

/// What the trend does not carry an acceleration beyond [m/s2, m/s2, rad/s2].
///
/// A side wind of 38 m/s gives 2 m/s2; as much yaw acceleration would take an arm of 1.8 m, seven times the default. More is a
/// car that slides or swings: its tyres lose what the model believes faster and faster, and steering ahead of that loses the car.
/// Without the bound the general track with a delay of 0.25 s that is assumed 20 ms too short costs 2.9 m instead of 0.17
/// (`cargo fmu robustness --case fast_wrong`), and the lane change with lag, delay 20 ms wrong and noise 4.2 cm instead of 2.6
/// (`--case slow_noise`); a gust at its worst gains (`--case crosswind_peak`: 1.0 cm instead of 1.5).
const BOUND: f64 = 2.0;

/// An unexplained acceleration and its trend.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trend<T: Scalar = f64> {
    /// The acceleration now [m/s2, m/s2, rad/s2].
    pub now: Disturbance<T>,
    /// Its change [m/s3, m/s3, rad/s3].
    slope: Disturbance<T>,
}

impl<T: Scalar> Trend<T> {
    /// Of an acceleration that stays as it is.
    pub fn steady(now: Disturbance<T>) -> Self {
        Self { now, slope: Disturbance::zeros() }
    }

    /// What is expected after `t` [s].
    pub fn after(&self, t: f64) -> Disturbance<T> {
        self.now + self.lead() * T::from(1.0 - left(t))
    }

    /// What is expected in the middle of each period [s] of a plan that begins after `latency` [s].
    pub fn along(&self, latency: f64, period: f64) -> Course<T> {
        Course { now: self.now, lead: self.lead(), left: left(latency + 0.5 * period), decay: left(period) }
    }

    /// Takes over the present acceleration's change over `duration` [s], from `before`.
    pub(crate) fn follow(&mut self, before: &Disturbance<T>, duration: f64) {
        let kept = (-duration / MEMORY).exp();
        self.slope = self.slope * T::from(kept) + (self.now - before) * T::from((1.0 - kept) / duration);
    }

    /// The same, every quantity converted.
    pub(crate) fn map<S: Scalar>(&self, convert: impl Fn(T) -> S) -> Trend<S> {
        Trend { now: self.now.map(&convert), slope: self.slope.map(&convert) }
    }

    /// All that the trend will still add [m/s2, m/s2, rad/s2].
    ///
    /// Bounded smoothly, so that the command has a derivative.
    fn lead(&self) -> Disturbance<T> {
        self.now.zip_map(&self.slope, |now, slope| {
            let lead = slope * REACH;
            let room = (if lead.re() < 0.0 { now } else { -now }) + BOUND;
            if room.re() > 0.0 { lead * room / (lead * lead + room * room).sqrt() } else { T::zero() }
        })
    }
}

/// The share of a trend that is still ahead after `t` [s].
fn left(t: f64) -> f64 {
    (-t / REACH).exp()
}

/// Goes along a trend with a plan, one stage after the other.
#[derive(Clone, Copy)]
pub struct Course<T: Scalar> {
    now: Disturbance<T>,
    lead: Disturbance<T>,
    left: f64,
    decay: f64,
}

impl<T: Scalar> Course<T> {
    /// The acceleration in the middle of the stage before the next one.
    pub fn before(&self) -> Disturbance<T> {
        self.now + self.lead * T::from(1.0 - self.left / self.decay)
    }

    /// The acceleration in the middle of the next stage.
    pub fn advance(&mut self) -> Disturbance<T> {
        let expected = self.now + self.lead * T::from(1.0 - self.left);
        self.left *= self.decay;
        expected
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The trend of a ramp with these rates [1/s], from zero, seen every `duration` [s] for one second.
    fn ramp(rates: [f64; 3], duration: f64) -> Trend {
        let mut trend = Trend::steady(Disturbance::zeros());
        let mut t = 0.0;
        while t < 1.0 {
            let before = trend.now;
            trend.now += Disturbance::from(rates) * duration;
            trend.follow(&before, duration);
            t += duration;
        }
        trend
    }

    #[test]
    fn a_ramp_is_carried_on_with_its_own_rate_however_often_it_is_seen() {
        for duration in [0.001, 0.01, 0.033] {
            let rates = [0.3, -0.2, 0.1];
            let trend = ramp(rates, duration);
            let t = 0.001;
            let rate = (trend.after(t) - trend.now) / t;
            // Of one second seven memories have passed, e^-6.7 is left out; over 1 ms a three-hundredth of the trend fades.
            assert!((rate - Disturbance::from(rates)).amax() < 0.3 * 5e-3, "{duration}: {rate}");
        }
    }

    #[test]
    fn a_trend_fades_to_its_reach() {
        let trend = ramp([0.3, 0.0, 0.0], 0.01);
        let far = trend.after(100.0)[0] - trend.now[0];
        assert!((far - 0.3 * REACH).abs() < 0.3 * REACH * 5e-3, "{far}");
    }

    #[test]
    fn stages_see_what_is_expected_in_their_middle() {
        let trend = ramp([0.5, -0.5, 0.2], 0.033);
        let mut course = trend.along(0.07, 0.033);
        for i in 0..80 {
            let expected = trend.after(0.07 + (f64::from(i) + 0.5) * 0.033);
            assert!((course.advance() - expected).amax() < 1e-14, "stage {i}");
        }
    }

    #[test]
    fn nothing_is_carried_beyond_what_wind_gives_and_what_is_there_already_stays() {
        let steep = ramp([1.9, -2.5, 0.0], 0.01);
        let far = steep.after(100.0);
        assert!(far[0] > steep.now[0] && far[0] < BOUND, "{far}");
        assert_eq!(far[1], steep.now[1]);
    }

    #[test]
    fn what_slides_is_expected_back_when_it_comes_back() {
        let mut trend = ramp([-4.0, 0.0, 0.0], 0.01);
        let before = trend.now;
        trend.now[0] = -3.0;
        trend.follow(&before, 0.1);
        assert!(trend.after(0.1)[0] > -3.0);
    }
}

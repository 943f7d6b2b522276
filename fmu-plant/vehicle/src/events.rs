//! What happens at given times: a gust, and the steering of open-loop manoeuvres.

use std::f64::consts::TAU;

use crate::{Parameters, Scalar, smooth};

/// A gust: a wind that rises, holds and falls. Without a hold it is the 1 - cos gust to within its smooth flanks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gust {
    start: f64,
    rise: f64,
    hold: f64,
    /// Wind at its height, global frame [m/s].
    wind: [f64; 2],
}

impl Gust {
    /// The gust of the parameters; None if it has no speed.
    #[must_use]
    pub fn new(p: &Parameters) -> Option<Self> {
        let (sin, cos) = p.gust_direction.sin_cos();
        (p.gust_speed != 0.0).then_some(Self {
            start: p.gust_start,
            rise: p.gust_rise,
            hold: p.gust_hold,
            wind: [p.gust_speed * cos, p.gust_speed * sin],
        })
    }

    /// Its wind at time `t`, global frame [m/s].
    #[must_use]
    pub fn wind(&self, t: f64) -> [f64; 2] {
        let begin = self.start + self.rise;
        let share = smooth::window(t, begin, begin + self.hold, self.rise);
        self.wind.map(|w| w * share)
    }

    /// Whether it blows at some time between `from` and `to`.
    #[must_use]
    pub fn acts(&self, from: f64, to: f64) -> bool {
        to > self.start && from < self.start + 2.0 * self.rise + self.hold
    }
}

/// An open-loop steering manoeuvre; its angle is added behind the actuator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steering {
    form: Form,
    amplitude: f64,
}

/// The course of the steering angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Rises within [`STEP_TIME`] and stays, ISO 7401.
    Step,
    /// A sine of 0.7 Hz that waits for 0.5 s at its second extremum, ISO 19365 and FMVSS 126.
    SineWithDwell,
}

/// When open-loop steering begins [s]: the vehicle runs straight for a second first.
pub const STEER_FROM: f64 = 1.0;
/// Rise time of the step [s]: 30 degrees at a steering wheel with a ratio of 15 take 0.15 s at the 200 deg/s of ISO 7401.
pub const STEP_TIME: f64 = 0.15;
/// Frequency of the sine [Hz] and length of the dwell [s], FMVSS 126 S7.9.
const SINE: (f64, f64) = (0.7, 0.5);

impl Steering {
    /// The steering of a form.
    #[must_use]
    pub fn new(form: Form, amplitude: f64) -> Self {
        Self { form, amplitude }
    }

    /// Angle at time `t` [rad].
    #[must_use]
    pub fn angle(&self, t: f64) -> f64 {
        let t = t - STEER_FROM;
        if t <= 0.0 {
            return 0.0;
        }
        let share = match self.form {
            Form::Step => smooth::step(t / STEP_TIME),
            Form::SineWithDwell => {
                let (frequency, dwell) = SINE;
                let extremum = 0.75 / frequency;
                let phase = if t < extremum { t } else { (t - dwell).max(extremum) };
                if phase * frequency >= 1.0 { 0.0 } else { (TAU * frequency * phase).sin() }
            }
        };
        self.amplitude * share
    }
}

/// What the clock adds to commands and wind.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Events {
    /// The gust, if there is one.
    pub gust: Option<Gust>,
    /// The manoeuvre's own steering, if it has one.
    pub steering: Option<Steering>,
}

impl Events {
    /// Whether something changes between the times `from` and `to` [s].
    #[must_use]
    pub fn act(&self, from: f64, to: f64) -> bool {
        self.gust.is_some_and(|gust| gust.acts(from, to)) || (self.steering.is_some() && to > STEER_FROM)
    }

    /// Steering angle and wind at time `t` on top of others.
    pub fn add<D: Scalar>(&self, t: f64, delta: D, [x, y]: [D; 2]) -> (D, [D; 2]) {
        let delta = self.steering.map_or(delta, |steering| delta + steering.angle(t));
        let wind = self.gust.map_or([x, y], |gust| {
            let [gust_x, gust_y] = gust.wind(t);
            [x + gust_x, y + gust_y]
        });
        (delta, wind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_with_dwell_waits_at_its_second_extremum() {
        let steering = Steering::new(Form::SineWithDwell, 2.0);
        let at = |t: f64| steering.angle(STEER_FROM + t);
        assert!((at(0.25 / 0.7) - 2.0).abs() < 1e-12);
        for t in [0.75 / 0.7, 0.75 / 0.7 + 0.25, 0.75 / 0.7 + 0.5] {
            assert!((at(t) + 2.0).abs() < 1e-12, "{} at {t} s", at(t));
        }
        assert_eq!([at(-0.5), at(1.0 / 0.7 + 0.5)], [0.0, 0.0]);
    }

    #[test]
    fn gust_rises_holds_and_falls() {
        let p =
            Parameters { gust_start: 2.0, gust_rise: 0.5, gust_hold: 1.0, gust_speed: 20.0, ..Parameters::default() };
        let p = Parameters { gust_direction: std::f64::consts::FRAC_PI_2, ..p };
        let gust = Gust::new(&p).unwrap();
        let at = |t: f64| gust.wind(t)[1];
        assert_eq!([at(2.0), at(2.5), at(3.0), at(3.5), at(4.0)], [0.0, 20.0, 20.0, 20.0, 0.0]);
        assert!((at(2.25) - 10.0).abs() < 1e-12);
        assert!(!gust.acts(0.0, 2.0) && gust.acts(1.0, 2.1) && !gust.acts(4.0, 5.0));
    }
}

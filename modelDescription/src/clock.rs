//! Time as the importer counts it: where the next step must begin and where it may end.

use serde::{Deserialize, Serialize};

use crate::error::Error;

/// The importer's clock in one instance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Clock {
    /// Start of the experiment [s].
    pub start: f64,
    /// End of the experiment, if there is one [s].
    pub stop: Option<f64>,
    /// End of the last successful step [s].
    pub now: f64,
}

impl Clock {
    /// Time from `start` to `stop`.
    pub fn new(start: f64, stop: Option<f64>) -> Result<Self, Error> {
        let end = stop.unwrap_or(f64::INFINITY);
        if !start.is_finite() || stop.is_some_and(|stop| !stop.is_finite()) || end < start {
            return Err(Error::Experiment { start, stop: end });
        }
        Ok(Self { start, stop, now: start })
    }

    /// Checks a step before anything is computed.
    pub fn check_step(&self, t: f64, h: f64, max_step: f64) -> Result<(), Error> {
        let refuse = |reason| Err(Error::StepSize { h, reason });
        if !h.is_finite() {
            return refuse("it must be finite");
        }
        if h <= 0.0 {
            return refuse("it must be positive");
        }
        if h > max_step {
            return refuse("it is longer than this model's longest step");
        }
        // Importers that compute t as n * h differ from our t + h by the rounding of both: a few units in the last place.
        let tolerance = 64.0 * f64::EPSILON * t.abs().max(self.now.abs()).max(h);
        if !t.is_finite() || (t - self.now).abs() > tolerance {
            return Err(Error::CommunicationPoint { given: t, expected: self.now });
        }
        let end = t + h;
        if end <= t {
            return refuse("it does not advance the time, whose resolution is coarser");
        }
        if let Some(stop) = self.stop {
            // A time that was summed over a million steps may be off by a ten-thousandth of a step (1e6 roundings of a sum that
            // is itself 1e6 steps long: 1e6 * 1e6 * 1.1e-16); a step that is really too long is off by far more.
            if end - stop > (1e-3 * h).max(64.0 * f64::EPSILON * stop.abs()) {
                return Err(Error::StopTime { end, stop });
            }
        }
        Ok(())
    }
}

impl Default for Clock {
    fn default() -> Self {
        Self { start: 0.0, stop: None, now: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_steps_are_refused() {
        let clock = Clock::new(0.0, None).unwrap();
        for h in [0.0, -0.0, -0.1, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            assert!(clock.check_step(0.0, h, 10.0).is_err(), "h = {h}");
        }
        for t in [f64::NAN, f64::INFINITY, 0.1, -0.1, 1e-9] {
            assert!(clock.check_step(t, 0.1, 10.0).is_err(), "t = {t}");
        }
    }

    #[test]
    fn a_step_below_the_resolution_of_time_is_refused() {
        let clock = Clock::new(1e6, None).unwrap();
        assert!(clock.check_step(1e6, 1e-12, 10.0).is_err());
    }

    #[test]
    fn multiplied_and_summed_time_reach_the_stop_time() {
        for (n, h) in [(100_000_u32, 1e-3), (3_000, 1.0 / 30.0), (10_000, 0.1)] {
            let stop = f64::from(n) * h;
            let mut multiplied = Clock::new(0.0, Some(stop)).unwrap();
            let mut summed = multiplied;
            for k in 0..n {
                let t = f64::from(k) * h;
                multiplied.check_step(t, h, 10.0).unwrap();
                multiplied.now = t + h;
                summed.check_step(summed.now, h, 10.0).unwrap();
                summed.now += h;
            }
            assert!(multiplied.check_step(stop, h, 10.0).is_err(), "h = {h}");
            assert!(summed.check_step(summed.now, h, 10.0).is_err(), "h = {h}");
        }
    }

    #[test]
    fn impossible_experiments_are_refused() {
        for (start, stop) in [(f64::NAN, None), (f64::INFINITY, None), (1.0, Some(0.0)), (0.0, Some(f64::NAN))] {
            assert!(Clock::new(start, stop).is_err(), "{start} to {stop:?}");
        }
    }
}

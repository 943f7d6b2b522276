//! Communication steps: which samples fall into one, and what each of them sees.

use std::borrow::Cow;

use super::Controller;
use crate::Error;
use crate::lanes::{Work, widest};
use crate::signals::Inputs;

/// Fraction of a period by which times may differ and still be one: importers add up steps in floating point.
const SAME_SAMPLE: f64 = 1e-6;

/// [`Controller::sample`] with its arguments.
struct Sampling<'a> {
    controller: &'a mut Controller,
    t: f64,
    h: f64,
    inputs: &'a Inputs,
}

impl Work for Sampling<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.controller.sample(self.t, self.h, self.inputs);
    }
}

impl Controller {
    /// One communication step from time `t` [s] over `h` [s], with what was measured at `t`.
    ///
    /// Takes every sample that falls into the step. The command of the last one is visible afterwards, at `t + h`, and the
    /// plan is made for that moment (and the actuators' delay).
    ///
    /// # Errors
    /// [`Error::Step`] for a step that is not positive and finite, [`Error::Time`] for a time that is not finite; the controller
    /// is as before then.
    pub fn advance(&mut self, t: f64, h: f64, inputs: &Inputs) -> Result<(), Error> {
        self.advance_with(t, h, |_| (0.0, Cow::Borrowed(inputs)))
    }

    /// Like [`advance`](Self::advance), with inputs that change at `rates` (each per second) within the step: a sample inside
    /// the step then sees what is measured at its own time.
    ///
    /// # Errors
    /// See [`advance`](Self::advance).
    pub fn advance_along(&mut self, t: f64, h: f64, inputs: &Inputs, rates: &Inputs) -> Result<(), Error> {
        self.advance_with(t, h, |age| (age, Cow::Owned(inputs.moved(rates, age))))
    }

    /// Takes the samples of a step; `measure` says, for a time since the start of the step [s], how long after the start the
    /// measurement that the sample uses is taken [s], and what it is.
    fn advance_with<'a>(
        &mut self,
        t: f64,
        h: f64,
        measure: impl Fn(f64) -> (f64, Cow<'a, Inputs>),
    ) -> Result<(), Error> {
        if !(h > 0.0 && h.is_finite()) {
            return Err(Error::Step(h));
        }
        if !t.is_finite() {
            return Err(Error::Time(t));
        }
        self.sampled = 0;
        let end = t + h - SAME_SAMPLE * self.parameters.t_s.min(h);
        loop {
            let due = self.start + self.samples as f64 * self.parameters.t_s;
            if due >= end {
                return Ok(());
            }
            self.samples += 1;
            self.sampled += 1;
            let (age, inputs) = measure((due - t).max(0.0));
            widest(Sampling { controller: self, t: t + age, h: h - age, inputs: &inputs });
            self.latency.send(t + h, self.u_prev);
        }
    }
}

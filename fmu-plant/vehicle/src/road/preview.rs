//! What a controller sees of the road ahead.

use nalgebra::SVector;
use num_dual::Dual64;
use serde::{Deserialize, Serialize};

use super::Road;

/// Elements of the preview: now and the next 40 sample times.
pub const PREVIEW: usize = 41;

/// Curvature, speed and friction of the path now and at the next 40 sample times.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Preview {
    /// Curvature, positive to the left [1/m].
    pub kappa_ref: SVector<f64, PREVIEW>,
    /// Wanted speed [m/s].
    pub v_x_ref: SVector<f64, PREVIEW>,
    /// Friction [1].
    pub mu_ref: SVector<f64, PREVIEW>,
}

impl Default for Preview {
    fn default() -> Self {
        Self { kappa_ref: SVector::zeros(), v_x_ref: SVector::zeros(), mu_ref: SVector::zeros() }
    }
}

impl Road {
    /// What lies ahead of arc length `s`: element j is where the reference, passing `s` now, will be after `j * step`
    /// seconds; `friction` tells the one at an arc length [1].
    #[must_use]
    pub fn preview(&self, s: f64, step: f64, friction: impl Fn(f64) -> f64) -> Preview {
        let mut preview = Preview::default();
        self.look_ahead(s, step, |j, ahead| {
            preview.kappa_ref[j] = self.curvature(ahead);
            preview.v_x_ref[j] = self.speed(ahead);
            preview.mu_ref[j] = friction(ahead);
        });
        preview
    }

    /// Time derivative of the preview while the arc length grows at `s_dot`.
    #[must_use]
    pub fn preview_rate(&self, s: f64, s_dot: f64, step: f64, friction: impl Fn(Dual64) -> Dual64) -> Preview {
        let mut rate = Preview::default();
        let pace = s_dot / self.schedule.speed(self.inside(s));
        self.look_ahead(s, step, |j, ahead| {
            // Every place of the reference's schedule moves at the speed there, times the pace of the whole.
            let ahead = Dual64::new(ahead, pace * self.schedule.speed(self.inside(ahead)));
            rate.kappa_ref[j] = self.curvature(ahead).eps;
            rate.v_x_ref[j] = self.tables.v_x.at(self.inside(ahead)).eps;
            rate.mu_ref[j] = friction(ahead).eps;
        });
        rate
    }

    fn look_ahead(&self, s: f64, step: f64, mut each: impl FnMut(usize, f64)) {
        let now = self.schedule.time(s);
        each(0, s);
        let mut after = 0.0;
        for j in 1..PREVIEW {
            after += step;
            each(j, self.schedule.place(now + after));
        }
    }
}

//! The reference as the importer gives it, moved to the moment at which a command takes effect.

use nalgebra::SVector;

use crate::parameters::HORIZON_MAX;

/// Elements of a preview: now and the next 40 sample times.
pub const PREVIEW: usize = HORIZON_MAX + 1;

/// A quantity now and at the next 40 sample times.
pub type Preview = SVector<f64, PREVIEW>;

/// Value of a preview `periods` after now, linear between its elements, held beyond the last.
pub fn at(preview: &Preview, periods: f64) -> f64 {
    let last = PREVIEW - 1;
    let position = periods.clamp(0.0, last as f64);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the preview above")]
    let index = (position as usize).min(last - 1);
    let fraction = position - index as f64;
    preview[index] + fraction * (preview[index + 1] - preview[index])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_met_lines_are_exact_and_the_end_is_held() {
        let line = Preview::from_fn(|i, _| 2.0 * i as f64 - 3.0);
        for periods in [0.0, 1.0, 7.0, 40.0, 0.25, 39.5] {
            assert!((at(&line, periods) - (2.0 * periods - 3.0)).abs() < 1e-12, "{periods}");
        }
        assert_eq!(at(&line, 55.0), at(&line, 40.0));
        assert_eq!(at(&line, -1.0), at(&line, 0.0));
    }
}

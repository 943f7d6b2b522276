//! The reference as the importer gives it, moved to the moment at which a command takes effect.

use nalgebra::SVector;

use crate::parameters::HORIZON_MAX;

/// Elements of a preview: now and the next 40 sample times.
pub const PREVIEW: usize = HORIZON_MAX + 1;

/// A quantity now and at the next 40 sample times.
pub type Preview = SVector<f64, PREVIEW>;

/// Index of the last element.
const LAST: usize = PREVIEW - 1;

/// Element before a moment `periods` after now, and how far it is to the next one.
fn place(periods: f64) -> (usize, f64) {
    let position = periods.clamp(0.0, LAST as f64);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the preview above")]
    let index = position as usize;
    (index, position - index as f64)
}

/// The part of a preview from `periods` after now on: linear between its elements, held beyond the last.
pub fn from(preview: &Preview, periods: f64) -> Preview {
    let (index, fraction) = place(periods);
    Preview::from_fn(|i, _| {
        let (before, after) = (preview[(i + index).min(LAST)], preview[(i + index + 1).min(LAST)]);
        before + fraction * (after - before)
    })
}

/// Value of a preview `periods` after now.
pub fn at(preview: &Preview, periods: f64) -> f64 {
    let (index, fraction) = place(periods);
    let after = (index + 1).min(LAST);
    preview[index] + fraction * (preview[after] - preview[index])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_met_lines_are_exact_and_the_end_is_held() {
        let line = Preview::from_fn(|i, _| 2.0 * i as f64 - 3.0);
        for periods in [0.0, 1.0, 7.0, 40.0, 0.25, 39.5] {
            let moved = from(&line, periods);
            for i in 0..PREVIEW {
                let expected = 2.0 * (periods + i as f64).min(40.0) - 3.0;
                assert!((moved[i] - expected).abs() < 1e-12, "{periods} {i}: {}", moved[i]);
            }
            assert_eq!(at(&line, periods), moved[0]);
        }
        assert_eq!(at(&line, 55.0), at(&line, 40.0));
        assert_eq!(at(&line, -1.0), at(&line, 0.0));
    }
}

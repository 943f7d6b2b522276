//! A smooth function on a uniform grid: cubic Hermite pieces, looked up in constant time.

use std::sync::Arc;

use crate::Scalar;

/// A function of one variable from 0 on; the end values are held outside. Copies share the table.
#[derive(Debug, Clone)]
pub struct Profile {
    per_step: f64,
    /// Number of cells, as a number to compare with.
    end: f64,
    /// Value, and slope times the grid step, at each knot.
    knots: Arc<[[f64; 2]]>,
}

impl Profile {
    /// Tabulates `f` (value and slope) from 0 to `length` with cells of at most `step`.
    pub fn new(length: f64, step: f64, mut f: impl FnMut(f64) -> (f64, f64)) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of cells, far below 2^32")]
        let cells = (length / step - 1e-9).ceil().max(1.0) as u32;
        let step = length / f64::from(cells);
        let knots = (0..=cells)
            .map(|i| {
                let (value, slope) = f(f64::from(i) * step);
                [value, slope * step]
            })
            .collect();
        Self { per_step: 1.0 / step, end: f64::from(cells), knots }
    }

    /// The function's value at `s`.
    #[inline]
    pub fn at<D: Scalar>(&self, s: D) -> D {
        let u = s * self.per_step;
        // A NaN is not inside and so indexes nothing.
        let inside = u.re() > 0.0;
        if !inside {
            return D::from(self.knots[0][0]);
        }
        if u.re() >= self.end {
            return D::from(self.knots[self.knots.len() - 1][0]);
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 < u < number of cells")]
        let i = u.re() as usize;
        #[expect(clippy::cast_precision_loss, reason = "a cell's number is far below 2^52")]
        let t = u - i as f64;
        let [[y_0, d_0], [y_1, d_1]] = [self.knots[i], self.knots[i + 1]];
        let rise = y_1 - y_0;
        // Horner's form of the cubic with these end values and end slopes.
        ((t * (d_0 + d_1 - 2.0 * rise) + (3.0 * rise - 2.0 * d_0 - d_1)) * t + d_0) * t + y_0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_error_is_of_fourth_order() {
        let worst = |step: f64| {
            let profile = Profile::new(10.0, step, |s| (s.sin(), s.cos()));
            (0..10_000).map(|i| f64::from(i) * 1e-3).map(|s| (profile.at(s) - s.sin()).abs()).fold(0.0, f64::max)
        };
        // Bound of Hermite interpolation: h^4 / 384 times the fourth derivative, here 1.
        assert!(worst(0.1) < 1e-4 / 384.0 * 1.01, "{}", worst(0.1));
        let ratio = worst(0.2) / worst(0.1);
        assert!((ratio - 16.0).abs() < 1.0, "ratio {ratio}");
    }

    #[test]
    fn outside_the_end_values_hold() {
        let profile = Profile::new(1.0, 0.1, |s| (s, 1.0));
        assert_eq!([profile.at(-3.0), profile.at(f64::NAN), profile.at(7.0)], [0.0, 0.0, 1.0]);
    }
}

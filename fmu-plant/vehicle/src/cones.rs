//! Which cones the vehicle's body has touched.

use serde::{Deserialize, Serialize};

use crate::Parameters;

/// Cones that a road may have.
const CONES_MAX: usize = 128;

/// The body's outline in its own frame [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Front end ahead of the centre of gravity.
    front: f64,
    /// Rear end behind it.
    rear: f64,
    /// Half the width.
    side: f64,
}

impl Body {
    /// The outline of a vehicle.
    #[must_use]
    pub fn new(p: &Parameters) -> Self {
        Self { front: p.l_f + p.overhang_f, rear: p.l_r + p.overhang_r, side: 0.5 * p.width }
    }

    /// Whether a place `(x, y)` lies inside the outline of a vehicle at `at` with the heading `psi`.
    #[must_use]
    pub fn covers(&self, at: [f64; 2], psi: f64, [x, y]: [f64; 2]) -> bool {
        let (sin, cos) = psi.sin_cos();
        let (d_x, d_y) = (x - at[0], y - at[1]);
        let (ahead, left) = (d_x * cos + d_y * sin, d_y * cos - d_x * sin);
        ahead <= self.front && ahead >= -self.rear && left.abs() <= self.side
    }

    /// No point of the outline is farther from the centre of gravity than this [m].
    fn reach(&self) -> f64 {
        self.front.max(self.rear) + self.side
    }
}

/// The cones that have been hit, as a set of bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Hits(u128);

impl Hits {
    /// Adds the cones under the body.
    pub fn add(&mut self, body: &Body, at: [f64; 2], psi: f64, cones: &[[f64; 2]]) {
        let reach = body.reach();
        for (i, cone) in cones.iter().take(CONES_MAX).enumerate() {
            if (cone[0] - at[0]).abs() < reach && self.0 & (1 << i) == 0 && body.covers(at, psi, *cone) {
                self.0 |= 1 << i;
            }
        }
    }

    /// How many.
    #[must_use]
    pub fn count(self) -> i32 {
        self.0.count_ones().cast_signed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cone_counts_once_and_only_under_the_body() {
        let body = Body::new(&Parameters::default());
        let cones = [[2.0, 0.0], [2.0, 5.0], [-5.0, 0.0]];
        let mut hits = Hits::default();
        for _ in 0..3 {
            hits.add(&body, [0.0, 0.0], 0.0, &cones);
        }
        assert_eq!(hits.count(), 1);
        // Turned by a quarter the body reaches to the left, where the second cone is 2 m ahead of it.
        hits.add(&body, [2.0, 3.0], std::f64::consts::FRAC_PI_2, &cones);
        assert_eq!(hits.count(), 2);
    }
}

//! The path in the plane: where each arc length lies, and which arc length belongs to a place.

use super::Profile;
use crate::integrate;

/// Grid of the path's points [m]; cubic pieces between them miss a circle of 10 m radius by 1e-8 m.
const STEP: f64 = 0.25;

/// A place and a heading in the global frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// Along the start of the road [m].
    pub x: f64,
    /// To the left of it [m].
    pub y: f64,
    /// Heading [rad].
    pub psi: f64,
}

/// The path's points over arc length.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    length: f64,
    closed: bool,
    x: Profile,
    y: Profile,
    psi: Profile,
    kappa: Profile,
    end: Pose,
    /// Sharpest curvature [1/m].
    pub kappa_max: f64,
}

impl Line {
    /// Integrates the curvature from `start`.
    pub fn new(kappa: &Profile, length: f64, closed: bool, start: Pose) -> Self {
        let mut pose = [start.psi, start.x, start.y];
        let mut kappa_max = kappa.at(0.0_f64).abs();
        let (mut y, mut psi) = (Vec::new(), Vec::new());
        let mut done = 0.0;
        let x = Profile::new(length, STEP, |s| {
            let (from, h) = (done, s - done);
            pose = integrate::rk4(&pose, h, |stage, p| {
                let offset = [0.0, 0.5 * h, h][stage];
                [kappa.at(from + offset), p[0].cos(), p[0].sin()]
            });
            done = s;
            kappa_max = kappa_max.max(kappa.at(s).abs());
            y.push((pose[2], pose[0].sin()));
            psi.push((pose[0], kappa.at(s)));
            (pose[1], pose[0].cos())
        });
        let table = |rows: Vec<(f64, f64)>| {
            let mut rows = rows.into_iter();
            Profile::new(length, STEP, |_| rows.next().expect("all tables have the same grid"))
        };
        let (y, psi) = (table(y), table(psi));
        let [psi_end, x_end, y_end] = pose;
        let end = Pose { x: x_end, y: y_end, psi: psi_end };
        Self { length, closed, x, y, psi, kappa: kappa.clone(), end, kappa_max }
    }

    /// Place and heading at `s`; straight on before the start and beyond the end, lap after lap on a closed track.
    pub fn pose(&self, s: f64) -> Pose {
        let (lap, s) = if self.closed {
            let lap = (s / self.length).floor();
            (lap, s - lap * self.length)
        } else {
            (0.0, s)
        };
        let inside = s.clamp(0.0, self.length);
        let psi = self.psi.at(inside);
        let (sin, cos) = psi.sin_cos();
        let straight = s - inside;
        Pose {
            x: self.x.at(inside) + straight * cos,
            y: self.y.at(inside) + straight * sin,
            psi: psi + lap * (self.end.psi - self.psi.at(0.0_f64)),
        }
    }

    fn curvature(&self, s: f64) -> f64 {
        let s = if self.closed { s.rem_euclid(self.length) } else { s };
        if (0.0..=self.length).contains(&s) { self.kappa.at(s) } else { 0.0 }
    }

    /// The arc length within `reach` of `near` whose point is nearest to (`x`, `y`), and the position to the left of it.
    ///
    /// Looking only nearby keeps the vehicle on its own leg of a hairpin.
    pub fn project(&self, (x, y): (f64, f64), near: f64, reach: f64) -> (f64, f64) {
        /// Coarse search [m]: half of the sharpest radius that a car can drive would be enough.
        const COARSE: f64 = 0.5;
        let square = |s: f64| {
            let pose = self.pose(s);
            (x - pose.x).powi(2) + (y - pose.y).powi(2)
        };
        let mut best = near;
        let mut least = square(near);
        let mut offset = COARSE;
        while offset <= reach {
            for s in [near - offset, near + offset] {
                let distance = square(s);
                if distance < least {
                    (best, least) = (s, distance);
                }
            }
            offset += COARSE;
        }
        // Newton's method on the tangent's share of the distance; steps stay inside the coarse grid.
        let mut s = best;
        for _ in 0..8 {
            let pose = self.pose(s);
            let (sin, cos) = pose.psi.sin_cos();
            let along = (x - pose.x) * cos + (y - pose.y) * sin;
            let left = (y - pose.y) * cos - (x - pose.x) * sin;
            let slope = (1.0 - left * self.curvature(s)).max(0.05);
            s = (s + along / slope).clamp(best - COARSE, best + COARSE);
        }
        let pose = self.pose(s);
        let (sin, cos) = pose.psi.sin_cos();
        (s, (y - pose.y) * cos - (x - pose.x) * sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circle_comes_back_to_its_start() {
        let radius = 20.0;
        let length = std::f64::consts::TAU * radius;
        let kappa = Profile::new(length, 0.05, |_| (1.0 / radius, 0.0));
        let line = Line::new(&kappa, length, true, Pose::default());
        let half = line.pose(0.5 * length);
        assert!(half.x.abs() < 1e-9 && (half.y - 2.0 * radius).abs() < 1e-9, "{half:?}");
        let lap = line.pose(1.25 * length);
        assert!((lap.x - radius).abs() < 1e-8 && (lap.y - radius).abs() < 1e-8, "{lap:?}");
        assert!((lap.psi - 2.5 * std::f64::consts::PI).abs() < 1e-8);
    }

    #[test]
    fn projection_gives_arc_length_and_offset_back() {
        let kappa = Profile::new(100.0, 0.05, |s| (0.05 * (s * 0.1).sin(), 0.005 * (s * 0.1).cos()));
        let line = Line::new(&kappa, 100.0, false, Pose::default());
        for (s, left) in [(30.0, 3.0), (47.0, -8.0), (99.0, 0.1), (104.0, -2.0), (-3.0, 1.0)] {
            let pose = line.pose(s);
            let place = (pose.x - left * pose.psi.sin(), pose.y + left * pose.psi.cos());
            let (found, offset) = line.project(place, s - 4.0, 10.0);
            assert!((found - s).abs() < 1e-6 && (offset - left).abs() < 1e-6, "{found}, {offset} for {s}, {left}");
        }
    }
}

//! The cubic smoothing spline of C. H. Reinsch, Smoothing by spline functions, Numerische Mathematik 10 (1967), 177-183.
//!
//! Written here because the crates at hand do not fit into an FMU that reads any user's file: csaps brings a thread pool,
//! and splinefit aborts the process on some closed curves.

use nalgebra::Vector2;

/// Points in the plane over a parameter, joined by cubics with continuous second derivatives.
pub struct Spline {
    u: Vec<f64>,
    points: Vec<Vector2<f64>>,
    /// Second derivatives at the points; 0 at both ends.
    bends: Vec<Vector2<f64>>,
}

impl Spline {
    /// The smoothest curve (least integral of the squared second derivative) that misses `points` by `tolerance` at most,
    /// root mean square. `u` increases; there are at least three points.
    pub fn smooth(u: &[f64], points: &[Vector2<f64>], tolerance: f64) -> Self {
        /// Halvings of the logarithmic interval below: to a ratio of 1e-3 of the smoothing.
        const HALVINGS: u32 = 16;
        // The integral is in 1/m and the misses in m2: the smoothing has the unit m3. Between these ends lie the cube of
        // 1 cm and of 500 m.
        let (mut rough, mut flat) = (1e-6_f64.ln(), 1e8_f64.ln());
        let mut best = Self::with(u, points, 0.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (rough + flat);
            let spline = Self::with(u, points, middle.exp());
            if spline.miss(points) <= tolerance {
                (rough, best) = (middle, spline);
            } else {
                flat = middle;
            }
        }
        best
    }

    /// The spline that balances misses and bends with the weight `smoothing` [m3]; 0 interpolates.
    fn with(u: &[f64], points: &[Vector2<f64>], smoothing: f64) -> Self {
        let n = u.len();
        let inner = n - 2;
        let h: Vec<f64> = u.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // Column i of Q holds the second difference around point i + 1.
        let q = |i: usize| [1.0 / h[i], -1.0 / h[i] - 1.0 / h[i + 1], 1.0 / h[i + 1]];
        // The three diagonals of R + smoothing * Q' Q.
        let mut bands = vec![[0.0; 3]; inner];
        let mut bends = vec![Vector2::zeros(); inner];
        for i in 0..inner {
            let here = q(i);
            bands[i][0] = (h[i] + h[i + 1]) / 3.0 + smoothing * here.iter().map(|x| x * x).sum::<f64>();
            if i + 1 < inner {
                let next = q(i + 1);
                bands[i][1] = h[i + 1] / 6.0 + smoothing * (here[1] * next[0] + here[2] * next[1]);
            }
            if i + 2 < inner {
                bands[i][2] = smoothing * here[2] * q(i + 2)[0];
            }
            bends[i] = points[i] * here[0] + points[i + 1] * here[1] + points[i + 2] * here[2];
        }
        solve(&mut bands, &mut bends);
        let mut smoothed = points.to_vec();
        for i in 0..inner {
            for (k, weight) in q(i).into_iter().enumerate() {
                smoothed[i + k] -= bends[i] * (smoothing * weight);
            }
        }
        bends.insert(0, Vector2::zeros());
        bends.push(Vector2::zeros());
        Self { u: u.to_vec(), points: smoothed, bends }
    }

    /// Root mean square distance from the given points.
    fn miss(&self, points: &[Vector2<f64>]) -> f64 {
        let sum: f64 = self.points.iter().zip(points).map(|(a, b)| (a - b).norm_squared()).sum();
        #[expect(clippy::cast_precision_loss, reason = "a count of points")]
        let count = points.len() as f64;
        (sum / count).sqrt()
    }

    /// Position, first and second derivative at `u`.
    pub fn at(&self, u: f64) -> [Vector2<f64>; 3] {
        let cell = self.u.partition_point(|knot| *knot <= u).clamp(1, self.u.len() - 1) - 1;
        let h = self.u[cell + 1] - self.u[cell];
        let t = (u - self.u[cell]) / h;
        let r = 1.0 - t;
        let (p_0, p_1, m_0, m_1) = (self.points[cell], self.points[cell + 1], self.bends[cell], self.bends[cell + 1]);
        [
            p_0 * r + p_1 * t + (m_0 * (r * r * r - r) + m_1 * (t * t * t - t)) * (h * h / 6.0),
            (p_1 - p_0) / h + (m_1 * (3.0 * t * t - 1.0) - m_0 * (3.0 * r * r - 1.0)) * (h / 6.0),
            m_0 * r + m_1 * t,
        ]
    }
}

/// Solves a symmetric positive definite system with two bands beside the diagonal by the LDL' decomposition.
fn solve(bands: &mut [[f64; 3]], right: &mut [Vector2<f64>]) {
    let n = bands.len();
    for i in 0..n {
        let [pivot, one, two] = bands[i];
        for (k, factor) in [(1, one / pivot), (2, two / pivot)] {
            if i + k >= n {
                continue;
            }
            bands[i + k][0] -= factor * bands[i][k];
            if k == 1 {
                bands[i + 1][1] -= factor * two;
            }
            let known = right[i];
            right[i + k] -= known * factor;
        }
    }
    for i in (0..n).rev() {
        let mut value = right[i];
        for k in 1..=2 {
            if i + k < n {
                value -= right[i + k] * bands[i][k];
            }
        }
        right[i] = value / bands[i][0];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_tolerance_the_curve_passes_through_the_points() {
        let u: Vec<f64> = (0..30).map(|i| f64::from(i) + 0.3 * f64::from(i).sin()).collect();
        let points: Vec<Vector2<f64>> = u.iter().map(|u| Vector2::new(*u, (u * 0.3).sin())).collect();
        let spline = Spline::with(&u, &points, 0.0);
        for (u, point) in u.iter().zip(&points) {
            assert!((spline.at(*u)[0][1] - point[1]).abs() < 1e-13);
        }
        // Inside, the error of cubic interpolation is h^4 / 384 times the fourth derivative 0.3^4, h up to 1.6.
        assert!((spline.at(14.5)[0][1] - (14.5_f64 * 0.3).sin()).abs() < 1.5e-4);
    }

    #[test]
    fn derivatives_match_differences() {
        let u: Vec<f64> = (0..20).map(f64::from).collect();
        let points: Vec<Vector2<f64>> = u.iter().map(|u| Vector2::new((u * 0.5).cos(), (u * 0.4).sin())).collect();
        let spline = Spline::smooth(&u, &points, 0.01);
        for at in [0.4, 7.77, 18.9] {
            let h = 1e-4;
            let [low, here, high] = [at - h, at, at + h].map(|u| spline.at(u));
            for axis in 0..2 {
                assert!(((high[0][axis] - low[0][axis]) / (2.0 * h) - here[1][axis]).abs() < 1e-7);
                assert!(((high[1][axis] - low[1][axis]) / (2.0 * h) - here[2][axis]).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn a_straight_line_survives_any_smoothing() {
        let u: Vec<f64> = (0..10).map(f64::from).collect();
        let points: Vec<Vector2<f64>> = u.iter().map(|u| Vector2::new(2.0 * u, 1.0 - u)).collect();
        let spline = Spline::with(&u, &points, 1e6);
        assert!(spline.miss(&points) < 1e-9, "{}", spline.miss(&points));
    }
}

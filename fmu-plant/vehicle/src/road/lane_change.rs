//! The double lane change of the paper's ancestors: two hyperbolic tangents.

use super::{Pose, Profile, Tables};

/// Straight before the lane change [m].
const ENTRY: f64 = 40.0;
/// Length [m]: at its end the curvature has been below 1e-7 1/m for 20 m.
const LENGTH: f64 = 200.0;
/// Grid of the tables [m]; the narrowest feature is 9 m wide, so the interpolation is good to 1e-10 1/m.
const STEP: f64 = 0.05;

/// First, second and third derivative of the lateral position over the longitudinal one, and the position itself.
///
/// Y(X) = 4.05/2 (1 + tanh z1) - 5.7/2 (1 + tanh z2), z1 = 2.4/25 (X - 27.19) - 1.2, z2 = 2.4/21.95 (X - 56.46) - 1.2.
fn path(x: f64) -> [f64; 4] {
    let lane = |width: f64, slope: f64, middle: f64| {
        let t = (slope * (x - middle) - 1.2).tanh();
        let sech_2 = 1.0 - t * t;
        let half = 0.5 * width;
        [
            half * (1.0 + t),
            half * slope * sech_2,
            half * slope.powi(2) * -2.0 * t * sech_2,
            half * slope.powi(3) * (6.0 * t * t - 2.0) * sech_2,
        ]
    };
    let (out, back) = (lane(4.05, 2.4 / 25.0, 27.19), lane(5.7, 2.4 / 21.95, 56.46));
    std::array::from_fn(|i| out[i] - back[i])
}

/// Curvature and its slope over arc length from the derivatives of the lateral position over the longitudinal one.
fn curvature([_, y_1, y_2, y_3]: [f64; 4]) -> (f64, f64) {
    let stretch = 1.0 + y_1 * y_1;
    let kappa = y_2 / stretch.powf(1.5);
    let per_x = y_3 / stretch.powf(1.5) - 3.0 * y_1 * y_2 * y_2 / stretch.powf(2.5);
    (kappa, per_x / stretch.sqrt())
}

/// Curvature over arc length of a path that is given as lateral over longitudinal position, from `x` on.
pub(super) fn from_lateral(mut x: f64, length: f64, path: impl Fn(f64) -> [f64; 4]) -> Profile {
    let mut s_done = 0.0;
    Profile::new(length, STEP, |s| {
        // dx/ds = 1 / sqrt(1 + Y'^2), by the method of Runge and Kutta.
        let h = s - s_done;
        [x] = crate::integrate::rk4(&[x], h, |_, x| [1.0 / path(x[0])[1].hypot(1.0)]);
        s_done = s;
        curvature(path(x))
    })
}

/// The manoeuvre at a constant speed [m/s].
pub(super) fn tables(speed: f64) -> Tables {
    // The tangents are followed from the very start: over the entry they are straight to 1e-6 m, and cutting them off
    // there would put a kink into the curvature.
    let kappa = from_lateral(-ENTRY, LENGTH, path);
    let [y, y_1, ..] = path(-ENTRY);
    Tables {
        start: Pose { x: 0.0, y, psi: y_1.atan() },
        ..Tables::plain(LENGTH, kappa, Profile::new(LENGTH, LENGTH, |_| (speed, 0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn driving_the_curvature_gives_the_path_back() {
        let tables = tables(14.0);
        let Pose { x, y, psi } = tables.start;
        let (h, n) = (0.01, 15_000_u32);
        let mut end = [0.0, x, y, psi];
        for _ in 0..n {
            end = crate::integrate::rk4(&end, h, |_, p| [1.0, p[3].cos(), p[3].sin(), tables.kappa.at(p[0])]);
            let want = path(end[1] - ENTRY)[0];
            assert!((end[2] - want).abs() < 1e-8, "at {} m: {} for {want}", end[0], end[2]);
        }
    }

    #[test]
    fn sharpest_curvature_is_the_published_one() {
        let tables = tables(14.0);
        let sharpest = (0..2000).map(|i| tables.kappa.at(f64::from(i) * 0.1).abs()).fold(0.0, f64::max);
        assert!((sharpest - 0.0271).abs() < 5e-5, "{sharpest} 1/m");
        assert!(tables.kappa.at(180.0_f64).abs() < 1e-7);
    }
}

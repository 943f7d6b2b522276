//! A smooth line through points.

use nalgebra::Vector2;

use super::{Geometry, smoothing::Spline};
use crate::road::Pose;

/// Distance of the places where the line is evaluated [m].
const STEP: f64 = 0.1;
/// Points below which nothing can be said about curvature.
const POINTS_MIN: usize = 4;
/// A last point this near to the first one closes the track [m].
const CLOSED: f64 = 1e-3;
/// Points of the next and the last lap that a closed line takes in, so that its ends meet smoothly.
const OVERLAP: usize = 20;

/// The line that misses points, which do not repeat, by `tolerance` [m] at most, root mean square; its length, curvature and the arc length of every point.
pub fn line(x: &[f64], y: &[f64], tolerance: f64) -> Result<Geometry, String> {
    let n = x.len();
    if n < POINTS_MIN {
        return Err(format!("{n} points are too few for a smooth line: at least {POINTS_MIN} are needed"));
    }
    let mut chords = vec![0.0];
    for i in 1..n {
        chords.push(chords[i - 1] + (x[i] - x[i - 1]).hypot(y[i] - y[i - 1]));
    }
    let total = chords[n - 1];
    if total > super::LENGTH_MAX {
        return Err(format!("{total} m are more than the {} m that are taken", super::LENGTH_MAX));
    }
    let closed = (x[n - 1] - x[0]).hypot(y[n - 1] - y[0]) < CLOSED;
    // Coordinates relative to the first point keep digits when the user's origin is far away.
    let points: Vec<Vector2<f64>> = x.iter().zip(y).map(|(px, py)| Vector2::new(px - x[0], py - y[0])).collect();
    let spline = if closed {
        let lap = n - 1;
        let around = lap.min(OVERLAP);
        let before = (lap - around..lap).map(|i| (chords[i] - total, points[i]));
        let after = (1..=around).map(|i| (chords[i] + total, points[i]));
        let whole = chords.iter().copied().zip(points.iter().copied());
        let (u, points): (Vec<f64>, Vec<Vector2<f64>>) = before.chain(whole).chain(after).unzip();
        Spline::smooth(&u, &points, tolerance)
    } else {
        Spline::smooth(&chords, &points, tolerance)
    };

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most LENGTH_MAX over STEP")]
    let cells = (total / STEP).ceil().max(4.0) as u32;
    let h = total / f64::from(cells);
    let speed = |u: f64| spline.at(u)[1].norm();
    let mut places = vec![0.0];
    let mut kappa = Vec::new();
    for cell in 0..=cells {
        let u = f64::from(cell) * h;
        let [_, first, second] = spline.at(u);
        let turn = first.perp(&second) / first.norm().powi(3);
        if turn.is_nan() || turn.abs() >= 1.0 {
            return Err(format!("the line turns with a radius below 1 m at {u} m"));
        }
        kappa.push(turn);
        if cell < cells {
            let so_far = places[places.len() - 1];
            places.push(so_far + h / 6.0 * (speed(u) + 4.0 * speed(u + 0.5 * h) + speed(u + h)));
        }
    }
    if closed {
        // The overlap leaves a difference far below the tolerance; the table must not keep a step.
        let seam = 0.5 * (kappa[0] + kappa[kappa.len() - 1]);
        kappa[0] = seam;
        *kappa.last_mut().expect("a road has places") = seam;
    }
    let nodes = chords.iter().map(|&u| interpolate(h, &places, u)).collect();
    let [place, tangent, _] = spline.at(0.0);
    let start = Pose { x: x[0] + place.x, y: y[0] + place.y, psi: tangent.y.atan2(tangent.x) };
    Ok(Geometry { length: places[places.len() - 1], closed, nodes, places, kappa, start })
}

/// Linear interpolation on a uniform grid; arc length over chord length is that smooth.
fn interpolate(h: f64, values: &[f64], u: f64) -> f64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "u lies on the grid")]
    let i = ((u / h) as usize).min(values.len() - 2);
    #[expect(clippy::cast_precision_loss, reason = "a cell's number")]
    let t = u / h - i as f64;
    values[i] + (values[i + 1] - values[i]) * t
}

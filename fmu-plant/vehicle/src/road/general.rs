//! The general track: ours, since the paper's is not published. 2 km of curves in both directions between 5 and 25 m/s
//! under a wind of 20 to 50 m/s.

use super::{Profile, Tables, Wind};
use crate::smooth::{step, step_derivatives};

/// Length [m].
const LENGTH: f64 = 2000.0;
/// Grid of the tables [m]; the shortest transition is 8 m long, so the interpolation is good to 1e-8 of its height.
const STEP: f64 = 0.2;

/// A curve: where it begins [m], the length of each transition [m], of the arc between them [m], and its curvature [1/m].
///
/// Chosen so that speed^2 times curvature stays below half of the grip, 0.5 * 0.82 * 9.81 = 4.02 m/s2 (tested), that
/// left and right alternate, and that the heading stays within 45 degrees of the start.
const CURVES: [(f64, f64, f64, f64); 19] = [
    (40.0, 18.0, 4.0, 0.022),
    (90.0, 25.0, 10.0, -0.016),
    (160.0, 35.0, 10.0, -0.0085),
    (250.0, 40.0, 60.0, 0.0078),
    (400.0, 40.0, 20.0, -0.0080),
    (510.0, 40.0, 20.0, 0.0092),
    (615.0, 20.0, 10.0, -0.029),
    (690.0, 20.0, 10.0, 0.036),
    (760.0, 20.0, 5.0, -0.034),
    (838.0, 10.0, 4.0, 0.050),
    (880.0, 8.0, 2.0, -0.080),
    (920.0, 12.0, 4.0, 0.045),
    (1000.0, 30.0, 10.0, -0.017),
    (1100.0, 40.0, 20.0, 0.0108),
    (1220.0, 50.0, 20.0, -0.0092),
    (1360.0, 60.0, 40.0, 0.0062),
    (1540.0, 60.0, 60.0, -0.0063),
    (1730.0, 60.0, 20.0, 0.0064),
    (1880.0, 40.0, 0.0, -0.0036),
];

/// Speeds [m/s] at places [m]; in between, the kinetic energy changes along a smooth step.
const SPEEDS: [(f64, f64); 12] = [
    (0.0, 12.0),
    (60.0, 12.0),
    (260.0, 22.0),
    (440.0, 22.0),
    (660.0, 10.0),
    (780.0, 10.0),
    (860.0, 5.0),
    (920.0, 5.0),
    (1240.0, 20.0),
    (1460.0, 25.0),
    (1640.0, 25.0),
    (1900.0, 15.0),
];

/// Curvature [1/m] and its slope.
fn curvature(s: f64) -> (f64, f64) {
    let mut sum = (0.0, 0.0);
    for (begin, transition, arc, kappa) in CURVES {
        let (up, down) = ((s - begin) / transition, (s - begin - transition - arc) / transition);
        sum.0 += kappa * (step(up) - step(down));
        sum.1 += kappa * (step_derivatives(up)[0] - step_derivatives(down)[0]) / transition;
    }
    sum
}

/// Speed [m/s] and its slope [1/s].
fn speed(s: f64) -> (f64, f64) {
    let mut square = (SPEEDS[0].1.powi(2), 0.0);
    for pair in SPEEDS.windows(2) {
        let ((from, before), (to, after)) = (pair[0], pair[1]);
        let t = (s - from) / (to - from);
        let rise = after.powi(2) - before.powi(2);
        square.0 += rise * step(t);
        square.1 += rise * step_derivatives(t)[0] / (to - from);
    }
    let v = square.0.sqrt();
    (v, 0.5 * square.1 / v)
}

/// Speed of the wind [m/s] and its slope [1/s]: two waves whose sum spans 20 to 50 m/s.
fn wind(s: f64) -> (f64, f64) {
    const LONG: f64 = std::f64::consts::TAU / 800.0;
    const SHORT: f64 = std::f64::consts::TAU / 160.0;
    (
        35.0 - 10.0 * (LONG * s).cos() - 5.0 * (SHORT * s).cos(),
        10.0 * LONG * (LONG * s).sin() + 5.0 * SHORT * (SHORT * s).sin(),
    )
}

/// The track.
pub(super) fn tables() -> Tables {
    Tables {
        // Against the first heading: a head wind, as in the paper's drag, that turns relative to the car in the curves.
        wind: Some(Wind { speed: Profile::new(LENGTH, STEP, wind), direction: [-1.0, 0.0] }),
        ..Tables::plain(LENGTH, Profile::new(LENGTH, STEP, curvature), Profile::new(LENGTH, STEP, speed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places() -> impl Iterator<Item = f64> {
        (0..=20_000).map(|i| f64::from(i) * 0.1)
    }

    fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    }

    #[test]
    fn demands_are_what_the_manoeuvre_promises() {
        let lateral = span(places().map(|s| curvature(s).0 * speed(s).0.powi(2)));
        let limit = 0.5 * 0.82 * 9.81;
        assert!(lateral.1 < limit && lateral.1 > 0.9 * limit, "to the left {} of {limit} m/s2", lateral.1);
        assert!(-lateral.0 < limit && -lateral.0 > 0.9 * limit, "to the right {} of {limit} m/s2", -lateral.0);
        let (slowest, fastest) = span(places().map(|s| speed(s).0));
        assert!((slowest - 5.0).abs() < 1e-9 && (fastest - 25.0).abs() < 1e-9, "{slowest} to {fastest} m/s");
        let (braking, driving) = span(places().map(|s| speed(s).0 * speed(s).1));
        assert!(braking > -2.0 && driving < 2.0, "{braking} to {driving} m/s2");
        let (calm, storm) = span(places().map(|s| wind(s).0));
        assert!((calm - 20.0).abs() < 0.1 && (storm - 50.0).abs() < 0.5, "{calm} to {storm} m/s");
    }

    #[test]
    fn slopes_are_the_derivatives() {
        for s in places().filter(|s| *s > 1.0 && *s < 1999.0) {
            for (name, f) in [("curvature", curvature as fn(f64) -> (f64, f64)), ("speed", speed), ("wind", wind)] {
                let h = 1e-3;
                let difference = (f(s + h).0 - f(s - h).0) / (2.0 * h);
                // Central differences: h^2 times the third derivative, plus cancellation of values up to 50.
                assert!((difference - f(s).1).abs() < 1e-8, "{name} at {s} m: {difference} for {}", f(s).1);
            }
        }
    }

    #[test]
    fn heading_stays_within_45_degrees() {
        let mut heading = 0.0;
        let (right, left) = span(places().map(|s| {
            heading += curvature(s).0 * 0.1;
            heading
        }));
        let limit = std::f64::consts::FRAC_PI_4;
        assert!(right > -limit && left < limit, "{right} to {left} rad");
    }
}

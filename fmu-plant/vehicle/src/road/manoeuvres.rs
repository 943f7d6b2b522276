//! Plain manoeuvres: straight, open-loop steering, constant radius, and a closed circuit.

use std::f64::consts::PI;

use super::{Profile, Tables};
use crate::{
    events::Form,
    smooth::{step, step_derivatives},
};

/// Length of the straight roads [m]: a minute at 33 m/s.
const STRAIGHT: f64 = 2000.0;
/// Straight and transition before a circle [m].
const ENTRY: f64 = 50.0;
/// Grid of the tables [m]; transitions are 40 m long and more.
const STEP: f64 = 0.2;

/// A straight road at a constant speed [m/s].
pub(super) fn straight(speed: f64) -> Tables {
    Tables::plain(STRAIGHT, constant(STRAIGHT, 0.0), constant(STRAIGHT, speed))
}

/// A straight road on which the manoeuvre steers by itself.
pub(super) fn open_loop(form: Form, speed: f64) -> Tables {
    Tables { steering: Some(form), ..straight(speed) }
}

/// A straight, a transition and two full circles of `radius` [m], positive to the left, after ISO 4138.
pub(super) fn constant_radius(radius: f64, speed: f64) -> Tables {
    let length = 2.0 * ENTRY + 4.0 * PI * radius.abs();
    let kappa = Profile::new(length, STEP, |s| {
        let t = (s - ENTRY) / ENTRY;
        (step(t) / radius, step_derivatives(t)[0] / (ENTRY * radius))
    });
    Tables::plain(length, kappa, constant(length, speed))
}

/// A closed track: two straights and two half circles of 40 m radius, 12 to 18 m/s, to the left.
pub(super) fn circuit() -> Tables {
    const RADIUS: f64 = 40.0;
    const TRANSITION: f64 = 40.0;
    const RUN: f64 = 200.0;
    /// Where the car speeds up and slows down on each straight [m], and the speeds [m/s]: 12 m/s are 3.6 m/s2 in the
    /// curves, and the change takes 1.8 m/s2.
    const CHANGE: f64 = 95.0;
    const SPEEDS: (f64, f64) = (12.0, 18.0);
    // Half a turn each: transitions count half, so that the track closes exactly.
    let arc = PI * RADIUS - TRANSITION;
    let half = RUN + 2.0 * TRANSITION + arc;
    let kappa = Profile::new(2.0 * half, STEP, |s| {
        let s = s % half;
        let (up, down) = ((s - RUN) / TRANSITION, (s - RUN - TRANSITION - arc) / TRANSITION);
        let slope = step_derivatives(up)[0] - step_derivatives(down)[0];
        ((step(up) - step(down)) / RADIUS, slope / (TRANSITION * RADIUS))
    });
    let v_x = Profile::new(2.0 * half, STEP, |s| {
        let s = s % half;
        let (up, down) = (s / CHANGE, (s - RUN + CHANGE) / CHANGE);
        let rise = SPEEDS.1.powi(2) - SPEEDS.0.powi(2);
        let v = (SPEEDS.0.powi(2) + rise * (step(up) - step(down))).sqrt();
        let slope = rise * (step_derivatives(up)[0] - step_derivatives(down)[0]) / CHANGE;
        (v, 0.5 * slope / v)
    });
    Tables { closed: true, ..Tables::plain(2.0 * half, kappa, v_x) }
}

fn constant(length: f64, value: f64) -> Profile {
    Profile::new(length, length, |_| (value, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::road::{Pose, line::Line};

    #[test]
    fn circuit_closes() {
        let tables = circuit();
        let line = Line::new(&tables.kappa, tables.length, false, Pose::default());
        let end = line.pose(tables.length);
        assert!(end.x.hypot(end.y) < 1e-6, "{end:?}");
        assert!((end.psi - 2.0 * PI).abs() < 1e-9);
    }

    #[test]
    fn circle_has_its_radius_to_either_side() {
        for radius in [30.0, -100.0] {
            let tables = constant_radius(radius, 10.0);
            assert!((tables.kappa.at(tables.length * 0.7) - 1.0 / radius).abs() < 1e-15);
        }
    }
}

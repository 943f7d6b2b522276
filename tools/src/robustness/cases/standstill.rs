//! Slow down to a stop in a bend, hold, drive away.

use std::f64::consts::PI;

use super::{CM, Case, lateral, within, worse};
use crate::recording::Recording;
use crate::robustness::scenario::Scenario;

/// Speed before and after [m/s].
const SPEED: f64 = 25.0;
/// When braking begins [s] and how firmly [m/s2].
const BRAKES: (f64, f64) = (3.0, 3.0);
/// How long the car stands [s].
const HOLD: f64 = 6.0;
/// How it drives away [m/s2].
const DRIVE: f64 = 2.0;
/// When the reference stands and when it drives away [s].
const STANDS: f64 = BRAKES.0 + SPEED / BRAKES.1;
const LEAVES: f64 = STANDS + HOLD;
/// End of the run [s]: five seconds at speed.
const END: f64 = LEAVES + SPEED / DRIVE + 5.0;

/// The wanted speed [m/s] at a time [s].
fn speed(t: f64) -> f64 {
    let braked = SPEED - BRAKES.1 * (t - BRAKES.0);
    let driven = DRIVE * (t - LEAVES);
    braked.max(driven).clamp(0.0, SPEED)
}

pub(super) fn cases() -> Vec<Case> {
    let bend = |name: &str| {
        // 3.1 m/s2 in the bend at full speed: its curvature keeps the wheels turned while the car stands.
        Scenario::on("constant_radius")
            .with(&[("plant.radius", 200.0), ("plant.speed", SPEED)])
            .at_speeds(speed)
            .until(END)
            .called(name)
    };
    let noisy = || bend("sensor noise").with(&[("plant.noise_scale", 1.0)]);
    let slow = || bend("lag 0.1 s, delay 50 ms").slowed(0.1, 0.05, 0.05);
    let hill = || bend("uphill 5 %").with(&[("plant.grade", 0.05)]);
    let steering = ("deg", 180.0 / PI);
    vec![
        Case {
            name: "stop_steering",
            asked: "25 -> 0 -> 25 m/s: steering while standing, peak to peak",
            // A tenth of a degree at the wheels is what nobody sees.
            limit: Some(0.1_f64.to_radians()),
            unit: steering,
            scenarios: vec![bend("ideal"), slow(), hill()],
            measure: steering_at_rest,
        },
        Case {
            name: "stop_steering_noise",
            asked: "25 -> 0 -> 25 m/s, sensor noise: steering while standing",
            limit: Some(0.1_f64.to_radians()),
            unit: steering,
            scenarios: vec![noisy()],
            measure: steering_at_rest,
        },
        Case {
            name: "stop_creep",
            asked: "25 -> 0 -> 25 m/s: way made while standing",
            // The way of a wheel that turns by a few degrees.
            limit: Some(0.05),
            unit: CM,
            scenarios: vec![bend("ideal"), slow(), hill(), noisy()],
            measure: creep,
        },
        Case {
            name: "stop_lateral",
            asked: "25 -> 0 -> 25 m/s: lateral error",
            limit: Some(0.05),
            unit: CM,
            scenarios: vec![bend("ideal"), slow(), hill(), noisy()],
            measure: lateral,
        },
        Case {
            name: "stop_speed",
            asked: "25 -> 0 -> 25 m/s: speed error",
            limit: None,
            unit: ("m/s", 1.0),
            scenarios: vec![bend("ideal"), slow(), hill(), noisy()],
            measure: speed_error,
        },
    ]
}

/// The second half of standing: the first one lets it settle.
fn standing(run: &Recording, column: &str) -> Vec<f64> {
    within(run, column, STANDS + HOLD / 2.0, LEAVES - 0.1).collect()
}

fn steering_at_rest(run: &Recording) -> f64 {
    span(&standing(run, "delta"))
}

fn creep(run: &Recording) -> f64 {
    span(&standing(run, "s"))
}

fn span(values: &[f64]) -> f64 {
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, worse);
    let lowest = values.iter().map(|value| -value).fold(f64::NEG_INFINITY, worse);
    highest + lowest
}

fn speed_error(run: &Recording) -> f64 {
    let times = run.column("t").into_iter();
    times.zip(run.column("v_x_true")).map(|(t, v_x)| (v_x - speed(t)).abs()).fold(0.0, worse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_brakes_stands_and_drives_away() {
        assert_eq!(
            [speed(0.0), speed(BRAKES.0), speed(STANDS), speed(LEAVES), speed(END)],
            [25.0, 25.0, 0.0, 0.0, 25.0]
        );
        for i in 0..1000 {
            let (t, h) = (f64::from(i) * END / 1000.0, 1e-3);
            let a_x = (speed(t + h) - speed(t)) / h;
            assert!((-BRAKES.1 - 1e-9..=DRIVE + 1e-9).contains(&a_x), "{a_x} m/s2 at {t} s");
        }
    }

    #[test]
    fn a_span_counts_from_the_lowest_to_the_highest() {
        assert_eq!(span(&[1.0, -2.0, 0.5]), 3.0);
        assert!(span(&[1.0, f64::NAN]).is_nan());
    }
}

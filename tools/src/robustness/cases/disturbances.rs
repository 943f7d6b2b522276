//! Wind from the side and from ahead, slopes, and a start far from the path, on the straight.

use std::f64::consts::{FRAC_PI_2, PI};

use super::{CM, Case, Measure, SEEDS, lateral, lateral_from, within, worse};
use crate::recording::Recording;
use crate::robustness::scenario::Scenario;

/// When a gust begins [s].
const GUST: f64 = 2.0;
/// How long it rises [s]: the shortest that the plant takes, a wall of wind.
const RISE: f64 = 0.01;
/// What drive is left [m/s2]: a motor of 32 kW at 25 m/s, while the head wind and the rolling resistance take 1.16 m/s2.
const WEAK: f64 = 0.8;

/// A wind on the straight that begins after [`GUST`] and stays.
fn wind(speed: f64, wind: f64, direction: f64) -> Scenario {
    Scenario::on("straight").with(&[
        ("plant.speed", speed),
        ("plant.gust_start", GUST),
        ("plant.gust_rise", RISE),
        ("plant.gust_hold", 1e5),
        ("plant.gust_speed", wind),
        ("plant.gust_direction", direction),
    ])
}

pub(super) fn cases() -> Vec<Case> {
    let side: Vec<Scenario> = [14.0, 25.0, 35.0]
        .into_iter()
        .flat_map(|speed| {
            [("left", FRAC_PI_2), ("right", -FRAC_PI_2)].map(|(name, direction)| {
                wind(speed, 35.0, direction).until(GUST + 4.0).called(format!("{speed} m/s, to the {name}"))
            })
        })
        .collect();
    let case =
        |name, asked, limit, scenarios, measure: Measure| Case { name, asked, limit, unit: CM, scenarios, measure };
    vec![
        case("crosswind", "35 m/s of crosswind at once, 2 s later", Some(0.005), side.clone(), |run| {
            lateral_from(run, GUST + RISE + 2.0)
        }),
        case("crosswind_peak", "35 m/s of crosswind at once, at its worst", None, side, lateral),
        case("head_wind", "a_x saturated by 50 m/s of head wind at 25 m/s", Some(0.1), head_wind(), lateral),
        case(
            "head_wind_bends",
            "general track in its wind with a drive of 0.8 m/s2",
            Some(0.1),
            vec![Scenario::on("general").with(&[("plant.a_x_max", WEAK), ("controller.a_x_max", WEAK)]).called("told")],
            lateral,
        ),
        case("slope", "grade and bank of 5 %, after 4 s", Some(0.005), slopes(), |run| lateral_from(run, 4.0)),
        // Back on the path to the noise of a position sensor.
        case("far_start", "3 m and 60 deg off the path, after 15 s", Some(0.01), far_starts(), |run| {
            lateral_from(run, 15.0)
        }),
        Case {
            unit: ("deg", 180.0 / PI),
            ..case(
                "far_start_steering",
                "3 m and 60 deg off the path, steering in one period",
                Some(0.8 * 0.033 + 1e-9),
                far_starts(),
                steering_jump,
            )
        },
    ]
}

/// The drive is too weak for the wind: the car slows down, and must do so on the path. Exactly from ahead nothing disturbs it;
/// the wind also comes from 10 degrees beside, and sensors are noisy.
fn head_wind() -> Vec<Scenario> {
    let weak = |told: f64, direction: f64| {
        wind(25.0, 50.0, direction).with(&[("plant.a_x_max", WEAK), ("controller.a_x_max", told)]).until(40.0)
    };
    let beside = PI - 10.0_f64.to_radians();
    let noisy = SEEDS.map(|seed| {
        weak(WEAK, beside)
            .with(&[("plant.noise_scale", 1.0), ("plant.seed", seed)])
            .called(format!("noise, seed {seed}"))
    });
    [
        weak(WEAK, PI).called("from ahead"),
        weak(WEAK, beside).called("10 deg from the left"),
        weak(WEAK, -beside).called("10 deg from the right"),
        weak(4.0, beside).called("controller not told of the weak drive"),
    ]
    .into_iter()
    .chain(noisy)
    .collect()
}

fn slopes() -> Vec<Scenario> {
    [("uphill", 0.05, 0.0), ("downhill", -0.05, 0.0), ("bank", 0.0, 0.05), ("all", 0.05, -0.05)]
        .map(|(name, grade, bank)| {
            Scenario::on("straight")
                .with(&[("plant.speed", 20.0), ("plant.grade", grade), ("plant.bank", bank)])
                .until(12.0)
                .called(name)
        })
        .into()
}

/// Far from the path and not along it.
fn far_starts() -> Vec<Scenario> {
    let degrees = 60.0_f64.to_radians();
    [(3.0, 0.0), (-3.0, 0.0), (0.0, degrees), (3.0, degrees), (3.0, -degrees)]
        .into_iter()
        .flat_map(|(e_y, e_psi): (f64, f64)| {
            [5.0, 10.0, 15.0].map(|speed| {
                Scenario::on("straight")
                    .with(&[("plant.speed", speed), ("plant.e_y_0", e_y), ("plant.e_psi_0", e_psi)])
                    .until(20.0)
                    .called(format!("{e_y} m, {:.0} deg, {speed} m/s", e_psi.to_degrees()))
            })
        })
        .collect()
}

/// Largest change of the steering command from one communication point to the next [rad].
fn steering_jump(run: &Recording) -> f64 {
    let commands: Vec<f64> = within(run, "delta", 0.0, f64::INFINITY).collect();
    commands.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, worse)
}

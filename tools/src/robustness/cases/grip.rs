//! At and beyond the limit of grip, and on ice that begins in mid-manoeuvre.

use vehicle::{Parameters, Road};

use super::{CM, Case, lateral};
use crate::robustness::scenario::Scenario;

/// Steering rate of a road car's actuator [rad/s]; 0.4 to 0.8 are usual.
const STEERING_RATE: f64 = 0.5;
/// Steering rate that follows the lane change at 4 m/s at best [rad/s], and speeds that are wanted all the same [m/s].
const SLOW_RATE: f64 = 0.07;
const SLOW: [f64; 3] = [5.0, 8.0, 14.0];
/// Where the patch begins [m]: between the two lane changes, while the car is still turning.
const PATCH: f64 = 90.0;
/// Friction on the patch over that of the road: 0.4 over 0.82.
const PATCH_MU: f64 = 0.4 / 0.82;
/// What a planner that sees the patch uses of the grip there [1], and how it brakes before it [m/s2]: with a speed of 14 m/s
/// in the first half of the manoeuvre a third of the grip is left to brake with.
const SHARE: f64 = 0.8;
const BRAKING: f64 = 2.0;

/// Speeds of the lane change over the patch [m/s]: its second half asks for all grip there at 12 m/s.
const PATCHED: [f64; 3] = [12.0, 14.0, 16.0];

pub(super) fn cases() -> Vec<Case> {
    let at = |speed: f64| steered(speed, STEERING_RATE);
    let range = (0..=24).flat_map(|i| {
        let speed = 14.0 + 0.25 * f64::from(i);
        let quick = Scenario::lane_change(speed).called(format!("{speed} m/s, 0.8 rad/s"));
        [at(speed).called(format!("{speed} m/s, 0.5 rad/s")), quick]
    });
    let case = |name, asked, limit, scenarios| Case { name, asked, limit, unit: CM, scenarios, measure: lateral };
    vec![
        case("grip_17", "lane change at 17 m/s, grip ends at 17.2 m/s", Some(0.3), vec![at(17.0)]),
        case("grip_20", "lane change at 20 m/s", Some(1.5), vec![at(20.0)]),
        // What is borne at 20 m/s is borne below it: a controller that slows down late fails in between.
        case("grip_range", "lane change at any speed from 14 to 20 m/s", Some(1.5), range.collect()),
        case(
            "slow_steering",
            "lane change at 5, 8 and 14 m/s, steering rate 0.07 rad/s",
            Some(0.5),
            SLOW.map(|speed| steered(speed, SLOW_RATE).called(format!("{speed} m/s"))).into(),
        ),
        case(
            "patch",
            "friction falls to 0.4 in mid-manoeuvre, seen in the preview",
            Some(0.5),
            PATCHED.map(on_ice).into(),
        ),
        case(
            "patch_planned",
            "friction falls to 0.4, not seen, but the wanted speed minds it",
            Some(0.5),
            vec![Scenario::along(lane_change_over_ice(14.0)).unaware_of_friction().called("14.0 m/s")],
        ),
        case(
            "patch_unseen",
            "friction falls to 0.4, neither seen nor minded",
            None,
            PATCHED.map(|speed| on_ice(speed).unaware_of_friction()).into(),
        ),
    ]
}

/// The lane change with a steering rate [rad/s] that both sides know.
fn steered(speed: f64, rate: f64) -> Scenario {
    Scenario::lane_change(speed).with(&[("plant.delta_rate_max", rate), ("controller.delta_rate_max", rate)])
}

/// The lane change with a patch from [`PATCH`] on.
fn on_ice(speed: f64) -> Scenario {
    Scenario::lane_change(speed).with(&[
        ("plant.patch_start", PATCH),
        ("plant.patch_length", 1e3),
        ("plant.patch_mu", PATCH_MU),
    ])
}

/// The lane change with friction 0.4 from [`PATCH`] on, and with the speed that a planner asks for that sees it: what the
/// curvature permits there, braked for in time.
fn lane_change_over_ice(speed: f64) -> String {
    /// Distance of the table's rows [m]; the curvature's features are 9 m long and more.
    const STEP: f64 = 0.5;
    /// Length of the smooth edge of the patch [m].
    const EDGE: f64 = 2.0;
    let p = Parameters { speed, ..Parameters::default() };
    let road = Road::named("double_lane_change", &p).expect("the plant's own manoeuvre");
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "400 rows")]
    let rows = (road.length() / STEP) as usize;
    let places: Vec<f64> = (0..=rows).map(|row| row as f64 * STEP).collect();
    let mu = |s: f64| 1.0 + (PATCH_MU - 1.0) * ((s - PATCH + EDGE) / EDGE).clamp(0.0, 1.0);
    let permitted = |s: f64| {
        let kappa = road.curvature(s).abs().max(1e-6);
        // Off the patch the wanted speed is given; a lane change at 14 m/s is within the grip there.
        if s < PATCH - EDGE { speed } else { (SHARE * p.mu * mu(s) * p.g / kappa).sqrt().min(speed) }
    };
    let mut v_x: Vec<f64> = places.iter().map(|s| permitted(*s)).collect();
    for i in (0..rows).rev() {
        v_x[i] = v_x[i].min((v_x[i + 1].powi(2) + 2.0 * BRAKING * STEP).sqrt());
    }
    for i in 1..=rows {
        v_x[i] = v_x[i].min((v_x[i - 1].powi(2) + 2.0 * BRAKING * STEP).sqrt());
    }
    let line = |(s, v_x): (&f64, &f64)| format!("{s},{},{v_x},{}\n", road.curvature(*s), mu(*s));
    "s,kappa,v_x,mu\n".to_owned() + &places.iter().zip(&v_x).map(line).collect::<String>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_planned_speed_is_what_ice_and_brakes_permit() {
        let table = lane_change_over_ice(14.0);
        let rows: Vec<[f64; 4]> = table
            .lines()
            .skip(1)
            .map(|line| {
                let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
                [cells[0], cells[1], cells[2], cells[3]]
            })
            .collect();
        for [s, kappa, v_x, mu] in &rows {
            let lateral = v_x * v_x * kappa.abs();
            // Share of the grip; the dry half is driven as it comes.
            let permitted = if *s < PATCH { 1.0 } else { SHARE };
            assert!(lateral <= permitted * 0.82 * mu * 9.81 + 1e-9, "{lateral} m/s2 at {s} m, friction {mu}");
        }
        let hardest = rows.windows(2).map(|w| (w[1][2].powi(2) - w[0][2].powi(2)) / (2.0 * (w[1][0] - w[0][0])));
        for a_x in hardest {
            assert!(a_x.abs() <= BRAKING + 1e-9, "{a_x} m/s2");
        }
        let slowest = rows.iter().map(|row| row[2]).fold(f64::INFINITY, f64::min);
        // sqrt(0.8 * 0.4 * 9.81 / 0.0271), at the sharpest place of the second half.
        assert!((slowest - 10.76).abs() < 0.01, "{slowest} m/s");
    }
}

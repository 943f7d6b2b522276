//! Slow and late actuators, known to the controller and known a little wrong; bad sensors.

use super::{CM, Case, SEEDS, lateral};
use crate::robustness::scenario::Scenario;

/// Speed of the lane change [m/s].
const SPEED: f64 = 14.0;
/// Speeds of the lane change up to the limit of grip [m/s].
const FAST: [f64; 3] = [14.0, 15.0, 17.0];
/// How far the assumed delay is off [s].
const WRONG: f64 = 0.02;

pub(super) fn cases() -> Vec<Case> {
    let slow = |assumed: f64| Scenario::lane_change(SPEED).slowed(0.1, 0.05, assumed);
    let told = || slow(0.05).called("told");
    let wrong = || [slow(0.05 - WRONG).called("20 ms too short"), slow(0.05 + WRONG).called("20 ms too long")];
    let noisy = SEEDS.into_iter().flat_map(|seed| {
        let [short, long] = wrong();
        [told(), short, long].map(|scenario| {
            let name = format!("{}, seed {seed}", scenario.name);
            scenario.with(&[("plant.noise_scale", 1.0), ("plant.seed", seed)]).called(name)
        })
    });
    let bad_sensors = SEEDS
        .map(|seed| {
            Scenario::lane_change(SPEED)
                .with(&[("plant.noise_scale", 3.0), ("plant.seed", seed)])
                .called(format!("seed {seed}"))
        })
        .into();
    let late = |road: &str, more: &[(&str, f64)]| -> Vec<Scenario> {
        [0.1, 0.15, 0.2, 0.25]
            .into_iter()
            .flat_map(|delay: f64| [-WRONG, 0.0, WRONG].map(|wrong| (delay, delay + wrong)))
            .map(|(delay, assumed)| {
                let name = format!("{:.0} ms, assumed {:.0}", 1e3 * delay, 1e3 * assumed);
                Scenario::on(road).slowed(0.0, delay, assumed).with(more).called(name)
            })
            .collect()
    };
    let untold = |scenario: Scenario, name: &str, lag: f64| {
        scenario.with(&[("plant.tau_delta", lag)]).called(format!("{name}, {:.0} ms", 1e3 * lag))
    };
    let late_untold = [0.05, 0.1, 0.15]
        .into_iter()
        .flat_map(|lag| {
            let lane_changes = FAST.map(|speed| untold(Scenario::lane_change(speed), &format!("{speed} m/s"), lag));
            let noisy = Scenario::lane_change(SPEED).with(&[("plant.noise_scale", 1.0)]);
            let others = [untold(noisy, "noise", lag), untold(Scenario::on("general"), "general track", lag)];
            lane_changes.into_iter().chain(others)
        })
        .collect();
    let gust = [("plant.speed", 25.0), ("plant.gust_speed", 20.0)];
    let case =
        |name, asked, limit, scenarios| Case { name, asked, limit: Some(limit), unit: CM, scenarios, measure: lateral };
    vec![
        case("slow_told", "lane change at 14 m/s, lag 0.1 s, delay 50 ms, told", 0.02, vec![told()]),
        case("slow_wrong", "lane change at 14 m/s, lag 0.1 s, delay assumed 20 ms wrong", 0.03, wrong().into()),
        case("slow_noise", "lane change at 14 m/s, lag 0.1 s, told or wrong, sensor noise", 0.03, noisy.collect()),
        case(
            "very_slow",
            "lane change at 14 m/s, lag 0.3 s, delay 250 ms, told",
            0.04,
            vec![Scenario::lane_change(SPEED).slowed(0.3, 0.25, 0.25).called("told")],
        ),
        // The car must not be lost: half a metre is what a lane leaves on either side.
        case("late_untold", "lane change and general track, lag 0.05 to 0.15 s, not told", 0.5, late_untold),
        case("fast_wrong", "general track to 25 m/s, delay 0.1 to 0.25 s, 20 ms wrong", 0.5, late("general", &[])),
        case("fast_gust", "gust of 20 m/s at 25 m/s, delay 0.1 to 0.25 s, 20 ms wrong", 0.5, late("straight", &gust)),
        // No more than ten of the position sensor's deviations: the car must not be lost to what it does not know.
        case("bad_sensors", "sensor noise three times what is assumed, at 14 m/s", 0.3, bad_sensors),
    ]
}

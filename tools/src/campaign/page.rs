//! The page of a campaign.

use super::{FRICTION, MODES, Outcome, Situation};
use crate::plots::{BLUE, Chart, Curve, GREY, ORANGE, assemble, chart};

/// Lateral error at which the page cuts its curves, so that the small ones can be told apart [m].
const SHOWN: f64 = 0.12;
/// Friction at which the situations with sensor noise are driven [1].
const NOMINAL: f64 = 0.82;

/// Error over speed for each friction value, and with sensor noise.
pub(super) fn of(results: &[Outcome]) -> String {
    const CHARTS: [[&str; 3]; 4] = [
        ["mu04", "Friction 0.4, no sensor noise", "The network was trained at 0.82."],
        ["mu06", "Friction 0.6, no sensor noise", ""],
        ["mu082", "Friction 0.82, no sensor noise", "What the network was trained for."],
        ["mu10", "Friction 1.0, no sensor noise", ""],
    ];
    let lane_changes = |mu: f64, noise: f64| -> Vec<&Outcome> {
        let is_one = |Situation { road, tyre, mu: friction, noise: scale, .. }: &Situation| {
            *road == "double_lane_change" && *tyre == "dry_asphalt" && *friction == mu && *scale == noise
        };
        results.iter().filter(|result| is_one(&result.situation)).collect()
    };
    let mut charts: Vec<Chart> =
        CHARTS.into_iter().zip(FRICTION).map(|(labels, mu)| over_speed(labels, &lane_changes(mu, 0.0))).collect();
    let noisy = lane_changes(NOMINAL, 1.0);
    charts.push(over_speed(["noise", "Friction 0.82, sensor noise", &lost(&noisy)], &noisy));
    assemble(
        "Adaptation against constant stiffness",
        "Double lane change, dry asphalt tyre, ideal actuators. The network was trained at friction 0.82. A cross above \
         12 cm is a car that left the road in every run, a point at 12 cm an error of 12 cm or more.",
        "",
        &charts,
    )
}

/// Error over speed of every mode: the mean over the runs that stayed on the road, and a cross above the cut where none did.
fn over_speed(labels: [&str; 3], runs: &[&Outcome]) -> Chart {
    let speed: Vec<f64> = runs.iter().map(|run| run.situation.speed).collect();
    let top = 100.0 * SHOWN;
    let shown = |run: &&Outcome, mode: usize| run.mean(mode).map_or(f64::NAN, |(e_y, _)| (100.0 * e_y).min(top));
    let curve = |mode: usize, color| {
        Curve::new(MODES[mode], &speed, runs.iter().map(|run| shown(run, mode)).collect(), color).with_points()
    };
    let crosses = |(mode, color): (usize, _)| {
        let left = |(run, speed): (&&Outcome, &f64)| run.mean(mode).is_none().then_some(*speed);
        let at: Vec<f64> = runs.iter().zip(&speed).filter_map(left).collect();
        let name = format!("{}, off the road", MODES[mode]);
        // One above the other, as often several modes leave the road at one speed.
        let height = top + 0.4 * (mode + 1) as f64;
        (!at.is_empty()).then(|| Curve::new(name, &at, vec![height; at.len()], color).crosses())
    };
    let mut curves = vec![curve(0, GREY).dashed(), curve(1, ORANGE), curve(2, BLUE)];
    curves.extend([GREY, ORANGE, BLUE].into_iter().enumerate().filter_map(crosses));
    chart(labels, ["speed [m/s]", "max |e_y| [cm], cut at 12 cm"], curves)
}

/// What the curves leave out: the runs that left the road.
fn lost(runs: &[&Outcome]) -> String {
    let left = |run: &Outcome, mode: usize| {
        let (left, all, speed) = (run.left(mode), run.runs.len(), run.situation.speed);
        (left > 0).then(|| format!("{} at {speed:.1} m/s in {left} of {all}", MODES[mode]))
    };
    let all: Vec<String> =
        runs.iter().flat_map(|run| (0..MODES.len()).filter_map(move |mode| left(run, mode))).collect();
    let lost = if all.is_empty() { "none".to_owned() } else { all.join("; ") };
    format!("Means over the seeds with which the car stayed on the road. Left it: {lost}.")
}

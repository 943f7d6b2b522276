//! The page of a campaign.

use super::{FRICTION, MODES, Outcome, Situation};
use crate::plots::{BLUE, Chart, Curve, GREY, ORANGE, assemble, chart};

/// Lateral error at which the page cuts its curves, so that the small ones can be told apart [m].
const SHOWN: f64 = 0.12;

/// Error over speed for each friction value.
pub(super) fn of(results: &[Outcome]) -> String {
    const CHARTS: [[&str; 3]; 4] = [
        ["mu04", "Friction 0.4", "The network was trained at 0.82."],
        ["mu06", "Friction 0.6", ""],
        ["mu082", "Friction 0.82", "What the network was trained for."],
        ["mu10", "Friction 1.0", ""],
    ];
    let charts: Vec<Chart> = CHARTS
        .into_iter()
        .zip(FRICTION)
        .map(|(labels, mu)| {
            let runs: Vec<&Outcome> = results
                .iter()
                .filter(|r| {
                    let Situation { road, tyre, mu: friction, noise, .. } = r.situation;
                    road == "double_lane_change" && tyre == "dry_asphalt" && friction == mu && noise == 0.0
                })
                .collect();
            let speed: Vec<f64> = runs.iter().map(|r| r.situation.speed).collect();
            let curve = |mode: usize, color| {
                Curve::new(MODES[mode], &speed, runs.iter().map(|r| 100.0 * r.e_y[mode].min(SHOWN)).collect(), color)
            };
            chart(
                labels,
                ["speed [m/s]", "max |e_y| [cm], cut at 12 cm"],
                vec![curve(0, GREY).dashed(), curve(1, ORANGE), curve(2, BLUE)],
            )
        })
        .collect();
    assemble(
        "Adaptation against constant stiffness",
        "Double lane change, dry asphalt tyre, ideal actuators. The network was trained at friction 0.82.",
        "",
        &charts,
    )
}

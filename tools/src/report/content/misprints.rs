//! The errata: the table, the printed matrices in the loop, and one sample of latency without compensation.

use anyhow::Result;
use lpv_mpc::{Controller, Parameters};

use super::{Findings, numbers};
use crate::plots::{BLUE, Curve, GREEN, GREY, ORANGE, PURPLE, Page, RED, chart};
use crate::recording::Recording;
use crate::report::errata::{Shot, Unaware, until_gone};
use crate::report::runs::{Figures, ROAD, Situation, drive, prepare};

/// The table of the errata.
const ERRATA: &str = include_str!("../errata.md");

/// One sample of latency with the controller's compensation and without it, with the shipped weights and with the paper's.
pub fn late() -> Result<Vec<(&'static str, Recording)>> {
    let ours = || prepare(Situation::LaneChange, &[]);
    let paper = || -> Result<_> {
        let (plant, _, settings) = ours()?;
        Ok((plant, Controller::new(Parameters::paper(), 0.0)?, settings))
    };
    let mut runs = Vec::new();
    let step = Parameters::paper().t_s;
    for (names, build) in [
        (["shipped weights, told", "shipped weights, not told"], &ours as &dyn Fn() -> Result<_>),
        (["paper's weights, told", "paper's weights, not told"], &paper),
    ] {
        let (mut plant, mut controller, _) = build()?;
        runs.push((names[0], until_gone(drive(Situation::LaneChange, &mut plant, &mut controller, step)?).0));
        let (mut plant, controller, _) = build()?;
        let run = drive(Situation::LaneChange, &mut plant, &mut Unaware(controller), step)?;
        runs.push((names[1], until_gone(run).0));
    }
    Ok(runs)
}

/// The section.
pub fn section(page: &mut Page, findings: &Findings) {
    page.section("errata", "Errata");
    page.text(ERRATA);
    let mut rows = vec![
        ["form of the model", "leaves the road", "largest e_y [cm]", "largest speed error [m/s]"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for Shot { name, recording, left } in &findings.errata {
        let figures = Figures::of(recording);
        rows.push(vec![
            (*name).to_owned(),
            left.map_or("no".to_owned(), |time| format!("at {time:.1} s")),
            if left.is_some() {
                format!("over {:.0}", 100.0 * ROAD)
            } else {
                format!("{:.2}", 100.0 * figures.tracking.e_y_max)
            },
            format!("{:.3}", figures.tracking.speed_max),
        ]);
    }
    page.markup(&numbers(&rows));
    let colors = [BLUE, RED, ORANGE, GREEN, PURPLE, GREY];
    let curves = findings.errata.iter().enumerate().map(|(i, shot)| {
        let t = shot.recording.column("t");
        let curve = Curve::new(shot.name, &t, shot.recording.column("e_y_true"), colors[i % colors.len()]);
        if i >= colors.len() { curve.dashed() } else { curve }
    });
    page.chart(
        &chart(
            [
                "printed",
                "The printed matrices in the loop",
                "Lane change at 14 m/s with the paper's weights, horizon and bounds; the model as printed, corrected, and with one misprint at a time.",
            ],
            ["time [s]", "e_y [m]"],
            curves.collect(),
        )
        .zoomed(None, Some([-ROAD, ROAD])),
    );
    let late = findings.late.iter().zip([BLUE, ORANGE, GREEN, RED]);
    let curves = late.map(|((name, run), color)| {
        let curve = Curve::new(*name, &run.column("t"), run.column("e_y_true"), color);
        if name.ends_with("not told") { curve } else { curve.dashed() }
    });
    page.chart(
        &chart(
            [
                "late",
                "One sample of latency",
                "Lane change at communication steps of 33 ms: a command is visible one whole sample late. The controller is told its step and predicts over it, or it is not told.",
            ],
            ["time [s]", "e_y [m]"],
            curves.collect(),
        )
        .zoomed(None, Some([-ROAD, ROAD])),
    );
}

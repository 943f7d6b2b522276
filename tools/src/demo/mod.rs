//! `cargo fmu demo`: packs both FMUs, loads the packed archives as a stranger's tool would, and drives the lane change.

pub mod imported;

use anyhow::Result;
use clap::Parser;
use vehicle::{Parameters, Road};

use crate::archive::write_whole;
use crate::importer::Fmu;
use crate::output::Output;
use crate::pack::{Packed, pack};
use crate::plots::page;
use crate::recording::{PAPER, Recording, Tracking, tracking_table};
use crate::simulate::journey;
use crate::workspace::{archive_folder, shown};

/// Communication steps of the demonstration: a fine one, and the controller's own period, which adds a whole sample of latency.
const STEPS: [(&str, f64); 2] = [("1 ms steps", 0.001), ("33 ms steps", 0.033)];

/// Shows the controller FMU driving the plant FMU through the double lane change.
///
/// Builds and packs what is missing, prints the tracking errors beside the paper's and writes a page of plots.
#[derive(Clone, Debug, Parser)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: &Args, output: &Output) -> Result<()> {
    let packed = pack(output)?;
    let mut runs = vec![("paper", PAPER)];
    let mut shown_run = Recording::default();
    let mut remarks = Vec::new();
    let way = Road::named("double_lane_change", &Parameters::default())?.length();
    for (name, step) in STEPS {
        let recording = drive(&packed, step, &[], output)?;
        runs.push((name, Tracking::of(&recording)));
        remarks.extend(journey::remarks(&recording, way, false).into_iter().map(|remark| format!("{name}: {remark}")));
        if shown_run.rows.is_empty() {
            shown_run = recording;
        }
    }
    output.line("\nDouble lane change at 14 m/s, the controller FMU driving the plant FMU\n");
    for line in tracking_table(&runs) {
        output.line(&line);
    }
    for remark in remarks {
        output.line(&remark);
    }
    let file = archive_folder().join("demo.html");
    let lead = "The controller FMU drives the plant FMU through a double lane change at 14 m/s; both were loaded from their packed \
                archives. The plots show the run in which they exchanged values every millisecond.";
    let picture = shown_run.thinned(shown_run.rows.len() / 1500);
    write_whole(&file, page("Double lane change", lead, &picture, &runs).as_bytes())?;
    closing(&packed, &shown(&file), output);
    Ok(())
}

/// Loads both archives, sets parameters given as (side, name, value) and drives to the end of the road.
pub fn drive(packed: &Packed, step: f64, settings: &[(&str, &str, &str)], output: &Output) -> Result<Recording> {
    let (plant, controller) = (Fmu::open(&packed.plant)?, Fmu::open(&packed.controller)?);
    let mut plant = plant.instantiate("plant")?;
    let mut controller = controller.instantiate("controller")?;
    for (side, name, value) in settings {
        match *side {
            "plant" => plant.set(name, value)?,
            _ => controller.set(name, value)?,
        }
    }
    plant.initialize()?;
    controller.initialize()?;
    let progress = output.progress("driving");
    let recording = imported::drive(&mut plant, &mut controller, step, None, |t| {
        progress.set_message(format!("driving, {t:.1} s"));
    })?;
    progress.finish_and_clear();
    plant.terminate()?;
    controller.terminate()?;
    Ok(recording)
}

fn closing(packed: &Packed, page: &str, output: &Output) {
    output.line(&format!(
        "\nThe controller   {}\nThe vehicle      {}\nBoth, wired      {}\nPlots            {page}   (open it in a browser)\n",
        shown(&packed.controller),
        shown(&packed.plant),
        shown(&packed.system)
    ));
    output.line(
        "Load them in any FMI 2.0 tool: equal names connect. Next:\n  \
         cargo fmu simulate --road general                 2 km of bends in a strong wind\n  \
         cargo fmu simulate --set plant.speed=16 --set controller.horizon=20\n  \
         cargo fmu simulate --help",
    );
}

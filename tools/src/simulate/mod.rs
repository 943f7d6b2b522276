//! `cargo fmu simulate`: the closed loop on the cores, at any step, on any road.

pub mod bends;
pub mod journey;
pub mod native;
pub mod settings;
mod unused;

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use clap::Parser;
use lpv_mpc::jordan::Network;
use lpv_mpc::{Adaptation, Controller, Status};
use vehicle::{Road, Vehicle, road::NAMES};

use crate::archive::{read_text, writable, write_whole};
use crate::output::{Output, table};
use crate::parameter_set::ParameterSet;
use crate::plots::page;
use crate::recording::{PAPER, Recording, Tracking, tracking_table};
use crate::workspace::shown;
use bends::Bends;
use journey::Progress;
use settings::Settings;

/// Drives the closed loop natively and prints how well it follows.
///
/// Gives the same bits as the packed FMUs under a master that exchanges values once a step, without the detour through FMI.
#[derive(Clone, Debug, Parser)]
#[command(after_help = "\
Examples:
  cargo fmu simulate                                    the lane change at 14 m/s, 1 ms steps
  cargo fmu simulate --road general --step 0.033        2 km of bends in a strong wind, one whole sample of latency
  cargo fmu simulate --set plant.speed=16 --set controller.horizon=20
  cargo fmu simulate --set plant.noise_scale=1 --csv run.csv --page run.html
  cargo fmu simulate --road my_track.csv                columns s,kappa,v_x [m, 1/m, m/s]
  cargo fmu simulate --parameters target/tune/tuned.ssv
  cargo fmu simulate --list                             every parameter with its value")]
pub struct Args {
    /// Manoeuvre or file; the help names them all.
    #[arg(long, default_value = "double_lane_change", help = road_help())]
    pub road: String,
    /// Communication step [s]: how often the two sides exchange values
    #[arg(long, default_value_t = 0.001, allow_negative_numbers = true)]
    pub step: f64,
    /// End of the run [s]; without it the run ends with the road
    #[arg(long, allow_negative_numbers = true)]
    pub stop: Option<f64>,
    /// A parameter, as plant.NAME=VALUE or controller.NAME=VALUE; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Parameters from an SSP parameter set (.ssv), such as `cargo fmu tune` writes; --set goes before it
    #[arg(long, value_name = "FILE")]
    pub parameters: Option<PathBuf>,
    /// Write every sample to this file: names, units, then numbers
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Write plots to this file, one HTML page that needs no network
    #[arg(long, value_name = "FILE")]
    pub page: Option<PathBuf>,
    /// Print the parameters and do nothing else
    #[arg(long)]
    pub list: bool,
}

/// Roads by name, from the plant's own list, and what a file holds.
fn road_help() -> String {
    format!(
        "Manoeuvre ({}) or a CSV file of the columns x,y,v_x (points, m and m/s) or s,kappa,v_x (m, 1/m, m/s)",
        NAMES.join(", ")
    )
}

impl Args {
    /// The parameters of the file and those that are typed.
    fn assignments(&self) -> Result<Vec<String>> {
        let mut assignments = Vec::new();
        if let Some(file) = &self.parameters {
            let set = ParameterSet::parse(&read_text(file)?).with_context(|| {
                format!("{} is no parameter set: a file .ssv is wanted, such as cargo fmu tune writes", file.display())
            })?;
            assignments = set.assignments().with_context(|| format!("in {}", file.display()))?;
        }
        // The last assignment of a name holds: what is typed goes before what is read.
        assignments.extend_from_slice(&self.set);
        Ok(assignments)
    }
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<()> {
    let assignments = args.assignments()?;
    let settings = Settings::new(&args.road, &assignments)?;
    if args.list {
        for line in list(&settings.described()?) {
            output.line(&line);
        }
        return Ok(());
    }
    ensure!(args.step > 0.0 && args.step <= 1.0, "the step must be above 0 and at most 1 s, got {}", args.step);
    for file in [&args.csv, &args.page].into_iter().flatten() {
        writable(file)?;
    }
    let (mut plant, mut controller) = build(&settings)?;
    journey::possible(&plant, args.step, args.stop)?;
    let foreseen = foreseen(args, &settings, &assignments, &plant)?;
    if !foreseen.is_empty() {
        output.line(&format!("{}\n", foreseen.join("\n")));
    }
    let begin = Instant::now();
    let recording = drive(&mut plant, &mut controller, args, output)?;
    summary(args, &settings, &recording, begin.elapsed().as_secs_f64(), output);
    let remarks = journey::remarks(&recording, journey::way(&plant), args.stop.is_some());
    if !remarks.is_empty() {
        output.line("");
    }
    for remark in remarks {
        output.line(&remark);
    }
    save(args, &settings, &recording, output)
}

/// What can be said of a run before it begins: what is set and does nothing, and a bend that is sharper than the car.
///
/// # Errors
/// If such a bend cannot be driven at all, and the end of the road is wanted.
fn foreseen(args: &Args, settings: &Settings, assignments: &[String], plant: &Vehicle) -> Result<Vec<String>> {
    let mut remarks = unused::remarks(settings, plant.road(), assignments)?;
    if let Some(bends) = Bends::of(plant, settings.controller.delta_max) {
        if args.stop.is_none() {
            bends.possible()?;
        }
        remarks.push(format!("Sharper than the car: {bends}."));
    }
    Ok(remarks)
}

/// Drives with a bar; a car that makes no progress is given up unless the end is set by time.
fn drive(plant: &mut Vehicle, controller: &mut Controller, args: &Args, output: &Output) -> Result<Recording> {
    let end = args.stop.unwrap_or_else(|| journey::time(plant));
    let bar = output.bar("driving", 1000);
    let mut progress = Progress::default();
    let recording = native::drive_while(
        plant,
        controller,
        args.step,
        args.stop,
        |_, _, _| {},
        |t, s| {
            // The bar's own thousand parts: a fraction of a run needs no more.
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1000, and whole seconds")]
            let (part, second) = ((1000.0 * (t / end).min(1.0)) as u64, t as u64);
            if part != bar.position() {
                bar.set_position(part);
                bar.set_message(format!("driving, {second} s of {end:.0} s, at {s:.0} m"));
            }
            progress.goes_on(t, s) || args.stop.is_some()
        },
    )?;
    bar.finish_and_clear();
    Ok(recording)
}

/// The network that ships in the controller's FMU.
const NETWORK: &str = include_str!("../../../fmu-controller/resources/jordan.json");

/// The two sides as the settings say.
pub fn build(settings: &Settings) -> Result<(Vehicle, Controller)> {
    let road = road(&settings.road, &settings.plant)?;
    let plant = Vehicle::new(settings.plant.clone(), road)?;
    let controller = match settings.controller.adaptation {
        Adaptation::Constant => Controller::new(settings.controller.clone(), 0.0)?,
        _ => Controller::with_network(settings.controller.clone(), 0.0, network(&settings.network_file)?)?,
    };
    Ok((plant, controller))
}

/// The network of a file, or the one that ships if the name is empty.
pub fn network(file: &str) -> Result<Network> {
    if file.is_empty() {
        return Ok(Network::from_json(NETWORK)?);
    }
    Network::from_json(&read_text(Path::new(file))?).with_context(|| format!("in {file}"))
}

/// Names with values and units in columns, and what they mean behind them.
fn list(rows: &[Vec<String>]) -> Vec<String> {
    let columns: Vec<Vec<String>> = rows.iter().map(|row| row[..3].to_vec()).collect();
    let lines = table(&columns);
    let width = lines.iter().map(|line| line.chars().count()).max().unwrap_or(0);
    lines.iter().zip(rows).map(|(line, row)| format!("{line:<width$}  {}", row[3])).collect()
}

/// A manoeuvre by its name, or a road from a file.
fn road(name: &str, parameters: &vehicle::Parameters) -> Result<Road> {
    let file = Path::new(name);
    if file.is_file() {
        return Road::from_csv_within(&read_text(file)?, parameters.road_tolerance)
            .with_context(|| format!("in {name}"));
    }
    if NAMES.contains(&name) {
        return Ok(Road::named(name, parameters)?);
    }
    let place = std::path::absolute(file).unwrap_or_else(|_| file.to_path_buf());
    bail!("no road {name}: there is no file {}, and the manoeuvres are {}", place.display(), NAMES.join(", "))
}

fn summary(args: &Args, settings: &Settings, run: &Recording, seconds: f64, output: &Output) {
    let last = |name: &str| run.column(name).last().copied().unwrap_or_default();
    let status = run.column("status");
    let degraded = status.iter().filter(|&&status| status >= f64::from(Status::Estimated as u8)).count();
    output.line(&format!(
        "{} over {:.0} m and {:.2} s at steps of {} ms, in {seconds:.2} s of computing\n",
        settings.road,
        last("s"),
        last("t"),
        args.step * 1e3
    ));
    for line in tracking_table(&[("this run", Tracking::of(run))]) {
        output.line(&line);
    }
    let grip = run.column("grip_usage").into_iter().fold(0.0, f64::max);
    output.line(&format!("\ngrip in use, largest      {:>5.0} %", 100.0 * grip));
    if degraded > 0 {
        output
            .line(&format!("degraded answers          {degraded} of {} samples are worse than optimal", status.len()));
    }
}

fn save(args: &Args, settings: &Settings, recording: &Recording, output: &Output) -> Result<()> {
    if let Some(file) = &args.csv {
        write_whole(file, recording.csv().as_bytes())?;
        output.line(&format!("samples: {}", shown(file)));
    }
    if let Some(file) = &args.page {
        let lead = format!("{} at communication steps of {} ms.", settings.road, args.step * 1e3);
        let runs = [("paper (lane change)", PAPER), ("this run", Tracking::of(recording))];
        let picture = recording.thinned(recording.rows.len() / 1500);
        write_whole(file, page("Closed loop", &lead, &picture, &runs).as_bytes())?;
        output.line(&format!("plots: {}", shown(file)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(arguments: &[&str]) -> String {
        let args = Args::try_parse_from([&["simulate"], arguments].concat()).unwrap();
        format!("{:#}", run(&args, &Output { quiet: true }).unwrap_err())
    }

    #[test]
    fn a_refusal_says_what_was_wrong() {
        let said = refusal(&["--road", "nosuch.csv"]);
        assert!(said.starts_with("no road nosuch.csv: there is no file /") && said.contains("circuit"), "{said}");
        assert_eq!(refusal(&["--step", "-1"]), "the step must be above 0 and at most 1 s, got -1");
        assert_eq!(refusal(&["--stop", "-3"]), "the end of the run, --stop, must be above 0 s, got -3");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().to_str().unwrap();
        assert_eq!(refusal(&["--csv", path]), format!("{path} is a folder: name a file in it"));
        let file = folder.path().join("x.md");
        std::fs::write(&file, "# No set\n<a>").unwrap();
        let said = refusal(&["--parameters", file.to_str().unwrap()]);
        assert!(said.contains("x.md is no parameter set: a file .ssv is wanted"), "{said}");
    }

    #[test]
    fn the_help_names_every_road() {
        let help = <Args as clap::CommandFactory>::command().render_help().to_string();
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        for name in NAMES {
            assert!(help.contains(name), "{name} in {help}");
        }
    }
}

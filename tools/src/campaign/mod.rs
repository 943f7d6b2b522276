//! `cargo fmu campaign`: does adaptation ever lose to constant stiffness?
//!
//! The lane change at shares of the speed that friction permits, over tyres, friction values and sensor noise, and the general
//! track, each with every mode of adaptation. The controller is told its car, as a user would: the nominal stiffnesses of the
//! tyre, the network that was trained for it, the friction of the road ahead. With `--untold` it believes in the default tyre
//! and friction on every road. All runs are native, spread over the processors; a run's result does not depend on which
//! processor drove it.

mod outcome;
mod page;

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use lpv_mpc::jordan::Document;
use rayon::prelude::*;

use crate::archive::write_whole;
use crate::output::{Output, table};
use crate::recording::{Recording, Tracking};
use crate::simulate::settings::Settings;
use crate::simulate::{build, native, network};
use crate::workspace::{root, shown};
use outcome::{Outcome, Run, as_csv, cell};

/// Modes of adaptation as the parameter names them, constant stiffness first: the others are compared with it.
const MODES: [&str; 3] = ["constant", "network_now", "network_horizon"];
/// Tyre presets of the plant, and the networks that were trained on them.
const TYRES: [(&str, &str); 3] = [
    ("dry_asphalt", "fmu-controller/resources/jordan.json"),
    ("alcala", "fmu-controller/resources/jordan_alcala.json"),
    ("linear", "fmu-controller/resources/jordan_linear.json"),
];
/// Friction values of the preset whose force has a peak [1].
const FRICTION: [f64; 4] = [0.4, 0.6, 0.82, 1.0];
/// Speeds of the lane change as shares of what its curvature permits at the friction at hand [1].
const SHARES: [f64; 5] = [0.5, 0.65, 0.8, 0.9, 0.95];
/// Speed at which the lane change uses all grip at friction 0.82 [m/s].
const LIMIT: f64 = 17.2;
/// Runs of a situation with sensor noise, each with its own seed: a single one says little.
const SEEDS: u32 = 8;

/// Compares constant stiffness with the network, now and along the horizon, over many situations.
#[derive(Clone, Debug, Parser)]
#[command(after_help = "\
Examples:
  cargo fmu campaign                            all situations, table on the screen, CSV and page in target/campaign/
  cargo fmu campaign --step 0.033               one whole sample of latency
  cargo fmu campaign --untold                   other tyres and friction than the controller believes in
  cargo fmu campaign --set plant.tau_delta=0.1 --set controller.tau_delta=0.1")]
pub struct Args {
    /// Communication step [s]
    #[arg(long, default_value_t = 0.001)]
    pub step: f64,
    /// A parameter of every run, as plant.NAME=VALUE or controller.NAME=VALUE; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Tell the controller neither the tyre nor the friction of the road
    #[arg(long)]
    pub untold: bool,
    /// Folder for campaign.csv and campaign.html
    #[arg(long, default_value = "target/campaign")]
    pub output: PathBuf,
}

/// One situation that every mode drives.
#[derive(Clone, Debug, PartialEq)]
struct Situation {
    road: &'static str,
    tyre: &'static str,
    mu: f64,
    noise: f64,
    /// Speed of roads that have one [m/s].
    speed: f64,
}

impl Situation {
    fn seeds(&self) -> std::ops::RangeInclusive<u32> {
        1..=if self.noise > 0.0 { SEEDS } else { 1 }
    }
}

/// Runs the command.
///
/// # Errors
/// If a parameter is unknown or the results cannot be written.
pub fn run(args: &Args, output: &Output) -> Result<()> {
    ensure!(args.step > 0.0 && args.step <= 1.0, "the step must be above 0 and at most 1 s, got {}", args.step);
    let situations = situations();
    let runs: usize = situations.iter().map(|situation| situation.seeds().count() * MODES.len()).sum();
    let bar = output.bar("driving", runs as u64);
    let results: Vec<Outcome> = situations
        .into_par_iter()
        .map(|situation| {
            let mut runs = Vec::new();
            for seed in situation.seeds() {
                let mut run: Run = [(0.0, 0.0); 3];
                for (figures, mode) in run.iter_mut().zip(MODES) {
                    *figures = drive(args, &situation, mode, seed)?;
                    bar.inc(1);
                }
                runs.push(run);
            }
            Ok(Outcome { situation, runs })
        })
        .collect::<Result<_>>()?;
    bar.finish_and_clear();
    for line in table(&rows(&results)) {
        output.line(&line);
    }
    for (i, mode) in MODES.iter().enumerate().skip(1) {
        let lost: Vec<String> = results.iter().filter(|r| r.loses(i)).map(|r| name(&r.situation)).collect();
        let list = if lost.is_empty() { String::new() } else { format!(": {}", lost.join("; ")) };
        output.line(&format!(
            "\n{mode} loses to constant stiffness in {} of {} situations{list}",
            lost.len(),
            results.len()
        ));
    }
    let (csv, page) = (args.output.join("campaign.csv"), args.output.join("campaign.html"));
    write_whole(&csv, as_csv(&results).as_bytes())?;
    write_whole(&page, page::of(&results).as_bytes())?;
    output.line(&format!("\nsamples: {}\nplots: {}", shown(&csv), shown(&page)));
    Ok(())
}

/// Every situation, in the order of the table.
fn situations() -> Vec<Situation> {
    let lane_change = |tyre, mu: f64, noise, share: f64| Situation {
        road: "double_lane_change",
        tyre,
        mu,
        noise,
        speed: share * LIMIT * (mu / 0.82).sqrt(),
    };
    let general = |tyre| Situation { road: "general", tyre, mu: 0.82, noise: 0.0, speed: 0.0 };
    let friction = FRICTION.iter().flat_map(|mu| SHARES.map(|share| lane_change("dry_asphalt", *mu, 0.0, share)));
    let tyres =
        TYRES[1..].iter().flat_map(|(tyre, _)| SHARES[..3].iter().map(|share| lane_change(tyre, 0.82, 0.0, *share)));
    let noise = SHARES.map(|share| lane_change("dry_asphalt", 0.82, 1.0, share));
    friction.chain(tyres).chain(noise).chain(TYRES.map(|(tyre, _)| general(tyre))).collect()
}

/// Largest lateral error [m] and RMSE of the speed [m/s].
fn drive(args: &Args, situation: &Situation, mode: &str, seed: u32) -> Result<(f64, f64)> {
    let Situation { road, tyre, mu, noise, speed } = situation;
    let mut assignments = vec![
        format!("plant.tyre={tyre}"),
        format!("plant.mu={mu}"),
        format!("plant.noise_scale={noise}"),
        format!("plant.seed={seed}"),
        format!("controller.adaptation={mode}"),
    ];
    if *speed > 0.0 {
        assignments.push(format!("plant.speed={speed}"));
    }
    if !args.untold {
        assignments.extend(beliefs(tyre)?);
    }
    assignments.extend(args.set.iter().cloned());
    let (mut plant, mut controller) = build(&Settings::new(road, &assignments)?)?;
    // A car that spins may reach what the plant refuses to compute: then it has left the road for good.
    let blind = |_: f64, seen: &mut lpv_mpc::Inputs| {
        if args.untold {
            seen.mu_ref.fill(0.0);
        }
    };
    let Ok(recording) = native::drive_through(&mut plant, &mut controller, args.step, None, blind, |_| {}) else {
        return Ok((f64::INFINITY, f64::INFINITY));
    };
    Ok(figures(&recording))
}

/// What a user sets for a car with this tyre: its nominal stiffnesses and its network.
fn beliefs(tyre: &str) -> Result<[String; 3]> {
    let (_, file) =
        TYRES.iter().find(|(name, _)| *name == tyre).with_context(|| format!("no network for tyre {tyre}"))?;
    let file = root().join(file).display().to_string();
    let Document { c_f_nominal, c_r_nominal, .. } = *network(&file)?.document();
    Ok([
        format!("controller.c_f_nominal={c_f_nominal}"),
        format!("controller.c_r_nominal={c_r_nominal}"),
        format!("controller.network_file={file}"),
    ])
}

fn figures(recording: &Recording) -> (f64, f64) {
    let tracking = Tracking::of(recording);
    (tracking.e_y_max, tracking.speed_rms)
}

fn name(situation: &Situation) -> String {
    let Situation { road, tyre, mu, noise, speed } = situation;
    let noise = if *noise > 0.0 { ", noise" } else { "" };
    let speed = if *speed > 0.0 { format!(" at {speed:.1} m/s") } else { String::new() };
    format!("{road}{speed}, {tyre}, mu {mu}{noise}")
}

fn rows(results: &[Outcome]) -> Vec<Vec<String>> {
    let mut rows = vec![vec!["max |e_y| [cm], mean over the runs on the road".to_owned()]];
    rows[0].extend(MODES.map(str::to_owned));
    for result in results {
        let mut row = vec![name(&result.situation)];
        row.extend([0, 1, 2].map(|mode| cell(result, mode)));
        rows.push(row);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_friction_tyre_and_the_general_track_is_driven() {
        let all = situations();
        for mu in FRICTION {
            assert_eq!(
                all.iter().filter(|s| s.mu == mu && s.noise == 0.0 && s.tyre == TYRES[0].0 && s.speed > 0.0).count(),
                5
            );
        }
        for (tyre, _) in TYRES {
            assert!(all.iter().any(|s| s.tyre == tyre && s.road == "general"));
        }
        let fastest = all.iter().map(|s| s.speed).fold(0.0, f64::max);
        // v^2 is proportional to friction: 0.95 of the limit at friction 1.
        assert!((fastest - 0.95 * LIMIT / 0.82_f64.sqrt()).abs() < 1e-9);
    }
}

//! `cargo fmu campaign`: does adaptation ever lose to constant stiffness?
//!
//! The lane change at shares of the speed that friction permits, over tyres, friction values and sensor noise, and the general
//! track, each with every mode of adaptation. All runs are native, spread over the processors; a run's result does not depend
//! on which processor drove it.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Parser;
use rayon::prelude::*;

use crate::archive::write_whole;
use crate::output::{Output, table};
use crate::plots::{BLUE, Chart, Curve, GREY, ORANGE, assemble, chart};
use crate::recording::{Recording, Tracking};
use crate::simulate::settings::Settings;
use crate::simulate::{build, native};
use crate::workspace::shown;

/// Modes of adaptation as the parameter names them, constant stiffness first: the others are compared with it.
const MODES: [&str; 3] = ["constant", "network_now", "network_horizon"];
/// Tyre presets of the plant.
const TYRES: [&str; 3] = ["dry_asphalt", "alcala", "linear"];
/// Friction values of the preset whose force has a peak [1].
const FRICTION: [f64; 4] = [0.4, 0.6, 0.82, 1.0];
/// Speeds of the lane change as shares of what its curvature permits at the friction at hand [1].
const SHARES: [f64; 5] = [0.5, 0.65, 0.8, 0.9, 0.95];
/// Speed at which the lane change uses all grip at friction 0.82 [m/s].
const LIMIT: f64 = 17.2;
/// Lateral error beyond which a car has left the road [m]; larger ones are cut there in the table.
const ROAD: f64 = 2.0;
/// Lateral error at which the page cuts its curves, so that the small ones can be told apart [m].
const SHOWN: f64 = 0.12;
/// What counts as no difference [m]: a tenth of a sensor's standard deviation of 1 cm.
const NOISE: f64 = 1e-3;

/// Compares constant stiffness with the network, now and along the horizon, over many situations.
#[derive(Clone, Debug, Parser)]
#[command(after_help = "\
Examples:
  cargo fmu campaign                            all situations, table on the screen, CSV and page in target/campaign/
  cargo fmu campaign --step 0.033               one whole sample of latency
  cargo fmu campaign --set plant.tau_delta=0.1 --set controller.tau_delta=0.1")]
pub struct Args {
    /// Communication step [s]
    #[arg(long, default_value_t = 0.001)]
    pub step: f64,
    /// A parameter of every run, as plant.NAME=VALUE or controller.NAME=VALUE; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
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

/// What the modes did in one situation, largest lateral errors [m] and RMSE of the speed [m/s].
struct Outcome {
    situation: Situation,
    e_y: [f64; 3],
    v_x: [f64; 3],
}

impl Outcome {
    /// Whether a mode did worse than constant stiffness by more than noise.
    fn loses(&self, mode: usize) -> bool {
        let margin = NOISE.max(0.1 * self.e_y[0]);
        self.e_y[mode].min(ROAD) > self.e_y[0].min(ROAD) + margin
    }
}

/// Runs the command.
///
/// # Errors
/// If a parameter is unknown or the results cannot be written.
pub fn run(args: &Args, output: &Output) -> Result<()> {
    ensure!(args.step > 0.0 && args.step <= 1.0, "the step must be above 0 and at most 1 s, got {}", args.step);
    let situations = situations();
    let bar = output.bar("driving", (situations.len() * MODES.len()) as u64);
    let results: Vec<Outcome> = situations
        .into_par_iter()
        .map(|situation| {
            let mut result = Outcome { situation, e_y: [0.0; 3], v_x: [0.0; 3] };
            for (i, mode) in MODES.iter().enumerate() {
                (result.e_y[i], result.v_x[i]) = drive(args, &result.situation, mode)?;
                bar.inc(1);
            }
            Ok(result)
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
    write_whole(&page, as_page(&results).as_bytes())?;
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
    let tyres = TYRES[1..].iter().flat_map(|tyre| SHARES[..3].iter().map(|share| lane_change(tyre, 0.82, 0.0, *share)));
    let noise = SHARES.map(|share| lane_change("dry_asphalt", 0.82, 1.0, share));
    friction.chain(tyres).chain(noise).chain(TYRES.map(general)).collect()
}

/// Largest lateral error [m] and RMSE of the speed [m/s].
fn drive(args: &Args, situation: &Situation, mode: &str) -> Result<(f64, f64)> {
    let Situation { road, tyre, mu, noise, speed } = situation;
    let mut assignments = vec![
        format!("plant.tyre={tyre}"),
        format!("plant.mu={mu}"),
        format!("plant.noise_scale={noise}"),
        format!("controller.adaptation={mode}"),
    ];
    if *speed > 0.0 {
        assignments.push(format!("plant.speed={speed}"));
    }
    assignments.extend(args.set.iter().cloned());
    let (mut plant, mut controller) = build(&Settings::new(road, &assignments)?)?;
    // A car that spins may reach what the plant refuses to compute: then it has left the road for good.
    let Ok(recording) = native::drive(&mut plant, &mut controller, args.step, None, |_| {}) else {
        return Ok((f64::INFINITY, f64::INFINITY));
    };
    Ok(figures(&recording))
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
    let mut rows = vec![vec!["max |e_y| [cm]".to_owned()]];
    rows[0].extend(MODES.map(str::to_owned));
    for result in results {
        let mut row = vec![name(&result.situation)];
        row.extend(
            result.e_y.map(|e_y| if e_y > ROAD { "off the road".to_owned() } else { format!("{:.2}", 100.0 * e_y) }),
        );
        rows.push(row);
    }
    rows
}

fn as_csv(results: &[Outcome]) -> String {
    let mut csv = "road,tyre,mu,noise,speed,mode,e_y_max,v_x_rmse\n,,1,1,m/s,,m,m/s\n".to_owned();
    for Outcome { situation: Situation { road, tyre, mu, noise, speed }, e_y, v_x } in results {
        for ((mode, e_y), v_x) in MODES.iter().zip(e_y).zip(v_x) {
            csv.push_str(&format!("{road},{tyre},{mu},{noise},{speed},{mode},{e_y},{v_x}\n"));
        }
    }
    csv
}

/// Error over speed for each friction value.
fn as_page(results: &[Outcome]) -> String {
    const CHARTS: [[&str; 3]; 4] = [
        ["mu04", "Friction 0.4", "The network was trained at 0.82 and is not told."],
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_friction_tyre_and_the_general_track_is_driven() {
        let all = situations();
        for mu in FRICTION {
            assert_eq!(
                all.iter().filter(|s| s.mu == mu && s.noise == 0.0 && s.tyre == TYRES[0] && s.speed > 0.0).count(),
                5
            );
        }
        for tyre in TYRES {
            assert!(all.iter().any(|s| s.tyre == tyre && s.road == "general"));
        }
        let fastest = all.iter().map(|s| s.speed).fold(0.0, f64::max);
        // v^2 is proportional to friction: 0.95 of the limit at friction 1.
        assert!((fastest - 0.95 * LIMIT / 0.82_f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn losing_is_more_than_noise_and_leaving_the_road_is_the_worst() {
        let situation = situations().swap_remove(0);
        let result = |e_y| Outcome { situation: situation.clone(), e_y, v_x: [0.0; 3] };
        assert!(!result([0.010, 0.0105, 0.011]).loses(2));
        assert!(result([0.010, 0.010, 0.0125]).loses(2));
        assert!(!result([30.0, 40.0, f64::INFINITY]).loses(2));
        assert!(result([0.5, 0.5, f64::INFINITY]).loses(2));
    }
}

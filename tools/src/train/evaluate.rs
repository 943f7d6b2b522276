//! Scores of a network on fresh manoeuvres, printed, plotted, or as JSON.

use std::path::PathBuf;

use anyhow::{Context, Result};
use lpv_mpc::jordan::{FEEDBACK, Network, Scores};
use serde_json::json;
use vehicle::Parameters;

use super::data::{Run, Sample};
use super::manoeuvre::{Class, SPEED};
use super::recipe::{Preset, Purpose, Recipe};
use super::score::{self, Answers, Score};
use super::{Args, page, session};
use crate::archive::{read_text, write_whole};
use crate::output::{Output, table};
use crate::workspace::{self, shown};

/// Bands of the share of grip in use [1].
const GRIP_BANDS: [(f64, f64); 4] = [(0.0, 0.3), (0.3, 0.6), (0.6, 0.8), (0.8, 1.01)];

/// Grip of both axles at rest, `mu F_z` [N].
pub fn peak(plant: &Parameters) -> [f64; FEEDBACK] {
    let per_metre = plant.mu * plant.m * plant.g / (plant.l_f + plant.l_r);
    [per_metre * plant.l_r, per_metre * plant.l_f]
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<()> {
    let shipped = || workspace::root().join(workspace::CONTROLLER.folder).join("resources").join("jordan.json");
    let file = args.network.clone().unwrap_or_else(shipped);
    let network = Network::from_json(&read_text(&file)?).with_context(|| format!("in {}", file.display()))?;
    let made = &network.document().provenance;
    // The plant that the network was made for, unless another one is asked for.
    let mut recipe = Recipe {
        tyre: made.tyre.clone(),
        mu: (made.mu[0], made.mu[1]),
        noise: made.noise,
        wind: made.wind,
        ..Recipe::new(Preset::Default, args.seed)
    };
    args.apply(&mut recipe);
    recipe.validate()?;
    let quiet = Output { quiet: output.quiet || args.json };
    let runs = session::drive(&recipe, Purpose::Evaluation, &quiet)?;
    let (standard, beyond) = runs.split_at(recipe.counts(Purpose::Evaluation).0);
    let report = Report::new(&network, standard, beyond, peak(&recipe.plant()?));
    if args.json {
        output.line(&serde_json::to_string(&report.json())?);
        return Ok(());
    }
    output.line(&format!(
        "{}: tyre {}, friction {} to {}, noise {}, wind up to {} m/s, seed {}",
        shown(&file),
        recipe.tyre,
        recipe.mu.0,
        recipe.mu.1,
        recipe.noise,
        recipe.wind,
        recipe.seed
    ));
    for line in report.lines() {
        output.line(&line);
    }
    let beside = |file: &PathBuf| {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        workspace::root().join("target").join("network").join(format!("{name}-scores.html"))
    };
    let pictures = args.page.clone().unwrap_or_else(|| beside(&file));
    write_whole(&pictures, page::scores(&report, standard, &network).as_bytes())?;
    output.line(&format!("\nplots: {}", shown(&pictures)));
    Ok(())
}

/// Scores of one set under all ways to answer.
#[derive(Clone, Debug)]
pub struct Set {
    /// What the set is.
    pub name: &'static str,
    /// Ways to answer with their scores.
    pub rows: Vec<(&'static str, Score)>,
}

/// Everything that is said about a network.
#[derive(Clone, Debug)]
pub struct Report {
    /// The standard set and the set beyond it.
    pub sets: Vec<Set>,
    /// Free-running scores of parts of the standard set.
    pub bands: Vec<(String, Score)>,
}

impl Report {
    /// Scores a network on both sets.
    pub fn new(network: &Network, standard: &[Run], beyond: &[Run], peak: [f64; FEEDBACK]) -> Self {
        let sets = [("within 90 % of grip", standard), ("beyond", beyond)]
            .into_iter()
            .filter(|(_, runs)| !runs.is_empty())
            .map(|(name, runs)| Set { name, rows: ways(network, runs, peak) })
            .collect();
        Self { sets, bands: bands(network, standard, peak) }
    }

    /// The scores that a network file carries.
    pub fn scores(&self, seed: u64) -> Scores {
        let [free, forced] = self.main();
        Scores {
            seed,
            free_running: score::pair(free.r_squared),
            teacher_forced: score::pair(forced.r_squared),
            force_error: score::pair(free.force),
        }
    }

    /// Free-running and teacher-forced scores on the standard set.
    fn main(&self) -> [Score; 2] {
        let rows = &self.sets[0].rows;
        [rows[0].1, rows[1].1]
    }

    fn json(&self) -> serde_json::Value {
        let [free, forced] = self.main().map(|score| json!({"c_f": score.r_squared[0], "c_r": score.r_squared[1]}));
        json!({"free_running": free, "teacher_forced": forced})
    }

    /// All tables as text.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let mut section = |title: &str, rows: &mut dyn Iterator<Item = (&str, Score)>| {
            // Quantity above axle: the terminal is narrow.
            let split = HEAD.map(|name| name.rsplit_once(' ').unwrap_or_default());
            let mut cells = vec![split.map(|(quantity, _)| quantity.to_owned()).to_vec()];
            cells.push(split.map(|(_, axle)| axle.to_owned()).to_vec());
            cells.extend(rows.map(|(name, score)| row(name, &score)));
            lines.push(format!("\n{title}"));
            lines.extend(table(&cells));
        };
        for set in &self.sets {
            section(set.name, &mut set.rows.iter().map(|(name, score)| (*name, *score)));
        }
        let bands = &mut self.bands.iter().map(|(name, score)| (name.as_str(), *score));
        section("within 90 % of grip, free-running, in parts", bands);
        lines.push(
            "\nStiffness: RMSE and worst in kN/rad; force: error, rms and worst, in % of the axle's grip.".to_owned(),
        );
        lines
    }
}

/// Names of the columns.
pub const HEAD: [&str; 11] = [
    "",
    "R2 front",
    "R2 rear",
    "RMSE front",
    "RMSE rear",
    "worst front",
    "worst rear",
    "force front",
    "force rear",
    "worst force front",
    "worst force rear",
];

/// The cells of one score.
pub fn row(name: &str, score: &Score) -> Vec<String> {
    let Score { r_squared, rmse, worst, force, worst_force } = score;
    let mut cells = vec![name.to_owned()];
    cells.extend(r_squared.iter().map(|&value| known(value)));
    cells.extend(rmse.iter().chain(worst).map(|value| format!("{:.2}", value * 1e-3)));
    cells.extend(force.iter().chain(worst_force).map(|value| format!("{:.2}", value * 100.0)));
    cells
}

/// A coefficient of determination; a stiffness that never changes (`linear`) has none.
fn known(value: f64) -> String {
    if value.is_finite() { format!("{value:.5}") } else { "-".to_owned() }
}

/// All ways to answer: the network and what needs no network.
fn ways(network: &Network, runs: &[Run], peak: [f64; FEEDBACK]) -> Vec<(&'static str, Score)> {
    let mean = score::mean(runs);
    let nominal = network.stiffness(&network.nominal());
    let all = |answer: &dyn Fn(&Run) -> Answers| -> Score {
        let answers: Vec<Answers> = runs.iter().map(answer).collect();
        score::score(runs, &answers, peak, |_, _| true)
    };
    vec![
        ("network, free-running", all(&|run| score::free_running(network, run))),
        ("network, teacher-forced", all(&|run| score::teacher_forced(network, run))),
        ("previous true value", all(&score::persistence)),
        ("best constant", all(&|run| score::constant(mean, run))),
        ("nominal", all(&|run| score::constant(nominal.into(), run))),
    ]
}

/// Free-running scores over bands of speed and grip, and over the classes.
fn bands(network: &Network, runs: &[Run], peak: [f64; FEEDBACK]) -> Vec<(String, Score)> {
    let answers: Vec<Answers> = runs.iter().map(|run| score::free_running(network, run)).collect();
    let part = |select: &dyn Fn(&Run, &Sample) -> bool| score::score(runs, &answers, peak, select);
    let width = (SPEED.1 - SPEED.0) / 4.0;
    let mut bands: Vec<(String, Score)> = (0..4)
        .map(|i| {
            let (low, high) = (SPEED.0 + width * f64::from(i), SPEED.0 + width * f64::from(i + 1));
            let inside = |_: &Run, sample: &Sample| (low..high).contains(&sample.measured.v_x);
            (format!("{low:.0} to {high:.0} m/s"), part(&inside))
        })
        .collect();
    bands.extend(GRIP_BANDS.map(|(low, high)| {
        let inside = |_: &Run, sample: &Sample| (low..high).contains(&sample.grip);
        (format!("{:.0} to {:.0} % of grip", 100.0 * low, 100.0 * high.min(1.0)), part(&inside))
    }));
    bands.extend(
        Class::ALL.map(|class| (class.name().to_owned(), part(&|run: &Run, _: &Sample| run.manoeuvre.class == class))),
    );
    bands
}

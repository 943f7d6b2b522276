//! One training from the first manoeuvre to the written file, interrupted and resumed as its user likes.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use lpv_mpc::jordan::{Document, Network, Provenance, Scores};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use vehicle::{Parameters, Road, Vehicle};

use super::Args;
use super::data::{self, Run};
use super::learn::{Scales, Start, Training};
use super::recipe::{Preset, Purpose, Recipe, T_S};
use super::{evaluate, page};
use crate::archive::{read_text, write_whole};
use crate::output::Output;
use crate::workspace::shown;

/// Steps between two checkpoints.
const STRIDE: usize = 5;

/// What is needed to go on.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Checkpoint {
    recipe: Recipe,
    starts: Vec<Start>,
}

/// What a way of training gives.
struct Outcome {
    theta: DVector<f64>,
    /// Training and validation error over steps or epochs.
    curve: Vec<(usize, f64, f64)>,
}

/// Trains and writes the network.
pub fn run(recipe: &Recipe, args: &Args, file: &Path, output: &Output) -> Result<()> {
    let begin = Instant::now();
    let training = drive(recipe, Purpose::Training, output)?;
    let validation = drive(recipe, Purpose::Validation, output)?;
    let mirrored = |runs: &[Run]| -> Vec<Run> { runs.iter().cloned().chain(runs.iter().map(Run::mirrored)).collect() };
    let hash = data::hash(&training);
    let (training, validation) = (mirrored(&training), mirrored(&validation));
    let scales = Scales::new(&training, recipe.shape().inputs);

    let points: usize = training.iter().map(|run| run.samples.len()).sum();
    output.line(&format!("{} manoeuvres and their mirror images, {points} samples", training.len() / 2));
    let sets = [&training[..], &validation[..]];
    let outcome = if recipe.preset == Preset::Paper {
        adam(recipe, &scales, sets, output)?
    } else {
        second_order(recipe, &scales, sets, (args.resume, file), output)?
    };
    let seconds = begin.elapsed().as_secs_f64();

    let document = document(recipe, &scales, &outcome.theta, hash)?;
    let held_out = drive(recipe, Purpose::Evaluation, output)?;
    let peak = evaluate::peak(&recipe.plant()?);
    let network = Network::try_from(document.clone())?;
    let (standard, beyond) = held_out.split_at(recipe.counts(Purpose::Evaluation).0);
    let report = evaluate::Report::new(&network, standard, beyond, peak);
    let document = Document { scores: report.scores(recipe.seed), ..document };
    write_whole(file, document.to_json().as_bytes())?;

    for line in report.lines() {
        output.line(&line);
    }
    let pictures = args.page.clone().unwrap_or_else(|| file.with_extension("html"));
    write_whole(&pictures, page::training(&report, standard, &network, &outcome.curve).as_bytes())?;
    output.line(&format!(
        "\ntrained in {seconds:.0} s; one step keeps at most {:.3} of a wrong memory",
        network.contraction()
    ));
    output.line(&format!("network: {}", shown(file)));
    output.line(&format!("plots: {}", shown(&pictures)));
    Ok(())
}

/// All manoeuvres for a purpose: the standard set, then the set beyond it.
pub fn drive(recipe: &Recipe, purpose: Purpose, output: &Output) -> Result<Vec<Run>> {
    let (standard, beyond) = recipe.counts(purpose);
    let mut manoeuvres = recipe.draw(purpose, standard, false);
    manoeuvres.extend(recipe.draw(purpose, beyond, true));
    let bar = output.bar("driving", manoeuvres.len() as u64);
    let runs = data::drive(&recipe.plant()?, T_S, &manoeuvres, || bar.inc(1));
    bar.finish_and_clear();
    runs
}

/// The default way, with a checkpoint beside the network file after every few steps.
fn second_order(
    recipe: &Recipe,
    scales: &Scales,
    sets: [&[Run]; 2],
    (resume, file): (bool, &Path),
    output: &Output,
) -> Result<Outcome> {
    let checkpoint = file.with_extension("checkpoint.json");
    let earlier = if resume { Some(read_checkpoint(recipe, &checkpoint)?) } else { None };
    let mut training = Training::new(recipe, scales, sets, earlier);
    let bar = output.bar("training", training.progress(recipe).1);
    while !training.finished() {
        training.advance(STRIDE);
        bar.set_position(training.progress(recipe).0);
        bar.set_message(format!("training, error {:.1e}", training.best().validation));
        let saved = Checkpoint { recipe: recipe.clone(), starts: training.starts.clone() };
        write_whole(&checkpoint, serde_json::to_string(&saved)?.as_bytes())?;
    }
    bar.finish_and_clear();
    let best = training.best();
    Ok(Outcome { theta: best.best.clone(), curve: best.curve.clone() })
}

fn read_checkpoint(recipe: &Recipe, file: &Path) -> Result<Vec<Start>> {
    let text = read_text(file).context("there is no interrupted training to resume")?;
    let checkpoint: Checkpoint = serde_json::from_str(&text).with_context(|| format!("in {}", file.display()))?;
    ensure!(checkpoint.recipe == *recipe, "{} belongs to a training with other settings", file.display());
    Ok(checkpoint.starts)
}

#[cfg(feature = "adam")]
fn adam(recipe: &Recipe, scales: &Scales, sets: [&[Run]; 2], output: &Output) -> Result<Outcome> {
    let (theta, curve) = super::adam::train(recipe, scales, sets, output)?;
    Ok(Outcome { theta, curve })
}

#[cfg(not(feature = "adam"))]
fn adam(_: &Recipe, _: &Scales, _: [&[Run]; 2], _: &Output) -> Result<Outcome> {
    anyhow::bail!("the paper's recipe needs the feature adam")
}

/// The network file's content, its scores still open.
pub fn document(recipe: &Recipe, scales: &Scales, theta: &DVector<f64>, data: String) -> Result<Document> {
    let plant = recipe.plant()?;
    let [c_f_nominal, c_r_nominal] = nominal(recipe, &plant)?;
    Ok(Document {
        t_s: T_S,
        l_f: plant.l_f,
        l_r: plant.l_r,
        c_f_nominal,
        c_r_nominal,
        inputs: scales.inputs.clone(),
        outputs: scales.outputs,
        layers: recipe.shape().layers(theta),
        envelope: scales.envelope.clone(),
        scores: Scores::default(),
        provenance: Provenance {
            recipe: recipe.words(),
            preset: recipe.preset.name(),
            tyre: recipe.tyre.clone(),
            mu: [recipe.mu.0, recipe.mu.1],
            noise: recipe.noise,
            wind: recipe.wind,
            seed: recipe.seed,
            manoeuvres: recipe.manoeuvres,
            beyond: recipe.beyond,
            data,
        },
    })
}

/// Stiffness of both axles at small slip, averaged over the friction [N/rad].
fn nominal(recipe: &Recipe, plant: &Parameters) -> Result<[f64; 2]> {
    let straight = |mu: f64| -> Result<[f64; 2]> {
        let parameters = Parameters { mu, v_x_0: 15.0, noise_scale: 0.0, ..plant.clone() };
        let truth = Vehicle::new(parameters, Road::from_csv(data::STRAIGHT)?)?.outputs();
        Ok([truth.c_f_true, truth.c_r_true])
    };
    let (low, high) = (straight(recipe.mu.0)?, straight(recipe.mu.1)?);
    Ok(std::array::from_fn(|o| 0.5 * (low[o] + high[o])))
}

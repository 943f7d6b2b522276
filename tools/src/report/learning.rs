//! The network: a short training as it happens, and what teacher forcing hides.

use anyhow::{Context, Result};
use lpv_mpc::jordan::{Document, Network};

use super::reference;
use crate::archive::read_text;
use crate::output::Output;
use crate::plots::{BLUE, Chart, Curve, GREEN, GREY, ORANGE, chart};
use crate::train::data::Run;
use crate::train::learn::{Scales, Training};
use crate::train::manoeuvre::Class;
use crate::train::recipe::{Preset, Purpose, Recipe, T_S};
use crate::train::score::{self, Answers, Score};
use crate::train::{evaluate, session};
use crate::workspace;

/// Attempted steps of the training on the page: its curve is flat by then.
const STEPS: usize = 60;
/// Steps between two movements of the bar.
const STRIDE: usize = 5;

/// Step, training error and validation error.
pub type Point = (usize, f64, f64);

/// Everything that the page shows of the networks.
pub struct Learning {
    /// Training and validation error over the steps.
    pub curve: Vec<Point>,
    /// Ways to answer with their scores on manoeuvres that no network saw.
    pub scores: Vec<(String, Score)>,
    /// The charts of a held-out lane change.
    pub charts: Vec<Chart>,
}

/// Trains the network of the paper's size, and scores it beside the one that ships and the one of the paper's recipe.
pub fn learn(output: &Output) -> Result<Learning> {
    let recipe = Recipe { starts: 1, steps: STEPS, ..Recipe::new(Preset::PaperSize, 1) };
    let (network, curve) = train(&recipe, output)?;
    let held_out = session::drive(&recipe, Purpose::Evaluation, output)?;
    let (held_out, _) = held_out.split_at(recipe.counts(Purpose::Evaluation).0);
    let peak = evaluate::peak(&recipe.plant()?);
    let shipped = stored(&workspace::root().join("fmu-controller/resources/jordan.json"))?;
    // Made by `cargo fmu train --preset paper` with seed 1: two minutes, after the minutes that candle takes to compile.
    let paper = stored(&reference::folder().join("jordan_paper_recipe.json"))?;

    let score = |answer: &dyn Fn(&Run) -> Answers| {
        let answers: Vec<Answers> = held_out.iter().map(answer).collect();
        score::score(held_out, &answers, peak, |_, _| true)
    };
    let mut scores = Vec::new();
    for (name, network) in
        [("shipped, 16 and 8 neurons", &shipped), ("paper's size, trained here", &network), ("paper's recipe", &paper)]
    {
        scores.push((format!("{name}, free-running"), score(&|run| score::free_running(network, run))));
        scores.push((format!("{name}, teacher-forced"), score(&|run| score::teacher_forced(network, run))));
    }
    scores.push(("previous true value".to_owned(), score(&score::persistence)));
    let mean = score::mean(held_out);
    scores.push(("best constant".to_owned(), score(&|run| score::constant(mean, run))));
    let run = held_out.iter().find(|run| run.manoeuvre.class == Class::LaneChange);
    let run = run.context("no lane change among the held-out manoeuvres")?;
    Ok(Learning { curve, scores, charts: vec![prediction(run, &shipped), forcing(run, &paper)] })
}

fn stored(file: &std::path::Path) -> Result<Network> {
    Network::from_json(&read_text(file)?).with_context(|| format!("in {}", file.display()))
}

/// A training by the recipe, without a file.
fn train(recipe: &Recipe, output: &Output) -> Result<(Network, Vec<Point>)> {
    let [training, validation] = [Purpose::Training, Purpose::Validation].map(|purpose| -> Result<Vec<Run>> {
        let runs = session::drive(recipe, purpose, output)?;
        Ok(runs.iter().cloned().chain(runs.iter().map(Run::mirrored)).collect())
    });
    let (training, validation) = (training?, validation?);
    let scales = Scales::new(&training, recipe.shape().inputs);
    let mut training = Training::new(recipe, &scales, [&training[..], &validation[..]], None);
    let bar = output.bar("training", training.progress(recipe).1);
    while !training.finished() {
        training.advance(STRIDE);
        bar.set_position(training.progress(recipe).0);
    }
    bar.finish_and_clear();
    let best = training.best();
    let document: Document = session::document(recipe, &scales, &best.best, String::new())?;
    Ok((Network::try_from(document)?, best.curve.clone()))
}

fn times(run: &Run) -> Vec<f64> {
    (1..=run.samples.len()).map(|k| T_S * k as f64).collect()
}

fn axle(answers: &[[f64; 2]], axle: usize) -> Vec<f64> {
    answers.iter().map(|c| c[axle] * 1e-3).collect()
}

fn truth(run: &Run) -> Answers {
    run.samples.iter().map(|sample| sample.c).collect()
}

fn prediction(run: &Run, network: &Network) -> Chart {
    let (t, truth, answers) = (times(run), truth(run), score::free_running(network, run));
    chart(
        [
            "prediction",
            "Prediction on a held-out lane change",
            "The shipped network on its own answers. As the paper's figure 5.",
        ],
        ["time [s]", "stiffness [kN/rad]"],
        vec![
            Curve::new("front, true", &t, axle(&truth, 0), BLUE),
            Curve::new("front, network", &t, axle(&answers, 0), ORANGE).dashed(),
            Curve::new("rear, true", &t, axle(&truth, 1), GREEN),
            Curve::new("rear, network", &t, axle(&answers, 1), GREY).dashed(),
        ],
    )
}

fn forcing(run: &Run, network: &Network) -> Chart {
    let (t, truth) = (times(run), truth(run));
    let (free, forced) = (score::free_running(network, run), score::teacher_forced(network, run));
    chart(
        [
            "forcing",
            "The paper's recipe, teacher-forced and as deployed",
            "Front axle. The same weights: fed the true previous stiffness, and fed their own answers, which is all a car has.",
        ],
        ["time [s]", "stiffness [kN/rad]"],
        vec![
            Curve::new("true", &t, axle(&truth, 0), GREY),
            Curve::new("teacher-forced", &t, axle(&forced, 0), BLUE).dashed(),
            Curve::new("free-running", &t, axle(&free, 0), ORANGE),
        ],
    )
}

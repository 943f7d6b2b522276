//! `cargo fmu train`: the Jordan network, trained on the plant and scored as it is used, on its own answers.

#[cfg(feature = "adam")]
mod adam;
pub(crate) mod data;
pub(crate) mod evaluate;
pub(crate) mod learn;
pub(crate) mod manoeuvre;
mod marquardt;
mod page;
pub(crate) mod recipe;
pub(crate) mod score;
pub(crate) mod session;
mod stack;

use std::path::PathBuf;

use anyhow::Result;
use clap::Parser;

use crate::output::Output;
use crate::workspace;
use recipe::{Preset, Recipe};

/// Trains the network that tells the controller the stiffness of its tyres, or scores one.
///
/// The data come from the plant itself: steps, sines, sweeps, lane changes, random curves, braking in turns. All of it follows
/// from the seed, whatever the number of processors.
#[derive(Clone, Debug, Parser)]
#[command(after_help = "\
Examples:
  cargo fmu train                                     the network that ships, in a few minutes
  cargo fmu train --preset paper-size                 the paper's 8 and 5 neurons, trained our way
  cargo fmu train --preset friction                   friction 0.4 to 1.0, unknown to the network
  cargo fmu train --tyre alcala --noise 1 --wind 20   another tyre, noisy sensors, wind
  cargo fmu train --set plant.m=2300 --set plant.i_z=3900  another car; tools/guide/own_vehicle.md has the whole way
  cargo fmu train --resume                            go on where an interrupted training stopped
  cargo fmu train --evaluate --seed 7                 score the shipped network on fresh manoeuvres
  cargo fmu train --evaluate --network my.json --json")]
pub struct Args {
    /// What to train
    #[arg(long, value_enum, default_value = "default")]
    pub preset: Preset,
    /// Seed of manoeuvres and weights; with --evaluate the seed of fresh manoeuvres
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Go on from the checkpoint of an interrupted training with the same settings
    #[arg(long)]
    pub resume: bool,
    /// Network file to write [default: target/network/PRESET.json]
    #[arg(long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Score a network instead of training one
    #[arg(long)]
    pub evaluate: bool,
    /// Network to score [default: the one that ships]
    #[arg(long, value_name = "FILE", requires = "evaluate")]
    pub network: Option<PathBuf>,
    /// Print the scores as JSON and nothing else
    #[arg(long, requires = "evaluate")]
    pub json: bool,
    /// Page of plots to write [default: beside the network in target/network]
    #[arg(long, value_name = "FILE")]
    pub page: Option<PathBuf>,
    /// Tyre of the plant (dry_asphalt, alcala, linear)
    #[arg(long, value_name = "NAME")]
    pub tyre: Option<String>,
    /// A parameter of the vehicle, as plant.NAME=VALUE; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Smallest and largest friction
    #[arg(long, num_args = 2, value_names = ["MIN", "MAX"])]
    pub mu: Option<Vec<f64>>,
    /// Sensor noise on the network's inputs, 1 for the plant's own
    #[arg(long, value_name = "SCALE")]
    pub noise: Option<f64>,
    /// Largest wind [m/s]
    #[arg(long, value_name = "SPEED")]
    pub wind: Option<f64>,
    /// Neurons of the hidden layers
    #[arg(long, num_args = 2, value_names = ["FIRST", "SECOND"], conflicts_with = "evaluate")]
    pub hidden: Option<Vec<usize>>,
    /// Training manoeuvres within 90 % of grip
    #[arg(long, value_name = "COUNT", conflicts_with = "evaluate")]
    pub manoeuvres: Option<usize>,
    /// Training manoeuvres beyond
    #[arg(long, value_name = "COUNT", conflicts_with = "evaluate")]
    pub beyond: Option<usize>,
    /// Random starts
    #[arg(long, value_name = "COUNT", conflicts_with = "evaluate")]
    pub starts: Option<usize>,
    /// Second-order steps of the best start
    #[arg(long, value_name = "COUNT", conflicts_with = "evaluate")]
    pub steps: Option<usize>,
}

impl Args {
    /// Puts what was asked for into a recipe.
    fn apply(&self, recipe: &mut Recipe) {
        if let Some(tyre) = &self.tyre {
            recipe.tyre.clone_from(tyre);
        }
        recipe.set.clone_from(&self.set);
        if let Some([low, high]) = self.mu.as_deref() {
            recipe.mu = (*low, *high);
        }
        if let Some([first, second]) = self.hidden.as_deref() {
            recipe.hidden = [*first, *second];
        }
        recipe.noise = self.noise.unwrap_or(recipe.noise);
        recipe.wind = self.wind.unwrap_or(recipe.wind);
        recipe.manoeuvres = self.manoeuvres.unwrap_or(recipe.manoeuvres);
        recipe.beyond = self.beyond.unwrap_or(recipe.beyond);
        recipe.starts = self.starts.unwrap_or(recipe.starts);
        recipe.steps = self.steps.unwrap_or(recipe.steps);
    }
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<()> {
    if args.evaluate {
        return evaluate::run(args, output);
    }
    let mut recipe = Recipe::new(args.preset, args.seed);
    args.apply(&mut recipe);
    recipe.validate()?;
    if args.preset == Preset::Paper && cfg!(not(feature = "adam")) {
        // Adam comes from candle, whose hundred crates take minutes to compile; only the paper's own recipe needs it, so only the first
        // training by that recipe pays.
        return workspace::run_again_with("adam");
    }
    let folder = workspace::root().join("target").join("network");
    let file = args.output.clone().unwrap_or_else(|| folder.join(format!("{}.json", args.preset.name())));
    session::run(&recipe, args, &file, output)
}

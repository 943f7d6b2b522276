//! The tools around the two FMUs: pack them, drive them, show what they do. Run as `cargo fmu COMMAND`.

pub mod archive;
pub mod baselines;
pub mod bench;
pub mod campaign;
pub mod demo;
pub mod html;
pub mod importer;
pub mod interface;
pub mod optimise;
pub mod output;
pub mod pack;
pub mod parameter_set;
pub mod plots;
pub mod recording;
pub mod report;
pub mod robustness;
pub mod simulate;
pub mod train;
pub mod tune;
pub mod workspace;
pub mod xml;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use output::Output;

/// An adaptive MPC for path tracking and the vehicle that it drives, as two FMUs.
#[derive(Clone, Debug, Parser)]
#[command(
    name = "cargo fmu",
    bin_name = "cargo fmu",
    version,
    after_help = "\
Start with:
  cargo fmu demo        see the controller drive the vehicle, find the archives and a page of plots
  cargo fmu simulate    try other roads, speeds and parameters
  cargo fmu COMMAND --help"
)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Clone, Debug, Subcommand)]
enum Command {
    Bench(bench::Args),
    Campaign(campaign::Args),
    Demo(demo::Args),
    Merge(pack::merge::Args),
    Pack(pack::Args),
    Report(report::Args),
    Robustness(robustness::Args),
    Simulate(simulate::Args),
    Train(Box<train::Args>),
    Tune(Box<tune::Args>),
}

impl Cli {
    /// Runs the command that was asked for; gives what the program tells its caller.
    pub fn run(&self) -> Result<ExitCode> {
        let output = Output::default();
        match &self.command {
            Command::Bench(args) => bench::run(args, &output),
            Command::Campaign(args) => campaign::run(args, &output),
            Command::Demo(args) => demo::run(args, &output),
            Command::Merge(args) => pack::merge::run(args, &output),
            Command::Pack(args) => pack::run(args, &output),
            Command::Report(args) => report::run(args, &output),
            Command::Robustness(args) => robustness::run(args, &output),
            Command::Simulate(args) => simulate::run(args, &output),
            Command::Train(args) => train::run(args, &output),
            Command::Tune(args) => return tune::run(args, &output),
        }?;
        Ok(ExitCode::SUCCESS)
    }
}

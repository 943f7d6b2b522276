//! `cargo fmu tune`: weights of the controller by closed loops, after the paper's third contribution.

mod ask_tell;
mod dimensions;
mod fitness;
mod interrupt;
mod page;
mod session;
mod situation;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, ensure};
use clap::Parser;

use crate::archive::write_whole;
use crate::optimise::benchmark;
use crate::optimise::functions::Function;
use crate::optimise::search::{Method, evaluations};
use crate::output::Output;
use crate::plots::assemble;
use crate::workspace;
use page::html_table;
use session::Setup;

/// Finds weights for the controller by driving, or compares optimisers.
#[derive(Clone, Debug, Parser)]
#[command(after_help = "\
Examples:
  cargo fmu tune                                       the lane change, as the paper's fitness has it
  cargo fmu tune --method hybrid                       by the paper's GA-PSO, its 25 individuals and 15 iterations
  cargo fmu tune --fitness robust                      under delay, lag, noise, low friction, gusts, other speeds
  cargo fmu tune --set plant.m=2100 --set controller.m=2100 --road my_track.csv
  cargo fmu tune --search r_delta=1:1000 --search q_e_psi=0.01:100
  cargo fmu tune --resume                              go on after Ctrl-C
  cargo fmu simulate --parameters target/tune/tuned.ssv
  cargo fmu tune --benchmark sphere --seeds 30 --json  medians of the optimisers; --peers adds other people's
  cargo fmu tune --ask-tell                            candidates and values as lines of JSON; see tools/distributed

Ctrl-C ends the generation in hand, saves it with the best so far, and gives the exit code 130; a second one ends at once.")]
pub struct Args {
    /// What makes a set good
    #[arg(long, value_enum, default_value = "paper")]
    fitness: fitness::Kind,
    /// Manoeuvre to tune on, or a CSV file
    #[arg(long, default_value = "double_lane_change")]
    road: String,
    /// A parameter of every run, as plant.NAME=VALUE or controller.NAME=VALUE; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// A parameter of the controller to search, in place of the weights; may be repeated
    #[arg(long, value_name = "NAME=LOW:HIGH")]
    search: Vec<String>,
    /// Communication step [s]
    #[arg(long, default_value_t = 0.001)]
    step: f64,
    /// How to search
    #[arg(long, value_enum, default_value = "guided")]
    method: Method,
    /// Individuals of the genetic algorithm, and particles
    #[arg(long, default_value_t = 25, value_parser = clap::value_parser!(u16).range(4..))]
    population: u16,
    /// Iterations of the hybrid; every method gets as many evaluations as it makes in them
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u16).range(1..))]
    iterations: u16,
    /// Evaluations, in place of those of --iterations
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..))]
    evaluations: Option<u32>,
    /// Seed of all random draws
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Go on from the checkpoint of a tuning with the same settings
    #[arg(long)]
    resume: bool,
    /// Parameter set to write
    #[arg(long, value_name = "FILE", default_value = "target/tune/tuned.ssv")]
    output: PathBuf,
    /// Page of plots to write [default: beside the parameter set; of a benchmark only on demand]
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
    /// Let somebody else evaluate: ask on standard output, be told on standard input
    #[arg(long, conflicts_with_all = ["page", "benchmark"])]
    ask_tell: bool,
    /// Compare optimisers on a function of five variables instead of tuning
    #[arg(long, value_name = "FUNCTION", value_enum)]
    benchmark: Option<Function>,
    /// Searches of each optimiser, from seed 0 on
    #[arg(long, default_value_t = 30, requires = "benchmark", value_parser = clap::value_parser!(u16).range(1..))]
    seeds: u16,
    /// Compare with CMA-ES and a particle swarm of other projects as well; they are compiled first
    #[arg(long, requires = "benchmark")]
    peers: bool,
    /// Print the medians as JSON and nothing else
    #[arg(long, requires = "benchmark")]
    json: bool,
}

/// Runs the command; what a person stopped has another exit code than what came to its end.
///
/// # Errors
/// If a parameter is unknown, the tuning does not fit its checkpoint, or a file cannot be written.
pub fn run(args: &Args, output: &Output) -> Result<ExitCode> {
    let finished = if let Some(function) = args.benchmark {
        compare(args, function, output).map(|()| true)
    } else if args.ask_tell {
        ask_tell::run(setup(args)?, args, &args.output, std::io::stdin().lock(), std::io::stdout().lock())
            .map(|()| true)
    } else {
        session::run(setup(args)?, args, &args.output, output)
    }?;
    Ok(if finished { ExitCode::SUCCESS } else { ExitCode::from(interrupt::INTERRUPTED) })
}

/// What a tuning depends on.
fn setup(args: &Args) -> Result<Setup> {
    ensure!(args.step > 0.0 && args.step <= 1.0, "the step must be above 0 and at most 1 s, got {}", args.step);
    let population = usize::from(args.population);
    let budget =
        args.evaluations.map_or_else(|| evaluations(population, usize::from(args.iterations)), |count| count as usize);
    Ok(Setup {
        fitness: args.fitness,
        road: args.road.clone(),
        set: args.set.clone(),
        step: args.step,
        space: dimensions::space(&args.search)?,
        method: args.method,
        population,
        budget,
        seed: args.seed,
    })
}

fn compare(args: &Args, function: Function, output: &Output) -> Result<()> {
    if args.peers && cfg!(not(feature = "peers")) {
        return workspace::run_again_with("peers");
    }
    let budget = args.evaluations.map_or(benchmark::BUDGET, |count| count as usize);
    let comparison = benchmark::compare(function, usize::from(args.seeds), budget, args.peers)?;
    if let Some(file) = &args.page {
        let lead = format!("{budget} evaluations, seeds 0 to {}.", args.seeds - 1);
        let chart = benchmark::convergence(function, usize::from(args.seeds), budget)?;
        let above = html_table(&comparison.rows());
        write_whole(file, assemble("Optimisers", &lead, &above, &[chart]).as_bytes())?;
    }
    if args.json {
        serde_json::to_writer(std::io::stdout().lock(), &comparison.medians())?;
        let _closed = writeln!(std::io::stdout().lock());
        return Ok(());
    }
    for line in crate::output::table(&comparison.rows()) {
        output.line(&line);
    }
    Ok(())
}

//! `cargo fmu bench`: solvers of the controller's quadratic programme against each other on recorded problems.

#![allow(non_snake_case, reason = "matrices keep the paper's capitals")]

mod environment;
pub mod file;
mod peers;
mod report;
mod solvers;

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Result;
use nalgebra::SVector;

use crate::output::Output;
use crate::workspace;
use file::{File, NU, Problem};
use peers::{Peers, Request};
use report::{Figures, FileReport, Report};
use solvers::{Condensing, General, OnStructure, Run, Solver};

/// Horizons of the plot, as far as the longest recorded horizon goes.
const HORIZONS: [usize; 7] = [5, 10, 15, 20, 30, 40, 60];
/// Problems of the plot's points.
const PLOTTED: usize = 60;

/// Measure the solvers of the quadratic programme against each other
///
/// All solvers run in one go and take turns, block of problems by block of problems, so that a machine that slows down
/// slows all of them. A problem's time is its best of all rounds. Peers come from PyPI, for which a virtual environment is set up
/// the first time, and report their own times.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Recorded problems, in the format of fmu-controller/lpv-mpc/benches/qp/README.md [default: the files beside it]
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub qp: Vec<PathBuf>,
    /// Print JSON instead of tables
    #[arg(long)]
    pub json: bool,
    /// Rounds over all problems
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    pub rounds: u32,
    /// Problems that a solver solves in a row before the next one has its turn
    #[arg(long, default_value_t = 25, value_parser = clap::value_parser!(u32).range(1..))]
    pub block: u32,
    /// Python with the peers from PyPI, instead of the one in target/peers that is set up when it is missing
    #[arg(long, value_name = "PROGRAM")]
    pub python: Option<PathBuf>,
    /// Leave the peers from PyPI out
    #[arg(long)]
    pub without_peers: bool,
    /// Page with the plot of time over horizon
    #[arg(long, value_name = "FILE", default_value = "target/bench/horizon.html")]
    pub plot: PathBuf,
}

/// Runs the bench.
pub fn run(args: &Args, output: &Output) -> Result<()> {
    let mut files = Vec::new();
    for path in if args.qp.is_empty() { default_files() } else { args.qp.clone() } {
        files.push(File::read(&path)?);
    }
    let mut peers = start_peers(args, output)?;
    let mut report = Report::default();
    for file in &files {
        let solvers = measure(file, file.horizon, file.problems.len(), args, peers.as_mut(), output)?;
        let found = FileReport { file: file.name(), n: file.horizon, solvers };
        if !args.json {
            output.line(&format!("{} (N = {}, {} problems)", found.file, found.n, file.problems.len()));
            found.rows().iter().for_each(|row| output.line(row));
            output.line("");
        }
        report.files.push(found);
    }
    let mut curves: BTreeMap<String, Vec<(usize, f64)>> = BTreeMap::new();
    if let Some(longest) = files.iter().max_by_key(|file| file.horizon) {
        for horizon in HORIZONS.into_iter().filter(|horizon| *horizon <= longest.horizon) {
            let count = longest.problems.len().min(PLOTTED);
            for (name, figures) in measure(longest, horizon, count, args, peers.as_mut(), output)? {
                curves.entry(name).or_default().push((horizon, figures.p50));
            }
        }
    }
    report::write_plot(&args.plot, &curves)?;
    if args.json {
        output.line(&serde_json::to_string_pretty(&report)?);
    } else {
        output.line(&format!("median time over horizon: {}", workspace::shown(&args.plot)));
    }
    Ok(())
}

/// The peers, unless nobody wants them. Those that nobody named are left out where they cannot be had.
fn start_peers(args: &Args, output: &Output) -> Result<Option<Peers>> {
    if args.without_peers {
        return Ok(None);
    }
    if let Some(python) = &args.python {
        return Peers::start(python).map(Some);
    }
    let peers = environment::python(output).and_then(|python| Peers::start(&python));
    if let Err(reason) = &peers {
        output.remark(&format!("the peers from PyPI are left out: {reason:#}"));
    }
    Ok(peers.ok())
}

fn default_files() -> Vec<PathBuf> {
    let folder = workspace::root().join("fmu-controller").join("lpv-mpc").join("benches").join("qp");
    ["gen10", "dlc15", "sat1", "dlc15n40"].map(|name| folder.join(name).with_extension("bin")).to_vec()
}

/// Best runs of one solver.
struct Best {
    seconds: Vec<f64>,
    error: f64,
    failures: usize,
}

/// Lets all solvers take turns on the first problems of a file, shortened to a horizon.
fn measure(
    file: &File,
    horizon: usize,
    count: usize,
    args: &Args,
    mut peers: Option<&mut Peers>,
    output: &Output,
) -> Result<BTreeMap<String, Figures>> {
    let problems: Vec<Problem> = file.problems[..count].iter().map(|problem| shortened(problem, horizon)).collect();
    let references: Vec<_> = problems.iter().map(solvers::reference).collect();
    let mut best: BTreeMap<String, Best> = BTreeMap::new();
    let mut condensing = vec![f64::INFINITY; count];
    let bar = output.bar(&format!("{} N = {horizon}", file.name()), u64::from(args.rounds));
    for round in 0..args.rounds {
        let mut own: [(&str, Box<dyn Solver>); 3] = [
            ("structured", Box::new(OnStructure::new(horizon))),
            ("clarabel_update", Box::new(General::new(horizon, false))),
            ("clarabel_new", Box::new(General::new(horizon, true))),
        ];
        for (_, solver) in &mut own {
            if let Some(problem) = problems.first() {
                solver.solve(problem);
                solver.restart();
            }
        }
        let mut condenser = Condensing::new(horizon);
        let mut note = |name: &str, first: usize, runs: &[Run]| {
            let best = best.entry(name.to_owned()).or_insert_with(|| Best::new(count));
            best.note(round == 0, first, runs, &problems, &references);
        };
        // The first problem of a block finds cold caches. Each round has its blocks elsewhere, so that no problem is always
        // the first one.
        let length = args.block as usize;
        let offset = length * (round as usize + 1) / args.rounds as usize;
        let starts = std::iter::once(0).chain((offset..count).step_by(length));
        for first in starts {
            let block = first..count.min(if first < offset { offset } else { first + length });
            for (name, solver) in &mut own {
                let runs: Vec<Run> = problems[block.clone()].iter().map(|problem| solver.solve(problem)).collect();
                note(name, first, &runs);
            }
            for i in block.clone() {
                condensing[i] = condensing[i].min(condenser.time(&problems[i]));
            }
            if let Some(peers) = peers.as_deref_mut() {
                for name in peers.names.clone() {
                    let request = Request {
                        solver: &name,
                        file: &std::path::absolute(&file.path)?,
                        horizon,
                        first,
                        count: block.len(),
                        restart: first == 0,
                    };
                    note(&name, first, &peers.solve(&request)?);
                }
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(best
        .into_iter()
        .map(|(name, mut best)| {
            if !name.starts_with("clarabel") && name != "structured" {
                // The script hands them condensed problems.
                best.seconds.iter_mut().zip(&condensing).for_each(|(seconds, more)| *seconds += more);
            }
            (name, Figures::new(best.seconds, best.error, best.failures))
        })
        .collect())
}

impl Best {
    fn new(count: usize) -> Self {
        Self { seconds: vec![f64::INFINITY; count], error: 0.0, failures: 0 }
    }

    fn note(
        &mut self,
        is_first_round: bool,
        first: usize,
        runs: &[Run],
        problems: &[Problem],
        references: &[Option<SVector<f64, NU>>],
    ) {
        for (i, run) in (first..).zip(runs) {
            self.seconds[i] = self.seconds[i].min(run.seconds);
            if !is_first_round {
                continue;
            }
            self.failures += usize::from(!run.solved);
            if let (true, Some(reference)) = (run.solved, references[i]) {
                self.error = self.error.max(solvers::scaled_error(&problems[i], &run.u, &reference));
            }
        }
    }
}

fn shortened(problem: &Problem, horizon: usize) -> Problem {
    let mut problem = problem.clone();
    problem.stages.truncate(horizon);
    problem
}

//! `cargo fmu report`: the paper's tables and figures again, from code that runs, beside the paper's numbers and beside what a
//! user would otherwise pick.

mod charts;
mod content;
mod errata;
mod learning;
mod readme;
mod reference;
mod runs;
mod speed;
mod timing;
mod verdict;

use std::path::PathBuf;

use anyhow::Result;
use clap::Parser;

use crate::archive::write_whole;
use crate::optimise::benchmark;
use crate::optimise::functions::Function;
use crate::output::{Output, table};
use crate::plots::Chart;
use crate::robustness;
use crate::workspace::shown;
use content::Findings;
use runs::{Run, Situation, Who};

/// Makes the paper's tables and figures again, with baselines, errata and computing times, as one page that needs no network.
///
/// Lane change and general track are driven by the controller as it ships, by linear MPC with PID as in the paper, by Stanley's
/// law and by pure pursuit; an offline nonlinear MPC that knows the plant has the textbook cost and, as the ceiling, ours.
#[derive(Clone, Debug, Parser)]
#[command(after_help = "\
Examples:
  cargo fmu report                    page and data in target/report/
  cargo fmu report --output here/     the same elsewhere
  cargo fmu report --quick            without the robustness, in a quarter of the time
  cargo fmu report --readme           write the results of README.md from a few seconds of driving
  cargo fmu report --check            fail if they do not hold any more")]
pub struct Args {
    /// Folder for report.html and its data
    #[arg(long, default_value = "target/report")]
    pub output: PathBuf,
    /// Leave out the robustness, which takes most of the time
    #[arg(long)]
    pub quick: bool,
    /// Write the results into README.md and do nothing else
    #[arg(long, conflicts_with = "check")]
    pub readme: bool,
    /// Fail if a number in README.md does not hold any more
    #[arg(long)]
    pub check: bool,
    /// Search the gains of the baselines' PID again and print them
    #[arg(long, conflicts_with_all = ["readme", "check"])]
    pub tune_pid: bool,
}

/// Searches of each optimiser.
const SEEDS: usize = 30;
/// Weights on the steering increment with which the linear MPC is driven besides [1/rad2]: ours and less, by tens.
const WEIGHTS: [f64; 4] = [300.0, 30.0, 3.0, 0.3];

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<()> {
    if args.readme {
        output.line(&format!("results: {}", shown(&readme::write()?)));
        return Ok(());
    }
    if args.check {
        readme::check()?;
        output.line("README.md holds");
        return Ok(());
    }
    if args.tune_pid {
        let bar = output.bar("searching", speed::evaluations());
        let (gains, error) = speed::tune(|| bar.inc(1))?;
        bar.finish_and_clear();
        output.line(&format!("{gains:?}\nrms speed error {error:.5} m/s"));
        return Ok(());
    }
    let findings = find(args, output)?;
    for line in table(&content::overview(&findings.runs, Situation::General)) {
        output.line(&line);
    }
    output.line("");
    for verdict in &findings.verdicts() {
        let mark = if verdict.holds { "holds" } else { "MISSED" };
        output.line(&format!("{mark:6}  {}: {} (asked: {})", verdict.name, verdict.got, verdict.asked));
    }
    for run in &findings.runs {
        write_whole(&args.output.join(data_file(run)), content::samples(run).csv().as_bytes())?;
    }
    let page = args.output.join("report.html");
    write_whole(&page, content::page(&findings).as_bytes())?;
    output.line(&format!("\npage: {}\ndata: {} tables beside it", shown(&page), findings.runs.len()));
    Ok(())
}

/// Name of a run's data beside the page.
fn data_file(run: &Run) -> String {
    format!("{}-{}.csv", run.situation.id(), run.who.id())
}

/// Medians of the optimisers on the sphere, and their convergence.
fn optimisers(output: &Output) -> Result<(Vec<Vec<String>>, Chart)> {
    let progress = output.progress("searching");
    let found = benchmark::compare(Function::Sphere, SEEDS, benchmark::BUDGET, false)?;
    let chart = benchmark::convergence(Function::Sphere, SEEDS, benchmark::BUDGET)?;
    progress.finish_and_clear();
    Ok((found.rows(), chart))
}

/// Drives, trains and times everything.
fn find(args: &Args, output: &Output) -> Result<Findings> {
    let reference = reference::Reference::open()?;
    let bar = output.bar("driving", (Situation::ALL.len() * Who::ALL.len()) as u64);
    let runs = runs::all(&reference, || bar.inc(1))?;
    bar.finish_and_clear();
    let untold = runs::Figures::of(&reference.run("general_untold")?);
    let weighted = WEIGHTS.iter().map(|r_delta| Ok((*r_delta, runs::weighted(*r_delta)?))).collect::<Result<_>>()?;
    let errata = errata::shots()?;
    let late = content::late()?;
    let learning = learning::learn(output)?;
    let optimisers = optimisers(output)?;
    let robustness = if args.quick { None } else { Some(robustness::gather(runs::STEP, &[], true, output)?) };
    let bar = output.bar("timing", Who::ALL.len() as u64);
    // One after the other: a timing beside other work measures the other work.
    let mut times = Vec::new();
    for who in Who::ALL {
        let seconds = match who {
            Who::Ours => timing::times(None)?,
            Who::Baseline(baseline) => timing::times(Some(baseline))?,
            // Timed when they were made.
            Who::Nonlinear(nonlinear) => reference.times(&runs::stored(Situation::General, nonlinear))?,
        };
        times.push((who, seconds));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let parameters = lpv_mpc::Parameters::adaptive();
    let stale = reference.stale(&parameters)?;
    Ok(Findings { runs, errata, late, learning, times, untold, weighted, optimisers, robustness, stale })
}

//! `cargo fmu robustness`: how much delay, lag, noise, wind, ice and ignorance the closed loop bears.
//!
//! A list of cases, each with what is asked of a robust controller and what it does. All runs are native at communication
//! steps of 1 ms, spread over the processors; a run's result does not depend on which processor drove it, and the packed
//! FMUs give the same bits.

mod cases;
mod page;
mod scenario;
mod sweep;
mod weights;

use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use clap::Parser;
use rayon::prelude::*;

use crate::archive::write_whole;
use crate::output::{Output, table};
use crate::plots::{Chart, assemble};
use crate::workspace::shown;
use cases::{Case, Verdict, measure};
use sweep::Series;

/// Digits behind the point of figures in tables, and the most where a figure is as good as its limit.
const DIGITS: usize = 2;
const MOST_DIGITS: usize = 9;

/// Shows what delay, lag, noise, wind, slopes and lack of grip do to the closed loop.
#[derive(Clone, Debug, Parser)]
#[command(after_help = "\
Examples:
  cargo fmu robustness                              the list, and charts over delay, lag, noise, wind, ice and speed
  cargo fmu robustness --quick                      the same on coarser grids
  cargo fmu robustness --cases                      only what is asked and what is reached
  cargo fmu robustness --weights                    the default weights against the paper's and their own neighbours
  cargo fmu robustness --case grip_20               one case, each of its runs
  cargo fmu robustness --case grip_20 --set controller.q_e_y=100 --csv run.csv")]
pub struct Args {
    /// Only this case, run by run
    #[arg(long, value_name = "NAME", conflicts_with_all = ["cases", "weights"])]
    pub case: Option<String>,
    /// Only the list of cases
    #[arg(long)]
    pub cases: bool,
    /// Only a comparison of weights over an ensemble of situations
    #[arg(long, conflicts_with = "cases")]
    pub weights: bool,
    /// Every second value of each sweep
    #[arg(long)]
    pub quick: bool,
    /// Communication step [s]
    #[arg(long, default_value_t = 0.001)]
    pub step: f64,
    /// A parameter of every run, as plant.NAME=VALUE or controller.NAME=VALUE; may be repeated
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Write every sample of the case's worst run to this file
    #[arg(long, value_name = "FILE", requires = "case")]
    pub csv: Option<PathBuf>,
    /// Folder for the numbers and the page
    #[arg(long, default_value = "target/robustness")]
    pub output: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// If a parameter is unknown or the results cannot be written.
pub fn run(args: &Args, output: &Output) -> Result<()> {
    ensure!(args.step > 0.0 && args.step <= 1.0, "the step must be above 0 and at most 1 s, got {}", args.step);
    match &args.case {
        Some(name) => one_case(args, name, output),
        None if args.weights => weights::run(args, output),
        None => all(args, output),
    }
}

/// The list and, unless only that is wanted, the sweeps.
fn all(args: &Args, output: &Output) -> Result<()> {
    let evidence = if args.cases {
        Evidence { verdicts: judge(cases::all(), args.step, &args.set, output)?, series: Vec::new() }
    } else {
        gather(args.step, &args.set, args.quick, output)?
    };
    let verdicts = &evidence.verdicts;
    for line in table(&rows(verdicts)) {
        output.line(&line);
    }
    let failed = verdicts.iter().filter(|verdict| verdict.passed() == Some(false)).count();
    output.line(&format!("\n{failed} of {} cases fail", verdicts.iter().filter(|v| v.case.limit.is_some()).count()));
    let list = args.output.join("cases.csv");
    write_whole(&list, page::list_csv(verdicts).as_bytes())?;
    output.line(&format!("\ncases: {}", shown(&list)));
    if args.cases {
        return Ok(());
    }
    let (csv, html) = (args.output.join("sweeps.csv"), args.output.join("robustness.html"));
    write_whole(&csv, page::sweep_csv(&evidence.series).as_bytes())?;
    let lead =
        "What delay, lag, noise, wind and lack of grip do to the closed loop; the worst of each case's runs counts.";
    write_whole(&html, assemble("Robustness", lead, &evidence.list(), &evidence.charts()).as_bytes())?;
    output.line(&format!("samples: {}\nplots: {}", shown(&csv), shown(&html)));
    Ok(())
}

/// What the command finds, for pages.
pub(crate) struct Evidence {
    verdicts: Vec<Verdict>,
    series: Vec<Series>,
}

impl Evidence {
    /// The list of cases as a table in markup.
    pub(crate) fn list(&self) -> String {
        page::list(&self.verdicts)
    }

    /// Charts of the sweeps.
    pub(crate) fn charts(&self) -> Vec<Chart> {
        page::charts(&self.series)
    }
}

/// Drives the list and the sweeps; `quick` takes coarser grids.
///
/// # Errors
/// If a parameter is unknown or out of its range.
pub(crate) fn gather(step: f64, set: &[String], quick: bool, output: &Output) -> Result<Evidence> {
    Ok(Evidence { verdicts: judge(cases::all(), step, set, output)?, series: sweep::drive(step, set, quick, output)? })
}

/// Drives all scenarios of the cases.
fn judge(cases: Vec<Case>, step: f64, set: &[String], output: &Output) -> Result<Vec<Verdict>> {
    let cases: Vec<Case> = cases
        .into_iter()
        .map(|case| Case { scenarios: case.scenarios.into_iter().map(|s| s.assigned(set)).collect(), ..case })
        .collect();
    let runs: Vec<(usize, usize)> =
        cases.iter().enumerate().flat_map(|(i, case)| (0..case.scenarios.len()).map(move |j| (i, j))).collect();
    let bar = output.bar("driving", runs.len() as u64);
    let figures: Vec<f64> = runs
        .par_iter()
        .map(|&(i, j)| {
            let figure = measure(&cases[i], &cases[i].scenarios[j], step);
            bar.inc(1);
            figure
        })
        .collect::<Result<_>>()?;
    bar.finish_and_clear();
    let mut figures = figures.into_iter();
    Ok(cases
        .into_iter()
        .map(|case| {
            let figures = figures.by_ref().take(case.scenarios.len()).collect();
            Verdict { case, figures }
        })
        .collect())
}

fn rows(verdicts: &[Verdict]) -> Vec<Vec<String>> {
    let head = ["asked", "case", "at most", "got", "unit", "", "worst run"].map(str::to_owned).to_vec();
    let row = |verdict: &Verdict| {
        let Verdict { case, .. } = verdict;
        let (worst, figure) = verdict.worst();
        let digits = digits(case, figure);
        let passed = verdict.passed().map_or("", |passed| if passed { "passed" } else { "FAILED" });
        vec![
            case.asked.to_owned(),
            case.name.to_owned(),
            case.limit.map_or(String::new(), |limit| shown_figure(case, limit, digits)),
            shown_figure(case, figure, digits),
            case.unit.0.to_owned(),
            passed.to_owned(),
            case.scenarios[worst].name.clone(),
        ]
    };
    std::iter::once(head).chain(verdicts.iter().map(row)).collect()
}

fn shown_figure(case: &Case, figure: f64, digits: usize) -> String {
    if figure.is_finite() { format!("{:.digits$}", figure * case.unit.1) } else { "lost".to_owned() }
}

/// Digits behind the point that tell a figure from its limit, of which some are reached to a rounding.
fn digits(case: &Case, figure: f64) -> usize {
    let differ = |limit: f64, digits: usize| shown_figure(case, limit, digits) != shown_figure(case, figure, digits);
    case.limit.and_then(|limit| (DIGITS..=MOST_DIGITS).find(|digits| differ(limit, *digits))).unwrap_or(DIGITS)
}

/// Every run of one case.
fn one_case(args: &Args, name: &str, output: &Output) -> Result<()> {
    let all = cases::all();
    let known: Vec<&str> = all.iter().map(|case| case.name).collect();
    let Some(case) = all.iter().find(|case| case.name == name).cloned() else {
        bail!("unknown case {name}: known are {}", known.join(", "));
    };
    let verdict = judge(vec![case], args.step, &args.set, output)?.pop().context("one case has one verdict")?;
    let Verdict { case, figures } = &verdict;
    let digits = digits(case, verdict.worst().1);
    let limit = case.limit.map_or(String::new(), |limit| format!(" (at most {})", shown_figure(case, limit, digits)));
    output.line(&format!("{}, {}{limit}\n", case.asked, case.unit.0));
    let rows: Vec<Vec<String>> = case
        .scenarios
        .iter()
        .zip(figures)
        .map(|(scenario, figure)| vec![scenario.name.clone(), shown_figure(case, *figure, digits)])
        .collect();
    for line in table(&rows) {
        output.line(&line);
    }
    if let Some(file) = &args.csv {
        let (worst, _) = verdict.worst();
        let run = case.scenarios[worst].drive(args.step)?.context("the plant refused to go on, nothing to write")?;
        write_whole(file, run.csv().as_bytes())?;
        output.line(&format!("\nsamples of {}: {}", case.scenarios[worst].name, shown(file)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_is_told_from_its_limit() {
        let case = Case { limit: Some(0.03), unit: ("cm", 100.0), ..cases::all().swap_remove(0) };
        let shown = |figure: f64| {
            let digits = digits(&case, figure);
            [0.03, figure].map(|value| shown_figure(&case, value, digits))
        };
        assert_eq!(shown(0.02), ["3.00", "2.00"]);
        assert_eq!(shown(0.029_999), ["3.0000", "2.9999"]);
        assert_eq!(shown(0.03), ["3.00", "3.00"]);
        assert_eq!(shown(f64::INFINITY), ["3.00", "lost"]);
    }
}

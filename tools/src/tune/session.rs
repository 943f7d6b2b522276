//! One tuning from the present parameters to the written set, interrupted and resumed as its user likes.

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::fitness::{self, Fitness};
use super::{Args, dimensions, interrupt, page};
use crate::archive::{read_text, write_whole};
use crate::interface::Interface;
use crate::optimise::search::Method;
use crate::optimise::{Candidate, Dimension, Search, Space};
use crate::output::{Output, number, percent, table};
use crate::parameter_set::ParameterSet;
use crate::workspace::{CONTROLLER, shown};

/// All that decides how a tuning goes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Setup {
    pub fitness: fitness::Kind,
    pub road: String,
    pub set: Vec<String>,
    pub step: f64,
    pub space: Space,
    pub method: Method,
    pub population: usize,
    pub budget: usize,
    pub seed: u64,
}

/// What is needed to go on.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    pub setup: Setup,
    pub search: Search,
    /// Everything that was evaluated, in the order of asking.
    pub evaluated: Vec<Candidate>,
}

impl Checkpoint {
    /// A tuning that has not begun, or the one that was interrupted.
    ///
    /// # Errors
    /// If there is nothing to resume, or it belongs to another setup.
    pub fn start(setup: Setup, present: &[f64], resume: bool, file: &Path) -> Result<Self> {
        if resume {
            let text = read_text(file).context("there is no interrupted tuning to resume")?;
            let saved: Self = serde_json::from_str(&text).with_context(|| format!("in {}", file.display()))?;
            ensure!(saved.setup == setup, "{} belongs to a tuning with other settings", file.display());
            return Ok(saved);
        }
        let sides = setup.space.dimensions.len();
        let mut search = Search::new(setup.method, sides, setup.population, setup.budget, setup.seed);
        // What is in use takes part: the search can only improve on it.
        search.include(setup.space.point(present));
        Ok(Self { setup, search, evaluated: Vec::new() })
    }

    /// Takes a generation's values and saves the whole.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn tell(&mut self, points: Vec<Vec<f64>>, values: &[f64], file: &Path) -> Result<()> {
        let pairs = points.iter().zip(values);
        self.evaluated.extend(pairs.map(|(point, value)| Candidate { point: point.clone(), value: *value }));
        self.search.tell(points, values);
        write_whole(file, serde_json::to_string(self)?.as_bytes())
    }
}

/// The parameters before and after, judged by what the tuning saw and by what it did not see.
pub struct Verdict {
    pub present: Vec<f64>,
    pub tuned: Vec<f64>,
    pub training: Fitness,
    pub held_out: Fitness,
    /// Figures of the tuned set.
    pub seen: Vec<f64>,
    pub unseen: Vec<f64>,
}

/// Tunes and writes set, page and checkpoint; gives whether all evaluations were made.
pub fn run(setup: Setup, args: &Args, file: &Path, output: &Output) -> Result<bool> {
    let begin = Instant::now();
    let names: Vec<String> = setup.space.dimensions.iter().map(|side| side.name.clone()).collect();
    let present = dimensions::present(&setup.space, &setup.set)?;
    let training = Fitness::training(setup.fitness, &setup.road, &setup.set, setup.step, &names)?;
    let checkpoint = file.with_extension("checkpoint.json");
    let mut tuning = Checkpoint::start(setup, &present, args.resume, &checkpoint)?;
    let earlier = tuning.search.evaluations();
    search(&mut tuning, &training, &checkpoint, output)?;
    let seconds = begin.elapsed().as_secs_f64();

    let Checkpoint { setup, search, .. } = &tuning;
    let best = search.best().context("the tuning was stopped before anything was evaluated")?;
    let tuned = setup.space.values(&best.point);
    write_set(&names, &tuned, file)?;
    let held_out = Fitness::held_out(setup.fitness, &setup.road, &setup.set, setup.step, &names)?;
    let (seen, unseen) = (training.figures(&tuned), held_out.figures(&tuned));
    let verdict = Verdict { present, tuned, training, held_out, seen, unseen };

    for rows in [parameter_rows(&tuning, &verdict), figure_rows(&verdict)] {
        for line in table(&rows) {
            output.line(&line);
        }
        output.line("");
    }
    let pictures = args.page.clone().unwrap_or_else(|| file.with_extension("html"));
    write_whole(&pictures, page::of(&tuning, &verdict).as_bytes())?;
    let (evaluations, budget) = (search.evaluations(), search.budget());
    // The time is that of this run alone.
    let now = if earlier > 0 { format!(", {} of them now,", evaluations - earlier) } else { String::new() };
    output.line(&format!("{evaluations} of {budget} evaluations{now} in {seconds:.0} s, seed {}", setup.seed));
    if !search.finished() {
        output.line("stopped early; the same command with --resume goes on");
    }
    output.line(&format!("parameter set: {}", shown(file)));
    output.line(&format!("plots: {}", shown(&pictures)));
    Ok(search.finished())
}

fn search(tuning: &mut Checkpoint, fitness: &Fitness, checkpoint: &Path, output: &Output) -> Result<()> {
    let bar = output.bar("tuning", tuning.search.budget() as u64);
    bar.set_position(tuning.search.evaluations() as u64);
    bar.reset_eta();
    let (begin, earlier) = (Instant::now(), tuning.search.evaluations());
    let tenths = |evaluations: usize, budget: usize| 10 * evaluations / budget;
    let stop = interrupt::flag()?;
    while !tuning.search.finished() && !stop.raised() {
        let points = tuning.search.ask();
        let affordable = points.len().min(tuning.search.budget() - tuning.search.evaluations());
        let values: Vec<f64> = points[..affordable]
            .par_iter()
            .map(|point| {
                let value = fitness.score(&fitness.figures(&tuning.setup.space.values(point)));
                bar.inc(1);
                value
            })
            .collect();
        let before = tuning.search.evaluations();
        tuning.tell(points, &values, checkpoint)?;
        let best = tuning.search.best().map_or(f64::NAN, |best| best.value);
        bar.set_message(format!("tuning, best {best:.4}, {:.0} s left", bar.eta().as_secs_f64()));
        let (evaluations, budget) = (tuning.search.evaluations(), tuning.search.budget());
        if tenths(evaluations, budget) > tenths(before, budget) {
            let each = begin.elapsed().as_secs_f64() / (evaluations - earlier) as f64;
            let left = each * (budget - evaluations) as f64;
            output.milestone(&format!("tuning: {evaluations} of {budget}, best {best:.4}, {left:.0} s left"));
        }
    }
    bar.finish_and_clear();
    Ok(())
}

/// Writes the set for the controller.
pub fn write_set(names: &[String], values: &[f64], file: &Path) -> Result<()> {
    let values = names.iter().zip(values).map(|(name, value)| (name.clone(), value.to_string())).collect();
    let interface = Interface::parse(&read_text(&CONTROLLER.description_file())?)?;
    let document = ParameterSet::new("tuned_weights", values).element(&interface)?.document()?;
    write_whole(file, document.as_bytes())
}

/// How near its end a parameter of the box has reached it, as a share of the side [1].
const AT_BOUND: f64 = 0.01;

/// Which end of its side of the box a value has reached: a better one may lie beyond.
fn bound(side: &Dimension, value: f64) -> &'static str {
    match side.place(value) {
        place if place <= AT_BOUND => "lower",
        place if place >= 1.0 - AT_BOUND => "upper",
        _ => "",
    }
}

/// Parameters before and after, with what the better candidates have in common: a wide range is a parameter that hardly matters.
pub fn parameter_rows(tuning: &Checkpoint, verdict: &Verdict) -> Vec<Vec<String>> {
    let space = &tuning.setup.space;
    let mut sorted: Vec<&Candidate> = tuning.evaluated.iter().collect();
    sorted.sort_by(|a, b| a.value.total_cmp(&b.value));
    sorted.truncate(tuning.evaluated.len().div_ceil(10));
    let mut rows =
        vec![["parameter", "before", "after", "at its bound", "best tenth from", "to"].map(str::to_owned).to_vec()];
    for (k, side) in space.dimensions.iter().enumerate() {
        let places = || sorted.iter().map(|one| side.value(one.point[k]));
        let (low, high) = (places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max));
        let [before, after, low, high] = [verdict.present[k], verdict.tuned[k], low, high].map(number);
        rows.push(vec![side.name.clone(), before, after, bound(side, verdict.tuned[k]).to_owned(), low, high]);
    }
    rows
}

/// Figures before and after, run by run, and the fitness that they make.
pub fn figure_rows(verdict: &Verdict) -> Vec<Vec<String>> {
    let mut rows = vec![["1 = errors of the paper's size", "before", "after", "change"].map(str::to_owned).to_vec()];
    let line = |name: String, before: f64, after: f64| {
        vec![name, format!("{before:.4}"), format!("{after:.4}"), percent(after / before - 1.0)]
    };
    let Verdict { training, held_out, seen, unseen, .. } = verdict;
    for (title, fitness, after) in [("tuned on", training, seen), ("not seen", held_out, unseen)] {
        let runs = fitness.titles().into_iter().zip(fitness.present()).zip(after);
        rows.extend(runs.map(|((name, before), after)| line(format!("{title}: {name}"), *before, *after)));
        rows.push(line(format!("{title}: fitness"), fitness.score(fitness.present()), fitness.score(after)));
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_that_ends_at_its_bound_is_marked() {
        let side = Dimension::logarithmic("r_delta", 1e-3, 1e4);
        assert_eq!(
            [1e-3, 1.1e-3, 1.5e-3, 1.0, 9.9e3, 1e4].map(|value| bound(&side, value)),
            ["lower", "lower", "", "", "upper", "upper"]
        );
    }
}

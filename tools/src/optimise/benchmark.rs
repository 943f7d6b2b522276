//! Optimisers beside each other on one function: many seeds, the same number of evaluations for all.

use anyhow::Result;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use super::functions::{Function, SIDES};
use super::search::{Method, Search};
use crate::plots::{BLUE, Chart, Curve, GREEN, GREY, ORANGE, chart};

/// Individuals and particles, from the paper's tables.
const POPULATION: usize = 25;
/// Iterations on the sphere, from the paper's text.
const ITERATIONS: usize = 100;
/// Evaluations of the hybrid in the paper's hundred iterations: 25 first ones in each half, then 20 children and 25 particles.
pub const BUDGET: usize = 2 * POPULATION + ITERATIONS * (20 + POPULATION);

/// What the paper reports on the sphere after a hundred iterations.
pub const PAPER: [(&str, f64); 3] = [("ga", 2.95e-5), ("pso", 4.82e-6), ("hybrid", 4.24e-8)];

/// Least value so far over the evaluations.
type Curves = Vec<(usize, f64)>;

/// What one optimiser found, seed by seed.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// Its name.
    pub name: String,
    /// Least values, sorted.
    pub least: Vec<f64>,
}

impl Entry {
    fn new(name: &str, mut least: Vec<f64>) -> Self {
        least.sort_by(f64::total_cmp);
        Self { name: name.to_owned(), least }
    }

    /// Value at a share of the seeds; the mean of the two middle ones for the median of an even number.
    fn quantile(&self, share: f64) -> f64 {
        let place = share * (self.least.len() - 1) as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between the first and the last")]
        let (low, high) = (place.floor() as usize, place.ceil() as usize);
        self.least[low] + (place - place.floor()) * (self.least[high] - self.least[low])
    }

    /// The median.
    pub fn median(&self) -> f64 {
        self.quantile(0.5)
    }
}

/// All optimisers on one function.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The function.
    pub function: Function,
    /// Evaluations of each search.
    pub evaluations: usize,
    /// The optimisers, ours first.
    pub entries: Vec<Entry>,
}

/// Runs `seeds` searches of each optimiser, from seed 0 on; with `peers` those of other projects as well.
///
/// # Errors
/// If a peer fails.
pub fn compare(function: Function, seeds: usize, budget: usize, peers: bool) -> Result<Comparison> {
    let mut entries = Vec::new();
    for method in Method::ALL {
        let ends: Vec<f64> = (0..seeds as u64)
            .into_par_iter()
            .map(|seed| Ok(curve(function, method, budget, seed)?.last().map_or(f64::INFINITY, |end| end.1)))
            .collect::<Result<_>>()?;
        entries.push(Entry::new(method.name(), ends));
    }
    if peers {
        entries.extend(others(function, seeds, budget)?);
    }
    Ok(Comparison { function, evaluations: budget, entries })
}

#[cfg(feature = "peers")]
fn others(function: Function, seeds: usize, budget: usize) -> Result<Vec<Entry>> {
    use super::peers;
    peers::NAMES
        .iter()
        .map(|name| {
            let ends = (0..seeds as u64)
                .into_par_iter()
                .map(|seed| peers::least(name, function, budget, seed))
                .collect::<Result<_>>()?;
            Ok(Entry::new(name, ends))
        })
        .collect()
}

#[cfg(not(feature = "peers"))]
fn others(_: Function, _: usize, _: usize) -> Result<Vec<Entry>> {
    anyhow::bail!("other people's optimisers need the feature peers")
}

/// One search, generation by generation.
fn curve(function: Function, method: Method, budget: usize, seed: u64) -> Result<Curves> {
    let space = function.space()?;
    let mut search = Search::new(method, SIDES, POPULATION, budget, seed);
    while !search.finished() {
        search.advance(|point| function.value(&space.values(point)));
    }
    Ok(search.history().iter().map(|progress| (progress.evaluations, progress.best)).collect())
}

impl Comparison {
    /// Medians by optimiser, for other programs.
    pub fn medians(&self) -> Value {
        let medians: serde_json::Map<String, Value> =
            self.entries.iter().map(|entry| (entry.name.clone(), json!(entry.median()))).collect();
        json!({
            "function": self.function.name(),
            "dimensions": SIDES,
            "evaluations": self.evaluations,
            "seeds": self.entries.first().map_or(0, |entry| entry.least.len()),
            "medians": medians,
        })
    }

    /// A table, the paper's figures beside ours where there are some.
    pub fn rows(&self) -> Vec<Vec<String>> {
        let name = format!("{}, {} evaluations", self.function.name(), self.evaluations);
        let mut rows = vec![[&name, "median", "best tenth", "worst tenth", "paper"].map(str::to_owned).to_vec()];
        for entry in &self.entries {
            let paper = PAPER.iter().find(|(name, _)| self.function == Function::Sphere && *name == entry.name);
            let numbers = [0.5, 0.1, 0.9].map(|share| format!("{:.2e}", entry.quantile(share)));
            let paper = paper.map_or(String::new(), |(_, value)| format!("{value:.2e}"));
            rows.push([entry.name.clone()].into_iter().chain(numbers).chain([paper]).collect());
        }
        rows
    }
}

/// Convergence of the paper's methods and ours, the median over the seeds at each number of evaluations.
///
/// # Errors
/// If the function has no box.
pub(crate) fn convergence(function: Function, seeds: usize, budget: usize) -> Result<Chart> {
    let colors = [GREY, ORANGE, GREEN, BLUE];
    let mut curves = Vec::new();
    for (method, color) in Method::ALL.into_iter().zip(colors) {
        let all: Vec<Curves> = (0..seeds as u64)
            .into_par_iter()
            .map(|seed| curve(function, method, budget, seed))
            .collect::<Result<_>>()?;
        let x: Vec<usize> = (1..=POPULATION * 4).map(|k| k * budget / (POPULATION * 4)).collect();
        let y = x.iter().map(|x| Entry::new("", all.iter().map(|curve| reached(curve, *x)).collect()).median());
        // Below this a logarithmic axis would show rounding, and 0 not at all.
        let y = y.map(|value| value.max(f64::EPSILON * f64::EPSILON)).collect();
        let x: Vec<f64> = x.into_iter().map(|x| x as f64).collect();
        curves.push(Curve::new(method.name(), &x, y, color));
    }
    let labels = [
        &format!("convergence_{}", function.name()),
        &format!("Convergence on {}", function.name()),
        &format!("Median of {seeds} seeds, five variables, cut at 5e-32."),
    ];
    Ok(chart(labels.map(String::as_str), ["evaluations", "least value"], curves).log_y())
}

/// Least value after at most that many evaluations.
fn reached(curve: &Curves, evaluations: usize) -> f64 {
    curve.iter().take_while(|(at, _)| *at <= evaluations).last().map_or_else(|| curve[0].1, |(_, best)| *best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimise::search::evaluations;

    #[test]
    fn the_budget_is_that_of_the_papers_hundred_iterations() {
        assert_eq!(BUDGET, evaluations(POPULATION, ITERATIONS));
    }

    #[test]
    fn quantiles_lie_between_their_neighbours() {
        let entry = Entry::new("e", vec![4.0, 1.0, 3.0, 2.0]);
        assert_eq!((entry.quantile(0.0), entry.median(), entry.quantile(1.0)), (1.0, 2.5, 4.0));
    }

    #[test]
    fn medians_are_named_and_the_paper_stands_beside_the_sphere() {
        let comparison = compare(Function::Sphere, 2, 200, false).unwrap();
        let json = comparison.medians();
        assert_eq!((json["function"].as_str(), json["evaluations"].as_u64()), (Some("sphere"), Some(200)));
        for method in Method::ALL {
            assert!(json["medians"][method.name()].as_f64().unwrap() >= 0.0);
        }
        assert_eq!(comparison.rows()[3].last().unwrap(), "4.24e-8");
    }
}

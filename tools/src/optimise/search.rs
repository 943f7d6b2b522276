//! One search from its first generation to its last.

use rand::SeedableRng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::genetic::{self, Genetic};
use super::guided::Guided;
use super::hybrid::Hybrid;
use super::random::Random;
use super::swarm::{self, Swarm};
use super::{Candidate, Space};

/// Stands for a value that is no finite number, so that sums over a population stay finite.
pub const REFUSED: f64 = 1e300;

/// How to search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The paper's genetic algorithm
    Ga,
    /// The paper's improved particle swarm
    Pso,
    /// The paper's hybrid of both
    Hybrid,
    /// Differential evolution guided by quadratic models
    Guided,
}

impl Method {
    /// All of them, the paper's first.
    pub const ALL: [Self; 4] = [Self::Ga, Self::Pso, Self::Hybrid, Self::Guided];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ga => "ga",
            Self::Pso => "pso",
            Self::Hybrid => "hybrid",
            Self::Guided => "guided",
        }
    }
}

/// Evaluations that the paper's hybrid spends: a population and a swarm of this size over that many iterations.
pub fn evaluations(population: usize, iterations: usize) -> usize {
    let (first, later) = Genetic::evaluations(&genetic::Options { population, ..genetic::Options::default() });
    first + population + iterations * (later + population)
}

#[derive(Clone, Debug, Serialize, Deserialize)]
enum Strategy {
    Genetic(Genetic),
    Swarm(Swarm),
    Hybrid(Hybrid),
    Guided(Guided),
}

/// The best after a generation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Evaluations so far.
    pub evaluations: usize,
    /// Least value so far.
    pub best: f64,
    /// Middle value of what was evaluated of the generation.
    pub median: f64,
}

/// A search on its way; what it holds is all there is to it, so it goes on from where it was saved.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Search {
    strategy: Strategy,
    random: Random,
    budget: usize,
    evaluations: usize,
    best: Option<Candidate>,
    history: Vec<Progress>,
    /// A point that takes the place of the first one that is drawn, such as what is in use today.
    given: Option<Vec<f64>>,
}

impl Search {
    /// A search with `budget` evaluations of points with `sides` coordinates; `population` is that of the paper's methods.
    pub fn new(method: Method, sides: usize, population: usize, budget: usize, seed: u64) -> Self {
        let genetic = genetic::Options { population, ..genetic::Options::default() };
        let swarm = swarm::Options { particles: population, ..swarm::Options::default() };
        let (first, later) = Genetic::evaluations(&genetic);
        let strategy = match method {
            Method::Ga => Strategy::Genetic(Genetic::new(genetic, sides)),
            Method::Pso => Strategy::Swarm(Swarm::new(swarm, sides, (budget / population.max(1)).max(1) - 1)),
            Method::Hybrid => {
                let generations = budget.saturating_sub(first + population) / (later + population);
                Strategy::Hybrid(Hybrid::new(genetic, swarm, sides, generations))
            }
            Method::Guided => Strategy::Guided(Guided::new(sides, budget)),
        };
        Self {
            strategy,
            random: Random::seed_from_u64(seed),
            budget,
            evaluations: 0,
            best: None,
            history: Vec::new(),
            given: None,
        }
    }

    /// Lets a point take the place of the first one that is drawn.
    pub fn include(&mut self, point: Vec<f64>) {
        self.given = Some(point);
    }

    /// Whether all evaluations are spent.
    pub fn finished(&self) -> bool {
        self.evaluations >= self.budget
    }

    /// Evaluations so far.
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Evaluations in all.
    pub fn budget(&self) -> usize {
        self.budget
    }

    /// The best so far.
    pub fn best(&self) -> Option<&Candidate> {
        self.best.as_ref()
    }

    /// The best after each generation.
    pub fn history(&self) -> &[Progress] {
        &self.history
    }

    /// The next generation's points. Of the last one only what the budget allows is worth evaluating: the first
    /// `budget() - evaluations()`.
    pub fn ask(&mut self) -> Vec<Vec<f64>> {
        let random = &mut self.random;
        let mut points = match &mut self.strategy {
            Strategy::Genetic(strategy) => strategy.ask(random),
            Strategy::Swarm(strategy) => strategy.ask(random),
            Strategy::Hybrid(strategy) => strategy.ask(random),
            Strategy::Guided(strategy) => strategy.ask(random),
        };
        if let (Some(first), Some(given)) = (points.first_mut(), self.given.take()) {
            *first = given;
        }
        points
    }

    /// Takes the values of the points that [`Self::ask`] gave, in their order; missing ones at the end count as refused.
    pub fn tell(&mut self, points: Vec<Vec<f64>>, values: &[f64]) {
        let known = values.iter().copied().chain(std::iter::repeat(REFUSED));
        let evaluated: Vec<Candidate> = points
            .into_iter()
            .zip(known)
            .map(|(point, value)| Candidate { point, value: if value.is_finite() { value } else { REFUSED } })
            .collect();
        for one in &evaluated[..values.len().min(evaluated.len())] {
            if self.best.as_ref().is_none_or(|best| one.value < best.value) {
                self.best = Some(one.clone());
            }
        }
        match &mut self.strategy {
            Strategy::Genetic(strategy) => strategy.tell(&evaluated),
            Strategy::Swarm(strategy) => strategy.tell(&evaluated),
            Strategy::Hybrid(strategy) => strategy.tell(&evaluated),
            Strategy::Guided(strategy) => strategy.tell(&evaluated),
        }
        self.evaluations += values.len();
        // Without the members that the budget cut off, whose stand-in would become the middle of a generation cut short.
        let mut sorted: Vec<f64> = evaluated.iter().take(values.len()).map(|one| one.value).collect();
        sorted.sort_by(f64::total_cmp);
        let best = self.best.as_ref().map_or(REFUSED, |best| best.value);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(REFUSED);
        self.history.push(Progress { evaluations: self.evaluations, best, median });
    }

    /// One generation, evaluated by all threads; `f` sees points of the unit cube.
    pub fn advance(&mut self, f: impl Fn(&[f64]) -> f64 + Sync) {
        let points = self.ask();
        let affordable = points.len().min(self.budget - self.evaluations);
        let values: Vec<f64> = points[..affordable].par_iter().map(|point| f(point)).collect();
        self.tell(points, &values);
    }
}

/// The least value of a function over a box: values where it was found, and the value.
pub fn minimise(
    f: impl Fn(&[f64]) -> f64 + Sync,
    space: &Space,
    method: Method,
    budget: usize,
    seed: u64,
) -> Option<(Vec<f64>, f64)> {
    let mut search = Search::new(method, space.dimensions.len(), 25, budget, seed);
    while !search.finished() {
        search.advance(|point| f(&space.values(point)));
    }
    search.best().map(|best| (space.values(&best.point), best.value))
}

#[cfg(test)]
mod tests;

//! The paper's genetic algorithm, [Kebbati, Algorithm 1 and Table I].
//!
//! The algorithm as printed forgets its best and leaves open: the size of the tournament, what the selection pressure and the
//! mutation's size refer to, and the order in which children replace parents. Our choices are documented at the fields.

use serde::{Deserialize, Serialize};

use super::random::{self, Random};
use super::{Candidate, best_of};

/// Numbers of the algorithm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Individuals [1].
    pub population: usize,
    /// Children of a generation as a share of the population [1].
    pub offspring: f64,
    /// Selection pressure of the roulette [1]: an individual's chance is `exp(-pressure * (f - best) / (mean - best))`. The
    /// difference to the best makes it work for fitness of any sign and size.
    pub pressure: f64,
    /// Chance of a gene to mutate [1].
    pub mutation_rate: f64,
    /// Variance of a mutation [1], where 1 is the range that the population takes up along that side: a fixed size cannot
    /// refine, and the paper names no unit.
    pub mutation_variance: f64,
    /// Individuals in a tournament [1]: three, so that the weakest two never win and all others can.
    pub tournament: usize,
}

impl Default for Options {
    /// Table I of the paper.
    fn default() -> Self {
        Self {
            population: 25,
            offspring: 0.8,
            pressure: 0.75,
            mutation_rate: 0.3,
            mutation_variance: 0.15,
            tournament: 3,
        }
    }
}

/// A population on its way.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Genetic {
    options: Options,
    sides: usize,
    /// Individuals, the best first.
    people: Vec<Candidate>,
}

impl Genetic {
    /// Starts from nothing: the first generation is drawn by [`Self::ask`].
    pub fn new(options: Options, sides: usize) -> Self {
        Self { options, sides, people: Vec::new() }
    }

    /// Evaluations of the first generation and of each later one.
    pub fn evaluations(options: &Options) -> (usize, usize) {
        // Children come in pairs.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "half a share of the population")]
        let pairs = (0.5 * options.offspring * options.population as f64).round() as usize;
        (options.population, 2 * pairs.max(1))
    }

    /// The next generation.
    pub fn ask(&self, random: &mut Random) -> Vec<Vec<f64>> {
        let (first, later) = Self::evaluations(&self.options);
        if self.people.is_empty() {
            return (0..first).map(|_| random::point(random, self.sides)).collect();
        }
        let range = self.range();
        let wheel = self.wheel();
        let mut children = Vec::with_capacity(later);
        while children.len() < later {
            // Which of the two selections makes a pair of parents is drawn anew for each pair, as in Algorithm 1.
            let roulette = random::uniform(random) >= random::uniform(random);
            let mut parent = || if roulette { spin(&wheel, random) } else { self.tournament(random) };
            let (a, b) = (parent(), parent());
            let (mut one, mut other) = (self.people[a].point.clone(), self.people[b].point.clone());
            for side in 0..self.sides {
                if random::uniform(random) < 0.5 {
                    std::mem::swap(&mut one[side], &mut other[side]);
                }
            }
            for child in [&mut one, &mut other] {
                self.mutate(child, &range, random);
            }
            children.extend([one, other]);
        }
        children
    }

    /// Takes the evaluated children: the best of parents and children live on.
    pub fn tell(&mut self, children: &[Candidate]) {
        self.people.extend_from_slice(children);
        // A stable sort: of equals the older lives, whatever the platform.
        self.people.sort_by(|a, b| a.value.total_cmp(&b.value));
        self.people.truncate(self.options.population);
    }

    /// Takes in a solution from elsewhere, in the place of the worst.
    pub fn receive(&mut self, guest: &Candidate) {
        if self.people.iter().all(|one| one.point != guest.point) {
            self.people.pop();
            self.tell(std::slice::from_ref(guest));
        }
    }

    /// The best individual.
    pub fn best(&self) -> Option<&Candidate> {
        best_of(&self.people)
    }

    /// Least to greatest place of the population along each side.
    fn range(&self) -> Vec<f64> {
        let places = |side: usize| self.people.iter().map(move |one| one.point[side]);
        (0..self.sides).map(|side| places(side).fold(0.0, f64::max) - places(side).fold(1.0, f64::min)).collect()
    }

    /// Running sums of the chances.
    fn wheel(&self) -> Vec<f64> {
        let best = self.people[0].value;
        let mean = self.people.iter().map(|one| one.value / self.people.len() as f64).sum::<f64>();
        // Equal fitness of all: equal chances.
        let scale = if mean > best { mean - best } else { 1.0 };
        self.people
            .iter()
            .scan(0.0, |sum, one| {
                *sum += (-self.options.pressure * (one.value - best) / scale).exp();
                Some(*sum)
            })
            .collect()
    }

    fn tournament(&self, random: &mut Random) -> usize {
        // Sorted by fitness: the least index wins.
        let draws = (0..self.options.tournament.max(1)).map(|_| random::index(random, self.people.len()));
        draws.min().unwrap_or(0)
    }

    fn mutate(&self, child: &mut [f64], range: &[f64], random: &mut Random) {
        let size = self.options.mutation_variance.sqrt();
        for (gene, range) in child.iter_mut().zip(range) {
            if random::uniform(random) < self.options.mutation_rate {
                *gene = (*gene + size * range * random::normal(random)).clamp(0.0, 1.0);
            }
        }
    }
}

fn spin(wheel: &[f64], random: &mut Random) -> usize {
    let target = random::uniform(random) * wheel.last().copied().unwrap_or(0.0);
    wheel.partition_point(|sum| *sum <= target).min(wheel.len() - 1)
}

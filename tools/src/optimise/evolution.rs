//! Differential evolution that remembers which of its settings succeeded and lets its population shrink, L-SHADE of [Tanabe].

use serde::{Deserialize, Serialize};

use super::Candidate;
use super::random::{self, Random};

/// Remembered settings, [Tanabe, Table I].
const MEMORY: usize = 6;
/// Share of the population that counts as its best, [Tanabe, Table I].
const ELITE: f64 = 0.11;
/// Replaced individuals that are kept, as a share of the population, [Tanabe, Table I].
const ARCHIVE: f64 = 2.6;
/// The smallest population that the mutation can draw from, [Tanabe, Table I].
const SMALLEST: usize = 4;

/// What a trial was made with.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Settings {
    factor: f64,
    crossover: f64,
}

/// A population on its way.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Evolution {
    sides: usize,
    largest: usize,
    /// Individuals, the best first.
    people: Vec<Candidate>,
    replaced: Vec<Vec<f64>>,
    memory: Vec<Settings>,
    next: usize,
    /// Whose trials were asked for, and what they were made with.
    trials: Vec<(usize, Settings)>,
}

impl Evolution {
    /// Starts from nothing with `largest` individuals.
    pub fn new(sides: usize, largest: usize) -> Self {
        Self {
            sides,
            largest: largest.max(SMALLEST),
            people: Vec::new(),
            replaced: Vec::new(),
            memory: vec![Settings { factor: 0.5, crossover: 0.5 }; MEMORY],
            next: 0,
            trials: Vec::new(),
        }
    }

    /// The next trials: all individuals of the first generation, later `count` of them drawn at random.
    pub fn ask(&mut self, count: usize, random: &mut Random) -> Vec<Vec<f64>> {
        if self.people.is_empty() {
            return random::latin(random, self.largest, self.sides);
        }
        let mut order: Vec<usize> = (0..self.people.len()).collect();
        for last in (1..order.len()).rev() {
            order.swap(last, random::index(random, last + 1));
        }
        order.truncate(count);
        self.trials = order.into_iter().map(|i| (i, self.settings(random))).collect();
        self.trials.iter().map(|(i, settings)| self.trial(*i, *settings, random)).collect()
    }

    /// Takes the evaluated trials; `share` is how much of the search is over.
    pub fn tell(&mut self, trials: &[Candidate], share: f64) {
        if self.people.is_empty() {
            self.people = trials.to_vec();
        } else {
            self.replace(trials);
        }
        self.people.sort_by(|a, b| a.value.total_cmp(&b.value));
        let range = self.largest as f64 - SMALLEST as f64;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between two sizes of the population"
        )]
        let wanted = (self.largest as f64 - range * share.clamp(0.0, 1.0)).round() as usize;
        self.people.truncate(wanted.max(SMALLEST));
        let room = share_of(ARCHIVE, self.people.len());
        let excess = self.replaced.len().saturating_sub(room);
        self.replaced.drain(..excess);
    }

    /// Takes in a solution from elsewhere in the place of the worst, if it is better.
    pub fn receive(&mut self, guest: &Candidate) {
        let known = self.people.iter().any(|one| one.point == guest.point);
        if let Some(worst) = self.people.last_mut()
            && !known
            && guest.value < worst.value
        {
            *worst = guest.clone();
            self.people.sort_by(|a, b| a.value.total_cmp(&b.value));
        }
    }

    /// Scale factor by a Cauchy, crossover rate by a normal distribution around a remembered pair.
    fn settings(&self, random: &mut Random) -> Settings {
        let Settings { factor, crossover } = self.memory[random::index(random, MEMORY)];
        let mut drawn = 0.0;
        while drawn <= 0.0 {
            drawn = factor + 0.1 * (std::f64::consts::PI * (random::uniform(random) - 0.5)).tan();
        }
        Settings { factor: drawn.min(1.0), crossover: (crossover + 0.1 * random::normal(random)).clamp(0.0, 1.0) }
    }

    /// current-to-pbest/1 with the archive, binomial crossover.
    fn trial(&self, i: usize, Settings { factor, crossover }: Settings, random: &mut Random) -> Vec<f64> {
        let count = self.people.len();
        let here = &self.people[i].point;
        let elite = &self.people[random::index(random, share_of(ELITE, count).max(2).min(count))].point;
        let one = &self.people[random::index(random, count)].point;
        let k = random::index(random, count + self.replaced.len());
        let other = if k < count { &self.people[k].point } else { &self.replaced[k - count] };
        let forced = random::index(random, self.sides);
        (0..self.sides)
            .map(|side| {
                if side != forced && random::uniform(random) >= crossover {
                    return here[side];
                }
                let there = here[side] + factor * (elite[side] - here[side]) + factor * (one[side] - other[side]);
                // Halfway to the wall instead of beyond it.
                if there < 0.0 {
                    0.5 * here[side]
                } else if there > 1.0 {
                    0.5 * (1.0 + here[side])
                } else {
                    there
                }
            })
            .collect()
    }

    /// A trial replaces its parent if it is no worse; what succeeded is remembered, weighted by its gain.
    fn replace(&mut self, trials: &[Candidate]) {
        let (mut weights, mut factors, mut squares, mut rates) = (0.0, 0.0, 0.0, 0.0);
        for (trial, (i, Settings { factor, crossover })) in trials.iter().zip(&self.trials) {
            let parent = &mut self.people[*i];
            if trial.value < parent.value {
                let gain = parent.value - trial.value;
                weights += gain;
                factors += gain * factor;
                squares += gain * factor * factor;
                rates += gain * crossover;
                self.replaced.push(std::mem::take(&mut parent.point));
            }
            if trial.value <= parent.value {
                *parent = trial.clone();
            }
        }
        if weights > 0.0 {
            // The Lehmer mean of the factors favours large ones, against the pull towards ever smaller steps, [Tanabe].
            self.memory[self.next] = Settings { factor: squares / factors, crossover: rates / weights };
            self.next = (self.next + 1) % MEMORY;
        }
    }
}

fn share_of(share: f64, count: usize) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few times the population")]
    let rounded = (share * count as f64).round() as usize;
    rounded
}

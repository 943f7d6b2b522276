//! The default: the hybrid's principle, that searchers of different kinds hand on the best, with searchers that learn.
//!
//! Differential evolution explores. Quadratic models around the best point propose where the minimum should be, over regions from
//! the nearest points up to all that was evaluated, and draws beside it keep the nearest points well spread. Once nothing better
//! turns up there, most of that effort goes to the best point of another basin, so that a local minimum costs little time.
//! The models' share of a generation grows while they find better points and shrinks while they do not.

use serde::{Deserialize, Serialize};

use super::evolution::Evolution;
use super::quadratic::{self, Proposal, distance};
use super::random::{self, Random};
use super::{Candidate, best_of};

/// Individuals per side at the start, as far as the evaluations last. [Tanabe] takes 18 for 10000 evaluations per side; with a tenth of
/// those, 10 solve Rastrigin's function more often. This, [`SHARE`] and [`CREDIT`] were chosen on seeds 0 to 29 of the five test
/// functions and checked on seeds 1000 to 1029, with 4550 and with 725 evaluations.
const PER_SIDE: usize = 10;
/// Evaluations per individual of the first generation that there have to be.
const EVALUATIONS: usize = 12;
/// Points of a generation: few, because every generation learns from the one before, and as many as a desktop has processors.
const BATCH: usize = 12;
/// Least and greatest share of a generation that the models get.
const SHARE: [f64; 2] = [0.1, 0.75];
/// Factor on that share after a generation in which the models found nothing better, and in which they did.
const CREDIT: [f64; 2] = [0.9, 1.2];
/// Draws beside a centre lie within this share of the region of its nearest points.
const BESIDE: f64 = 0.2;
/// Generations without a better point after which a centre counts as settled.
const PATIENCE: usize = 6;
/// Least distance between two basins that are searched, in the unit cube.
const APART: f64 = 0.05;

/// A point that models are made around.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Centre {
    best: Candidate,
    /// Generations since it last became better.
    quiet: usize,
}

impl Centre {
    fn follow(&mut self, found: Option<&Candidate>) {
        self.quiet += 1;
        if let Some(found) = found.filter(|found| found.value < self.best.value) {
            *self = Self { best: found.clone(), quiet: 0 };
        }
    }
}

/// Whom a point was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
enum Origin {
    Evolution,
    Main,
    Aside,
}

/// A search on its way.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Guided {
    evolution: Evolution,
    sides: usize,
    budget: usize,
    archive: Vec<Candidate>,
    main: Option<Centre>,
    /// The second centre, in another basin.
    aside: Option<Centre>,
    /// Where second centres ended.
    settled: Vec<Vec<f64>>,
    /// Which points of the archive lie beside one of those.
    covered: Vec<bool>,
    /// How much of a generation is the models'.
    share: f64,
    asked: Vec<Origin>,
}

impl Guided {
    /// Starts from nothing; `budget` is how many evaluations the search will have.
    pub fn new(sides: usize, budget: usize) -> Self {
        let largest = (PER_SIDE * sides).min(budget / EVALUATIONS).max(2 * sides + 2);
        Self {
            evolution: Evolution::new(sides, largest),
            sides,
            budget,
            archive: Vec::new(),
            main: None,
            aside: None,
            settled: Vec::new(),
            covered: Vec::new(),
            share: 0.5,
            asked: Vec::new(),
        }
    }

    /// The next points: the models', then the evolution's trials.
    pub fn ask(&mut self, random: &mut Random) -> Vec<Vec<f64>> {
        self.asked.clear();
        let mut points = Vec::new();
        if let Some(main) = self.main.clone() {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a batch")]
            let wanted = (self.share * BATCH as f64).round() as usize;
            let aside = if main.quiet < PATIENCE { 0 } else { 2 * wanted / 3 };
            self.guess(&main, Origin::Main, wanted - aside, &mut points, random);
            if let Some(centre) = self.aside.clone().filter(|_| aside > 0) {
                self.guess(&centre, Origin::Aside, aside, &mut points, random);
            }
        }
        let trials = self.evolution.ask(BATCH - points.len().min(BATCH - 1), random);
        self.asked.extend(trials.iter().map(|_| Origin::Evolution));
        points.extend(trials);
        points
    }

    /// Points around a centre: the model of the nearest points, one of a wider region, and draws.
    fn guess(
        &mut self,
        centre: &Centre,
        origin: Origin,
        count: usize,
        points: &mut Vec<Vec<f64>>,
        random: &mut Random,
    ) {
        let least = quadratic::points_wanted(self.sides);
        // Any size between the narrowest and everything, evenly on a logarithmic scale.
        let most = (self.archive.len() as f64 / least as f64).max(1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the archive")]
        let wide = (least as f64 * most.powf(random::uniform(random))) as usize;
        let narrow = quadratic::propose(&self.archive, &centre.best, least);
        let before = points.len();
        if let Some(Proposal { point, radius }) = narrow {
            points.push(point);
            if count > 1 {
                points.extend(quadratic::propose(&self.archive, &centre.best, wide).map(|proposal| proposal.point));
            }
            while points.len() < before + count {
                points.push(beside(&centre.best.point, BESIDE * radius, random));
            }
        }
        self.asked.extend((before..points.len()).map(|_| origin));
    }

    /// Takes the evaluated points.
    pub fn tell(&mut self, evaluated: &[Candidate]) {
        let of = |origin: Origin| -> Vec<Candidate> {
            evaluated
                .iter()
                .zip(&self.asked)
                .filter(|(_, asked)| **asked == origin)
                .map(|(one, _)| one.clone())
                .collect()
        };
        let (trials, ours, theirs) = (of(Origin::Evolution), of(Origin::Main), of(Origin::Aside));
        let beside = |one: &Candidate| self.settled.iter().any(|there| distance(&one.point, there) < APART);
        self.covered.extend(evaluated.iter().map(beside));
        self.archive.extend_from_slice(evaluated);
        self.evolution.tell(&trials, self.archive.len() as f64 / self.budget as f64);
        for guest in [best_of(&ours), best_of(&theirs)].into_iter().flatten() {
            self.evolution.receive(guest);
        }
        if let Some(main) = &mut self.main {
            let found = best_of(&ours).is_some_and(|best| best.value < main.best.value);
            self.share = (self.share * CREDIT[usize::from(found)]).clamp(SHARE[0], SHARE[1]);
            main.follow(best_of(evaluated));
        } else {
            self.main = best_of(evaluated).map(|best| Centre { best: best.clone(), quiet: 0 });
        }
        if let Some(aside) = &mut self.aside {
            aside.follow(best_of(&theirs));
        }
        self.look_aside();
    }

    /// Moves the second centre on once it is settled or has come too near to the first.
    fn look_aside(&mut self) {
        let Some(main) = &self.main else { return };
        let far = |point: &[f64]| distance(point, &main.best.point) >= APART;
        if let Some(aside) = &self.aside
            && (aside.quiet >= PATIENCE || !far(&aside.best.point))
        {
            let there = aside.best.point.clone();
            for (one, covered) in self.archive.iter().zip(&mut self.covered) {
                *covered |= distance(&one.point, &there) < APART;
            }
            self.settled.push(there);
            self.aside = None;
        }
        if self.aside.is_none() && main.quiet >= PATIENCE {
            let points = self.archive.iter().zip(&self.covered);
            self.aside = points
                .filter(|(one, covered)| !**covered && far(&one.point))
                .map(|(one, _)| one)
                .min_by(|a, b| a.value.total_cmp(&b.value))
                .map(|best| Centre { best: best.clone(), quiet: 0 });
        }
    }
}

/// Evenly in a ball, cut at the walls of the cube.
fn beside(centre: &[f64], radius: f64, random: &mut Random) -> Vec<f64> {
    let direction: Vec<f64> = centre.iter().map(|_| random::normal(random)).collect();
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    let reach = radius * random::uniform(random).powf(1.0 / centre.len() as f64) / length;
    centre.iter().zip(direction).map(|(place, d)| (place + reach * d).clamp(0.0, 1.0)).collect()
}

//! The paper's hybrid: genetic algorithm and swarm side by side, after each iteration both go on with the better best.

use serde::{Deserialize, Serialize};

use super::random::Random;
use super::{Candidate, genetic, swarm};

/// Both halves.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Hybrid {
    genetic: genetic::Genetic,
    swarm: swarm::Swarm,
    /// How many of the points that were asked for are children of the genetic half.
    children: usize,
}

impl Hybrid {
    /// Starts from nothing.
    pub fn new(genetic: genetic::Options, swarm: swarm::Options, sides: usize, generations: usize) -> Self {
        Self {
            genetic: genetic::Genetic::new(genetic, sides),
            swarm: swarm::Swarm::new(swarm, sides, generations),
            children: 0,
        }
    }

    /// The next points of both halves.
    pub fn ask(&mut self, random: &mut Random) -> Vec<Vec<f64>> {
        let mut points = self.genetic.ask(random);
        self.children = points.len();
        points.extend(self.swarm.ask(random));
        points
    }

    /// Takes the evaluated points and hands the better best to the other half: it replaces the worst individual there, and the
    /// best that all particles are drawn to here.
    pub fn tell(&mut self, evaluated: &[Candidate]) {
        let (children, particles) = evaluated.split_at(self.children.min(evaluated.len()));
        self.genetic.tell(children);
        self.swarm.tell(particles);
        let (ours, theirs) = (self.genetic.best().cloned(), self.swarm.best().cloned());
        if let Some(best) = ours {
            self.swarm.receive(&best);
        }
        if let Some(best) = theirs {
            self.genetic.receive(&best);
        }
    }
}

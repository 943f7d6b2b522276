//! Dual active set after \[Goldfarb\], on the same recursion: what settles the active set where block changes cycle.
//!
//! One recursion factorises the problem without bounds. From then on a bound is a row of a small dense problem in the
//! multipliers, and what the plan answers to a multiplier costs one pass backwards and one forwards ([`response`]). Rows enter
//! one at a time, each time the most violated one; rows leave whose multiplier would turn negative. The dual cost rises with
//! every change, so no set comes back, and a vertex at which rows depend on each other is no exception: there the entering
//! row takes the place of another one. A change costs a fraction of a sweep, but it is one change, so this method begins
//! where block changes end.

mod cholesky;
mod response;
mod rows;
#[cfg(test)]
mod tests;

use super::active::Active;
use super::{Problem, Solution, Structured};
use cholesky::Cholesky;
use response::Response;
use rows::{Bounds, Row};

/// Squared share of a row that is its own, below which it counts as a combination of the other rows. On the recorded problems
/// and on 6000 random ones rounding leaves less than 1e-13 to rows that are, and rows that are not have more than 1e-10.
const DEPENDENT: f64 = 1e-12;
/// Between no share of a row in another one that depends on it and a whole one. Only levels and increments of the same input can
/// depend on each other, and as whole multiples: each is one input by itself or the difference of two.
const HALF_A_SHARE: f64 = 0.5;
/// Rows that may enter, against the number that can be active. Recorded problems need up to one, `N = 10`.
const ENTRIES_MAX: usize = 2;
/// Wrong multiplier of a row of the first set, against the worst one, each with the row's own scale, from which the row leaves.
/// All of them at once would be too many: those that are half as wrong mostly are right without the others.
const CLEARLY_WRONG: f64 = 0.5;
/// Violation of a row that depends on the others, against its scale, that rounding of the multipliers can leave: up to 5e-7 is
/// seen, on problems of a loop that diverges.
const ROUNDING_AT_VERTEX: f64 = 1e-6;

/// How a row entered the working set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Entry {
    /// With the multipliers changed, or about to.
    Made,
    /// In the place of a row that it depends on: where no multiplier changed, another description of the same vertex.
    InPlace,
    /// Not at all, which bounds that can be met exclude but for rounding.
    Impossible,
}

/// Working set with its multipliers, and the buffers of the method.
#[derive(Clone, Debug)]
pub(super) struct Dual<const NX: usize, const NU: usize> {
    rows: Vec<Row>,
    /// Multipliers of the rows, halved as the cost of [`super::riccati::Value`] is; never negative.
    nu: Vec<f64>,
    /// Multipliers that the rows have when they hold with equality.
    nu_target: Vec<f64>,
    /// By how much a row moves with its own multiplier.
    own: Vec<f64>,
    /// By how much the other rows move with it.
    coupling: Vec<f64>,
    cholesky: Cholesky,
    response: Response<NX, NU>,
}

impl<const NX: usize, const NU: usize> Dual<NX, NU> {
    pub(super) fn new(horizon: usize) -> Self {
        // One bound of each input and the soft bound in each sample: more cannot be independent.
        let most = horizon * (NU + 1);
        Self {
            rows: Vec::with_capacity(most),
            nu: vec![0.0; most],
            nu_target: vec![0.0; most],
            own: vec![0.0; most],
            coupling: vec![0.0; most],
            cholesky: Cholesky::new(most),
            response: Response::new(horizon),
        }
    }

    /// Takes up the rows of the active set that do not depend on the others.
    fn take_up(&mut self, bounds: &mut Bounds<NX, NU>) {
        for i in 0..bounds.horizon() {
            for quantity in rows::quantities::<NU>() {
                if let Some(row) = bounds.active_row(i, quantity)
                    && !self.append(bounds, row)
                {
                    bounds.mark(row, false);
                }
            }
        }
    }

    /// Drops rows until those that are left have multipliers of the right sign.
    fn purge(&mut self, bounds: &mut Bounds<NX, NU>) {
        loop {
            let k = self.rows.len();
            self.cholesky.solution(&mut self.nu_target[..k]);
            let scaled = |w: usize| self.nu_target[w] * self.own[w].sqrt();
            let worst = (0..k).map(scaled).fold(0.0, f64::min);
            self.nu[..k].copy_from_slice(&self.nu_target[..k]);
            if worst == 0.0 {
                return;
            }
            for w in (0..k).rev() {
                if self.nu[w] * self.own[w].sqrt() <= CLEARLY_WRONG * worst {
                    self.drop_row(bounds, w);
                }
            }
        }
    }

    /// Puts a row that is violated into the working set, and rows out that stand in its way.
    fn enter(&mut self, bounds: &mut Bounds<NX, NU>, row: Row) -> Entry {
        bounds.mark(row, true);
        let mut nu_row = 0.0;
        let mut entry = Entry::Made;
        while !self.append(bounds, row) {
            // The row is a combination of the others: its multiplier grows at their cost until one of them is free to go.
            let k = self.rows.len();
            self.cholesky.back(&mut self.coupling[..k]);
            let Some((step, w)) = first_zero(&self.nu[..k], &self.coupling[..k]) else {
                return Entry::Impossible;
            };
            for (nu, share) in self.nu[..k].iter_mut().zip(&self.coupling[..k]) {
                *nu = (*nu - step * share).max(0.0);
            }
            nu_row += step;
            entry = Entry::InPlace;
            self.drop_row(bounds, w);
        }
        self.nu[self.rows.len() - 1] = nu_row;
        entry
    }

    /// Moves the multipliers to where all rows hold with equality, dropping rows whose multipliers vanish on the way.
    fn balance(&mut self, bounds: &mut Bounds<NX, NU>) {
        loop {
            let k = self.rows.len();
            self.cholesky.solution(&mut self.nu_target[..k]);
            let mut blocking = None;
            let mut fraction = 1.0;
            for (w, (nu, target)) in self.nu[..k].iter().zip(&self.nu_target[..k]).enumerate() {
                if *target < 0.0 && *nu < fraction * (nu - target) {
                    fraction = nu / (nu - target);
                    blocking = Some(w);
                }
            }
            let Some(w) = blocking else {
                self.nu[..k].copy_from_slice(&self.nu_target[..k]);
                return;
            };
            for (nu, target) in self.nu[..k].iter_mut().zip(&self.nu_target[..k]) {
                *nu = (*nu + fraction * (target - *nu)).max(0.0);
            }
            self.drop_row(bounds, w);
        }
    }

    /// Appends a row unless it depends on the others; then `coupling` holds what [`Cholesky::append`] leaves.
    fn append(&mut self, bounds: &Bounds<NX, NU>, row: Row) -> bool {
        let k = self.rows.len();
        self.response.answer_one(bounds, row, &self.rows);
        for (coupling, other) in self.coupling.iter_mut().zip(&self.rows) {
            *coupling = -self.response.along(*other);
        }
        let own = bounds.softness(row) - self.response.along(row);
        let excess = self.response.excess_without_bounds(bounds, row);
        if !self.cholesky.append(&mut self.coupling[..k], own, excess, DEPENDENT) {
            return false;
        }
        self.own[k] = own;
        self.rows.push(row);
        true
    }

    fn drop_row(&mut self, bounds: &mut Bounds<NX, NU>, w: usize) {
        let k = self.rows.len();
        bounds.mark(self.rows.remove(w), false);
        self.nu.copy_within(w + 1..k, w);
        self.own.copy_within(w + 1..k, w);
        self.cholesky.remove(w);
    }
}

/// How far the multipliers can go until the first one with a share is zero, and which one that is.
fn first_zero(nu: &[f64], shares: &[f64]) -> Option<(f64, usize)> {
    let falling = nu.iter().zip(shares).enumerate().filter(|(_, (_, share))| **share > HALF_A_SHARE);
    falling.map(|(w, (nu, share))| (nu / share, w)).min_by(|a, b| a.0.total_cmp(&b.0))
}

impl<const NX: usize, const NU: usize> Structured<NX, NU> {
    /// Finds the active set from the one at hand. Returns whether it did, to the accuracy of the dense problem: a sweep has to
    /// confirm it.
    pub(super) fn find_active_set(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) -> bool {
        let Self { dual, active, sides, frozen, .. } = self;
        let bounds = &mut Bounds { problem, frozen, active, sides };
        dual.rows.clear();
        dual.cholesky.clear();
        if !dual.response.factorise(bounds) {
            return false;
        }
        dual.take_up(bounds);
        dual.purge(bounds);
        for _ in 0..ENTRIES_MAX * dual.own.len() {
            dual.response.answer_all(bounds, &dual.rows, &dual.nu);
            let Some((row, violation)) = bounds.most_violated(&dual.response) else { return true };
            solution.iterations += 1;
            match dual.enter(bounds, row) {
                Entry::Made => dual.balance(bounds),
                Entry::InPlace if violation < ROUNDING_AT_VERTEX => return true,
                Entry::InPlace => dual.balance(bounds),
                Entry::Impossible => return false,
            }
        }
        false
    }
}

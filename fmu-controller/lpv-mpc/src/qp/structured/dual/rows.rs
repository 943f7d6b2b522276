//! Bounds as rows over the inputs: which are active, and which one a plan violates most.

use super::super::super::optimality;
use super::super::rollout;
use super::response::Response;
use super::{Active, Problem};

/// Violation of a bound, against its scale, that rounding of multipliers may leave; a sweep makes the plan exact. On random
/// problems (see [`super::super`]) rounding leaves 1e-16 to 1e-8, less and less often; four of 21 000 largest violations are
/// between 1e-8 and 1e-5. Recorded ones are below 1e-12 or above 1e-6. With 1e-10 and 1e-8 all come out alike.
const VIOLATION: f64 = 1e-9;

/// What is bounded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// Input of this index.
    Level(usize),
    /// Increment of the input of this index.
    Rate(usize),
    /// Soft state behind the sample.
    Soft,
}

/// All that is bounded in a sample.
pub(super) fn quantities<const NU: usize>() -> impl Iterator<Item = Quantity> {
    (0..NU).flat_map(|j| [Quantity::Level(j), Quantity::Rate(j)]).chain([Quantity::Soft])
}

/// One bound of one sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Row {
    pub i: usize,
    pub quantity: Quantity,
    /// -1 the lower bound, +1 the upper one.
    pub side: i8,
}

/// The problem's bounds with the active set.
pub(super) struct Bounds<'a, const NX: usize, const NU: usize> {
    pub problem: &'a Problem<NX, NU>,
    pub frozen: &'a [bool; NU],
    pub active: &'a mut [[Active; NU]],
    pub sides: &'a mut [i8],
}

impl<const NX: usize, const NU: usize> Bounds<'_, NX, NU> {
    pub(super) fn horizon(&self) -> usize {
        self.sides.len()
    }

    pub(super) fn mark(&mut self, row: Row, is_active: bool) {
        let side = if is_active { row.side } else { 0 };
        match row.quantity {
            Quantity::Level(j) => self.active[row.i][j].level = side,
            Quantity::Rate(j) => self.active[row.i][j].rate = side,
            Quantity::Soft => self.sides[row.i] = side,
        }
    }

    /// The row of a quantity that is in the active set, for inputs that can move.
    pub(super) fn active_row(&self, i: usize, quantity: Quantity) -> Option<Row> {
        let side = match quantity {
            Quantity::Level(j) | Quantity::Rate(j) if self.frozen[j] => 0,
            Quantity::Level(j) => self.active[i][j].level,
            Quantity::Rate(j) => self.active[i][j].rate,
            Quantity::Soft => self.sides[i],
        };
        (side != 0).then_some(Row { i, quantity, side })
    }

    /// By how much a row gives way to its multiplier.
    pub(super) fn softness(&self, row: Row) -> f64 {
        if row.quantity == Quantity::Soft { 1.0 / self.problem.soft } else { 0.0 }
    }

    /// The row outside of the active set that a plan violates most, and by how much, against the input's range or the soft bound.
    pub(super) fn most_violated(&self, plan: &Response<NX, NU>) -> Option<(Row, f64)> {
        let Self { problem, frozen, active, sides } = self;
        let mut worst = VIOLATION;
        let mut found = None;
        let mut p = problem.u_prev_clamped().data.0[0];
        let mut test = |violation: f64, row: Row| {
            if violation > worst {
                worst = violation;
                found = Some(row);
            }
        };
        for i in 0..self.horizon() {
            let u = plan.input(i);
            for j in (0..NU).filter(|j| !frozen[*j]) {
                let scale = 1.0 / optimality::span(problem, j);
                if active[i][j].level == 0 {
                    let quantity = Quantity::Level(j);
                    test((u[j] - problem.u_max[j]) * scale, Row { i, quantity, side: 1 });
                    test((problem.u_min[j] - u[j]) * scale, Row { i, quantity, side: -1 });
                }
                if active[i][j].rate == 0 {
                    let quantity = Quantity::Rate(j);
                    let du = u[j] - p[j];
                    test((du - problem.du_max[j]) * scale, Row { i, quantity, side: 1 });
                    test((-du - problem.du_max[j]) * scale, Row { i, quantity, side: -1 });
                }
            }
            p = u;
            let soft_state = plan.soft_state(i);
            let side = rollout::side(problem, soft_state);
            if side != 0 && sides[i] == 0 {
                let scale = if problem.soft_bound > 0.0 { 1.0 / problem.soft_bound } else { 1.0 };
                test((soft_state.abs() - problem.soft_bound) * scale, Row { i, quantity: Quantity::Soft, side });
            }
        }
        found.map(|row| (row, worst))
    }
}

//! Recursion backwards on the active set, and multipliers backwards along a plan.

use super::super::optimality;
use super::active::{self, Active};
use super::riccati::{self, Affine, Value};
use super::{Hold, Problem, Solution, Structured, WRONG_SIGN};
use std::mem;

/// Bounds that were left for the wrong sign of their multiplier.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Released {
    /// How many.
    pub count: usize,
    /// The one with the largest scaled multiplier: sample, input, and what remains active there.
    pub worst: Option<(usize, usize, Active)>,
    severity: f64,
}

impl<const NX: usize, const NU: usize> Structured<NX, NU> {
    /// Policies on the active set. Returns whether the curvature was positive throughout.
    #[inline(always)]
    pub(super) fn backward(&mut self, problem: &Problem<NX, NU>) -> bool {
        let N = self.horizon;
        let r = &problem.r.data.0[0];
        let (mut value, mut before) = (terminal(problem), Value::ZERO);
        let (mut value, mut before) = (&mut value, &mut before);
        self.add_costs(problem, N, value);
        let mut demand = [None; NU];
        for i in (0..N).rev() {
            before.S = [[0.0; NX]; NX];
            before.s = [0.0; NX];
            self.add_costs(problem, i, before);
            let mut hold = [Hold::Free; NU];
            for j in 0..NU {
                (hold[j], demand[j]) = active::hold(problem, j, self.active[i][j], demand[j]);
            }
            let stage = &problem.stages[i];
            if riccati::step(stage, Affine::of(stage), value, r, &hold, &mut self.policies[i], before).is_none() {
                return false;
            }
            mem::swap(&mut value, &mut before);
        }
        true
    }

    /// Adds what state `i` costs by itself, but for the last one's weight, which [`terminal`] has.
    #[inline(always)]
    fn add_costs(&self, problem: &Problem<NX, NU>, i: usize, value: &mut Value<NX, NU>) {
        if i == 0 {
            return;
        }
        if i < self.horizon {
            value.add_squares(&problem.q.data.0[0], &problem.stages[i - 1].x_ref.data.0[0]);
        }
        let side = self.sides[i - 1];
        if side != 0 {
            value.add_square(problem.soft_state, problem.soft, f64::from(side) * problem.soft_bound);
        }
    }

    /// Sets costates, multipliers and residual of the plan, and leaves the bounds whose multipliers have the wrong sign.
    #[inline(always)]
    pub(super) fn multipliers(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) -> Released {
        optimality::costates(problem, solution);
        solution.residual = 0.0;
        let mut released = Released::default();
        let mut mu_next = [0.0; NU];
        // Sample of the corner whose demand is on its way to the beginning of its block.
        let mut corner: [Option<usize>; NU] = [None; NU];
        for i in (0..self.horizon).rev() {
            let (gradient, scale) = optimality::gradient(problem, solution, i);
            for j in 0..NU {
                let at = self.active[i][j];
                let mut mu = mu_next[j] - gradient[j];
                if mu.is_nan() {
                    // Bounds would hide it: their multipliers are only asked for their sign.
                    solution.residual = f64::NAN;
                }
                solution.mu_u[i][j] = 0.0;
                solution.mu_du[i][j] = 0.0;
                mu_next[j] = 0.0;
                if at.level != 0
                    && let Some(end) = corner[j].take()
                {
                    let beginning = (at.rate == 0).then_some((at.level, mu));
                    let theta = self.share(solution, j, (i + 1, end), beginning);
                    self.settle(solution, j, (i + 1, end), theta, scale[j], &mut released);
                    mu -= theta;
                }
                if at.rate != 0 {
                    solution.mu_du[i][j] = mu;
                    mu_next[j] = mu;
                    if at.is_corner() {
                        corner[j] = Some(i);
                    }
                    if let Some(end) = corner[j] {
                        if i == 0 {
                            // The block hangs on the input applied before.
                            let theta = self.share(solution, j, (i, end), None);
                            self.settle(solution, j, (i, end), theta, scale[j], &mut released);
                        }
                    } else if self.check(i, j, at.rate, mu / scale[j], Active::NONE, &mut released) {
                        mu_next[j] = 0.0;
                    }
                } else if at.level != 0 {
                    solution.mu_u[i][j] = mu;
                    self.check(i, j, at.level, mu / scale[j], Active::NONE, &mut released);
                } else if let Some(end) = corner[j].take() {
                    // The block begins free: what holds it is the level at its corner.
                    self.settle(solution, j, (i + 1, end), mu, scale[j], &mut released);
                } else {
                    let stationarity = mu.abs() / scale[j];
                    // `max` would drop a NaN.
                    if stationarity.is_nan() || stationarity > solution.residual {
                        solution.residual = stationarity;
                    }
                }
            }
        }
        released
    }

    /// What the level at the end of a block should take when the block is fixed at its beginning as well, by a level with its
    /// side and multiplier or by the input applied before. One row is then implied by the others and the multipliers can be
    /// shared in many ways; wanted is one in which all signs are right.
    fn share(
        &self,
        solution: &Solution<NX, NU>,
        j: usize,
        (first, corner): (usize, usize),
        beginning: Option<(i8, f64)>,
    ) -> f64 {
        let side = self.active[corner][j].level;
        let sign = f64::from(side);
        // Every row of the block's own side bounds the share from above, every other one from below.
        let rates = (first..=corner).map(|l| (self.active[l][j].rate, solution.mu_du[l][j]));
        let share = rates.chain(beginning).filter(|row| row.0 != side).map(|row| sign * row.1).fold(0.0, f64::max);
        sign * share
    }

    /// Shares the multipliers of a block that ends in a corner between the corner's level, which takes `theta`, and the
    /// increments.
    fn settle(
        &mut self,
        solution: &mut Solution<NX, NU>,
        j: usize,
        (first, corner): (usize, usize),
        theta: f64,
        scale: f64,
        released: &mut Released,
    ) {
        for l in first..=corner {
            solution.mu_du[l][j] -= theta;
            let at = self.active[l][j];
            let rest = Active { level: at.level, rate: 0 };
            self.check(l, j, at.rate, solution.mu_du[l][j] / scale, rest, released);
        }
        solution.mu_u[corner][j] = theta;
        let at = self.active[corner][j];
        if theta == 0.0 {
            self.active[corner][j].level = 0;
        } else {
            let rest = Active { level: 0, rate: at.rate };
            self.check(corner, j, at.level, theta / scale, rest, released);
        }
    }

    /// Leaves a bound whose scaled multiplier has the wrong sign. Returns whether it did.
    fn check(&mut self, i: usize, j: usize, side: i8, mu: f64, rest: Active, released: &mut Released) -> bool {
        let severity = -f64::from(side) * mu;
        if severity <= WRONG_SIGN || self.frozen[j] {
            return false;
        }
        released.count += 1;
        if severity > released.severity {
            released.severity = severity;
            released.worst = Some((i, j, rest));
        }
        self.active[i][j] = rest;
        true
    }
}

/// Value behind the last stage.
pub(super) fn terminal<const NX: usize, const NU: usize>(problem: &Problem<NX, NU>) -> Value<NX, NU> {
    let mut value = Value::ZERO;
    value.S = problem.q_terminal.data.0;
    if let Some(last) = problem.stages.last() {
        value.s = (-(problem.q_terminal * last.x_ref)).data.0[0];
    }
    value
}

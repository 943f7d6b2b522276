//! From sweep to sweep: which plan and which active set go on.

use super::active::Active;
use super::rollout;
use super::sweep::Released;
use super::{Outcome, Problem, STATIONARY, Solution, Structured};
use crate::lanes::{Work, widest};
use std::mem;

/// Fraction of the way to a target below which a step stands still.
const STANDSTILL: f64 = 1e-9;
/// Halvings of a step that the soft bound makes too long.
const HALVINGS_MAX: usize = 30;

impl<const NX: usize, const NU: usize> Structured<NX, NU> {
    /// Sweeps until the active set stands. Returns whether it did; if not, the plan is the best one met.
    ///
    /// A sweep that follows its policies within the bounds changes many bounds at once, mostly for the better. Where the
    /// cost rises, the plan goes straight towards the target instead, up to the first bound: so the cost never rises, no
    /// active set comes back, and the cycles of a plain block active set are cut.
    pub(super) fn descend(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>, limit: u32) -> bool {
        widest(Descent { solver: self, problem, solution, limit })
    }

    /// [`Self::descend`], to be put where wider vectors are; what only hard problems need may stay narrow.
    #[inline(always)]
    fn settle_by_sweeps(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>, limit: u32) -> bool {
        self.toggled.fill([false; NU]);
        for j in (0..NU).filter(|j| problem.is_frozen(*j)) {
            let there = if problem.du_max[j] > 0.0 { Active::at_level(1) } else { Active::at_rate(1) };
            self.active.iter_mut().for_each(|active| active[j] = there);
        }
        let mut cost = f64::INFINITY;
        let mut released = Released::default();
        for sweep in 0..limit {
            solution.iterations += 1;
            if !self.backward(problem) {
                return false;
            }
            let entered = if sweep == 0 {
                let (entered, slack) = self.follow(problem, &mut solution.x, &mut solution.u);
                solution.slack = slack;
                entered
            } else {
                if sweep == 1 {
                    cost = problem.cost(&solution.x, &solution.u);
                }
                match self.improve(problem, solution, &mut cost, &mut released) {
                    Some(entered) => entered,
                    None => continue,
                }
            };
            self.kept.copy_from_slice(&self.active);
            released = self.multipliers(problem, solution);
            if !entered && released.count == 0 {
                solution.outcome = Outcome::Optimal;
                return solution.residual < STATIONARY;
            }
        }
        false
    }

    /// Takes the plan a step further. Returns whether the active set changed, or nothing while multipliers mean nothing.
    fn improve(
        &mut self,
        problem: &Problem<NX, NU>,
        solution: &mut Solution<NX, NU>,
        cost: &mut f64,
        released: &mut Released,
    ) -> Option<bool> {
        self.left.copy_from_slice(&self.active);
        self.left_sides.copy_from_slice(&self.sides);
        let (mut x, mut u) = (mem::take(&mut self.x_target), mem::take(&mut self.u_target));
        x[0] = problem.x_0;
        let (entered, slack) = self.follow(problem, &mut x, &mut u);
        let cost_target = problem.cost(&x, &u);
        let better = !entered || cost_target < *cost;
        if better {
            *cost = cost_target;
            mem::swap(&mut solution.x, &mut x);
            mem::swap(&mut solution.u, &mut u);
            solution.slack = slack;
        }
        (self.x_target, self.u_target) = (x, u);
        if better {
            return Some(entered);
        }
        self.active.copy_from_slice(&self.left);
        self.sides.copy_from_slice(&self.left_sides);
        let (mut fraction, mut blocking) = self.approach(problem, solution);
        if let Some((i, j, rest)) = released.worst.filter(|_| fraction < STANDSTILL && released.count > 1) {
            // Bounds that were left together may hold each other; one alone lets go, unless the vertex is degenerate.
            self.active.copy_from_slice(&self.kept);
            self.active[i][j] = rest;
            released.count = 1;
            return None;
        }
        let mut cost_there = self.cost_towards(problem, solution, fraction);
        for _ in 0..HALVINGS_MAX {
            if cost_there <= *cost {
                break;
            }
            blocking = None;
            fraction *= 0.5;
            cost_there = self.cost_towards(problem, solution, fraction);
        }
        *cost = cost_there;
        let mut entered = fraction < 1.0;
        if let Some((i, j, there)) = blocking {
            self.active[i][j] = there;
        }
        solution.slack = 0.0;
        for i in 0..self.horizon {
            let (x, u) = (solution.x[i + 1], solution.u[i]);
            solution.x[i + 1] = x + (self.x_target[i + 1] - x) * fraction;
            solution.u[i] = u + (self.u_target[i] - u) * fraction;
            let side = rollout::side(problem, solution.x[i + 1][problem.soft_state]);
            entered |= side != self.sides[i];
            self.sides[i] = side;
            if problem.soft > 0.0 {
                solution.slack = solution.slack.max(problem.excess(&solution.x[i + 1]));
            }
        }
        if entered {
            // Away from the target the multipliers say little; the new bound has to be answered to first.
            *released = Released::default();
            return None;
        }
        Some(false)
    }

    /// Cost of the plan a fraction of the way to the target.
    fn cost_towards(&self, problem: &Problem<NX, NU>, solution: &Solution<NX, NU>, fraction: f64) -> f64 {
        let between = |i: usize| {
            let (x, u) = (solution.x[i + 1], solution.u[i]);
            (x + (self.x_target[i + 1] - x) * fraction, u + (self.u_target[i] - u) * fraction)
        };
        problem.cost_of((0..self.horizon).map(between))
    }
}

/// [`Structured::descend`] with its arguments.
struct Descent<'a, const NX: usize, const NU: usize> {
    solver: &'a mut Structured<NX, NU>,
    problem: &'a Problem<NX, NU>,
    solution: &'a mut Solution<NX, NU>,
    limit: u32,
}

impl<const NX: usize, const NU: usize> Work for Descent<'_, NX, NU> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        self.solver.settle_by_sweeps(self.problem, self.solution, self.limit)
    }
}

#[cfg(test)]
mod tests {
    use super::super::SWEEPS_BEFORE_ROWS;
    use super::*;
    use crate::lanes::same_with_wide;
    use crate::qp_support::{Stress, random_problem};

    /// A solver, and the problem and plan to work on.
    struct Owned<const NX: usize> {
        solver: Structured<NX, 2>,
        problem: Problem<NX, 2>,
        solution: Solution<NX, 2>,
    }

    impl<const NX: usize> Work for Owned<NX> {
        type Output = (bool, Solution<NX, 2>, Structured<NX, 2>);

        #[inline(always)]
        fn run(self) -> Self::Output {
            let Self { mut solver, problem, mut solution } = self;
            let settled = solver.settle_by_sweeps(&problem, &mut solution, SWEEPS_BEFORE_ROWS);
            (settled, solution, solver)
        }
    }

    fn compare<const NX: usize>(stress: &Stress) -> bool {
        let problem: Problem<NX, 2> = random_problem(stress);
        let (mut solver, mut solution) = (Structured::new(stress.horizon), Solution::new(stress.horizon));
        solution.x[0] = problem.x_0;
        solver.frozen = std::array::from_fn(|j| problem.is_frozen(j));
        let fresh = || Owned { solver: solver.clone(), problem: problem.clone(), solution: solution.clone() };
        same_with_wide(fresh).0
    }

    #[test]
    fn wider_vectors_give_the_same_bits() {
        let mut settled = 0;
        for seed in 0..100 {
            let (degenerate, outside) = (seed % 2 == 0, seed % 3 == 0);
            let stress = Stress { seed, horizon: 10, growth: 0.5, decades: 3.0, demand: 1.0, degenerate, outside };
            settled += usize::from(compare::<5>(&stress)) + usize::from(compare::<7>(&stress));
        }
        assert!((20..=180).contains(&settled), "of both kinds, but {settled} of 200 settled");
    }
}

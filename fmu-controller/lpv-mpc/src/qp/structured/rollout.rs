//! Forwards along the policies: within the bounds, or straight ahead and up to the first bound.

use super::super::optimality;
use super::active::Active;
use super::{Problem, Solution, Stage, Structured};
use crate::lanes::axpy;
use nalgebra::SVector;

/// Excess over a bound, as a fraction of the input's range, that is rounding and no violation. On random problems (see [`super`])
/// inputs exceed their bounds by less than 1e-15 or by more than 1e-6, on recorded ones by more than 1e-10. With 1e-13 to 1e-10
/// all come out alike.
const ROUNDING: f64 = 1e-11;

/// Side of the soft bound on which a state lies.
#[inline(always)]
pub(super) fn side<const NX: usize, const NU: usize>(problem: &Problem<NX, NU>, soft_state: f64) -> i8 {
    if problem.soft <= 0.0 {
        0
    } else if soft_state > problem.soft_bound {
        1
    } else if soft_state < -problem.soft_bound {
        -1
    } else {
        0
    }
}

/// Next state.
#[inline(always)]
pub(super) fn advance<const NX: usize, const NU: usize>(
    stage: &Stage<NX, NU>,
    x: &[f64; NX],
    u: &[f64; NU],
) -> [f64; NX] {
    advance_from(stage.d.data.0[0], stage, x, u)
}

/// Next state with another affine term, as differences have it.
#[inline(always)]
pub(super) fn advance_from<const NX: usize, const NU: usize>(
    d: [f64; NX],
    stage: &Stage<NX, NU>,
    x: &[f64; NX],
    u: &[f64; NU],
) -> [f64; NX] {
    let mut next = d;
    for k in 0..NX {
        axpy(x[k], &stage.A.data.0[k], &mut next);
    }
    for j in 0..NU {
        axpy(u[j], &stage.B.data.0[j], &mut next);
    }
    next
}

impl<const NX: usize, const NU: usize> Structured<NX, NU> {
    /// Follows the policies but never leaves the bounds; what would leave them enters the active set. Returns whether the
    /// active set changed.
    ///
    /// Stopping at a bound at once, instead of after the sweep, lets the later inputs answer to it: fewer bounds enter by
    /// mistake, and every sweep ends in a plan that can be executed.
    #[inline(always)]
    pub(super) fn follow(
        &mut self,
        problem: &Problem<NX, NU>,
        x_plan: &mut [SVector<f64, NX>],
        u_plan: &mut [SVector<f64, NU>],
    ) -> (bool, f64) {
        let mut changed = false;
        let mut x = problem.x_0.data.0[0];
        let mut p = problem.u_prev_clamped().data.0[0];
        let mut slack: f64 = 0.0;
        for i in 0..self.horizon {
            let mut u = self.policies[i].input(&x, &p);
            for j in 0..NU {
                let rise = p[j] + problem.du_max[j];
                let fall = p[j] - problem.du_max[j];
                let upper = problem.u_max[j].min(rise);
                let lower = problem.u_min[j].max(fall);
                if u[j] > upper {
                    changed |= self.enter(problem, (i, j), u[j] - upper, 1, problem.u_max[j] <= rise);
                    u[j] = upper;
                } else if u[j] < lower {
                    changed |= self.enter(problem, (i, j), lower - u[j], -1, problem.u_min[j] >= fall);
                    u[j] = lower;
                } else if self.active[i][j].is_corner() {
                    changed |= self.leave_corner(problem, (i, j), u[j]);
                }
            }
            x = advance(&problem.stages[i], &x, &u);
            p = u;
            u_plan[i] = SVector::from(u);
            x_plan[i + 1] = SVector::from(x);
            if problem.soft > 0.0 {
                let soft_state = x[problem.soft_state];
                let side = side(problem, soft_state);
                changed |= side != self.sides[i];
                self.sides[i] = side;
                slack = slack.max(soft_state.abs() - problem.soft_bound);
            }
        }
        (changed, slack)
    }

    /// Puts an input that exceeds a bound on that bound. Returns whether it was not there already.
    #[cold]
    fn enter(
        &mut self,
        problem: &Problem<NX, NU>,
        (i, j): (usize, usize),
        excess: f64,
        side: i8,
        is_level: bool,
    ) -> bool {
        if excess <= ROUNDING * optimality::span(problem, j) {
            return false;
        }
        let at = self.active[i][j];
        let toggles = if is_level { at == Active::at_rate(side) } else { at == Active::at_level(side) };
        let entered = if toggles && self.toggled[i][j] && !self.is_anchored(i, j) {
            // Going back and forth between its two bounds, the input wants to be where they meet.
            Active { level: side, rate: side }
        } else if is_level {
            Active::at_level(side)
        } else {
            Active::at_rate(side)
        };
        self.toggled[i][j] |= toggles;
        self.active[i][j] = entered;
        entered != at
    }

    /// A corner whose demand cannot be met is no corner.
    fn leave_corner(&mut self, problem: &Problem<NX, NU>, (i, j): (usize, usize), u: f64) -> bool {
        let at = &mut self.active[i][j];
        let off = (u - super::active::level(problem, j, at.level)).abs() > ROUNDING * optimality::span(problem, j);
        if off {
            at.level = 0;
        }
        off
    }

    /// Whether the inputs that a sample is linked to begin at a bound or at the input applied before.
    fn is_anchored(&self, i: usize, j: usize) -> bool {
        self.active[..i].iter().rev().map(|at| at[j]).find(|at| at.rate == 0).is_none_or(|at| at.level != 0)
    }

    /// Looks from the plan straight to where the policies lead. Returns the fraction of the way to the first bound that is not
    /// active, and what is active there: sample, input, bounds.
    pub(super) fn approach(
        &mut self,
        problem: &Problem<NX, NU>,
        plan: &Solution<NX, NU>,
    ) -> (f64, Option<(usize, usize, Active)>) {
        let mut fraction = 1.0;
        let mut blocking = None;
        let mut x = problem.x_0.data.0[0];
        let mut p = problem.u_prev_clamped().data.0[0];
        let mut p_plan = p;
        for i in 0..self.horizon {
            let u = self.policies[i].input(&x, &p);
            x = advance(&problem.stages[i], &x, &u);
            for j in 0..NU {
                if self.active[i][j].is_corner() {
                    self.leave_corner(problem, (i, j), u[j]);
                }
                let at = self.active[i][j];
                let u_plan = plan.u[i][j];
                let noise = ROUNDING * optimality::span(problem, j);
                let mut test = |gap: f64, step: f64, entered: Active| {
                    if step > noise && gap < fraction * step {
                        fraction = (gap / step).max(0.0);
                        blocking = Some((i, j, entered));
                    }
                };
                if at.level == 0 {
                    let step = u[j] - u_plan;
                    test(problem.u_max[j] - u_plan, step, Active { level: 1, ..at });
                    test(u_plan - problem.u_min[j], -step, Active { level: -1, ..at });
                }
                if at.rate == 0 {
                    let du = u_plan - p_plan[j];
                    let step = u[j] - p[j] - du;
                    test(problem.du_max[j] - du, step, Active { rate: 1, ..at });
                    test(problem.du_max[j] + du, -step, Active { rate: -1, ..at });
                }
            }
            p = u;
            p_plan = plan.u[i].data.0[0];
            self.u_target[i] = SVector::from(u);
            self.x_target[i + 1] = SVector::from(x);
        }
        (fraction, blocking)
    }
}

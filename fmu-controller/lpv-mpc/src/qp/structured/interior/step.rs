//! One step of the interior point method: Newton's directions by the recursion, how far they may be followed, and the way there.

use super::super::Problem;
use super::super::active::Hold;
use super::super::riccati::{self, Affine, Value};
use super::super::rollout;
use super::{Interior, Row};
use nalgebra::SVector;

/// Derivative of the distances with respect to input (upper, lower) or increment (rise, fall).
const SIGN: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];

/// Products of distances and multipliers along the directions: a parabola in the step length.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Complementarity {
    /// Sums of the products here, of their slopes and of their curvatures.
    sums: [f64; 3],
    /// Rows that have a multiplier.
    pub(super) rows: f64,
}

impl Complementarity {
    #[inline(always)]
    pub(super) fn add(&mut self, row: &Row) {
        let [here, slope, curvature] = &mut self.sums;
        *here += row.s * row.z;
        *slope += row.s * row.dz + row.ds * row.z;
        *curvature += row.ds * row.dz;
        self.rows += 1.0;
    }

    /// Mean after a step.
    #[inline(always)]
    pub(super) fn after(&self, step: f64) -> f64 {
        let [here, slope, curvature] = self.sums;
        (here + step * (slope + step * curvature)) / self.rows
    }
}

impl<const NX: usize, const NU: usize> Interior<NX, NU> {
    #[inline(always)]
    pub(super) fn set_targets(&mut self, target: impl Fn(&Row) -> f64) {
        for rows in &mut self.rows {
            for row in rows.iter_mut().flatten() {
                row.target = target(row);
            }
        }
        for row in self.soft.iter_mut().flatten() {
            row.target = target(row);
        }
    }

    /// Tells the active rows by where the predictor drives them: to their bound, or to a zero multiplier. Returns whether
    /// they are the same as last time.
    #[inline(always)]
    pub(super) fn predict_active(&mut self) -> bool {
        let mut settled = true;
        for rows in &mut self.rows {
            for row in rows.iter_mut().flatten() {
                let active = row.z > 0.0 && row.ds < -0.5 * row.s;
                settled &= active == row.active;
                row.active = active;
            }
        }
        settled
    }

    /// Newton step as one recursion over differences: backwards with the barrier's curvature and the slopes at the iterate,
    /// forwards to the directions. Differences, because near the bounds the barrier's curvature times the whole input would
    /// drown the slopes in rounding.
    #[inline(always)]
    pub(super) fn recursion(&mut self, problem: &Problem<NX, NU>, factorise: bool) -> bool {
        let N = self.u.len();
        let u_prev = problem.u_prev_clamped();
        let mut value = self.costs(problem, N);
        for i in (0..N).rev() {
            let mut r = problem.r.data.0[0];
            let mut hold = [Hold::Free; NU];
            let mut slope = [0.0; NU];
            for j in 0..NU {
                if problem.is_frozen(j) {
                    hold[j] = Hold::Fixed(0.0);
                    continue;
                }
                let p = if i == 0 { u_prev[j] } else { self.u[i - 1][j] };
                slope[j] = r[j] * (self.u[i][j] - p - problem.stages[i].du_ref[j]);
                for (m, row) in self.rows[i][j].iter_mut().enumerate() {
                    if row.z > 0.0 {
                        if factorise {
                            row.inverse = 1.0 / row.s;
                        }
                        let weight = 0.5 * row.z * row.inverse;
                        let push = -0.5 * SIGN[m] * row.target * row.inverse;
                        if m < 2 {
                            value.U[j][j] += weight;
                            value.t[j] += push;
                        } else {
                            r[j] += weight;
                            slope[j] += push;
                        }
                    }
                }
                value.t[j] += slope[j];
            }
            let stage = &problem.stages[i];
            let mut before = self.costs(problem, i);
            let policy = &mut self.policies[i];
            if factorise {
                match riccati::step(stage, Affine::ZERO, &value, &r, &hold, policy, &mut before) {
                    Some(factor) => self.factors[i] = factor,
                    None => return false,
                }
            } else {
                let after = (&value.s, &value.t);
                riccati::linear_step(stage, &self.factors[i], &r, &hold, after, policy, (&mut before.s, &mut before.t));
            }
            value = before;
            for j in 0..NU {
                value.t[j] -= slope[j];
            }
        }
        let mut x = [0.0; NX];
        let mut p = [0.0; NU];
        for i in 0..N {
            p = self.policies[i].input(&x, &p);
            x = rollout::advance_from([0.0; NX], &problem.stages[i], &x, &p);
            self.du[i] = p;
            self.dx[i] = x;
        }
        true
    }

    /// What state `i` costs by itself near the iterate, with the barrier of the soft bound.
    #[inline(always)]
    fn costs(&self, problem: &Problem<NX, NU>, i: usize) -> Value<NX, NU> {
        let mut value = Value::ZERO;
        if i == 0 {
            return value;
        }
        let error = SVector::from(self.x[i - 1]) - problem.stages[i - 1].x_ref;
        if i == self.u.len() {
            value.S = problem.q_terminal.data.0;
            value.s = (problem.q_terminal * error).data.0[0];
        } else {
            for k in 0..NX {
                value.S[k][k] = problem.q[k];
                value.s[k] = problem.q[k] * error[k];
            }
        }
        if problem.has_soft_bound() {
            let k = problem.soft_state;
            for (row, sign) in self.soft[i - 1].iter().zip([1.0, -1.0]) {
                let denominator = row.s + row.z / (2.0 * problem.soft);
                value.S[k][k] += 0.5 * row.z / denominator;
                value.s[k] += sign * 0.5 * (row.z + (row.target - row.s * row.z) / denominator);
            }
        }
        value
    }

    /// Directions of distances and multipliers; returns the step length that keeps all of them positive, and what becomes of
    /// their products along the way.
    #[inline(always)]
    pub(super) fn directions(&mut self, problem: &Problem<NX, NU>, fraction: f64) -> (f64, Complementarity) {
        let mut inverse_alpha: f64 = fraction;
        let mut products = Complementarity::default();
        let mut limit = |row: &Row| {
            products.add(row);
            // Divisions only where a row sets the limit, which few do.
            if -row.ds > inverse_alpha * row.s {
                inverse_alpha = -row.ds / row.s;
            }
            if -row.dz > inverse_alpha * row.z {
                inverse_alpha = -row.dz / row.z;
            }
        };
        let mut dp = [0.0; NU];
        for i in 0..self.u.len() {
            for j in 0..NU {
                let du = self.du[i][j];
                for (m, row) in self.rows[i][j].iter_mut().enumerate() {
                    if row.z > 0.0 {
                        row.ds = SIGN[m] * if m < 2 { du } else { du - dp[j] };
                        row.dz = (row.target - row.z * row.ds) * row.inverse - row.z;
                        limit(row);
                    }
                }
                dp[j] = du;
            }
            if problem.has_soft_bound() {
                let k = problem.soft_state;
                let dx = self.dx[i][k];
                for (side, row) in self.soft[i].iter_mut().enumerate() {
                    let dx = if side == 0 { dx } else { -dx };
                    let soften = 1.0 / (2.0 * problem.soft);
                    row.dz = (row.target - row.s * row.z + row.z * dx) / (row.s + row.z * soften);
                    row.ds = row.dz * soften - dx;
                    // None is left where the squares of an excess overflow.
                    if row.z > 0.0 {
                        limit(row);
                    }
                }
            }
        }
        (fraction / inverse_alpha, products)
    }

    #[inline(always)]
    pub(super) fn advance(&mut self, alpha: f64) {
        let step = |row: &mut Row| {
            row.s += alpha * row.ds;
            row.z += alpha * row.dz;
        };
        for rows in &mut self.rows {
            rows.iter_mut().flatten().filter(|row| row.z > 0.0).for_each(step);
        }
        self.soft.iter_mut().flatten().filter(|row| row.z > 0.0).for_each(step);
        for i in 0..self.u.len() {
            for j in 0..NU {
                self.u[i][j] += alpha * self.du[i][j];
            }
            for k in 0..NX {
                self.x[i][k] += alpha * self.dx[i][k];
            }
        }
    }
}

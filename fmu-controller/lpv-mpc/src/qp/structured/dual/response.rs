//! What the optimum without bounds answers to multipliers: one recursion once, then a pass backwards and one forwards each.

use super::super::active::Hold;
use super::super::policy::Policy;
use super::super::riccati::{self, Affine, Value, transpose};
use super::super::{rollout, sweep};
use super::rows::{Bounds, Quantity, Row};
use crate::lanes::axpy;

/// A stage as the passes read it.
#[derive(Clone, Copy, Debug)]
struct Gains<const NX: usize, const NU: usize> {
    A_rows: [[f64; NX]; NX],
    B_rows: [[f64; NU]; NX],
    K_rows: [[f64; NX]; NU],
    /// Inverse curvature of the input.
    inverse: [[f64; NU]; NU],
}

/// The optimum without bounds, and by how much multipliers move it.
#[derive(Clone, Debug)]
pub(super) struct Response<const NX: usize, const NU: usize> {
    gains: Vec<Gains<NX, NU>>,
    policies: Vec<Policy<NX, NU>>,
    /// The optimum: inputs, and the soft state behind each.
    u_free: Vec<[f64; NU]>,
    soft_free: Vec<f64>,
    /// Slopes that multipliers add to the cost: of the inputs, and of the soft state behind each.
    push: Vec<[f64; NU]>,
    push_soft: Vec<f64>,
    /// By how much the plan gives way.
    u: Vec<[f64; NU]>,
    soft: Vec<f64>,
}

impl<const NX: usize, const NU: usize> Response<NX, NU> {
    pub(super) fn new(horizon: usize) -> Self {
        let gains = Gains {
            A_rows: [[0.0; NX]; NX],
            B_rows: [[0.0; NU]; NX],
            K_rows: [[0.0; NX]; NU],
            inverse: [[0.0; NU]; NU],
        };
        Self {
            gains: vec![gains; horizon],
            policies: vec![Policy::ZERO; horizon],
            u_free: vec![[0.0; NU]; horizon],
            soft_free: vec![0.0; horizon],
            push: vec![[0.0; NU]; horizon],
            push_soft: vec![0.0; horizon],
            u: vec![[0.0; NU]; horizon],
            soft: vec![0.0; horizon],
        }
    }

    /// Solves the problem without bounds, inputs that cannot move aside. Returns whether the curvature was positive throughout.
    pub(super) fn factorise(&mut self, bounds: &Bounds<NX, NU>) -> bool {
        let Bounds { problem, frozen, .. } = bounds;
        let u_prev = problem.u_prev_clamped().data.0[0];
        let hold: [Hold; NU] = std::array::from_fn(|j| if frozen[j] { Hold::Fixed(u_prev[j]) } else { Hold::Free });
        let mut value = sweep::terminal(problem);
        for (i, stage) in problem.stages.iter().enumerate().rev() {
            let mut before = Value::ZERO;
            if i > 0 {
                before.add_squares(&problem.q.data.0[0], &problem.stages[i - 1].x_ref.data.0[0]);
            }
            let policy = &mut self.policies[i];
            let (affine, r) = (Affine::of(stage), &problem.r.data.0[0]);
            let Some(factor) = riccati::step(stage, affine, &value, r, &hold, policy, &mut before) else {
                return false;
            };
            self.gains[i] = Gains {
                A_rows: transpose(&stage.A.data.0),
                B_rows: transpose(&stage.B.data.0),
                K_rows: transpose(&policy.K),
                inverse: factor.inverse,
            };
            value = before;
        }
        let (mut x, mut u) = (problem.x_0.data.0[0], u_prev);
        for (i, stage) in problem.stages.iter().enumerate() {
            u = self.policies[i].input(&x, &u);
            x = rollout::advance(stage, &x, &u);
            self.u_free[i] = u;
            self.soft_free[i] = x[problem.soft_state];
        }
        true
    }

    /// Answer to a multiplier of one on a row, up to the last sample that it or one of the `others` is in.
    pub(super) fn answer_one(&mut self, bounds: &Bounds<NX, NU>, row: Row, others: &[Row]) {
        self.push_along(row, 1.0);
        let until = others.iter().fold(row.i, |until, other| until.max(other.i));
        self.solve(bounds, row.i, until);
    }

    /// Answer to all multipliers.
    pub(super) fn answer_all(&mut self, bounds: &Bounds<NX, NU>, rows: &[Row], nu: &[f64]) {
        let mut last = 0;
        for (row, nu) in rows.iter().zip(nu) {
            self.push_along(*row, *nu);
            last = last.max(row.i);
        }
        self.solve(bounds, last, self.u.len() - 1);
    }

    /// By how much the answer moves a row towards its bound.
    pub(super) fn along(&self, row: Row) -> f64 {
        let i = row.i;
        f64::from(row.side)
            * match row.quantity {
                Quantity::Level(j) => self.u[i][j],
                Quantity::Rate(j) if i > 0 => self.u[i][j] - self.u[i - 1][j],
                Quantity::Rate(j) => self.u[i][j],
                Quantity::Soft => self.soft[i],
            }
    }

    /// By how much the optimum without bounds exceeds a bound.
    pub(super) fn excess_without_bounds(&self, bounds: &Bounds<NX, NU>, row: Row) -> f64 {
        let problem = bounds.problem;
        let (i, side) = (row.i, f64::from(row.side));
        match row.quantity {
            Quantity::Level(j) => side * (self.u_free[i][j] - super::super::active::level(problem, j, row.side)),
            Quantity::Rate(j) => {
                let before = if i > 0 { self.u_free[i - 1][j] } else { problem.u_prev_clamped()[j] };
                side * (self.u_free[i][j] - before) - problem.du_max[j]
            }
            Quantity::Soft => side * self.soft_free[i] - problem.soft_bound,
        }
    }

    /// Input of the plan that has given way.
    pub(super) fn input(&self, i: usize) -> [f64; NU] {
        std::array::from_fn(|j| self.u_free[i][j] + self.u[i][j])
    }

    /// Soft state behind that input.
    pub(super) fn soft_state(&self, i: usize) -> f64 {
        self.soft_free[i] + self.soft[i]
    }

    fn push_along(&mut self, row: Row, nu: f64) {
        let i = row.i;
        let slope = f64::from(row.side) * nu;
        match row.quantity {
            Quantity::Level(j) => self.push[i][j] += slope,
            Quantity::Rate(j) => {
                self.push[i][j] += slope;
                if i > 0 {
                    self.push[i - 1][j] -= slope;
                }
            }
            Quantity::Soft => self.push_soft[i] += slope,
        }
    }

    /// Answer to the pushes, which it takes away, up to a sample; none of them is behind sample `last`.
    fn solve(&mut self, bounds: &Bounds<NX, NU>, last: usize, until: usize) {
        let Bounds { problem, frozen, .. } = bounds;
        let r = &problem.r.data.0[0];
        let soft_state = problem.soft_state;
        let (mut s, mut t) = ([0.0; NX], [0.0; NU]);
        for i in (0..=last).rev() {
            let Gains { A_rows, B_rows, K_rows, inverse } = &self.gains[i];
            s[soft_state] += std::mem::take(&mut self.push_soft[i]);
            let mut slope = std::mem::replace(&mut self.push[i], [0.0; NU]);
            for j in 0..NU {
                slope[j] += t[j];
            }
            let mut before = [0.0; NX];
            for k in 0..NX {
                axpy(s[k], &B_rows[k], &mut slope);
                axpy(s[k], &A_rows[k], &mut before);
            }
            let mut constant = [0.0; NU];
            for j in 0..NU {
                if !frozen[j] {
                    axpy(-slope[j], &inverse[j], &mut constant);
                }
                axpy(slope[j], &K_rows[j], &mut before);
            }
            self.policies[i].k = constant;
            s = before;
            for j in 0..NU {
                t[j] = -r[j] * constant[j];
            }
        }
        for policy in &mut self.policies[last + 1..=until] {
            policy.k = [0.0; NU];
        }
        let (mut x, mut u) = ([0.0; NX], [0.0; NU]);
        for (i, (policy, stage)) in self.policies[..=until].iter().zip(&problem.stages).enumerate() {
            u = policy.input(&x, &u);
            x = rollout::advance_from([0.0; NX], stage, &x, &u);
            self.u[i] = u;
            self.soft[i] = x[soft_state];
        }
    }
}

//! The programme in the form that Clarabel takes: sparse matrices of a fixed pattern, in units of its own.

use super::super::Problem;
use super::super::optimality;
use nalgebra::SVector;

/// The problem in Clarabel's form: minimise 1/2 z' P z + q' z subject to A z + s = b, s in the cones.
#[derive(Default)]
pub(super) struct Data {
    pub P: Columns,
    pub q: Vec<f64>,
    pub A: Columns,
    pub b: Vec<f64>,
}

/// Sparse matrix that is written column by column; its pattern depends on the horizon and the soft state alone.
#[derive(Default)]
pub(super) struct Columns {
    pub starts: Vec<usize>,
    pub rows: Vec<usize>,
    pub values: Vec<f64>,
}

/// Smallest and largest unit of a state, against SI units [1]: ours, so that a weight of nearly nothing does not make one of a
/// kilometre.
const UNITS: [f64; 2] = [0.1, 10.0];

/// Factor on the cost [1]: ours, the order of one over the weights of the default controller.
const COST: f64 = 1e-2;

/// Units in which Clarabel sees the problem.
pub(super) struct Scaling<const NX: usize, const NU: usize> {
    pub x: SVector<f64, NX>,
    pub u: SVector<f64, NU>,
    pub cost: f64,
}

impl<const NX: usize, const NU: usize> Scaling<NX, NU> {
    /// Inputs in units of their range, states so that their weight becomes about one, as far as units within [`UNITS`] do that.
    pub fn of(problem: &Problem<NX, NU>) -> Self {
        let x = SVector::from_fn(|k, _| {
            let weight = problem.q[k].max(problem.q_terminal[(k, k)]);
            if weight > 0.0 { (1.0 / weight.sqrt()).clamp(UNITS[0], UNITS[1]) } else { 1.0 }
        });
        Self { x, u: SVector::from_fn(|j, _| optimality::span(problem, j)), cost: COST }
    }
}

impl Columns {
    fn clear(&mut self) {
        self.starts.clear();
        self.rows.clear();
        self.values.clear();
        self.starts.push(0);
    }

    fn push(&mut self, row: usize, value: f64) {
        self.rows.push(row);
        self.values.push(value);
    }

    fn end_column(&mut self) {
        self.starts.push(self.rows.len());
    }
}

impl Data {
    /// Writes all columns stage by stage.
    pub fn fill<const NX: usize, const NU: usize>(&mut self, problem: &Problem<NX, NU>, scaling: &Scaling<NX, NU>) {
        self.P.clear();
        self.q.clear();
        self.A.clear();
        for i in 0..problem.stages.len() {
            for j in 0..NU {
                self.input_column(problem, scaling, i, j);
            }
            for k in 0..NX {
                self.state_column(problem, scaling, i, k);
            }
            self.slack_column(problem, scaling, i);
        }
        self.right_hand_side(problem, scaling);
    }

    fn input_column<const NX: usize, const NU: usize>(
        &mut self,
        problem: &Problem<NX, NU>,
        scaling: &Scaling<NX, NU>,
        i: usize,
        j: usize,
    ) {
        let N = problem.stages.len();
        let (columns, rows) = (NX + NU + 1, 4 * NU + 2);
        let (su, cost) = (scaling.u[j], scaling.cost);
        let weight = 2.0 * problem.r[j] * su * su * cost;
        if i > 0 {
            self.P.push((i - 1) * columns + j, -weight);
        }
        // What is asked of the increment from the input before, and of the next one from it.
        let du_ref = |i: usize| problem.stages.get(i).map_or(0.0, |stage| stage.du_ref[j]);
        let before = if i > 0 { 0.0 } else { problem.u_prev_clamped()[j] };
        self.q.push(2.0 * problem.r[j] * su * cost * (du_ref(i + 1) - du_ref(i) - before));
        // Every increment but the last one's successor touches the input twice.
        self.P.push(i * columns + j, if i + 1 < N { 2.0 * weight } else { weight });
        self.P.end_column();

        let fixed = problem.is_frozen(j);
        for k in 0..NX {
            self.A.push(i * NX + k, unless(fixed, -problem.stages[i].B[(k, j)] * su / scaling.x[k]));
        }
        let row = N * NX + i * rows;
        self.A.push(row + j, unless(fixed || problem.u_max[j].is_infinite(), 1.0));
        self.A.push(row + NU + j, unless(fixed || problem.u_min[j].is_infinite(), -1.0));
        let du = unless(fixed || problem.du_max[j].is_infinite(), 1.0);
        self.A.push(row + 2 * NU + j, du);
        self.A.push(row + 3 * NU + j, -du);
        if i + 1 < N {
            self.A.push(row + rows + 2 * NU + j, -du);
            self.A.push(row + rows + 3 * NU + j, du);
        }
        self.A.end_column();
    }

    fn state_column<const NX: usize, const NU: usize>(
        &mut self,
        problem: &Problem<NX, NU>,
        scaling: &Scaling<NX, NU>,
        i: usize,
        k: usize,
    ) {
        let N = problem.stages.len();
        let column = i * (NX + NU + 1) + NU;
        let Scaling { x: sx, cost, .. } = scaling;
        if i + 1 < N {
            self.P.push(column + k, 2.0 * problem.q[k] * sx[k] * sx[k] * cost);
        } else {
            for l in 0..=k {
                let weight = 2.0 * problem.q_terminal[(l, k)] * cost;
                self.P.push(column + l, weight * sx[l] * sx[k]);
            }
        }
        self.q.push(0.0);
        self.P.end_column();

        self.A.push(i * NX + k, 1.0);
        if let Some(next) = problem.stages.get(i + 1) {
            for l in 0..NX {
                self.A.push((i + 1) * NX + l, -next.A[(l, k)] * sx[k] / sx[l]);
            }
        }
        if k == problem.soft_state {
            let row = N * NX + i * (4 * NU + 2) + 4 * NU;
            let on = unless(!problem.has_soft_bound(), 1.0);
            self.A.push(row, on);
            self.A.push(row + 1, -on);
        }
        self.A.end_column();
    }

    fn slack_column<const NX: usize, const NU: usize>(
        &mut self,
        problem: &Problem<NX, NU>,
        scaling: &Scaling<NX, NU>,
        i: usize,
    ) {
        let on = problem.has_soft_bound();
        // The slack's unit is the one in which its weight is one.
        let unit = unless(!on, 1.0 / (problem.soft.sqrt() * scaling.x[problem.soft_state]));
        self.P.push(i * (NX + NU + 1) + NX + NU, 2.0 * scaling.cost);
        self.P.end_column();
        self.q.push(0.0);
        let row = problem.stages.len() * NX + i * (4 * NU + 2) + 4 * NU;
        self.A.push(row, -unit);
        self.A.push(row + 1, -unit);
        self.A.end_column();
    }

    fn right_hand_side<const NX: usize, const NU: usize>(
        &mut self,
        problem: &Problem<NX, NU>,
        scaling: &Scaling<NX, NU>,
    ) {
        self.b.clear();
        let u_prev = problem.u_prev_clamped();
        // An input that cannot move is taken out: it enters as a constant; its own variable means nothing, and reading clamps it.
        let fixed = SVector::<f64, NU>::from_fn(|j, _| unless(!problem.is_frozen(j), u_prev[j]));
        let mut before = problem.x_0;
        for stage in &problem.stages {
            let known = stage.A * before + stage.B * fixed + stage.d - stage.x_ref;
            before = stage.x_ref;
            self.b.extend(known.component_div(&scaling.x).iter());
        }
        let bound = |j: usize, value: f64| {
            if problem.is_frozen(j) || value.is_infinite() { 1.0 } else { value / scaling.u[j] }
        };
        let k = problem.soft_state;
        let soft_bound = |value: f64| {
            if problem.has_soft_bound() { value / scaling.x[k] } else { 1.0 }
        };
        for i in 0..problem.stages.len() {
            let before = if i == 0 { u_prev } else { SVector::zeros() };
            self.b.extend((0..NU).map(|j| bound(j, problem.u_max[j])));
            self.b.extend((0..NU).map(|j| bound(j, -problem.u_min[j])));
            self.b.extend((0..NU).map(|j| bound(j, problem.du_max[j] + before[j])));
            self.b.extend((0..NU).map(|j| bound(j, problem.du_max[j] - before[j])));
            let x_ref = problem.stages[i].x_ref[k];
            self.b.push(soft_bound(problem.soft_bound - x_ref));
            self.b.push(soft_bound(problem.soft_bound + x_ref));
        }
    }
}

/// The value, or zero where its row is not wanted.
fn unless(off: bool, value: f64) -> f64 {
    if off { 0.0 } else { value }
}

//! Clarabel behind the call of the structured solver: one workspace of fixed sparsity, only its values change.
//!
//! The workspace holds no result of an earlier solve: equilibration is off and the scaling is computed from the problem at
//! hand, so equal problems give equal bits whatever was solved before.

use super::optimality;
use super::{Outcome, Problem, Solution};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT};
use nalgebra::{SMatrix, SVector};
use std::fmt;

/// The quadratic programme through Clarabel's interior point method.
///
/// Variables by stage: u_i, x_(i+1) - x_ref, e_(i+1). Rows: the dynamics of all stages, then by stage the upper and lower bounds of
/// u, of du, and of the soft state. A bound that is infinite and a soft bound that is off keep their row as 0 <= 1.
pub struct Clarabel<const NX: usize, const NU: usize> {
    tolerance: f64,
    workspace: Option<Workspace>,
}

/// Solver and data of one horizon and one soft state.
struct Workspace {
    horizon: usize,
    soft_state: usize,
    solver: DefaultSolver<f64>,
    data: Data,
}

/// The problem in Clarabel's form: minimise 1/2 z' P z + q' z subject to A z + s = b, s in the cones.
#[derive(Default)]
struct Data {
    P: Columns,
    q: Vec<f64>,
    A: Columns,
    b: Vec<f64>,
}

/// Sparse matrix that is written column by column; its pattern depends on the horizon and the soft state alone.
#[derive(Default)]
struct Columns {
    starts: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<f64>,
}

/// Units in which Clarabel sees the problem.
struct Scaling<const NX: usize, const NU: usize> {
    x: SVector<f64, NX>,
    u: SVector<f64, NU>,
    cost: f64,
}

impl<const NX: usize, const NU: usize> Clarabel<NX, NU> {
    /// Variables of a stage.
    const COLUMNS: usize = NU + NX + 1;
    /// Inequality rows of a stage.
    const ROWS: usize = 4 * NU + 2;

    /// Solver with Clarabel's tolerance on gap and feasibility; its own default is 1e-8.
    #[must_use]
    pub fn new(tolerance: f64) -> Self {
        Self { tolerance, workspace: None }
    }

    /// Drops the workspace, so that the next solve builds a new one.
    pub fn reset(&mut self) {
        self.workspace = None;
    }

    /// Solves the problem. Allocates when it is the first one or the horizon or the soft state changed.
    pub fn solve(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) {
        let N = problem.stages.len();
        solution.resize(N);
        solution.iterations = 0;
        solution.residual = f64::INFINITY;
        if !problem.is_valid() {
            solution.outcome = Outcome::Invalid;
            return;
        }
        let scaling = Scaling::of(problem);
        let fits = |w: &Workspace| w.horizon == N && w.soft_state == problem.soft_state;
        let mut workspace = match self.workspace.take().filter(fits) {
            Some(mut workspace) => {
                workspace.data.fill(problem, &scaling);
                let Data { P, q, A, b } = &workspace.data;
                if workspace.solver.update_data(&P.values, q, &A.values, b).is_err() {
                    solution.outcome = Outcome::Breakdown;
                    return;
                }
                workspace
            }
            None => match Self::build(problem, &scaling, self.tolerance) {
                Some(workspace) => workspace,
                None => {
                    solution.outcome = Outcome::Breakdown;
                    return;
                }
            },
        };
        workspace.solver.solve();
        Self::read(problem, &scaling, &workspace.solver, solution);
        self.workspace = Some(workspace);
    }

    fn build(problem: &Problem<NX, NU>, scaling: &Scaling<NX, NU>, tolerance: f64) -> Option<Workspace> {
        let N = problem.stages.len();
        let (columns, rows) = (N * Self::COLUMNS, N * (NX + Self::ROWS));
        let mut data = Data::default();
        data.fill(problem, scaling);
        let P = data.P.to_csc(columns, columns);
        let A = data.A.to_csc(rows, columns);
        let settings = DefaultSettings {
            verbose: false,
            // All three would tie the workspace to the values of its first problem.
            presolve_enable: false,
            input_sparse_dropzeros: false,
            equilibrate_enable: false,
            tol_gap_abs: tolerance,
            tol_gap_rel: tolerance,
            tol_feas: tolerance,
            ..DefaultSettings::default()
        };
        let cones = [ZeroConeT(N * NX), NonnegativeConeT(N * Self::ROWS)];
        let solver = DefaultSolver::new(&P, &data.q, &A, &data.b, &cones, settings).ok()?;
        Some(Workspace { horizon: N, soft_state: problem.soft_state, solver, data })
    }

    fn read(
        problem: &Problem<NX, NU>,
        scaling: &Scaling<NX, NU>,
        solver: &DefaultSolver<f64>,
        solution: &mut Solution<NX, NU>,
    ) {
        let N = problem.stages.len();
        let answer = &solver.solution;
        solution.iterations = answer.iterations;
        solution.gain = SMatrix::zeros();
        solution.gain_u_prev = SMatrix::zeros();
        let finite = answer.x.iter().chain(&answer.z).all(|v| v.is_finite());
        solution.outcome = match answer.status {
            _ if !finite => Outcome::Breakdown,
            SolverStatus::Solved => Outcome::InteriorPoint,
            SolverStatus::AlmostSolved
            | SolverStatus::MaxIterations
            | SolverStatus::MaxTime
            | SolverStatus::InsufficientProgress => Outcome::MaxIterations,
            _ => Outcome::Breakdown,
        };
        if solution.outcome == Outcome::Breakdown {
            return;
        }
        // The inputs are moved into the bounds and the states follow from them, so the plan holds exactly what it promises.
        let mut u_prev = problem.u_prev_clamped();
        solution.x[0] = problem.x_0;
        solution.slack = 0.0;
        for (i, stage) in problem.stages.iter().enumerate() {
            for j in 0..NU {
                let u = answer.x[i * Self::COLUMNS + j] * scaling.u[j];
                let lower = problem.u_min[j].max(u_prev[j] - problem.du_max[j]);
                let upper = problem.u_max[j].min(u_prev[j] + problem.du_max[j]);
                solution.u[i][j] = u.max(lower).min(upper);
                let z = &answer.z[N * NX + i * Self::ROWS..][..Self::ROWS];
                let unscale = 1.0 / (scaling.cost * scaling.u[j]);
                solution.mu_u[i][j] = (z[j] - z[NU + j]) * unscale;
                solution.mu_du[i][j] = (z[2 * NU + j] - z[3 * NU + j]) * unscale;
            }
            u_prev = solution.u[i];
            solution.x[i + 1] = stage.A * solution.x[i] + stage.B * u_prev + stage.d;
            solution.slack = solution.slack.max(problem.excess(&solution.x[i + 1]));
        }
        optimality::costates(problem, solution);
        optimality::balance_frozen(problem, solution);
        solution.residual = optimality::residual(problem, solution);
    }
}

impl<const NX: usize, const NU: usize> Scaling<NX, NU> {
    /// Inputs in units of their range, states so that their weight becomes about one, the cost by the mean input weight.
    fn of(problem: &Problem<NX, NU>) -> Self {
        let x = SVector::from_fn(|k, _| {
            let weight = problem.q[k].max(problem.q_terminal[(k, k)]);
            // Beyond a factor of 1e3 from SI units the weight is noise to be left small, not a unit to be adopted.
            if weight > 0.0 { (1.0 / weight.sqrt()).clamp(1e-1, 1e1) } else { 1.0 }
        });
        Self { x, u: SVector::from_fn(|j, _| optimality::span(problem, j)), cost: 1e-2 }
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

    fn to_csc(&self, rows: usize, columns: usize) -> CscMatrix {
        CscMatrix::new(rows, columns, self.starts.clone(), self.rows.clone(), self.values.clone())
    }
}

impl Data {
    /// Writes all columns stage by stage.
    fn fill<const NX: usize, const NU: usize>(&mut self, problem: &Problem<NX, NU>, scaling: &Scaling<NX, NU>) {
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
            self.q.push(0.0);
        } else {
            self.q.push(-2.0 * problem.r[j] * su * cost * problem.u_prev_clamped()[j]);
        }
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
        // An input that cannot move is taken out: it enters as a constant, and its own cost keeps its variable there.
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

impl<const NX: usize, const NU: usize> Clone for Clarabel<NX, NU> {
    /// A clone has its own workspace, which holds nothing that could change an answer.
    fn clone(&self) -> Self {
        Self::new(self.tolerance)
    }
}

impl<const NX: usize, const NU: usize> fmt::Debug for Clarabel<NX, NU> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Clarabel").field("tolerance", &self.tolerance).finish_non_exhaustive()
    }
}

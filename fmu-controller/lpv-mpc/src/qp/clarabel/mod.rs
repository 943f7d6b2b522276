//! Clarabel behind the call of the structured solver: one workspace of fixed sparsity, only its values change.
//!
//! The workspace holds no result of an earlier solve: equilibration is off and the scaling is computed from the problem at
//! hand, so equal problems give equal bits whatever was solved before.

mod data;

use super::optimality;
use super::{Outcome, Problem, Solution};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT};
use data::{Columns, Data, Scaling};
use nalgebra::SMatrix;
use std::fmt;

/// The quadratic programme through Clarabel's interior point method.
///
/// Variables by stage: u_i, x_(i+1) - x_ref, e_(i+1). Rows: the dynamics of all stages, then by stage the upper and lower
/// bounds of u, of du, and of the soft state. A bound that is infinite and a soft bound that is off keep their row as 0 <= 1.
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
        let P = matrix(columns, columns, &data.P);
        let A = matrix(rows, columns, &data.A);
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
            SolverStatus::Solved => Outcome::SecondSolver,
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

fn matrix(rows: usize, columns: usize, data: &Columns) -> CscMatrix {
    CscMatrix::new(rows, columns, data.starts.clone(), data.rows.clone(), data.values.clone())
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

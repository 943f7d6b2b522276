//! Conditions of optimality, evaluated from a plan and its multipliers alone: the same measure for every solver.

use super::{Problem, Solution, Stage};
use nalgebra::SVector;

/// Sets the costates of a plan: λ_N = 2 W_N (x_N - x_ref_N) + soft term,
/// λ_i = A_i' λ_(i+1) + 2 W_i (x_i - x_ref_i) + soft term.
#[inline(always)]
pub fn costates<const NX: usize, const NU: usize>(problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) {
    let N = problem.stages.len();
    let k = problem.soft_state;
    for i in (0..N).rev() {
        let x = &solution.x[i + 1];
        let error = x - problem.stages[i].x_ref;
        let mut lambda = if i + 1 == N { problem.q_terminal * error } else { problem.q.component_mul(&error) };
        lambda *= 2.0;
        if problem.soft > 0.0 {
            lambda[k] += 2.0 * problem.soft * problem.excess(x).copysign(x[k]);
        }
        if i + 1 < N {
            lambda += problem.stages[i + 1].A.tr_mul(&solution.lambda[i + 1]);
        }
        solution.lambda[i] = lambda;
    }
}

/// Gradient of the cost with respect to each input of sample `i` along the dynamics, and the scale to judge it by: the
/// input's own curvature times its range, plus the magnitudes of the terms that cancel.
#[must_use]
#[inline(always)]
pub fn gradient<const NX: usize, const NU: usize>(
    problem: &Problem<NX, NU>,
    solution: &Solution<NX, NU>,
    i: usize,
) -> (SVector<f64, NU>, SVector<f64, NU>) {
    let N = problem.stages.len();
    let Stage { B, du_ref, .. } = &problem.stages[i];
    let du_ref_next = problem.stages.get(i + 1).map_or_else(SVector::zeros, |next| next.du_ref);
    let u = &solution.u;
    let u_before = if i == 0 { problem.u_prev_clamped() } else { u[i - 1] };
    let mut gradient = SVector::zeros();
    let mut scale = SVector::zeros();
    for j in 0..NU {
        let du = 2.0 * problem.r[j] * (u[i][j] - u_before[j] - du_ref[j]);
        let du_next = if i + 1 < N { 2.0 * problem.r[j] * (u[i + 1][j] - u[i][j] - du_ref_next[j]) } else { 0.0 };
        let mut along_dynamics = 0.0;
        let mut magnitude = du.abs() + du_next.abs();
        let mut curvature = 2.0 * problem.r[j];
        for k in 0..NX {
            let b = B[(k, j)];
            let term = b * solution.lambda[i][k];
            along_dynamics += term;
            magnitude += term.abs();
            curvature += 2.0 * problem.q[k] * b * b;
        }
        gradient[j] = du - du_next + along_dynamics;
        scale[j] = magnitude + curvature * span(problem, j);
    }
    (gradient, scale)
}

/// Gives inputs that cannot move the multipliers that balance their gradient, for solvers that have no rows for them.
pub(super) fn balance_frozen<const NX: usize, const NU: usize>(
    problem: &Problem<NX, NU>,
    solution: &mut Solution<NX, NU>,
) {
    let N = problem.stages.len();
    for i in (0..N).rev() {
        let (gradient, _) = gradient(problem, solution, i);
        for j in (0..NU).filter(|j| problem.is_frozen(*j)) {
            if problem.du_max[j] > 0.0 {
                solution.mu_u[i][j] = -gradient[j];
            } else {
                let next = if i + 1 < N { solution.mu_du[i + 1][j] } else { 0.0 };
                solution.mu_du[i][j] = next - gradient[j];
            }
        }
    }
}

/// Range of an input, by which its errors are measured; one where it is unbounded or a single point.
#[must_use]
pub fn span<const NX: usize, const NU: usize>(problem: &Problem<NX, NU>, j: usize) -> f64 {
    let span = problem.u_max[j] - problem.u_min[j];
    if span.is_finite() && span > 0.0 { span } else { 1.0 }
}

/// Largest violation of the conditions of optimality, each made dimensionless: stationarity by the scale of [`gradient`],
/// bounds by the range of the input, complementarity as the smaller one of a scaled multiplier and its scaled distance to the
/// bound.
///
/// Costates must be those of the plan ([`costates`]) and the states must follow from the inputs.
#[must_use]
pub fn residual<const NX: usize, const NU: usize>(problem: &Problem<NX, NU>, solution: &Solution<NX, NU>) -> f64 {
    let N = problem.stages.len();
    let mut worst: f64 = 0.0;
    let mut u_prev = problem.u_prev_clamped();
    for i in 0..N {
        let u = solution.u[i];
        let (gradient, scale) = gradient(problem, solution, i);
        for j in 0..NU {
            let mu_du_next = if i + 1 < N { solution.mu_du[i + 1][j] } else { 0.0 };
            let (mu_u, mu_du) = (solution.mu_u[i][j], solution.mu_du[i][j]);
            let span = span(problem, j);
            let stationarity = (gradient[j] + mu_u + mu_du - mu_du_next).abs() / scale[j];
            // A NaN must not hide behind `max`, which drops it.
            if stationarity.is_nan() {
                return f64::INFINITY;
            }
            let above = u[j] - problem.u_max[j];
            let below = problem.u_min[j] - u[j];
            let du = u[j] - u_prev[j];
            let violation = above.max(below).max(du.abs() - problem.du_max[j]) / span;
            let gap = |mu: f64, upper: f64, lower: f64| {
                let slack = if mu > 0.0 { -upper } else { -lower };
                (mu.abs() / scale[j]).min(slack.abs() / span)
            };
            let complementarity =
                gap(mu_u, above, below).max(gap(mu_du, du - problem.du_max[j], -du - problem.du_max[j]));
            worst = worst.max(stationarity).max(violation).max(complementarity);
        }
        u_prev = u;
    }
    worst
}

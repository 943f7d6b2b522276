//! Guard for the active set: a feasible interior point method, predictor and corrector after Mehrotra, on the same recursion.
//!
//! Every iterate keeps the dynamics and the bounds, so the distances to the bounds are functions of the inputs and only
//! stationarity and complementarity have to be driven to zero. A bound with distance s and multiplier z adds z/s to the
//! curvature; the soft bound's slack e = z / (2 soft) is eliminated in the same way.

use super::super::optimality;
use super::active::Hold;
use super::riccati::{self, Factor, Policy, Value, axpy};
use super::{Outcome, Problem, Solution, Structured};
use nalgebra::SVector;

/// Iterations after which the plan at hand is all there is.
const ITERATIONS_MAX: u32 = 40;
/// Fraction of the way to the nearest bound that a step may go.
const TO_BOUNDARY: f64 = 0.995;

/// Complementarity, against its start, below which an active set is tried that has not settled, and the factor to the next trial.
const POLISH_BELOW: f64 = 1e-2;
/// Stationarity, against its start, above which the active set that shows is not yet worth a trial.
const POLISH_STATIONARITY: f64 = 1e-1;
/// Sweeps of a trial.
const POLISH_SWEEPS: u32 = 3;
/// Complementarity, against its start, at which rounding ends the method.
const CONVERGED: f64 = 1e-13;
/// Residual up to which the answer counts as optimal.
const RESIDUAL_MAX: f64 = 1e-6;

/// Distance to a bound, its multiplier, and the target of their product.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    s: f64,
    z: f64,
    target: f64,
    ds: f64,
    dz: f64,
    active: bool,
}

/// Bounds of one input: upper, lower, rise, fall. Rows of infinite bounds keep `s` infinite and `z` zero.
type Rows = [Row; 4];
/// Derivative of the distances with respect to input (upper, lower) or increment (rise, fall).
const SIGN: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];

/// Buffers of the method.
#[derive(Clone, Debug)]
pub(super) struct Interior<const NX: usize, const NU: usize> {
    rows: Vec<[Rows; NU]>,
    soft: Vec<[Row; 2]>,
    u: Vec<[f64; NU]>,
    x: Vec<[f64; NX]>,
    du: Vec<[f64; NU]>,
    dx: Vec<[f64; NX]>,
    policies: Vec<Policy<NX, NU>>,
    factors: Vec<Factor<NX, NU>>,
}

impl<const NX: usize, const NU: usize> Interior<NX, NU> {
    pub(super) fn new(horizon: usize) -> Self {
        Self {
            rows: vec![[Rows::default(); NU]; horizon],
            soft: vec![[Row::default(); 2]; horizon],
            u: vec![[0.0; NU]; horizon],
            x: vec![[0.0; NX]; horizon],
            du: vec![[0.0; NU]; horizon],
            dx: vec![[0.0; NX]; horizon],
            policies: vec![Policy::ZERO; horizon],
            factors: vec![Factor::ZERO; horizon],
        }
    }

    /// Moves a plan into the interior of the bounds, so that no distance is below `margin` of what is possible there.
    fn start(&mut self, problem: &Problem<NX, NU>, plan: &[[f64; NU]], solution: &mut Solution<NX, NU>) -> f64 {
        const MARGIN: f64 = 0.05;
        let N = plan.len();
        let mut p = problem.u_prev_clamped();
        let mut x = problem.x_0;
        for i in 0..N {
            for j in 0..NU {
                let lower = problem.u_min[j].max(p[j] - problem.du_max[j]);
                let upper = problem.u_max[j].min(p[j] + problem.du_max[j]);
                let width = upper - lower;
                let margin = if width.is_finite() { MARGIN * width } else { MARGIN };
                // Frozen inputs have no interior; they stay where they are.
                let u = if problem.is_frozen(j) { p[j] } else { plan[i][j].max(lower + margin).min(upper - margin) };
                self.rows[i][j] = distances(problem, j, u, p[j]);
                self.u[i][j] = u;
            }
            p = SVector::from(self.u[i]);
            x = problem.stages[i].A * x + problem.stages[i].B * p + problem.stages[i].d;
            self.x[i] = x.data.0[0];
            solution.u[i] = p;
            solution.x[i + 1] = x;
        }
        optimality::costates(problem, solution);
        // The complementarity at which multipliers of bounds half a range away balance the gradient.
        let mut mu = 0.0;
        for i in 0..N {
            let (gradient, scale) = optimality::gradient(problem, solution, i);
            for j in 0..NU {
                mu += (gradient[j].abs() + 1e-3 * scale[j]) * optimality::span(problem, j);
            }
        }
        mu = 0.1 * mu / (N * NU) as f64;
        let k = problem.soft_state;
        for i in 0..N {
            for j in 0..NU {
                for row in &mut self.rows[i][j] {
                    row.z = if problem.is_frozen(j) || row.s.is_infinite() { 0.0 } else { mu / row.s };
                }
            }
            for (side, row) in self.soft[i].iter_mut().enumerate() {
                *row = Row::default();
                if problem.has_soft_bound() {
                    let b = problem.soft_bound - if side == 0 { self.x[i][k] } else { -self.x[i][k] };
                    // s = b + z / (2 soft) and s z = mu.
                    let h = problem.soft * b;
                    let z = if h > 0.0 {
                        2.0 * problem.soft * mu / (h + (h * h + 2.0 * problem.soft * mu).sqrt())
                    } else {
                        -h + (h * h + 2.0 * problem.soft * mu).sqrt()
                    };
                    row.z = z;
                    row.s = b + z / (2.0 * problem.soft);
                    if row.s <= 0.0 || h <= 0.0 {
                        row.s = mu / z;
                    }
                }
            }
        }
        mu
    }
}

fn distances<const NX: usize, const NU: usize>(problem: &Problem<NX, NU>, j: usize, u: f64, p: f64) -> Rows {
    let row = |s: f64| Row { s, ..Row::default() };
    let du = u - p;
    [row(problem.u_max[j] - u), row(u - problem.u_min[j]), row(problem.du_max[j] - du), row(problem.du_max[j] + du)]
}

impl<const NX: usize, const NU: usize> Structured<NX, NU> {
    /// Solves by interior points. As soon as they tell the active set, sweeps make the answer exact; where a degenerate vertex
    /// leaves no active set that stands, the answer of the interior points does.
    pub(super) fn solve_interior(&mut self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) {
        let mu_start = self.interior.start(problem, &self.inputs, solution);
        let mut stationarity = 1.0;
        let mut polish_below = POLISH_BELOW;
        for _ in 0..ITERATIONS_MAX {
            solution.iterations += 1;
            self.interior.set_targets(|_| 0.0);
            if !self.interior.recursion(problem, true) {
                break;
            }
            let step = self.interior.directions(problem, 1.0);
            let settled = self.interior.predict_active();
            let (mu_predicted, _) = self.interior.complementarity(step);
            let (mu, count) = self.interior.complementarity(0.0);
            if count == 0 {
                self.interior.advance(1.0);
                break;
            }
            let centring = (mu_predicted / mu).powi(3);
            self.interior.set_targets(|row| centring * mu - row.ds * row.dz);
            self.interior.recursion(problem, false);
            let step = self.interior.directions(problem, TO_BOUNDARY);
            self.interior.advance(step);
            stationarity *= 1.0 - step;
            let progress = self.interior.complementarity(0.0).0 / mu_start;
            if !progress.is_finite() {
                break;
            }
            if (settled || progress < polish_below) && stationarity < POLISH_STATIONARITY {
                polish_below = polish_below.min(progress * POLISH_BELOW);
                self.identify(problem);
                if self.descend(problem, solution, POLISH_SWEEPS) {
                    return;
                }
            }
            if progress < CONVERGED {
                break;
            }
        }
        self.interior.answer(problem, solution);
        self.identify(problem);
        if !self.backward(problem) || !solution.residual.is_finite() {
            solution.outcome = Outcome::Breakdown;
        }
    }

    /// Takes the active set that the multipliers tell.
    fn identify(&mut self, problem: &Problem<NX, NU>) {
        for i in 0..self.horizon {
            for j in 0..NU {
                let on = |row: &Row| row.active;
                let rows = &self.interior.rows[i][j];
                let side = |upper: &Row, lower: &Row| {
                    if on(upper) {
                        1
                    } else if on(lower) {
                        -1
                    } else {
                        0
                    }
                };
                self.active[i][j].level = side(&rows[0], &rows[1]);
                self.active[i][j].rate = side(&rows[2], &rows[3]);
            }
            let x = self.interior.x[i][problem.soft_state];
            if problem.has_soft_bound() {
                self.sides[i] = if x > problem.soft_bound {
                    1
                } else if x < -problem.soft_bound {
                    -1
                } else {
                    0
                };
            }
        }
    }
}

impl<const NX: usize, const NU: usize> Interior<NX, NU> {
    fn set_targets(&mut self, target: impl Fn(&Row) -> f64) {
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
    fn predict_active(&mut self) -> bool {
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
    fn recursion(&mut self, problem: &Problem<NX, NU>, factorise: bool) -> bool {
        let N = self.u.len();
        let u_prev = problem.u_prev_clamped();
        let mut value = Value::<NX, NU>::ZERO;
        let has_soft_bound = problem.has_soft_bound();
        let soft_state = problem.soft_state;
        for i in (0..N).rev() {
            let error = SVector::from(self.x[i]) - problem.stages[i].x_ref;
            if i + 1 < N {
                for k in 0..NX {
                    value.S[k][k] += problem.q[k];
                    value.s[k] += problem.q[k] * error[k];
                }
            } else {
                value.S = problem.q_terminal.data.0;
                value.s = (problem.q_terminal * error).data.0[0];
            }
            if has_soft_bound {
                for (row, sign) in self.soft[i].iter().zip([1.0, -1.0]) {
                    let denominator = row.s + row.z / (2.0 * problem.soft);
                    value.S[soft_state][soft_state] += 0.5 * row.z / denominator;
                    value.s[soft_state] += sign * 0.5 * (row.z + (row.target - row.s * row.z) / denominator);
                }
            }
            let mut r = problem.r.data.0[0];
            let mut hold = [Hold::Free; NU];
            let mut slope = [0.0; NU];
            for j in 0..NU {
                if problem.is_frozen(j) {
                    hold[j] = Hold::Fixed(0.0);
                    continue;
                }
                let p = if i == 0 { u_prev[j] } else { self.u[i - 1][j] };
                slope[j] = r[j] * (self.u[i][j] - p);
                for (m, row) in self.rows[i][j].iter().enumerate() {
                    if row.z > 0.0 {
                        let inverse = 1.0 / row.s;
                        let weight = 0.5 * row.z * inverse;
                        let push = -0.5 * SIGN[m] * row.target * inverse;
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
            let policy = &mut self.policies[i];
            let mut before = Value::ZERO;
            if factorise {
                match riccati::step(stage, &[0.0; NX], &value, &r, &hold, policy, &mut before) {
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
            let stage = &problem.stages[i];
            let mut next = [0.0; NX];
            for k in 0..NX {
                axpy(x[k], &stage.A.data.0[k], &mut next);
            }
            for j in 0..NU {
                axpy(p[j], &stage.B.data.0[j], &mut next);
            }
            x = next;
            self.du[i] = p;
            self.dx[i] = x;
        }
        true
    }

    /// Directions of distances and multipliers; returns the step length that keeps all of them positive.
    fn directions(&mut self, problem: &Problem<NX, NU>, fraction: f64) -> f64 {
        let mut inverse_alpha: f64 = fraction;
        let mut limit = |row: &Row| {
            inverse_alpha = inverse_alpha.max(-row.ds / row.s).max(-row.dz / row.z);
        };
        let mut dp = [0.0; NU];
        for i in 0..self.u.len() {
            for j in 0..NU {
                let du = self.du[i][j];
                for (m, row) in self.rows[i][j].iter_mut().enumerate() {
                    if row.z > 0.0 {
                        row.ds = SIGN[m] * if m < 2 { du } else { du - dp[j] };
                        row.dz = (row.target - row.z * row.ds) / row.s - row.z;
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
                    limit(row);
                }
            }
        }
        fraction / inverse_alpha
    }

    /// Mean product of distance and multiplier after a step along the directions, and the number of rows.
    fn complementarity(&self, alpha: f64) -> (f64, usize) {
        let mut sum = 0.0;
        let mut count = 0;
        let mut add = |row: &Row| {
            if row.z > 0.0 {
                sum += (row.s + alpha * row.ds) * (row.z + alpha * row.dz);
                count += 1;
            }
        };
        self.rows.iter().flatten().flatten().for_each(&mut add);
        self.soft.iter().flatten().for_each(&mut add);
        (if count > 0 { sum / f64::from(u32::try_from(count).unwrap_or(u32::MAX)) } else { 0.0 }, count)
    }

    /// Hands the plan and the multipliers over.
    fn answer(&self, problem: &Problem<NX, NU>, solution: &mut Solution<NX, NU>) {
        let mut x = problem.x_0;
        solution.slack = 0.0;
        for (i, stage) in problem.stages.iter().enumerate() {
            let u = SVector::from(self.u[i]);
            x = stage.A * x + stage.B * u + stage.d;
            solution.u[i] = u;
            solution.x[i + 1] = x;
            solution.slack = solution.slack.max(problem.excess(&x));
            for j in 0..NU {
                let rows = &self.rows[i][j];
                solution.mu_u[i][j] = rows[0].z - rows[1].z;
                solution.mu_du[i][j] = rows[2].z - rows[3].z;
            }
        }
        optimality::costates(problem, solution);
        optimality::balance_frozen(problem, solution);
        solution.residual = optimality::residual(problem, solution);
        solution.outcome =
            if solution.residual < RESIDUAL_MAX { Outcome::InteriorPoint } else { Outcome::MaxIterations };
    }

    fn advance(&mut self, alpha: f64) {
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

//! Guard for the active set: a feasible interior point method, predictor and corrector after Mehrotra, on the same recursion.
//!
//! Every iterate keeps the dynamics and the bounds, so the distances to the bounds are functions of the inputs and only
//! stationarity and complementarity have to be driven to zero. A bound with distance s and multiplier z adds z/s to the
//! curvature; the soft bound's slack e = z / (2 soft) is eliminated in the same way.

mod start;
mod step;

use super::super::optimality;
use super::policy::Policy;
use super::riccati::Factor;
use super::{Outcome, Problem, Solution, Structured};
use nalgebra::SVector;

// Fraction to the boundary, centring, trials and start (`start`) were chosen together for the least work on the recorded
// problems: with the iteration counted as two sweeps, N = 40 takes 26 sweeps on average, at most 39; customary values (0.995,
// third power, three sweeps of a trial, start at 0.05 and 0.1) take 33 and 52.

/// Iterations after which the plan at hand is all there is.
const ITERATIONS_MAX: u32 = 40;
/// Fraction of the way to the nearest bound that a step may go.
const TO_BOUNDARY: f64 = 0.999;

/// Complementarity, against its start, below which an active set is tried that has not settled, and the factor to the next trial.
const POLISH_BELOW: f64 = 1e-2;
/// Stationarity, against its start, above which the active set that shows is not yet worth a trial.
const POLISH_STATIONARITY: f64 = 5e-2;
/// Sweeps of a trial.
const POLISH_SWEEPS: u32 = 2;
/// Complementarity, against its start, at which rounding ends the method.
const CONVERGED: f64 = 1e-13;
/// Residual up to which the answer counts as optimal.
const RESIDUAL_MAX: f64 = 1e-6;

/// Distance to a bound, its multiplier, and the target of their product.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    s: f64,
    /// Inverse of the distance, as of the last factorisation.
    inverse: f64,
    z: f64,
    target: f64,
    ds: f64,
    dz: f64,
    active: bool,
}

/// Bounds of one input: upper, lower, rise, fall. Rows of infinite bounds keep `s` infinite and `z` zero.
type Rows = [Row; 4];

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
            let centring = (mu_predicted / mu).powi(2);
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
        self.identify(problem);
        if self.settle_by_rows(problem, solution) {
            return;
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
}

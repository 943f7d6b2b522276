//! Where interior points start: strictly within the bounds, with multipliers that balance the gradient.

use super::super::super::optimality;
use super::super::{Problem, Solution};
use super::{Interior, Row, Rows};
use nalgebra::SVector;

/// Distance to a bound, as a fraction of what is possible there, below which no input starts.
const MARGIN: f64 = 0.15;
/// Part of the complementarity that would balance the gradient at which the method starts.
const BALANCE: f64 = 0.03;

impl<const NX: usize, const NU: usize> Interior<NX, NU> {
    /// Moves a plan into the interior of the bounds, so that no distance is below [`MARGIN`] of what is possible there.
    pub(super) fn start(
        &mut self,
        problem: &Problem<NX, NU>,
        plan: &[[f64; NU]],
        solution: &mut Solution<NX, NU>,
    ) -> f64 {
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
        mu = BALANCE * mu / (N * NU) as f64;
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

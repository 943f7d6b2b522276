//! Derivative of the solution with respect to the problem's data.

use super::policy::Policy;
use super::riccati::{self, Affine, Value};
use super::sweep::terminal;
use super::{Hold, Problem, Solution, Stage, Structured, active, rollout};
use nalgebra::SVector;

/// Small change of a problem's data: each field is the differential of its namesake.
#[derive(Clone, Debug, PartialEq)]
pub struct Perturbation<const NX: usize, const NU: usize> {
    /// Change of prediction and reference, one element per sample of the horizon.
    pub stages: Vec<Stage<NX, NU>>,
    /// Change of the state now.
    pub x_0: SVector<f64, NX>,
    /// Change of the input applied before.
    pub u_prev: SVector<f64, NU>,
}

/// Change of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Tangent<const NX: usize, const NU: usize> {
    /// Changes of the states, from the one now to the end of the horizon.
    pub x: Vec<SVector<f64, NX>>, // N + 1
    /// Changes of the inputs.
    pub u: Vec<SVector<f64, NU>>, // N
}

impl<const NX: usize, const NU: usize> Perturbation<NX, NU> {
    /// No change of a problem of `horizon` samples.
    #[must_use]
    pub fn new(horizon: usize) -> Self {
        Self { stages: vec![Stage::default(); horizon], x_0: SVector::zeros(), u_prev: SVector::zeros() }
    }
}

impl<const NX: usize, const NU: usize> Structured<NX, NU> {
    /// Derivative of the plan along a small change of the problem that was solved last, before any [`Self::shift`].
    ///
    /// The conditions of optimality are differentiated on the final active set: again a problem of this kind, without bounds,
    /// so one recursion solves it. Where an infinitesimal change alters the active set there is no derivative; what is
    /// returned is then the one of the side on which the solver ended. Allocates; it is no part of a control step.
    #[must_use]
    pub fn tangent(
        &self,
        problem: &Problem<NX, NU>,
        solution: &Solution<NX, NU>,
        perturbation: &Perturbation<NX, NU>,
    ) -> Tangent<NX, NU> {
        let N = self.horizon;
        let r = &problem.r.data.0[0];
        let mut policies = vec![Policy::<NX, NU>::ZERO; N];
        let mut stages = problem.stages.clone();
        let mut value = terminal(problem);
        value.s = [0.0; NX];
        let mut demand = [None; NU];
        for i in (0..N).rev() {
            let change = &perturbation.stages[i];
            let weighted_ref = if i + 1 == N {
                problem.q_terminal * change.x_ref
            } else {
                for k in 0..NX {
                    value.add_square(k, problem.q[k], 0.0);
                }
                problem.q.component_mul(&change.x_ref)
            };
            for k in 0..NX {
                value.s[k] -= weighted_ref[k];
            }
            if self.sides[i] != 0 {
                value.add_square(problem.soft_state, problem.soft, 0.0);
            }
            let mut hold = [Hold::Free; NU];
            for j in 0..NU {
                (hold[j], demand[j]) = active::hold(problem, j, self.active[i][j], demand[j]);
                hold[j] = hold[j].still();
            }
            // Half, because the value's linear terms carry a factor of two.
            let lambda = 0.5 * solution.lambda[i];
            let slope_u = change.B.tr_mul(&lambda);
            let slope_x = change.A.tr_mul(&lambda);
            for j in 0..NU {
                value.t[j] += slope_u[j];
            }
            stages[i].d = change.A * solution.x[i] + change.B * solution.u[i] + change.d;
            stages[i].du_ref = change.du_ref;
            let (stage, mut before) = (&stages[i], Value::ZERO);
            if riccati::step(stage, Affine::of(stage), &value, r, &hold, &mut policies[i], &mut before).is_none() {
                // The same recursion succeeded when the problem was solved.
                break;
            }
            value = before;
            for k in 0..NX {
                value.s[k] += slope_x[k];
            }
        }
        let mut x = perturbation.x_0;
        let mut p = SVector::from_fn(|j, _| {
            let inside = problem.u_min[j] <= problem.u_prev[j] && problem.u_prev[j] <= problem.u_max[j];
            if inside { perturbation.u_prev[j] } else { 0.0 }
        });
        let mut tangent = Tangent { x: vec![x], u: Vec::with_capacity(N) };
        for (policy, stage) in policies.iter().zip(&stages) {
            p = SVector::from(policy.input(&x.data.0[0], &p.data.0[0]));
            x = SVector::from(rollout::advance(stage, &x.data.0[0], &p.data.0[0]));
            tangent.u.push(p);
            tangent.x.push(x);
        }
        tangent
    }
}

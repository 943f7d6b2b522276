//! Cost of what comes after the horizon.
//!
//! [Kebbati] repeats the weights of the stages at the last one, so a short horizon ends in states that are expensive to leave.
//! The alternative here is the cost of driving on without end by the best linear feedback, from the discrete algebraic Riccati
//! equation of the prediction model on a straight at the speed that the plan ends with.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::discretise::Hold;
use crate::guide::Path;
use crate::horizon::{Linear, Surroundings, linearise};
use crate::model::{Body, Disturbance, Input, NU, Point, State, Tyres, V_GUARD, V_X};
use crate::modes::TerminalCost;
use crate::parameters::Parameters;
use crate::qp::{Problem, Stage};

/// States with the actuators, and the command that acts: the increments of the command are what the cost counts.
const NZ: usize = crate::horizon::NX_LAGS + NU;

type Square = SMatrix<f64, NZ, NZ>;

/// Doublings at most [1]: 2^30 samples are a year.
const DOUBLINGS: usize = 30;

/// Relative change that counts as none [1]; the doubling converges quadratically, so the next one is at rounding.
const CONVERGED: f64 = 1e-9;

/// Relative change of the speed up to which the weight of the last state stays [1]: the lateral modes change by about as much. At a
/// steady speed no sample needs a new weight; under full braking from 14 m/s, 0.26 m/s a sample, nearly every one does.
const SAME_SPEED: f64 = 0.02;

/// How the last state is weighed.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Terminal {
    cost: TerminalCost,
    factor: f64,
    /// Speed that the weight in force was made for [m/s]; 0 if none was.
    v_x: f64,
}

impl Terminal {
    /// Of these parameters, to be weighed.
    pub fn new(p: &Parameters) -> Self {
        Self { cost: p.terminal_cost, factor: p.terminal_factor, v_x: 0.0 }
    }

    /// Weighs the last state by the speed `v_x` [m/s] that the last plan ends with, so that the weight does not depend on the
    /// measurement.
    pub fn weigh<const N_X: usize>(
        &mut self,
        problem: &mut Problem<N_X, NU>,
        v_x: f64,
        tyres: &Tyres,
        hold: &Hold,
        body: &Body,
    ) {
        let v_x = v_x.max(V_GUARD);
        if self.cost == TerminalCost::StageWeights || (v_x - self.v_x).abs() <= SAME_SPEED * self.v_x {
            return;
        }
        let straight = Path { kappa: [0.0; 2], mu: 1.0, wanted: v_x, v_x, disturbance: Disturbance::zeros() };
        let around = Surroundings { body, nominal: *tyres, hold };
        let mut x = State::zeros();
        x[V_X] = v_x;
        let mut end = Stage::<N_X, NU>::default();
        linearise(&Point::new(x, Input::zeros()), &straight, tyres, &around, Linear::from(&mut end));
        // Without a solution the weight of before stays; its speed was not far.
        if let Some(weight) = riccati(&end.A, &end.B, &problem.q, &problem.r) {
            problem.q_terminal = weight * self.factor;
            self.v_x = v_x;
        }
    }
}

/// Weight on the last state for `x+ = A x + B u` with the stage cost `x' diag(q) x + du' diag(r) du` without end.
///
/// The cost depends on the last command too; it is taken as the best one, which makes the weight a lower bound. Nothing if the
/// equation has no solution, as for a car that no steering moves.
fn riccati<const N_X: usize>(
    A: &SMatrix<f64, N_X, N_X>,
    B: &SMatrix<f64, N_X, NU>,
    q: &SVector<f64, N_X>,
    r: &SVector<f64, NU>,
) -> Option<SMatrix<f64, N_X, N_X>> {
    // Unused places between states and command stay zero.
    const U: usize = NZ - NU;
    let (mut F, mut G, mut H) = (Square::zeros(), Square::zeros(), Square::zeros());
    F.fixed_view_mut::<N_X, N_X>(0, 0).copy_from(A);
    F.fixed_view_mut::<N_X, NU>(0, U).copy_from(B);
    let mut input = SMatrix::<f64, NZ, NU>::zeros();
    input.fixed_view_mut::<N_X, NU>(0, 0).copy_from(B);
    for j in 0..NU {
        F[(U + j, U + j)] = 1.0;
        input[(U + j, j)] = 1.0;
    }
    G += input * SMatrix::<f64, NU, NU>::from_diagonal(&r.map(f64::recip)) * input.transpose();
    for i in 0..N_X {
        H[(i, i)] = q[i];
    }
    let P = double(F, G, H)?;
    let to_states = P.fixed_view::<NU, N_X>(U, 0).into_owned();
    let command = P.fixed_view::<NU, NU>(U, U).into_owned();
    let reduced = P.fixed_view::<N_X, N_X>(0, 0) - to_states.transpose() * command.try_inverse()? * to_states;
    let weight = (reduced + reduced.transpose()) * 0.5;
    (weight.iter().all(|w| w.is_finite()) && (0..N_X).all(|i| weight[(i, i)] >= 0.0)).then_some(weight)
}

/// Structure-preserving doubling, [Chu]: each pass doubles the number of samples that the cost `H` looks ahead.
fn double(mut F: Square, mut G: Square, mut H: Square) -> Option<Square> {
    for _ in 0..DOUBLINGS {
        let W = (Square::identity() + G * H).try_inverse()?;
        let FW = F * W;
        let change = F.transpose() * H * W * F;
        let G_next = G + FW * G * F.transpose();
        F = FW * F;
        G = (G_next + G_next.transpose()) * 0.5;
        let H_next = H + change;
        let settled = change.norm() <= CONVERGED * H_next.norm();
        H = (H_next + H_next.transpose()) * 0.5;
        if !H.norm().is_finite() {
            return None;
        }
        if settled {
            return Some(H);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parameters;
    use crate::discretise::{Hold, discretise};
    use crate::model::{Disturbance, Input, State, embed};

    fn model(v_x: f64) -> (SMatrix<f64, 5, 5>, SMatrix<f64, 5, 2>) {
        let p = Parameters::default();
        let x = State::from([v_x, 0.0, 0.0, 0.0, 0.0]);
        let lpv = embed(&x, &Input::zeros(), 0.0, &p.body(), &p.nominal_tyres(), &Disturbance::zeros());
        let sample = discretise(&lpv, &Hold::new(p.t_s, [0.0, 0.0]));
        (sample.Phi, sample.Gamma)
    }

    /// The cost to go by stepping back from the end, sample by sample, with states and command as one vector.
    fn stepped(
        A: &SMatrix<f64, 5, 5>,
        B: &SMatrix<f64, 5, 2>,
        q: &SVector<f64, 5>,
        r: &SVector<f64, 2>,
    ) -> SMatrix<f64, 5, 5> {
        let (mut F, mut D) = (SMatrix::<f64, 7, 7>::identity(), SMatrix::<f64, 7, 2>::zeros());
        F.fixed_view_mut::<5, 5>(0, 0).copy_from(A);
        F.fixed_view_mut::<5, 2>(0, 5).copy_from(B);
        D.fixed_view_mut::<5, 2>(0, 0).copy_from(B);
        D.fixed_view_mut::<2, 2>(5, 0).copy_from(&SMatrix::identity());
        let Q = SMatrix::<f64, 7, 7>::from_diagonal(&SVector::from_fn(|i, _| if i < 5 { q[i] } else { 0.0 }));
        let mut P = Q;
        for _ in 0..20_000 {
            let gain =
                (SMatrix::from_diagonal(r) + D.transpose() * P * D).try_inverse().unwrap() * D.transpose() * P * F;
            P = Q + F.transpose() * P * (F - D * gain);
        }
        let corner = P.fixed_view::<2, 5>(5, 0);
        P.fixed_view::<5, 5>(0, 0) - corner.transpose() * P.fixed_view::<2, 2>(5, 5).try_inverse().unwrap() * corner
    }

    #[test]
    fn doubling_and_stepping_back_agree() {
        let p = Parameters::default();
        let q = SVector::from([p.q_v_x, p.q_v_y, p.q_yaw_rate, p.q_e_y, p.q_e_psi]);
        let r = SVector::from([p.r_delta, p.r_a_x]);
        for v_x in [3.0, 10.0, 25.0, 40.0] {
            let (A, B) = model(v_x);
            let (got, want) = (riccati(&A, &B, &q, &r).unwrap(), stepped(&A, &B, &q, &r));
            // Rounding of 20,000 steps over weights of ten decades.
            assert!((got - want).norm() < 1e-6 * want.norm(), "{v_x} m/s: {got} {want}");
            assert!((0..5).all(|i| got[(i, i)] >= q[i] * (1.0 - 1e-9)), "it includes the last stage's own cost");
        }
    }

    #[test]
    fn a_car_that_nothing_steers_has_no_finite_cost() {
        let p = Parameters::default();
        let q = SVector::from([p.q_v_x, p.q_v_y, p.q_yaw_rate, p.q_e_y, p.q_e_psi]);
        let (A, mut B) = model(10.0);
        B.fixed_columns_mut::<1>(0).fill(0.0);
        assert_eq!(riccati(&A, &B, &q, &SVector::from([p.r_delta, p.r_a_x])), None);
    }
}

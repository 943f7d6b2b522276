//! Cost of what comes after the horizon.
//!
//! [Kebbati] repeats the weights of the stages at the last one, so a short horizon ends in states that are expensive to leave.
//! The alternative here is the cost of driving on without end by the best linear feedback, from the discrete algebraic Riccati
//! equation of the prediction model on a straight at the speed that the plan ends with.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::guide::Path;
use crate::hold::Hold;
use crate::horizon::{Linear, Surroundings, linearise};
use crate::lanes::{Work, widest};
use crate::model::{
    A_X, Body, DELTA, Disturbance, E_PSI, E_Y, Input, NU, NX, Point, State, Tyres, V_GUARD, V_X, V_Y, YAW_RATE,
};
use crate::modes::TerminalCost;
use crate::parameters::Parameters;
use crate::qp::{Problem, Stage};

/// A matrix over states and a command.
type Square<const NZ: usize> = SMatrix<f64, NZ, NZ>;

/// Doublings at most [1]: 2^30 samples are a year.
const DOUBLINGS: usize = 30;

/// Relative change that is the last [1]: the doubling converges quadratically, so what is left is its square, 1e-12. Along
/// `cargo fmu simulate --road general --step 0.033 --set controller.terminal_cost=riccati` the commands are within 3e-11 rad or
/// m/s2 of those with 1e-14, and likewise with 1e-4 to 1e-7; with 1e-2 they are 2e-8 off.
const CONVERGED: f64 = 1e-6;

/// Relative change up to which the weight of the last state stays [1]: of the speed, by which the lateral modes change by about
/// as much, and of the weight on the steering increments, by which the cost to go changes by no more, for it is the least of sums
/// in which that weight stands once. At a steady speed no sample needs a new weight; under full braking from 14 m/s, 0.26 m/s a
/// sample, nearly every one does.
const SAME: f64 = 0.02;

/// How the last state is weighed.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Terminal {
    cost: TerminalCost,
    factor: f64,
    /// Speed that the weight in force was made for [m/s]; 0 if none was.
    v_x: f64,
    /// Weight of the steering increments that it was made with [1/rad2]; it changes with the caution.
    r_delta: f64,
}

impl Terminal {
    /// Of these parameters, to be weighed.
    pub fn new(p: &Parameters) -> Self {
        Self { cost: p.terminal_cost, factor: p.terminal_factor, v_x: 0.0, r_delta: 0.0 }
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
        let (v_x, r_delta) = (v_x.max(V_GUARD), problem.r[DELTA]);
        let is_same = |now: f64, made_for: f64| (now - made_for).abs() <= SAME * made_for;
        if self.cost == TerminalCost::StageWeights || (is_same(v_x, self.v_x) && is_same(r_delta, self.r_delta)) {
            return;
        }
        let straight =
            Path { kappa: [0.0; 2], mu: 1.0, wanted: v_x, permitted: v_x, v_x, disturbance: Disturbance::zeros() };
        let around = Surroundings { nominal: *tyres, hold };
        let mut x = State::zeros();
        x[V_X] = v_x;
        let mut end = Stage::<N_X, NU>::default();
        linearise(&Point::new(x, Input::zeros(), body), &straight, tyres, &around, Linear::from(&mut end));
        // Without a solution the weight of before stays; what it was made for was not far.
        let equation = Equation { A: &end.A, B: &end.B, q: &problem.q, r: &problem.r };
        if let Some(weight) = equation.solution() {
            problem.q_terminal = weight * self.factor;
            (self.v_x, self.r_delta) = (v_x, r_delta);
        }
    }
}

/// The discrete algebraic Riccati equation of `x+ = A x + B u` with the stage cost `x' diag(q) x + du' diag(r) du`.
struct Equation<'a, const N_X: usize> {
    A: &'a SMatrix<f64, N_X, N_X>,
    B: &'a SMatrix<f64, N_X, NU>,
    q: &'a SVector<f64, N_X>,
    r: &'a SVector<f64, NU>,
}

impl<const N_X: usize> Equation<'_, N_X> {
    /// Weight on the last state of a horizon, behind which the cost goes on without end.
    ///
    /// On a straight steering and speed have nothing to do with each other, and two small equations take a third of the time
    /// of one. Nothing if there is no solution, as for a car that no steering moves.
    fn solution(&self) -> Option<SMatrix<f64, N_X, N_X>> {
        let mut weight = SMatrix::zeros();
        if N_X == NX {
            self.solve::<4, 5>([V_Y, YAW_RATE, E_Y, E_PSI], DELTA, &mut weight)?;
            self.solve::<1, 2>([V_X], A_X, &mut weight)?;
        } else {
            self.solve::<5, 6>([V_Y, YAW_RATE, E_Y, E_PSI, NX + DELTA], DELTA, &mut weight)?;
            self.solve::<2, 3>([V_X, NX + A_X], A_X, &mut weight)?;
        }
        Some(weight)
    }

    /// The part of some states that one command moves and no other state; `NZ` is `M + 1`.
    ///
    /// The cost depends on the last command too; it is taken as the best one, which makes the weight a lower bound.
    fn solve<const M: usize, const NZ: usize>(
        &self,
        states: [usize; M],
        command: usize,
        weight: &mut SMatrix<f64, N_X, N_X>,
    ) -> Option<()> {
        let Self { A, B, q, r } = self;
        // The states and the command that acts: the increments of the command are what the cost counts.
        let (mut F, mut H, mut input) = (Square::<NZ>::zeros(), Square::zeros(), SVector::<f64, NZ>::zeros());
        for (i, &row) in states.iter().enumerate() {
            for (j, &column) in states.iter().enumerate() {
                F[(i, j)] = A[(row, column)];
            }
            (F[(i, M)], input[i], H[(i, i)]) = (B[(row, command)], B[(row, command)], q[row]);
        }
        (F[(M, M)], input[M]) = (1.0, 1.0);
        let G = input * input.transpose() / r[command];
        let P = widest(Doubling { F, G, H })?;
        for (i, &row) in states.iter().enumerate() {
            for (j, &column) in states.iter().enumerate() {
                weight[(row, column)] = P[(i, j)] - P[(i, M)] * P[(M, j)] / P[(M, M)];
            }
        }
        let is_weight = |i: &usize| weight[(*i, *i)] >= 0.0 && weight.row(*i).iter().all(|w| w.is_finite());
        states.iter().all(is_weight).then_some(())
    }
}

/// Structure-preserving doubling, [Chu]: each pass doubles the number of samples that the cost `H` looks ahead.
struct Doubling<const NZ: usize> {
    F: Square<NZ>,
    G: Square<NZ>,
    H: Square<NZ>,
}

impl<const NZ: usize> Work for Doubling<NZ> {
    type Output = Option<Square<NZ>>;

    #[inline(always)]
    fn run(self) -> Option<Square<NZ>> {
        let Self { mut F, mut G, mut H } = self;
        for _ in 0..DOUBLINGS {
            let W = (Square::identity() + G * H).try_inverse()?;
            let WF = W * F;
            let change = F.transpose() * (H * WF);
            let G_next = G + F * (W * G) * F.transpose();
            F *= WF;
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parameters;
    use crate::discretise::discretise;
    use crate::hold::Hold;
    use crate::model::{Disturbance, Input, Point, State};

    fn model(v_x: f64) -> (SMatrix<f64, 5, 5>, SMatrix<f64, 5, 2>) {
        let p = Parameters::default();
        let x = State::from([v_x, 0.0, 0.0, 0.0, 0.0]);
        let lpv = Point::new(x, Input::zeros(), &p.body()).embed(0.0, &p.nominal_tyres(), &Disturbance::zeros());
        let sample = discretise(&lpv, &Hold::new(p.t_s, [0.0, 0.0]));
        (sample.Phi, sample.Gamma)
    }

    fn weight(
        A: &SMatrix<f64, 5, 5>,
        B: &SMatrix<f64, 5, 2>,
        q: &SVector<f64, 5>,
        r: &SVector<f64, 2>,
    ) -> Option<SMatrix<f64, 5, 5>> {
        Equation { A, B, q, r }.solution()
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
            let (got, want) = (weight(&A, &B, &q, &r).unwrap(), stepped(&A, &B, &q, &r));
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
        assert_eq!(weight(&A, &B, &q, &SVector::from([p.r_delta, p.r_a_x])), None);
    }

    /// The problem of a sample whose steering increments weigh `caution` [1] times as much as given.
    fn cautious(p: &Parameters, caution: f64) -> Problem<5, 2> {
        let mut problem = Problem::new(p.horizon);
        problem.q = SVector::from([p.q_v_x, p.q_v_y, p.q_yaw_rate, p.q_e_y, p.q_e_psi]);
        problem.r = SVector::from([p.r_delta * caution, p.r_a_x]);
        problem
    }

    #[test]
    fn the_weight_is_that_of_the_present_caution_whatever_came_before() {
        let p = Parameters { terminal_cost: TerminalCost::Riccati, ..Parameters::default() };
        let (hold, body, tyres) = (Hold::new(p.t_s, [0.0, 0.0]), p.body(), p.nominal_tyres());
        let mut driven = Terminal::new(&p);
        let mut problem = cautious(&p, 1.0);
        // The car brakes from 25 m/s, its latency changes, and all plans end with 10 m/s.
        for caution in [23.0, 9.0, 1.0, 1.5, 1.0] {
            problem.r[DELTA] = p.r_delta * caution;
            driven.weigh(&mut problem, 10.0, &tyres, &hold, &body);
            let mut fresh = cautious(&p, caution);
            Terminal::new(&p).weigh(&mut fresh, 10.0, &tyres, &hold, &body);
            assert_eq!(problem.q_terminal, fresh.q_terminal, "caution {caution}");
        }
    }

    #[test]
    fn small_changes_need_no_new_weight() {
        let p = Parameters { terminal_cost: TerminalCost::Riccati, ..Parameters::default() };
        let (hold, body, tyres) = (Hold::new(p.t_s, [0.0, 0.0]), p.body(), p.nominal_tyres());
        let mut terminal = Terminal::new(&p);
        let mut problem = cautious(&p, 2.0);
        terminal.weigh(&mut problem, 10.0, &tyres, &hold, &body);
        let made = problem.q_terminal;
        problem.r[DELTA] *= 1.01;
        terminal.weigh(&mut problem, 10.1, &tyres, &hold, &body);
        assert_eq!(problem.q_terminal, made);
    }
}

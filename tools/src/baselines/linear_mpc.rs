//! Steering by MPC on the linear bicycle: the model of [Rajamani, section 2.5], discretised exactly.

use lpv_mpc::model::V_GUARD;
use lpv_mpc::qp::{Problem, Solution, Stage, Structured};
use lpv_mpc::{Inputs, Parameters};
use nalgebra::{SMatrix, SVector};

use super::Law;

/// States: lateral velocity, yaw rate, lateral error, heading error.
const NX: usize = 4;
/// State, steering and the path's own yaw rate together, for one matrix exponential.
const NZ: usize = NX + 2;
const E_Y: usize = 2;

/// Speed at which the bicycle is linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Linearisation {
    /// Always the same [m/s].
    Fixed(f64),
    /// As measured, held over the horizon.
    Measured,
}

/// The predictive controller of the steering alone.
#[derive(Clone, Debug)]
pub struct LinearMpc {
    parameters: Parameters,
    linearisation: Linearisation,
    problem: Problem<NX, 1>,
    solution: Solution<NX, 1>,
    solver: Structured<NX, 1>,
}

/// State transition, response to the steering angle and to the yaw rate of the path.
struct Discrete {
    phi: SMatrix<f64, NX, NX>,
    gamma: SVector<f64, NX>,
    bend: SVector<f64, NX>,
}

impl LinearMpc {
    /// A controller with the horizon, the weights and the bounds of the adaptive one.
    pub fn new(p: &Parameters, linearisation: Linearisation) -> Self {
        let mut problem = Problem::new(p.horizon);
        problem.q = SVector::from([p.q_v_y, p.q_yaw_rate, p.q_e_y, p.q_e_psi]);
        problem.q_terminal = SMatrix::from_diagonal(&(problem.q * p.terminal_factor));
        problem.r = SVector::from([p.r_delta]);
        problem.u_min = SVector::from([-p.delta_max]);
        problem.u_max = SVector::from([p.delta_max]);
        problem.du_max = SVector::from([p.delta_rate_max * p.t_s]);
        problem.soft_state = E_Y;
        problem.soft_bound = p.e_y_max;
        problem.soft = p.e_y_penalty;
        Self {
            parameters: p.clone(),
            linearisation,
            problem,
            solution: Solution::new(p.horizon),
            solver: Structured::new(p.horizon),
        }
    }

    /// The bicycle at speed `v` [m/s] over `step` [s].
    fn discretise(&self, v: f64, step: f64) -> Discrete {
        let Parameters { m, i_z, l_f, l_r, c_f_nominal: c_f, c_r_nominal: c_r, .. } = self.parameters;
        let mut rate = SMatrix::<f64, NZ, NZ>::zeros();
        rate.fixed_view_mut::<NX, NZ>(0, 0).copy_from(&SMatrix::<f64, NX, NZ>::from_row_slice(&[
            -(c_f + c_r) / (m * v),
            -(c_f * l_f - c_r * l_r) / (m * v) - v,
            0.0,
            0.0,
            c_f / m,
            0.0,
            -(c_f * l_f - c_r * l_r) / (i_z * v),
            -(c_f * l_f * l_f + c_r * l_r * l_r) / (i_z * v),
            0.0,
            0.0,
            c_f * l_f / i_z,
            0.0,
            1.0,
            0.0,
            0.0,
            v,
            0.0,
            0.0,
            0.0,
            1.0,
            0.0,
            0.0,
            0.0,
            -1.0,
        ]));
        let whole = (rate * step).exp();
        Discrete {
            phi: whole.fixed_view::<NX, NX>(0, 0).into_owned(),
            gamma: whole.fixed_view::<NX, 1>(0, NX).into_owned(),
            bend: whole.fixed_view::<NX, 1>(0, NX + 1).into_owned(),
        }
    }

    /// Steady cornering at speed `v` [m/s] with the path's yaw rate [rad/s], on the path.
    fn steady(&self, v: f64, yaw_rate: f64) -> SVector<f64, NX> {
        let Parameters { m, l_f, l_r, c_r_nominal, .. } = self.parameters;
        let v_y = yaw_rate * (l_r - m * l_f * v * v / (c_r_nominal * (l_f + l_r)));
        SVector::from([v_y, yaw_rate, 0.0, -v_y / v])
    }
}

impl Law for LinearMpc {
    fn steer(&mut self, seen: &Inputs, latency: f64, delta: f64) -> f64 {
        let v = match self.linearisation {
            Linearisation::Fixed(v) => v,
            Linearisation::Measured => seen.v_x.max(V_GUARD),
        };
        let Discrete { phi, gamma, bend } = self.discretise(v, latency);
        let measured = SVector::from([seen.v_y, seen.yaw_rate, seen.e_y, seen.e_psi]);
        self.problem.x_0 = phi * measured + gamma * delta + bend * path_yaw_rate(seen, 0.0);
        self.problem.u_prev = SVector::from([delta]);

        let t_s = self.parameters.t_s;
        let Discrete { phi, gamma, bend } = self.discretise(v, t_s);
        let turn = |i: usize| path_yaw_rate(seen, latency / t_s + i as f64);
        for i in 0..self.problem.stages.len() {
            let (before, after) = (turn(i), turn(i + 1));
            self.problem.stages[i] = Stage {
                A: phi,
                B: gamma,
                d: bend * (0.5 * (before + after)),
                x_ref: self.steady(v, after),
                ..Stage::default()
            };
        }
        self.solver.shift();
        self.solver.solve(&self.problem, &mut self.solution);
        // Without a plan the wheels stay where they are.
        if self.solution.outcome.has_plan() { self.solution.u[0][0] } else { delta }
    }
}

/// How fast the path turns `periods` after now, at the wanted speed [rad/s]: linear between what is given, held beyond it.
///
/// Also at a fixed speed the model is told this true rate; the curvature times the fixed speed would be off by as much as the
/// speed is, and the general track's hairpin would not be survived.
fn path_yaw_rate(seen: &Inputs, periods: f64) -> f64 {
    let last = seen.kappa_ref.len() - 1;
    let position = periods.clamp(0.0, last as f64);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the preview above")]
    let index = position as usize;
    let at = |i: usize| seen.kappa_ref[i] * seen.v_x_ref[i];
    let (before, after) = (at(index), at((index + 1).min(last)));
    before + (position - index as f64) * (after - before)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lpv_mpc::model::{Disturbance, Input, State, derivative};

    #[test]
    fn the_linear_bicycle_is_the_slope_of_the_nonlinear_one() {
        let p = Parameters::default();
        let law = LinearMpc::new(&p, Linearisation::Measured);
        let (v, step) = (15.0, 1e-4);
        let Discrete { phi, gamma, .. } = law.discretise(v, step);
        let rate = |x: State, delta: f64| {
            derivative(&x, &Input::from([delta, 0.0]), 0.0, &p.body(), &p.nominal_tyres(), &Disturbance::zeros())
        };
        let straight = State::from([v, 0.0, 0.0, 0.0, 0.0]);
        let small = 1e-6;
        for j in 0..NX {
            let mut moved = straight;
            moved[j + 1] = small;
            let slope = (rate(moved, 0.0) - rate(straight, 0.0)) / small;
            for i in 0..NX {
                let got = (phi[(i, j)] - f64::from(u8::from(i == j))) / step;
                // One step of 0.1 ms: its second order is 1e-4 of the fastest rate, 20/s, times the largest entry.
                assert!(
                    (got - slope[i + 1]).abs() < 0.02 * (1.0 + slope[i + 1].abs()),
                    "A {i} {j}: {got} {}",
                    slope[i + 1]
                );
            }
        }
        let slope = rate(straight, small) / small;
        for i in 0..2 {
            assert!((gamma[i] / step / slope[i + 1] - 1.0).abs() < 5e-3, "B {i}");
        }
    }

    #[test]
    fn on_the_path_it_steers_as_steady_cornering_asks() {
        let p = Parameters::default();
        let mut law = LinearMpc::new(&p, Linearisation::Measured);
        let (v, kappa) = (12.0, 2e-3);
        let steady = law.steady(v, v * kappa);
        let mut seen = Inputs { v_x: v, v_y: steady[0], yaw_rate: steady[1], e_psi: steady[3], ..Inputs::default() };
        seen.kappa_ref.fill(kappa);
        seen.v_x_ref.fill(v);
        let l = p.l_f + p.l_r;
        let want = kappa * (l + p.m * (p.l_r / p.c_f_nominal - p.l_f / p.c_r_nominal) / l * v * v);
        let got = law.steer(&seen, 0.001, want);
        assert!((got / want - 1.0).abs() < 1e-6, "{got} rad for {want} rad");
    }
}

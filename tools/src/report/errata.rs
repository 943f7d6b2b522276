//! The paper's prediction model with its misprints, each of which can be left in by itself.

use anyhow::Result;
use lpv_mpc::model::{A_X, DELTA, E_PSI, E_Y, NU, NX, V_X, V_Y, YAW_RATE};
use lpv_mpc::qp::{Problem, Solution, Stage, Structured};
use lpv_mpc::{Inputs, Parameters, Status};
use nalgebra::{SMatrix, SVector};
use vehicle::{Road, Vehicle};

use super::runs::{ROAD, STEP};
use crate::recording::Recording;
use crate::simulate::native::{Driver, Shown, drive};

/// State, input and affine term together, for one matrix exponential.
const NZ: usize = NX + NU;

/// Which misprints are left in; the numbers are those of the page's table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Printed {
    /// 3: `A32` with `+ C_r l_r`.
    pub yaw: bool,
    /// 4: `A52` with the cosine.
    pub path: bool,
    /// 5: `B21`, `B31` negative.
    pub inputs: bool,
    /// 6: `A41 = sin` and `A45 = 0`.
    pub lateral: bool,
    /// 8: `x + A x + B u dt`.
    pub step: bool,
    /// 9: terminal cost `x' Q x`.
    pub terminal: bool,
    /// 10: resistance `mu m g`.
    pub drag: bool,
}

impl Printed {
    /// Everything as printed.
    pub const ALL: Self =
        Self { yaw: true, path: true, inputs: true, lateral: true, step: true, terminal: true, drag: true };

    /// What the page shows: the corrected form, the printed one, and each misprint alone, with its row of the errata.
    pub const CASES: [(&'static str, Self); 9] = [
        ("corrected", Self::NONE),
        ("as printed", Self::ALL),
        ("3: A32 with + C_r l_r", Self { yaw: true, ..Self::NONE }),
        ("4: A52 with the cosine", Self { path: true, ..Self::NONE }),
        ("5: B21, B31 negative", Self { inputs: true, ..Self::NONE }),
        ("6: A41 = sin, A45 = 0", Self { lateral: true, ..Self::NONE }),
        ("8: x + A x + B u dt", Self { step: true, ..Self::NONE }),
        ("9: terminal cost x'Qx", Self { terminal: true, ..Self::NONE }),
        ("10: drag mu m g", Self { drag: true, ..Self::NONE }),
    ];

    const NONE: Self =
        Self { yaw: false, path: false, inputs: false, lateral: false, step: false, terminal: false, drag: false };
}

/// The paper's controller: its weights, horizon and period, the scheduling vector as measured, no latency foreseen.
struct PaperMpc {
    printed: Printed,
    p: Parameters,
    /// Friction of tyre and road, which the printed drag takes [1].
    mu: f64,
    problem: Problem<NX, NU>,
    solution: Solution<NX, NU>,
    solver: Structured<NX, NU>,
    samples: u64,
    u: SVector<f64, NU>,
}

impl PaperMpc {
    fn new(printed: Printed, mu: f64) -> Self {
        let p = Parameters::paper();
        let mut problem = Problem::new(p.horizon);
        problem.q = SVector::from([p.q_v_x, p.q_v_y, p.q_yaw_rate, p.q_e_y, p.q_e_psi]);
        problem.q_terminal = SMatrix::from_diagonal(&problem.q);
        problem.r = SVector::from([p.r_delta, p.r_a_x]);
        problem.u_min = SVector::from([-p.delta_max, p.a_x_min]);
        problem.u_max = SVector::from([p.delta_max, p.a_x_max]);
        // The paper's own bound on the increments, for both inputs.
        problem.du_max = SVector::repeat(std::f64::consts::PI / 12.0);
        problem.soft_state = E_Y;
        problem.soft_bound = p.e_y_max;
        problem.soft = p.e_y_penalty;
        let (solution, solver) = (Solution::new(p.horizon), Structured::new(p.horizon));
        Self { printed, p, mu, problem, solution, solver, samples: 0, u: SVector::zeros() }
    }

    /// [Kebbati, eqs. (6) to (8)], printed or corrected, over one period.
    fn stage(&self, x: &SVector<f64, NX>, delta: f64, kappa: f64) -> (SMatrix<f64, NX, NX>, SMatrix<f64, NX, NU>) {
        let Printed { yaw, path, inputs, lateral, step, drag, .. } = self.printed;
        let Parameters { m, i_z, l_f, l_r, c_d, area, rho, c_rr, g, c_f_nominal: c_f, c_r_nominal: c_r, t_s, .. } =
            self.p;
        let [v_x, v_y, _, e_y, e_psi] = (*x).into();
        let v = v_x.max(1.0);
        let (s, c) = delta.sin_cos();
        let bend = kappa / (1.0 - e_y * kappa);
        let sign = if inputs { -1.0 } else { 1.0 };
        let mut rate = SMatrix::<f64, NZ, NZ>::zeros();
        rate[(V_X, V_X)] = -(if drag { self.mu } else { c_rr }) * g / v - rho * c_d * area * v / (2.0 * m);
        rate[(V_X, V_Y)] = c_f * s / (m * v);
        rate[(V_X, YAW_RATE)] = c_f * l_f * s / (m * v) + v_y;
        rate[(V_Y, V_Y)] = -(c_r + c_f * c) / (m * v);
        rate[(V_Y, YAW_RATE)] = -(c_f * l_f * c - c_r * l_r) / (m * v) - v;
        rate[(YAW_RATE, V_Y)] = -(c_f * l_f * c + if yaw { c_r * l_r } else { -c_r * l_r }) / (i_z * v);
        rate[(YAW_RATE, YAW_RATE)] = -(c_f * l_f * l_f * c + c_r * l_r * l_r) / (i_z * v);
        rate[(E_Y, V_Y)] = e_psi.cos();
        if lateral {
            rate[(E_Y, V_X)] = e_psi.sin();
        } else {
            rate[(E_Y, E_PSI)] = if e_psi == 0.0 { v } else { v * e_psi.sin() / e_psi };
        }
        rate[(E_PSI, V_X)] = -bend * e_psi.cos();
        rate[(E_PSI, V_Y)] = bend * if path { e_psi.cos() } else { e_psi.sin() };
        rate[(E_PSI, YAW_RATE)] = 1.0;
        rate[(V_X, NX + DELTA)] = -c_f * s / m;
        rate[(V_X, NX + A_X)] = 1.0;
        rate[(V_Y, NX + DELTA)] = sign * c_f * c / m;
        rate[(YAW_RATE, NX + DELTA)] = sign * c_f * l_f * c / i_z;
        let whole = if step {
            // The printed rule has no step on `A x`.
            let mut literal = rate;
            literal.fixed_columns_mut::<NU>(NX).scale_mut(t_s);
            literal + SMatrix::identity()
        } else {
            (rate * t_s).exp()
        };
        (whole.fixed_view::<NX, NX>(0, 0).into_owned(), whole.fixed_view::<NX, NU>(0, NX).into_owned())
    }

    fn sample(&mut self, seen: &Inputs) {
        let x = seen.state();
        self.problem.x_0 = x;
        self.problem.u_prev = self.u;
        let last = self.problem.stages.len() - 1;
        for i in 0..=last {
            let kappa = 0.5 * (seen.kappa_ref[i] + seen.kappa_ref[i + 1]);
            let (transition, response) = self.stage(&x, self.u[DELTA], kappa);
            let mut x_ref = SVector::zeros();
            if !(self.printed.terminal && i == last) {
                x_ref[V_X] = seen.v_x_ref[i + 1];
            }
            self.problem.stages[i] = Stage { A: transition, B: response, x_ref, ..Stage::default() };
        }
        self.solver.shift();
        self.solver.solve(&self.problem, &mut self.solution);
        if self.solution.outcome.has_plan() {
            self.u = self.solution.u[0];
        }
    }
}

impl Driver for PaperMpc {
    fn advance(&mut self, t: f64, h: f64, seen: &Inputs) -> Result<()> {
        while self.samples as f64 * self.p.t_s < t + h * (1.0 - 1e-6) {
            self.samples += 1;
            self.sample(seen);
        }
        Ok(())
    }

    fn shown(&self) -> Shown {
        Shown {
            delta: self.u[DELTA],
            a_x: self.u[A_X],
            c_f: self.p.c_f_nominal,
            c_r: self.p.c_r_nominal,
            status: Status::Optimal,
            iterations: self.solution.iterations,
            kkt_residual: 0.0,
            slack_e_y: 0.0,
        }
    }
}

/// What a form of the model does in the loop.
pub struct Shot {
    /// What it is.
    pub name: &'static str,
    /// The lane change as far as it was driven.
    pub recording: Recording,
    /// When the car left the road [s].
    pub left: Option<f64>,
}

/// Drives the lane change with each form of the model.
pub fn shots() -> Result<Vec<Shot>> {
    Printed::CASES
        .into_iter()
        .map(|(name, printed)| {
            let parameters = vehicle::Parameters::default();
            let road = Road::named("double_lane_change", &parameters)?;
            let end = road.duration();
            let mut plant = Vehicle::new(parameters.clone(), road)?;
            let mut driver = PaperMpc::new(printed, parameters.mu);
            let (recording, left) = until_gone(drive(&mut plant, &mut driver, STEP, Some(end), |_| {})?);
            Ok(Shot { name, recording, left })
        })
        .collect()
}

/// A run up to where the car left the road, and when that was [s]: beyond there is nothing to see.
pub fn until_gone(mut recording: Recording) -> (Recording, Option<f64>) {
    let gone = recording.column("e_y_true").iter().position(|e_y| e_y.is_nan() || e_y.abs() > ROAD);
    let left = gone.and_then(|row| recording.column("t").get(row).copied());
    recording.rows.truncate(gone.map_or(recording.rows.len(), |row| row + 1));
    (recording, left)
}

/// A controller that is told that its command acts at once, whatever the step: nothing is compensated.
pub struct Unaware<D>(pub D);

impl<D: Driver> Driver for Unaware<D> {
    fn advance(&mut self, t: f64, _h: f64, seen: &Inputs) -> Result<()> {
        // Longer than the rounding of times, shorter than anything that matters to a car.
        self.0.advance(t, 1e-5, seen)
    }

    fn shown(&self) -> Shown {
        self.0.shown()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_model_leaves_the_road_and_the_corrected_one_does_not() {
        let shots = shots().unwrap();
        let of = |name: &str| shots.iter().find(|shot| shot.name == name).unwrap();
        // On the first 105 m of 200, which begin with a straight of 40 m.
        assert!(of("as printed").left.unwrap() < 7.5);
        assert_eq!(of("corrected").left, None);
        let e_y = of("corrected").recording.column("e_y_true").iter().fold(0.0_f64, |max, e| max.max(e.abs()));
        assert!(e_y < 0.023, "worse than the paper's 2.3 cm: {e_y} m");
    }

    #[test]
    fn the_corrected_matrices_are_those_of_the_controller() {
        use lpv_mpc::model::{Disturbance, Input, Point};
        let mpc = PaperMpc::new(Printed::default(), 0.82);
        // Sideslip so small that the paper's small-angle form is the controller's exact one.
        let x = SVector::from([14.0, 1e-4, 1e-4, 0.02, 0.01]);
        let (delta, kappa) = (0.05, 0.02);
        let (body, tyres) = (mpc.p.body(), mpc.p.nominal_tyres());
        let lpv = Point::new(x, Input::from([delta, 0.0]), &body).embed(kappa, &tyres, &Disturbance::zeros());
        let mut whole = SMatrix::<f64, NZ, NZ>::zeros();
        whole.fixed_view_mut::<NX, NX>(0, 0).copy_from(&lpv.A);
        whole.fixed_view_mut::<NX, NU>(0, NX).copy_from(&lpv.B);
        let want = (whole * mpc.p.t_s).exp();
        let (transition, response) = mpc.stage(&x, delta, kappa);
        assert!((transition - want.fixed_view::<NX, NX>(0, 0)).amax() < 1e-6);
        assert!((response - want.fixed_view::<NX, NU>(0, NX)).amax() < 1e-6);
    }
}

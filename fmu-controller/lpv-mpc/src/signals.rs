//! What the controller is given and what it answers, named as in the public interface.

use nalgebra::SVector;
use num_dual::Dual64;
use serde::{Deserialize, Serialize};

use crate::ahead::{FRICTION_MIN, Road, Row};
use crate::ladder::Status;
use crate::model::{A_X, DELTA, E_PSI, E_Y, Input, State, Tyres, V_X, V_Y, YAW_RATE};
use crate::parameters::{HORIZON_MAX, Parameters};
use crate::preview::{PREVIEW, Preview};

/// A predicted quantity over the horizon; beyond it the last value is repeated.
pub type Trajectory = SVector<f64, HORIZON_MAX>;

/// What is measured, and what is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inputs {
    /// Longitudinal velocity, body frame [m/s].
    pub v_x: f64,
    /// Lateral velocity, body frame [m/s].
    pub v_y: f64,
    /// Yaw rate, positive to the left [rad/s].
    pub yaw_rate: f64,
    /// Lateral position relative to the path, positive to the left [m].
    pub e_y: f64,
    /// Vehicle heading minus path heading [rad].
    pub e_psi: f64,
    /// Curvature of the path now and at the next 40 sample times [1/m].
    pub kappa_ref: Preview,
    /// Wanted speed now and at the next 40 sample times [m/s].
    pub v_x_ref: Preview,
    /// Friction of the road now and where the reference will be at the next 40 sample times; 0 where it is not known, then the
    /// parameter `mu` holds [1].
    pub mu_ref: Preview,
    /// Whether only the first element of each preview is given and holds for the others.
    pub hold_preview: bool,
}

impl Default for Inputs {
    fn default() -> Self {
        Self {
            v_x: 0.0,
            v_y: 0.0,
            yaw_rate: 0.0,
            e_y: 0.0,
            e_psi: 0.0,
            kappa_ref: Preview::zeros(),
            v_x_ref: Preview::zeros(),
            mu_ref: Preview::zeros(),
            hold_preview: false,
        }
    }
}

impl Inputs {
    /// These inputs after `duration` [s] of change at `rates` (each per second).
    #[must_use]
    pub fn moved(&self, rates: &Self, duration: f64) -> Self {
        Self {
            v_x: self.v_x + duration * rates.v_x,
            v_y: self.v_y + duration * rates.v_y,
            yaw_rate: self.yaw_rate + duration * rates.yaw_rate,
            e_y: self.e_y + duration * rates.e_y,
            e_psi: self.e_psi + duration * rates.e_psi,
            kappa_ref: self.kappa_ref + rates.kappa_ref * duration,
            v_x_ref: self.v_x_ref + rates.v_x_ref * duration,
            // A friction that falls must not fall to 0, which stands for an unknown one.
            mu_ref: self.mu_ref.zip_map(&rates.mu_ref, |mu, rate| {
                if mu > 0.0 { (mu + rate * duration).max(FRICTION_MIN) } else { mu + rate * duration }
            }),
            hold_preview: self.hold_preview,
        }
    }

    /// The measured state.
    pub fn state(&self) -> State {
        let mut x = State::zeros();
        x[V_X] = self.v_x;
        x[V_Y] = self.v_y;
        x[YAW_RATE] = self.yaw_rate;
        x[E_Y] = self.e_y;
        x[E_PSI] = self.e_psi;
        x
    }

    /// The previewed road.
    #[inline(always)]
    pub(crate) fn road(&self, p: &Parameters) -> Road {
        Road::new(self.rows(), p)
    }

    /// The previewed road with its derivative along a `direction` of the inputs.
    pub(crate) fn road_along(&self, direction: &Self, p: &Parameters) -> Road<Dual64> {
        // A preview that is held follows its first element.
        let direction = Self { hold_preview: self.hold_preview, ..*direction };
        let (values, slopes) = (self.rows(), direction.rows());
        let dual = |k: usize| std::array::from_fn(|i| Dual64::new(values[k][i], slopes[k][i]));
        Road::new(std::array::from_fn(dual), p)
    }

    /// The previews of curvature [1/m], wanted speed [m/s] and friction [1].
    #[inline(always)]
    fn rows(&self) -> [Row<f64>; 3] {
        [&self.kappa_ref, &self.v_x_ref, &self.mu_ref].map(|preview| {
            let [row] = preview.data.0;
            if self.hold_preview { [row[0]; PREVIEW] } else { row }
        })
    }
}

/// Command, diagnostics and plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Front steering angle command [rad].
    pub delta: f64,
    /// Longitudinal acceleration command [m/s2].
    pub a_x: f64,
    /// Front cornering stiffness that the controller believes in [N/rad].
    pub c_f: f64,
    /// Rear cornering stiffness that the controller believes in [N/rad].
    pub c_r: f64,
    /// How far the network is believed: 0 the nominal stiffnesses, 1 the network's [1].
    pub confidence: f64,
    /// How good the command is.
    pub status: Status,
    /// Iterations of the solver.
    pub iterations: u32,
    /// Scaled residual of the conditions of optimality [1].
    pub kkt_residual: f64,
    /// Largest predicted excess over the soft bound on the lateral error [m].
    pub slack_e_y: f64,
    /// Predicted lateral error [m].
    pub e_y_pred: Trajectory,
    /// Predicted heading error [rad].
    pub e_psi_pred: Trajectory,
    /// Predicted longitudinal velocity [m/s].
    pub v_x_pred: Trajectory,
    /// Predicted lateral velocity [m/s].
    pub v_y_pred: Trajectory,
    /// Predicted yaw rate [rad/s].
    pub yaw_rate_pred: Trajectory,
    /// Planned steering angle commands [rad].
    pub delta_pred: Trajectory,
    /// Planned acceleration commands [m/s2].
    pub a_x_pred: Trajectory,
}

impl Output {
    /// Writes element `i` of the predicted trajectories.
    pub(crate) fn set_stage(&mut self, i: usize, x: &State, u: &Input) {
        self.e_y_pred[i] = x[E_Y];
        self.e_psi_pred[i] = x[E_PSI];
        self.v_x_pred[i] = x[V_X];
        self.v_y_pred[i] = x[V_Y];
        self.yaw_rate_pred[i] = x[YAW_RATE];
        self.delta_pred[i] = u[DELTA];
        self.a_x_pred[i] = u[A_X];
    }

    /// Repeats element `last` of the predicted trajectories in all that follow.
    pub(crate) fn hold_from(&mut self, last: usize) {
        for trajectory in [
            &mut self.e_y_pred,
            &mut self.e_psi_pred,
            &mut self.v_x_pred,
            &mut self.v_y_pred,
            &mut self.yaw_rate_pred,
            &mut self.delta_pred,
            &mut self.a_x_pred,
        ] {
            let (kept, held) = trajectory.as_mut_slice().split_at_mut(last + 1);
            held.fill(kept[last]);
        }
    }

    /// Before the first sample: no command, no plan, the nominal beliefs.
    pub(crate) fn initial(tyres: &Tyres) -> Self {
        let nothing = Trajectory::zeros();
        Self {
            delta: 0.0,
            a_x: 0.0,
            c_f: tyres.c_f,
            c_r: tyres.c_r,
            confidence: 0.0,
            status: Status::Optimal,
            iterations: 0,
            kkt_residual: 0.0,
            slack_e_y: 0.0,
            e_y_pred: nothing,
            e_psi_pred: nothing,
            v_x_pred: nothing,
            v_y_pred: nothing,
            yaw_rate_pred: nothing,
            delta_pred: nothing,
            a_x_pred: nothing,
        }
    }
}

//! Everything about the controller that its user may set.

use serde::{Deserialize, Serialize};

use crate::model::{Body, Tyres};
use crate::modes::{Adaptation, Backend, Estimation, TerminalCost};

mod ranges;

/// Largest horizon that the public interface carries previews and predictions for.
pub const HORIZON_MAX: usize = 40;

/// Parameters of the controller, named as in the public interface.
///
/// [`Default`] is a tuning that survives delay, lag and noise; [`Parameters::paper`] is the paper's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// Mass [kg].
    pub m: f64,
    /// Yaw inertia [kg m2].
    pub i_z: f64,
    /// Distance from the centre of gravity to the front axle [m].
    pub l_f: f64,
    /// Distance from the centre of gravity to the rear axle [m].
    pub l_r: f64,
    /// Drag coefficient [1].
    pub c_d: f64,
    /// Frontal area [m2].
    pub area: f64,
    /// Air density [kg/m3].
    pub rho: f64,
    /// Rolling resistance coefficient [1].
    pub c_rr: f64,
    /// Gravitational acceleration [m/s2].
    pub g: f64,
    /// Nominal front cornering stiffness of the axle [N/rad].
    pub c_f_nominal: f64,
    /// Nominal rear cornering stiffness of the axle [N/rad].
    pub c_r_nominal: f64,
    /// Friction of the road where the preview does not tell it, and that at which the nominal stiffnesses hold [1].
    pub mu: f64,
    /// Share of the grip that the planned speed may use; 0: any speed that is wanted, and no way back from far off the path [1].
    pub grip_max: f64,
    /// Controller period [s].
    pub t_s: f64,
    /// Prediction horizon in periods [1].
    pub horizon: usize,
    /// Weight on the longitudinal velocity error [s2/m2].
    pub q_v_x: f64,
    /// Weight on the lateral velocity error [s2/m2].
    pub q_v_y: f64,
    /// Weight on the yaw rate error [s2/rad2].
    pub q_yaw_rate: f64,
    /// Weight on the lateral error [1/m2].
    pub q_e_y: f64,
    /// Weight on the heading error [1/rad2].
    pub q_e_psi: f64,
    /// Weight on the steering increment per period [1/rad2].
    pub r_delta: f64,
    /// Weight on the acceleration increment per period [s4/m2].
    pub r_a_x: f64,
    /// What the state at the end of the horizon costs.
    pub terminal_cost: TerminalCost,
    /// Factor of the terminal cost [1].
    pub terminal_factor: f64,
    /// Largest steering angle [rad].
    pub delta_max: f64,
    /// Largest steering rate [rad/s].
    pub delta_rate_max: f64,
    /// Strongest braking, a negative acceleration [m/s2].
    pub a_x_min: f64,
    /// Strongest acceleration [m/s2].
    pub a_x_max: f64,
    /// Largest rate of the acceleration [m/s3].
    pub a_x_rate_max: f64,
    /// Lateral error beyond which the soft constraint costs [m].
    pub e_y_max: f64,
    /// Penalty on the squared excess over `e_y_max` [1/m2].
    pub e_y_penalty: f64,
    /// Where the stiffnesses of the prediction model come from.
    pub adaptation: Adaptation,
    /// Which solver answers first.
    pub backend: Backend,
    /// Latency of the actuators beyond the communication step, on both commands [s].
    pub input_delay: f64,
    /// Time constant of the steering actuator [s].
    pub tau_delta: f64,
    /// Time constant of the drive and brake actuator [s].
    pub tau_a_x: f64,
    /// Where the state that the plan starts from comes from.
    pub estimation: Estimation,
    /// Largest standard deviations of the sensors, in units of 0.03 m/s on both velocities, 0.002 rad/s, 0.01 m and 0.002 rad
    /// [1]. That they have less, down to a tenth, is found out.
    pub sensor_noise: f64,
    /// Whether the lateral velocity is measured; if not, it is estimated.
    pub v_y_measured: bool,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            // The paper's 0.33 s of preview is too short for the limit of grip and for slow actuators.
            horizon: 30,
            // The paper's weights on the states but for the speed, where a tenth is enough. Its increments are almost free:
            // near dead-beat, so that a steering lag of 50 ms or mild sensor noise leaves the road.
            q_v_x: 5.0,
            r_delta: 300.0,
            r_a_x: 0.1,
            // `cargo fmu robustness`: lane changes from 14 to 20 m/s stay within 9 cm; 0.95 leaves 11 cm at 17 m/s, 0.85 gains
            // nothing and is slower.
            grip_max: 0.9,
            estimation: Estimation::Kalman,
            ..Self::paper()
        }
    }
}

impl Parameters {
    /// The defaults with the network along the horizon: what ships, where a network is at hand.
    ///
    /// 40 periods are 1.3 s: at the limit of grip the plan has to see that far, and the tyre has to be right along all of it.
    pub fn adaptive() -> Self {
        Self { adaptation: Adaptation::NetworkHorizon, horizon: HORIZON_MAX, ..Self::default() }
    }

    /// The paper's own tuning: Table 2 of [Kebbati] and the weights that its tuner found, the measurement taken as it is.
    pub fn paper() -> Self {
        Self {
            m: 1575.0,
            i_z: 2875.0,
            l_f: 1.2,
            l_r: 1.6,
            c_d: 0.29,
            area: 1.6,
            rho: 1.225,
            g: 9.81,
            mu: 0.82,
            grip_max: 0.0,
            t_s: 0.033,
            horizon: 10,
            e_y_max: 0.3,
            delta_max: std::f64::consts::FRAC_PI_6,
            q_v_x: 50.0,
            q_v_y: 1e-5,
            q_yaw_rate: 0.01,
            q_e_y: 47.43,
            q_e_psi: 1e-3,
            r_delta: 0.003,
            r_a_x: 1e-4,
            terminal_cost: TerminalCost::StageWeights,
            terminal_factor: 1.0,
            // Not in the paper: a passenger car's rolling resistance on asphalt, [Rajamani, section 4.1.4].
            c_rr: 0.015,
            // Not in the paper: slope B C mu F_z at zero slip of the magic formula B 10, C 1.4, mu 0.82 under the static
            // axle loads of Table 2, m g l_r / L and m g l_f / L.
            c_f_nominal: 101_359.0,
            c_r_nominal: 76_019.0,
            // The paper bounds increments by pi/12 per period, 7.9 rad/s; a road car's steering does 0.4 to 0.8 rad/s.
            delta_rate_max: 0.8,
            // Not in the paper: full braking at mu 0.82 and the drive of a compact electric car.
            a_x_min: -8.0,
            a_x_max: 4.0,
            a_x_rate_max: 30.0,
            // The paper's bound on e_y is hard, so one gust makes its problem infeasible; a hundred times the weight of the
            // error itself keeps it where it can be kept.
            e_y_penalty: 4743.0,
            adaptation: Adaptation::Constant,
            backend: Backend::Structured,
            input_delay: 0.0,
            tau_delta: 0.0,
            tau_a_x: 0.0,
            estimation: Estimation::Measured,
            sensor_noise: 1.0,
            v_y_measured: true,
        }
    }

    /// The body that the prediction model assumes.
    pub fn body(&self) -> Body {
        Body {
            m: self.m,
            i_z: self.i_z,
            l_f: self.l_f,
            l_r: self.l_r,
            drag: 0.5 * self.rho * self.c_d * self.area,
            rolling: self.c_rr * self.g,
        }
    }

    /// The nominal tyres of the prediction model.
    pub fn nominal_tyres(&self) -> Tyres {
        Tyres::secant(self.c_f_nominal, self.c_r_nominal)
    }
}

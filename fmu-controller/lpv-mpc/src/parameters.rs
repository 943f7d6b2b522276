//! Everything about the controller that its user may set.

use serde::{Deserialize, Serialize};

use crate::Error;
use crate::model::{Body, Tyres};
use crate::modes::{Adaptation, Backend, Estimation, TerminalCost};

/// Largest horizon that the public interface carries previews and predictions for.
pub const HORIZON_MAX: usize = 40;

/// Longest latency that the command history covers [s].
const LATENCY_MAX: f64 = 1.0;

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

    /// Checks every parameter against its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] with the name, the range and the value of the first parameter outside its range.
    pub fn validate(&self) -> Result<(), Error> {
        let positive = |v: f64| v > 0.0 && v.is_finite();
        let not_negative = |v: f64| v >= 0.0 && v.is_finite();
        let check = |name, value: f64, ok: bool, expected| {
            if ok { Ok(()) } else { Err(Error::Parameter { name, expected, value }) }
        };
        for (name, value) in [
            ("m", self.m),
            ("i_z", self.i_z),
            ("l_f", self.l_f),
            ("l_r", self.l_r),
            ("g", self.g),
            ("mu", self.mu),
            ("c_f_nominal", self.c_f_nominal),
            ("c_r_nominal", self.c_r_nominal),
            ("r_delta", self.r_delta),
            ("r_a_x", self.r_a_x),
            ("delta_max", self.delta_max),
            ("delta_rate_max", self.delta_rate_max),
            ("a_x_max", self.a_x_max),
            ("a_x_rate_max", self.a_x_rate_max),
            ("e_y_max", self.e_y_max),
            ("sensor_noise", self.sensor_noise),
        ] {
            check(name, value, positive(value), "positive and finite")?;
        }
        for (name, value) in [
            ("c_d", self.c_d),
            ("area", self.area),
            ("rho", self.rho),
            ("c_rr", self.c_rr),
            ("q_v_x", self.q_v_x),
            ("q_v_y", self.q_v_y),
            ("q_yaw_rate", self.q_yaw_rate),
            ("q_e_y", self.q_e_y),
            ("q_e_psi", self.q_e_psi),
            ("terminal_factor", self.terminal_factor),
            ("e_y_penalty", self.e_y_penalty),
            ("tau_delta", self.tau_delta),
            ("tau_a_x", self.tau_a_x),
        ] {
            check(name, value, not_negative(value), "zero or positive, and finite")?;
        }
        check("grip_max", self.grip_max, (0.0..=2.0).contains(&self.grip_max), "between 0 and 2")?;
        check("t_s", self.t_s, (1e-3..=0.2).contains(&self.t_s), "between 0.001 and 0.2 s")?;
        check("input_delay", self.input_delay, (0.0..=LATENCY_MAX).contains(&self.input_delay), "between 0 and 1 s")?;
        check("a_x_min", self.a_x_min, self.a_x_min < 0.0 && self.a_x_min.is_finite(), "negative and finite")?;
        check("horizon", self.horizon as f64, (1..=HORIZON_MAX).contains(&self.horizon), "between 1 and 40 periods")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid() {
        assert_eq!(Parameters::default().validate(), Ok(()));
        assert_eq!(Parameters::adaptive().validate(), Ok(()));
        assert_eq!(Parameters::paper().validate(), Ok(()));
    }

    #[test]
    fn an_error_names_parameter_and_value() {
        let negative_mass = Parameters { m: -3.0, ..Parameters::default() };
        assert_eq!(
            negative_mass.validate().unwrap_err().to_string(),
            "parameter m must be positive and finite, got -3"
        );
        let no_horizon = Parameters { horizon: 0, ..Parameters::default() };
        assert_eq!(
            no_horizon.validate().unwrap_err().to_string(),
            "parameter horizon must be between 1 and 40 periods, got 0"
        );
    }

    #[test]
    fn every_real_parameter_refuses_nan() {
        let json = serde_value(&Parameters::default());
        for (name, _) in json {
            let mut nan = Parameters::default();
            if set(&mut nan, &name) {
                let error = nan.validate().unwrap_err().to_string();
                assert!(error.contains(&format!("parameter {name} ")), "{name}: {error}");
            }
        }
    }

    /// Names of the fields, from the Debug form: a list typed by hand would miss the next field.
    fn serde_value(p: &Parameters) -> Vec<(String, String)> {
        format!("{p:?}")
            .trim_start_matches("Parameters { ")
            .trim_end_matches(" }")
            .split(", ")
            .filter_map(|pair| pair.split_once(": "))
            .map(|(name, value)| (name.to_owned(), value.to_owned()))
            .collect()
    }

    fn set(p: &mut Parameters, name: &str) -> bool {
        macro_rules! reals {
            ($($field:ident)*) => {
                match name { $(stringify!($field) => { p.$field = f64::NAN; true })* _ => false }
            };
        }
        let is_real = reals!(m i_z l_f l_r c_d area rho c_rr g mu grip_max c_f_nominal c_r_nominal t_s q_v_x q_v_y
            q_yaw_rate q_e_y q_e_psi r_delta r_a_x terminal_factor delta_max delta_rate_max a_x_min a_x_max a_x_rate_max
            e_y_max e_y_penalty input_delay tau_delta tau_a_x sensor_noise);
        assert!(
            is_real
                || ["horizon", "terminal_cost", "adaptation", "backend", "estimation", "v_y_measured"].contains(&name),
            "{name} is not covered"
        );
        is_real
    }
}

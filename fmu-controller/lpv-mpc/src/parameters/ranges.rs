//! The range of every parameter.

use super::{HORIZON_MAX, Parameters};
use crate::Error;

/// Longest latency that the command history covers [s].
const LATENCY_MAX: f64 = 1.0;

impl Parameters {
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

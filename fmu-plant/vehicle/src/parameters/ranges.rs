//! The range of every parameter.

use super::Parameters;
use crate::{Error, tyre::Preset};

macro_rules! ranges {
    ($($field:ident $min:expr, $max:expr;)*) => {
        /// The smallest value of each parameter.
        pub const MIN: Self =
            Self { tyre: Preset::DryAsphalt, load_transfer: false, combined_slip: false, crosswind: false, laps: 1, seed: i32::MIN, $($field: $min),* };
        /// The largest value of each parameter.
        pub const MAX: Self =
            Self { tyre: Preset::Custom, load_transfer: true, combined_slip: true, crosswind: true, laps: 1000, seed: i32::MAX, $($field: $max),* };

        /// Refuses a value outside its range, by name.
        pub fn validate(&self) -> Result<(), Error> {
            $(
                let (value, min, max) = (self.$field, Self::MIN.$field, Self::MAX.$field);
                if !(min..=max).contains(&value) {
                    return Err(Error::Parameter { name: stringify!($field), value, min, max });
                }
            )*
            self.validate_together()
        }
    };
}

// From a go-kart to a bus, from ice to racing slicks.
impl Parameters {
    ranges! {
        m 100.0, 50_000.0;
        i_z 10.0, 1_000_000.0;
        l_f 0.3, 6.0;
        l_r 0.3, 6.0;
        g 1.0, 20.0;
        mu 0.05, 2.0;
        tyre_b_f 0.5, 30.0;
        tyre_b_r 0.5, 30.0;
        tyre_c 0.5, 2.0;
        tyre_e -10.0, 1.0;
        relaxation_length 0.0, 2.0;
        h_cg 0.0, 2.0;
        drive_front 0.0, 1.0;
        brake_front 0.0, 1.0;
        width 0.1, 4.0;
        overhang_f 0.0, 5.0;
        overhang_r 0.0, 5.0;
        c_d 0.0, 3.0;
        area 0.0, 20.0;
        rho 0.0, 3.0;
        c_s 0.0, 5.0;
        area_side 0.0, 60.0;
        arm_side -5.0, 5.0;
        c_rr 0.0, 0.2;
        delay_delta 0.0, 1.0;
        tau_delta 0.0, 5.0;
        delta_rate_max 0.0, 100.0;
        delta_max 0.0, 1.2;
        delay_a_x 0.0, 1.0;
        tau_a_x 0.0, 5.0;
        a_x_rate_max 0.0, 1000.0;
        a_x_min -20.0, 0.0;
        a_x_max 0.0, 20.0;
        grade -0.5, 0.5;
        bank -0.5, 0.5;
        patch_start -1000.0, 1e6;
        patch_length 0.0, 1e6;
        patch_edge 0.1, 100.0;
        patch_mu 0.0, 2.0;
        gust_start 0.0, 1e6;
        gust_rise 0.01, 100.0;
        gust_hold 0.0, 1e6;
        gust_speed -60.0, 60.0;
        gust_direction -100.0, 100.0;
        steer_amplitude -0.6, 0.6;
        road_tolerance 0.0, 10.0;
        radius -10_000.0, 10_000.0;
        noise_scale 0.0, 100.0;
        speed 0.0, 70.0;
        preview_step 0.001, 1.0;
        e_y_0 -20.0, 20.0;
        e_psi_0 -3.2, 3.2;
        v_x_0 -70.0, 70.0;
    }
}

impl Parameters {
    /// Refuses what only makes sense together with other values.
    fn validate_together(&self) -> Result<(), Error> {
        let check = |name, value: f64, min: f64, max: f64| {
            if (min..=max).contains(&value) { Ok(()) } else { Err(Error::Parameter { name, value, min, max }) }
        };
        // The yaw inertia of vehicles is close to m l_f l_r; a factor of ten to either side is no vehicle.
        let inertia = self.m * self.l_f * self.l_r;
        if !(0.1 * inertia..=10.0 * inertia).contains(&self.i_z) {
            return Err(Error::Inertia { value: self.i_z, inertia });
        }
        // Shorter than 5 cm a tyre's contact patch would be slower than the integrator's step.
        if self.relaxation_length > 0.0 {
            check("relaxation_length", self.relaxation_length, 0.05, Self::MAX.relaxation_length)?;
        }
        // A circle tighter than this has its centre inside the vehicle.
        check("radius", self.radius.abs(), 5.0, Self::MAX.radius)?;
        let laps = f64::from(self.laps);
        check("laps", laps, f64::from(Self::MIN.laps), f64::from(Self::MAX.laps))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_lies_inside_every_range() {
        Parameters::default().validate().unwrap();
    }

    #[test]
    fn refusal_names_parameter_value_and_range() {
        let parameters = Parameters { m: -1575.0, ..Parameters::default() };
        let message = parameters.validate().unwrap_err().to_string();
        assert_eq!(message, "parameter m = -1575 lies outside its range 100 to 50000");
        let message = Parameters { i_z: 20.0, ..Parameters::default() }.validate().unwrap_err().to_string();
        assert_eq!(
            message,
            "parameter i_z = 20 lies outside its range 302.4 to 30240, a tenth to ten times m l_f l_r = 3024"
        );
        let parameters = Parameters { tau_delta: f64::NAN, ..Parameters::default() };
        assert!(parameters.validate().is_err(), "NaN accepted");
    }
}

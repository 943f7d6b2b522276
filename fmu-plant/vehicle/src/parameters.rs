//! The parameters of the plant: flat, named as the FMU names them, each with its range.
//!
//! Differs from [Kebbati] where the paper's drag `mu m g` takes the tyre's friction for a resistance (8 m/s2 of braking
//! at its own Table 2): rolling resistance has its own coefficient `c_rr` here.

use serde::{Deserialize, Serialize};

use crate::{Error, tyre::Preset};

/// Everything about the vehicle, its actuators, sensors and start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    /// Gravity [m/s2].
    pub g: f64,
    /// Tyre preset; `Custom` takes the coefficients below.
    pub tyre: Preset,
    /// Friction of tyre and road, the peak of the lateral force over the load [1].
    pub mu: f64,
    /// Stiffness factor of the front tyre, custom tyre only [1/rad].
    pub tyre_b_f: f64,
    /// Stiffness factor of the rear tyre, custom tyre only [1/rad].
    pub tyre_b_r: f64,
    /// Shape factor, custom tyre only [1].
    pub tyre_c: f64,
    /// Curvature factor, custom tyre only [1].
    pub tyre_e: f64,
    /// Drag coefficient [1].
    pub c_d: f64,
    /// Frontal area [m2].
    pub area: f64,
    /// Density of the air [kg/m3].
    pub rho: f64,
    /// Whether the lateral wind acts on the body.
    pub crosswind: bool,
    /// Side force coefficient, over the side area and per sine of the angle of the relative wind [1].
    pub c_s: f64,
    /// Side area [m2].
    pub area_side: f64,
    /// Distance of the side force ahead of the centre of gravity [m].
    pub arm_side: f64,
    /// Rolling resistance coefficient [1].
    pub c_rr: f64,
    /// Delay of the steering command [s].
    pub delay_delta: f64,
    /// Time constant of the steering's first-order lag [s].
    pub tau_delta: f64,
    /// Largest steering rate, 0 for none [rad/s].
    pub delta_rate_max: f64,
    /// Largest steering angle [rad].
    pub delta_max: f64,
    /// Delay of the acceleration command [s].
    pub delay_a_x: f64,
    /// Time constant of the drive's and brake's first-order lag [s].
    pub tau_a_x: f64,
    /// Largest rate of the acceleration, 0 for none [m/s3].
    pub a_x_rate_max: f64,
    /// Smallest acceleration, braking [m/s2].
    pub a_x_min: f64,
    /// Largest acceleration [m/s2].
    pub a_x_max: f64,
    /// Sensor noise: 0 off, 1 the standard deviations of [`crate::noise`] [1].
    pub noise_scale: f64,
    /// Seed of the sensor noise [1].
    pub seed: i32,
    /// Speed of the manoeuvres that have a constant one [m/s].
    pub speed: f64,
    /// Time between the elements of the preview, the controller's sample time; also how long a noise sample holds [s].
    pub preview_step: f64,
    /// Lateral error at the start [m].
    pub e_y_0: f64,
    /// Heading error at the start [rad].
    pub e_psi_0: f64,
    /// Speed at the start, negative for the road's own [m/s].
    pub v_x_0: f64,
}

impl Default for Parameters {
    /// The paper's Table 2; what it leaves open is said beside each value.
    fn default() -> Self {
        Self {
            m: 1575.0,
            i_z: 2875.0,
            l_f: 1.2,
            l_r: 1.6,
            g: 9.81,
            tyre: Preset::DryAsphalt,
            mu: 0.82,
            tyre_b_f: 10.0,
            tyre_b_r: 10.0,
            tyre_c: 1.4,
            tyre_e: 0.0,
            c_d: 0.29,
            area: 1.6,
            rho: 1.225,
            crosswind: true,
            // A passenger car's side force rises by about 0.038 a degree over its frontal area [Hucho, chapter 5], that
            // is 2.2 a radian; over this car's frontal area of 1.6 m2 that is 1.0 over a side area of 3.5 m2.
            c_s: 1.0,
            area_side: 3.5,
            // Yaw moment over side force of a passenger car puts the point of attack about 0.16 wheelbases ahead of
            // mid-wheelbase [Hucho, chapter 5]; the centre of gravity lies 0.2 m ahead of mid-wheelbase here.
            arm_side: 0.25,
            // Low-resistance car tyres on asphalt reach 0.010, ordinary ones 0.015 [Pacejka].
            c_rr: 0.015,
            delay_delta: 0.0,
            tau_delta: 0.0,
            delta_rate_max: 0.0,
            // The paper's steering bound.
            delta_max: std::f64::consts::FRAC_PI_6,
            delay_a_x: 0.0,
            tau_a_x: 0.0,
            a_x_rate_max: 0.0,
            // Braking at the grip limit mu g and the drive of a compact electric car (100 km/h in about 7 s).
            a_x_min: -8.0,
            a_x_max: 4.0,
            noise_scale: 0.0,
            seed: 1,
            speed: 14.0,
            preview_step: 0.033,
            e_y_0: 0.0,
            e_psi_0: 0.0,
            v_x_0: -1.0,
        }
    }
}

macro_rules! ranges {
    ($($field:ident $min:expr, $max:expr;)*) => {
        /// The smallest value of each parameter.
        pub const MIN: Self =
            Self { tyre: Preset::DryAsphalt, crosswind: false, seed: i32::MIN, $($field: $min),* };
        /// The largest value of each parameter.
        pub const MAX: Self =
            Self { tyre: Preset::Custom, crosswind: true, seed: i32::MAX, $($field: $max),* };

        /// Refuses a value outside its range, by name.
        pub fn validate(&self) -> Result<(), Error> {
            $(
                let (value, min, max) = (self.$field, Self::MIN.$field, Self::MAX.$field);
                if !(min..=max).contains(&value) {
                    return Err(Error::Parameter { name: stringify!($field), value, min, max });
                }
            )*
            Ok(())
        }
    };
}

// From a go-kart to a bus, from ice to racing slicks.
impl Parameters {
    ranges! {
        m 100.0, 50_000.0;
        i_z 50.0, 500_000.0;
        l_f 0.2, 10.0;
        l_r 0.2, 10.0;
        g 1.0, 30.0;
        mu 0.05, 2.0;
        tyre_b_f 0.5, 50.0;
        tyre_b_r 0.5, 50.0;
        tyre_c 0.5, 2.0;
        tyre_e -10.0, 1.0;
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
        noise_scale 0.0, 100.0;
        speed 0.0, 70.0;
        preview_step 0.001, 1.0;
        e_y_0 -20.0, 20.0;
        e_psi_0 -3.2, 3.2;
        v_x_0 -1.0, 70.0;
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
        let parameters = Parameters { tau_delta: f64::NAN, ..Parameters::default() };
        assert!(parameters.validate().is_err(), "NaN accepted");
    }
}

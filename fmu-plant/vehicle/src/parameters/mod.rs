//! The parameters of the plant: flat, named as the FMU names them, each with its range.
//!
//! Differs from [Kebbati] where the paper's drag `mu m g` takes the tyre's friction for a resistance (8 m/s2 of braking
//! at its own Table 2): rolling resistance has its own coefficient `c_rr` here.

use serde::{Deserialize, Serialize};

use crate::tyre::Preset;

mod ranges;

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
    /// Length that the tyres roll until their force has built up, 0 for at once [m].
    pub relaxation_length: f64,
    /// Whether drive and brakes move load between the axles.
    pub load_transfer: bool,
    /// Height of the centre of gravity, for the load transfer [m].
    pub h_cg: f64,
    /// Whether drive and brakes use up grip.
    pub combined_slip: bool,
    /// Share of the drive in front [1].
    pub drive_front: f64,
    /// Share of the brakes in front [1].
    pub brake_front: f64,
    /// Width of the body, for cones and lanes [m].
    pub width: f64,
    /// Length of the body ahead of the front axle [m].
    pub overhang_f: f64,
    /// Length of the body behind the rear axle [m].
    pub overhang_r: f64,
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
    /// Delay of the steering command; dense changes of it come through to within its 2048th part [s].
    pub delay_delta: f64,
    /// Time constant of the steering's first-order lag [s].
    pub tau_delta: f64,
    /// Largest steering rate, 0 for none [rad/s].
    pub delta_rate_max: f64,
    /// Largest steering angle [rad].
    pub delta_max: f64,
    /// Delay of the acceleration command, likewise [s].
    pub delay_a_x: f64,
    /// Time constant of the drive's and brake's first-order lag [s].
    pub tau_a_x: f64,
    /// Largest rate of the acceleration, 0 for none [m/s3].
    pub a_x_rate_max: f64,
    /// Smallest acceleration, braking [m/s2].
    pub a_x_min: f64,
    /// Largest acceleration [m/s2].
    pub a_x_max: f64,
    /// Slope of the whole road, uphill positive [rad].
    pub grade: f64,
    /// Cross slope of the whole road, left side up positive [rad].
    pub bank: f64,
    /// Where a patch of other friction begins, in full [m].
    pub patch_start: f64,
    /// How long it is, 0 for no patch [m].
    pub patch_length: f64,
    /// Length of each smooth edge outside of it [m].
    pub patch_edge: f64,
    /// Factor on the friction there [1].
    pub patch_mu: f64,
    /// When the gust begins [s].
    pub gust_start: f64,
    /// How long it rises, and falls again [s].
    pub gust_rise: f64,
    /// How long it stays in between [s].
    pub gust_hold: f64,
    /// Its speed, 0 for no gust [m/s].
    pub gust_speed: f64,
    /// Direction it blows to, in the road frame at the start [rad].
    pub gust_direction: f64,
    /// Steering angle of the open-loop manoeuvres [rad].
    pub steer_amplitude: f64,
    /// How far the smooth line may miss the points of a road file, root mean square, 0 for not at all [m].
    pub road_tolerance: f64,
    /// Radius of the constant-radius manoeuvre, positive to the left [m].
    pub radius: f64,
    /// Laps of a closed track until it is finished [1].
    pub laps: i32,
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
            // The extras beyond the paper are off; their values are those of a compact electric car near its table: 2.70 m
            // wheelbase, 4.445 m by 1.770 m, c_d 0.29 (first Nissan Leaf, manufacturer's data sheet 2011).
            relaxation_length: 0.0,
            load_transfer: false,
            // Track width 1.54 m over twice a static stability factor of 1.4, that of a car with its battery in the floor.
            h_cg: 0.55,
            combined_slip: false,
            drive_front: 1.0,
            // Ideal brake balance at 4 m/s2: the static 0.57 in front plus the transfer of h_cg over the wheelbase.
            brake_front: 0.65,
            width: 1.77,
            overhang_f: 0.9,
            overhang_r: 0.75,
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
            grade: 0.0,
            bank: 0.0,
            patch_start: 60.0,
            patch_length: 0.0,
            patch_edge: 2.0,
            patch_mu: 0.4,
            gust_start: 2.0,
            // Flanks of the side wind of ISO 12021's fans at 25 m/s are some 5 m wide.
            gust_rise: 0.2,
            gust_hold: 1.0,
            gust_speed: 0.0,
            gust_direction: std::f64::consts::FRAC_PI_2,
            steer_amplitude: 0.03,
            // The noise of a good satellite receiver.
            road_tolerance: 0.01,
            // ISO 4138 prefers 100 m.
            radius: 100.0,
            laps: 1,
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

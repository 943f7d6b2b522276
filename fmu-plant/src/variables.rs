//! Every variable of the plant, once.

use model_description::{Role, Scalar, Table, variables};
use vehicle::{Inputs, PREVIEW, Parameters};

use crate::VehiclePlant;

/// Smallest and largest values, where the mathematics declares them.
const P_MIN: Parameters = Parameters::MIN;
const P_MAX: Parameters = Parameters::MAX;
const I_MIN: Inputs = Inputs::MIN;
const I_MAX: Inputs = Inputs::MAX;

/// Inputs that act on the forces at once.
const ALL: &[&str] = &["delta", "a_x", "wind_speed", "wind_direction", "mu_scale"];
/// Inputs that act on lateral forces at once: drive and brakes through load transfer and combined slip.
const TYRES: &[&str] = &["delta", "a_x", "mu_scale"];

/// The inputs in the order of the table.
const INPUTS: [fn(&mut Inputs) -> &mut f64; 5] =
    [|i| &mut i.delta, |i| &mut i.a_x, |i| &mut i.wind_speed, |i| &mut i.wind_direction, |i| &mut i.mu_scale];

/// A direction in the space of the inputs, given as pairs of value reference and component.
pub fn along(components: impl Iterator<Item = (u32, f64)>) -> Inputs {
    let mut direction = Inputs::ZERO;
    for (reference, component) in components {
        if let Some(field) = INPUTS.get(reference as usize) {
            *field(&mut direction) += component;
        }
    }
    direction
}

/// Whether a value reference belongs to an input.
pub fn is_input(reference: u32) -> bool {
    table().lookup(reference).is_some_and(|(row, _)| row.role == Role::Input)
}

/// Name behind a value reference.
pub fn name(reference: u32) -> String {
    table().lookup(reference).map_or_else(|| reference.to_string(), |(row, element)| row.element_name(element))
}

/// Value of a Real variable.
pub fn real(plant: &VehiclePlant, reference: u32) -> Option<f64> {
    let (row, element) = table().lookup(reference)?;
    match row.read(plant, element) {
        Scalar::Real(value) => Some(value),
        _ => None,
    }
}

/// Value references are rows: append, never reorder.
pub fn table() -> &'static Table<VehiclePlant> {
    variables! { VehiclePlant;
        Input delta ["rad"] "Front steering angle command, positive to the left; beyond the actuator's limit it saturates", terminal "command", min I_MIN.delta, max I_MAX.delta => { get |m| m.inputs.delta, set |m, v: f64| (m.inputs.delta, m.acting.delta) = (v, v) };
        Input a_x ["m/s2"] "Longitudinal acceleration command of drive and brakes; negative brakes and never reverses", terminal "command", min I_MIN.a_x, max I_MAX.a_x => { get |m| m.inputs.a_x, set |m, v: f64| (m.inputs.a_x, m.acting.a_x) = (v, v) };
        Input wind_speed ["m/s"] "Wind, added to the manoeuvre's own", min I_MIN.wind_speed, max I_MAX.wind_speed => { get |m| m.inputs.wind_speed, set |m, v: f64| (m.inputs.wind_speed, m.acting.wind_speed) = (v, v) };
        Input wind_direction ["rad"] "Direction that the wind blows to, in the road frame at the start; 0 is along the road", min I_MIN.wind_direction, max I_MAX.wind_direction => { get |m| m.inputs.wind_direction, set |m, v: f64| (m.inputs.wind_direction, m.acting.wind_direction) = (v, v) };
        Input mu_scale ["1"] "Factor on the friction", min I_MIN.mu_scale, max I_MAX.mu_scale => { get |m| m.inputs.mu_scale, set |m, v: f64| (m.inputs.mu_scale, m.acting.mu_scale) = (v, v) };

        Output v_x ["m/s"] "Measured longitudinal velocity, body frame", terminal "measurement", depends &[], lazy false => measurement.v_x;
        Output v_y ["m/s"] "Measured lateral velocity of the centre of gravity, positive to the left", terminal "measurement", depends &[], lazy false => measurement.v_y;
        Output yaw_rate ["rad/s"] "Measured yaw rate, positive to the left", terminal "measurement", depends &[], lazy false => measurement.yaw_rate;
        Output e_y ["m"] "Measured lateral position relative to the path, positive to the left", terminal "measurement", depends &[], lazy false => measurement.e_y;
        Output e_psi ["rad"] "Measured vehicle heading minus path heading", terminal "measurement", depends &[], lazy false => measurement.e_psi;
        Output kappa_ref [PREVIEW] ["1/m"] "Curvature of the path now (element 1) and where the reference will be at the next 40 sample times, positive to the left", terminal "preview", depends &[] => preview.kappa_ref;
        Output v_x_ref [PREVIEW] ["m/s"] "Wanted speed now (element 1) and at the next 40 sample times", terminal "preview", depends &[] => preview.v_x_ref;

        Output v_x_true ["m/s"] "Longitudinal velocity, body frame", depends &[] => outputs.v_x_true;
        Output v_y_true ["m/s"] "Lateral velocity of the centre of gravity, positive to the left", depends &[] => outputs.v_y_true;
        Output yaw_rate_true ["rad/s"] "Yaw rate, positive to the left", depends &[] => outputs.yaw_rate_true;
        Output e_y_true ["m"] "Lateral position relative to the path, positive to the left", depends &[] => outputs.e_y_true;
        Output e_psi_true ["rad"] "Vehicle heading minus path heading", depends &[] => outputs.e_psi_true;
        Output x ["m"] "Position along the start of the road", depends &[] => outputs.x;
        Output y ["m"] "Position to the left of the start of the road", depends &[] => outputs.y;
        Output psi ["rad"] "Heading relative to the start of the road, not wrapped", depends &[] => outputs.psi;
        Output s ["m"] "Arc length along the path", depends &[] => outputs.s;
        Output a_lat ["m/s2"] "Lateral acceleration of the centre of gravity, body frame", depends ALL => outputs.a_lat;
        Output a_long ["m/s2"] "Longitudinal acceleration of the centre of gravity, body frame", depends ALL => outputs.a_long;
        Output alpha_f ["rad"] "Front slip angle", depends &["delta"] => outputs.alpha_f;
        Output alpha_r ["rad"] "Rear slip angle", depends &[] => outputs.alpha_r;
        Output f_yf ["N"] "Lateral force of the front axle", nominal 1e3, depends ALL => outputs.f_yf;
        Output f_yr ["N"] "Lateral force of the rear axle", nominal 1e3, depends ALL => outputs.f_yr;
        Output c_f_true ["N/rad"] "Secant stiffness of the front axle, force over slip angle", nominal 1e5, depends TYRES => outputs.c_f_true;
        Output c_r_true ["N/rad"] "Secant stiffness of the rear axle, force over slip angle", nominal 1e5, depends &["a_x", "mu_scale"] => outputs.c_r_true;
        Output delta_actual ["rad"] "Steering angle after the actuator", depends &["delta"] => outputs.delta_actual;
        Output a_x_actual ["m/s2"] "Acceleration by drive and brakes after the actuator", depends &["a_x", "mu_scale"] => outputs.a_x_actual;
        Output grip_usage ["1"] "Share of its grip that the more loaded axle uses", min 0.0, max 1.0, depends ALL => outputs.grip_usage;
        Output wind_speed_actual ["m/s"] "Speed of the wind where the vehicle is", depends &["wind_speed", "wind_direction"] => outputs.wind_speed_actual;
        Output finished "Whether the end of the road is reached", depends &[] => outputs.finished;
        Output cones_hit "Cones hit so far", depends &[] => outputs.cones_hit;

        Parameter m ["kg"] "Mass", min P_MIN.m, max P_MAX.m => parameters.m;
        Parameter i_z ["kg m2"] "Yaw inertia", min P_MIN.i_z, max P_MAX.i_z => parameters.i_z;
        Parameter l_f ["m"] "Distance from the centre of gravity to the front axle", min P_MIN.l_f, max P_MAX.l_f => parameters.l_f;
        Parameter l_r ["m"] "Distance from the centre of gravity to the rear axle", min P_MIN.l_r, max P_MAX.l_r => parameters.l_r;
        Parameter g ["m/s2"] "Gravity", min P_MIN.g, max P_MAX.g => parameters.g;
        Parameter tyre "Tyre preset: dry_asphalt, alcala, linear, or custom for the coefficients tyre_*" => tyre;
        Parameter mu ["1"] "Friction of tyre and road: peak of the lateral force over the load", min P_MIN.mu, max P_MAX.mu => parameters.mu;
        Parameter tyre_b_f ["1/rad"] "Stiffness factor of the front tyre, custom tyre only", min P_MIN.tyre_b_f, max P_MAX.tyre_b_f => parameters.tyre_b_f;
        Parameter tyre_b_r ["1/rad"] "Stiffness factor of the rear tyre, custom tyre only", min P_MIN.tyre_b_r, max P_MAX.tyre_b_r => parameters.tyre_b_r;
        Parameter tyre_c ["1"] "Shape factor, custom tyre only", min P_MIN.tyre_c, max P_MAX.tyre_c => parameters.tyre_c;
        Parameter tyre_e ["1"] "Curvature factor, custom tyre only", min P_MIN.tyre_e, max P_MAX.tyre_e => parameters.tyre_e;
        Parameter c_d ["1"] "Drag coefficient", min P_MIN.c_d, max P_MAX.c_d => parameters.c_d;
        Parameter area ["m2"] "Frontal area", min P_MIN.area, max P_MAX.area => parameters.area;
        Parameter rho ["kg/m3"] "Density of the air", min P_MIN.rho, max P_MAX.rho => parameters.rho;
        Parameter crosswind "Whether the lateral wind acts on the body" => parameters.crosswind;
        Parameter c_s ["1"] "Side force coefficient, over the side area and per sine of the angle of the relative wind", min P_MIN.c_s, max P_MAX.c_s => parameters.c_s;
        Parameter area_side ["m2"] "Side area", min P_MIN.area_side, max P_MAX.area_side => parameters.area_side;
        Parameter arm_side ["m"] "Distance of the side force ahead of the centre of gravity", min P_MIN.arm_side, max P_MAX.arm_side => parameters.arm_side;
        Parameter c_rr ["1"] "Rolling resistance coefficient", min P_MIN.c_rr, max P_MAX.c_rr => parameters.c_rr;
        Parameter delay_delta ["s"] "Delay of the steering command", min P_MIN.delay_delta, max P_MAX.delay_delta => parameters.delay_delta;
        Parameter tau_delta ["s"] "Time constant of the steering's first-order lag; 0: none", min P_MIN.tau_delta, max P_MAX.tau_delta => parameters.tau_delta;
        Parameter delta_rate_max ["rad/s"] "Largest steering rate; 0: no limit", min P_MIN.delta_rate_max, max P_MAX.delta_rate_max => parameters.delta_rate_max;
        Parameter delta_max ["rad"] "Largest steering angle", min P_MIN.delta_max, max P_MAX.delta_max => parameters.delta_max;
        Parameter delay_a_x ["s"] "Delay of the acceleration command", min P_MIN.delay_a_x, max P_MAX.delay_a_x => parameters.delay_a_x;
        Parameter tau_a_x ["s"] "Time constant of the drive's and brakes' first-order lag; 0: none", min P_MIN.tau_a_x, max P_MAX.tau_a_x => parameters.tau_a_x;
        Parameter a_x_rate_max ["m/s3"] "Largest rate of the acceleration; 0: no limit", min P_MIN.a_x_rate_max, max P_MAX.a_x_rate_max => parameters.a_x_rate_max;
        Parameter a_x_min ["m/s2"] "Strongest braking, negative", min P_MIN.a_x_min, max P_MAX.a_x_min => parameters.a_x_min;
        Parameter a_x_max ["m/s2"] "Strongest acceleration", min P_MIN.a_x_max, max P_MAX.a_x_max => parameters.a_x_max;
        Parameter noise_scale ["1"] "Sensor noise: 0 off, 1 standard deviations of 0.03 m/s, 0.002 rad/s, 0.01 m and 0.002 rad", min P_MIN.noise_scale, max P_MAX.noise_scale => parameters.noise_scale;
        Parameter seed "Seed of the sensor noise" => parameters.seed;
        Parameter road "A manoeuvre's name, or a CSV file (path or file URI; a relative one also in resources/)" => road;
        Parameter speed ["m/s"] "Speed of the manoeuvres that have a constant one", min P_MIN.speed, max P_MAX.speed => parameters.speed;
        Parameter preview_step ["s"] "Time between the elements of the preview: the controller's sample time; a noise sample holds as long", min P_MIN.preview_step, max P_MAX.preview_step => parameters.preview_step;
        Parameter e_y_0 ["m"] "Lateral error at the start", min P_MIN.e_y_0, max P_MAX.e_y_0 => parameters.e_y_0;
        Parameter e_psi_0 ["rad"] "Heading error at the start", min P_MIN.e_psi_0, max P_MAX.e_psi_0 => parameters.e_psi_0;
        Parameter v_x_0 ["m/s"] "Speed at the start; negative: the road's own", min P_MIN.v_x_0, max P_MAX.v_x_0 => parameters.v_x_0;

        Parameter relaxation_length ["m"] "Length that the tyres roll until their force has built up: 0 for at once, or at least 0.05", min P_MIN.relaxation_length, max P_MAX.relaxation_length => parameters.relaxation_length;
        Parameter load_transfer "Whether drive and brakes move load between the axles" => parameters.load_transfer;
        Parameter h_cg ["m"] "Height of the centre of gravity, for the load transfer", min P_MIN.h_cg, max P_MAX.h_cg => parameters.h_cg;
        Parameter combined_slip "Whether drive and brakes use up grip" => parameters.combined_slip;
        Parameter drive_front ["1"] "Share of the drive in front", min P_MIN.drive_front, max P_MAX.drive_front => parameters.drive_front;
        Parameter brake_front ["1"] "Share of the brakes in front", min P_MIN.brake_front, max P_MAX.brake_front => parameters.brake_front;
        Parameter width ["m"] "Width of the body, for cones and lanes", min P_MIN.width, max P_MAX.width => parameters.width;
        Parameter overhang_f ["m"] "Length of the body ahead of the front axle", min P_MIN.overhang_f, max P_MAX.overhang_f => parameters.overhang_f;
        Parameter overhang_r ["m"] "Length of the body behind the rear axle", min P_MIN.overhang_r, max P_MAX.overhang_r => parameters.overhang_r;
        Parameter grade ["rad"] "Slope of the whole road, uphill positive; added to the road's own", min P_MIN.grade, max P_MAX.grade => parameters.grade;
        Parameter bank ["rad"] "Cross slope of the whole road, left side up positive; added to the road's own", min P_MIN.bank, max P_MAX.bank => parameters.bank;
        Parameter patch_start ["m"] "Arc length where a patch of other friction begins in full", min P_MIN.patch_start, max P_MAX.patch_start => parameters.patch_start;
        Parameter patch_length ["m"] "Length of the patch; 0: no patch", min P_MIN.patch_length, max P_MAX.patch_length => parameters.patch_length;
        Parameter patch_edge ["m"] "Length of each smooth edge outside of the patch", min P_MIN.patch_edge, max P_MAX.patch_edge => parameters.patch_edge;
        Parameter patch_mu ["1"] "Factor on the friction in the patch", min P_MIN.patch_mu, max P_MAX.patch_mu => parameters.patch_mu;
        Parameter gust_start ["s"] "Time when the gust begins, from the start of the simulation", min P_MIN.gust_start, max P_MAX.gust_start => parameters.gust_start;
        Parameter gust_rise ["s"] "Time in which the gust rises, and falls again", min P_MIN.gust_rise, max P_MAX.gust_rise => parameters.gust_rise;
        Parameter gust_hold ["s"] "Time that the gust holds in between", min P_MIN.gust_hold, max P_MAX.gust_hold => parameters.gust_hold;
        Parameter gust_speed ["m/s"] "Speed of the gust; 0: no gust", min P_MIN.gust_speed, max P_MAX.gust_speed => parameters.gust_speed;
        Parameter gust_direction ["rad"] "Direction that the gust blows to, in the road frame at the start", min P_MIN.gust_direction, max P_MAX.gust_direction => parameters.gust_direction;
        Parameter steer_amplitude ["rad"] "Steering angle of the manoeuvres step_steer and sine_with_dwell, added behind the actuator", min P_MIN.steer_amplitude, max P_MAX.steer_amplitude => parameters.steer_amplitude;
        Parameter road_tolerance ["m"] "How far the smooth line may miss the points of a road file, root mean square; 0: not at all", min P_MIN.road_tolerance, max P_MAX.road_tolerance => parameters.road_tolerance;
        Parameter radius ["m"] "Radius of the manoeuvre constant_radius, positive to the left, at least 5 to either side", min P_MIN.radius, max P_MAX.radius => parameters.radius;
        Parameter laps "Laps of a closed track until it is finished", min P_MIN.laps as f64, max P_MAX.laps as f64 => parameters.laps;
        Output lap "Completed laps of a closed track", depends &[] => outputs.lap;
        Output slip_f ["1"] "Front slip angle over that of the peak force; 0 if the tyre has no peak", min 0.0, depends &["delta"] => outputs.slip_f;
        Output slip_r ["1"] "Rear slip angle over that of the peak force; 0 if the tyre has no peak", min 0.0, depends &[] => outputs.slip_r;
        Output mu_ref [PREVIEW] ["1"] "Friction of the road now (element 1) and where the reference will be at the next 40 sample times", terminal "preview", depends &[], depends_initially &["mu_scale"] => preview.mu_ref;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_follow_the_order_of_the_table() {
        let count = table().rows.iter().filter(|row| row.role == Role::Input).count();
        assert_eq!(count, INPUTS.len());
        for reference in 0_u32..5 {
            let mut plant = VehiclePlant { inputs: along([(reference, 3.0)].into_iter()), ..VehiclePlant::default() };
            assert_eq!(real(&plant, reference), Some(3.0), "{}", name(reference));
            plant.inputs = Inputs::ZERO;
            assert_eq!(real(&plant, reference), Some(0.0), "{}", name(reference));
        }
    }
}

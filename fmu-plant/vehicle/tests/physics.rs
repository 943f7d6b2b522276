//! The motion against closed forms: understeer gradient, frequency response, energy, symmetry, drag, slopes.

mod driver;

use driver::{drive, vehicle};
use vehicle::{
    Inputs, Parameters, Road, Vehicle,
    dynamics::{self, Drive, Dynamics, NX},
    integrate,
    tyre::Preset,
};

/// No resistance and linear tyres: what the textbook's linear bicycle knows.
fn bare() -> Parameters {
    Parameters { tyre: Preset::Linear, c_d: 0.0, c_s: 0.0, c_rr: 0.0, speed: 20.0, ..Parameters::default() }
}

/// Stiffnesses of the linear preset [N/rad].
const C_F: f64 = 38_000.0;
const C_R: f64 = 66_000.0;

/// Kinetic energy [J].
fn energy(p: &Parameters, x: &[f64; NX]) -> f64 {
    0.5 * p.m * (x[dynamics::V_X].powi(2) + x[dynamics::V_Y].powi(2)) + 0.5 * p.i_z * x[dynamics::YAW_RATE].powi(2)
}

#[test]
fn steady_state_yaw_rate_follows_the_understeer_gradient() {
    let p = bare();
    let (l, v, delta) = (p.l_f + p.l_r, 20.0, 1e-3);
    let mut vehicle = vehicle("straight", p.clone());
    for _ in 0..300 {
        // The speed is held against the tiny component of the front force.
        let a_x = 50.0 * (v - vehicle.outputs().v_x_true);
        vehicle.advance(0.01, &Inputs { delta, a_x, ..Inputs::default() }).unwrap();
    }
    let gradient = p.m / l * (p.l_r / C_F - p.l_f / C_R);
    let want = v * delta / (l + gradient * v * v);
    let got = vehicle.outputs().yaw_rate_true;
    // The closed form is linear; the squares of angles of 1e-3 rad remain.
    assert!((got / want - 1.0).abs() < 2e-5, "{got} for {want}");
}

#[test]
fn frequency_response_is_that_of_the_linear_bicycle() {
    let p = bare();
    let v = 20.0;
    for hertz in [0.2, 1.0, 2.0] {
        let omega = std::f64::consts::TAU * hertz;
        // (j w - A) x = B for x = [v_y, yaw rate], solved by Cramer's rule in complex numbers (re, im).
        let a = [
            [-(C_F + C_R) / (p.m * v), -(C_F * p.l_f - C_R * p.l_r) / (p.m * v) - v],
            [-(C_F * p.l_f - C_R * p.l_r) / (p.i_z * v), -(C_F * p.l_f * p.l_f + C_R * p.l_r * p.l_r) / (p.i_z * v)],
        ];
        let b = [C_F / p.m, C_F * p.l_f / p.i_z];
        let det = (a[0][0] * a[1][1] - a[0][1] * a[1][0] - omega * omega, -omega * (a[0][0] + a[1][1]));
        let numerator = (a[1][0] * b[0] - a[0][0] * b[1], omega * b[1]);
        let square = det.0 * det.0 + det.1 * det.1;
        let want = (
            (numerator.0 * det.0 + numerator.1 * det.1) / square,
            (numerator.1 * det.0 - numerator.0 * det.1) / square,
        );

        let mut vehicle = vehicle("straight", p.clone());
        let (amplitude, h) = (1e-4, 1e-3);
        let period = (1000.0 / hertz).round();
        let (mut t, mut sine, mut cosine) = (0.0, 0.0, 0.0);
        for step in 0..10_000_u32 {
            let inputs = Inputs { delta: amplitude * (omega * t).sin(), ..Inputs::default() };
            let rates = Inputs { delta: amplitude * omega * (omega * t).cos(), ..Inputs::ZERO };
            vehicle.advance_along(h, &inputs, &rates).unwrap();
            t += h;
            // The last whole period, after all transients.
            if f64::from(step) >= 10_000.0 - period {
                let yaw_rate = vehicle.outputs().yaw_rate_true / amplitude;
                sine += 2.0 / period * yaw_rate * (omega * t).sin();
                cosine += 2.0 / period * yaw_rate * (omega * t).cos();
            }
        }
        // The command is a chain of tangents: its error is (w h)^2 / 2 = 8e-5 at 2 Hz.
        assert!((sine - want.0).abs() < 2e-4 * want.0.hypot(want.1), "{hertz} Hz: {sine} for {}", want.0);
        assert!((cosine - want.1).abs() < 2e-4 * want.0.hypot(want.1), "{hertz} Hz: {cosine} for {}", want.1);
    }
}

#[test]
fn tyres_take_exactly_the_energy_that_the_motion_loses() {
    let p = Parameters { c_d: 0.0, c_s: 0.0, c_rr: 0.0, ..Parameters::default() };
    let mut vehicle = vehicle("straight", Parameters { v_x_0: 22.0, ..p.clone() });
    let inputs = Inputs { delta: 0.12, ..Inputs::default() };
    let start = energy(&p, &vehicle.truth().x);
    let power = |vehicle: &Vehicle| {
        let o = vehicle.outputs_under(&inputs);
        let front = inputs.delta.cos() * (o.v_y_true + p.l_f * o.yaw_rate_true) - inputs.delta.sin() * o.v_x_true;
        o.f_yf * front + o.f_yr * (o.v_y_true - p.l_r * o.yaw_rate_true)
    };
    let (h, mut work) = (1e-3, 0.0);
    for _ in 0..1000 {
        // Simpson's rule over two steps of 1 ms.
        let mut three = [power(&vehicle), 0.0, 0.0];
        for slot in &mut three[1..] {
            vehicle.advance(h, &inputs).unwrap();
            *slot = power(&vehicle);
        }
        work += h / 3.0 * (three[0] + 4.0 * three[1] + three[2]);
    }
    let lost = energy(&p, &vehicle.truth().x) - start;
    assert!(lost < -50_000.0, "the manoeuvre is too mild to tell: {lost} J");
    assert!((work - lost).abs() < 1e-6 * lost.abs(), "{work} J for {lost} J");
}

#[test]
fn left_and_right_are_mirror_images() {
    let everything = Parameters {
        load_transfer: true,
        combined_slip: true,
        relaxation_length: 0.3,
        tau_delta: 0.05,
        delta_rate_max: 0.5,
        ..Parameters::default()
    };
    for parameters in [Parameters::default(), everything] {
        let mirrored = |side: f64| {
            let p = Parameters { e_y_0: side * 0.4, e_psi_0: side * 0.1, bank: side * 0.02, ..parameters.clone() };
            let mut vehicle = vehicle("straight", p);
            for i in 0..400 {
                let delta = side * 0.1 * (f64::from(i) * 0.05).sin();
                let inputs = Inputs { delta, a_x: -1.0, wind_speed: 10.0, wind_direction: side * 1.2, mu_scale: 0.9 };
                vehicle.advance(0.01, &inputs).unwrap();
            }
            vehicle.truth().x
        };
        let (left, right) = (mirrored(1.0), mirrored(-1.0));
        for i in 0..NX {
            let even = [dynamics::V_X, dynamics::S, dynamics::X].contains(&i);
            let sign = if even { 1.0 } else { -1.0 };
            assert!(
                (left[i] - sign * right[i]).abs() <= 1e-12 * left[i].abs(),
                "{}: {} and {}",
                dynamics::NAMES[i],
                left[i],
                right[i]
            );
        }
    }
}

#[test]
fn integrator_converges_with_fourth_order_on_the_vehicle() {
    let p = Parameters::default();
    let road = Road::named("general", &p).unwrap();
    let dynamics = Dynamics::new(&p);
    let drive = Drive {
        delta: 0.06,
        sin_delta: 0.06_f64.sin(),
        cos_delta: 0.06_f64.cos(),
        a_x: 0.5,
        wind_x: 3.0,
        wind_y: -4.0,
        mu_scale: 1.0,
    };
    let mut start = [0.0; NX];
    start[dynamics::V_X] = 15.0;
    let end = |n: u32| {
        let h = 1.0 / f64::from(n);
        (0..n).fold(start, |x, _| integrate::rk4(&x, h, |_, x| dynamics.rates(&road, x, &drive)))
    };
    let exact = end(6400);
    let error = |n: u32| end(n).iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let order = (error(50) / error(200)).log2() / 2.0;
    // The cubic pieces of the road's tables break the fifth derivative, which costs a little.
    assert!((3.8..4.6).contains(&order), "order {order}, errors {} and {}", error(50), error(200));
}

#[test]
fn head_wind_brakes_as_the_paper_says_and_side_wind_pushes() {
    let p = Parameters { c_rr: 0.0, ..Parameters::default() };
    let vehicle = vehicle("straight", Parameters { v_x_0: 20.0, ..p.clone() });
    let head = Inputs { wind_speed: 15.0, wind_direction: std::f64::consts::PI, ..Inputs::default() };
    let want = -0.5 * p.rho * p.c_d * p.area * 35.0_f64.powi(2) / p.m;
    let got = vehicle.outputs_under(&head).a_long;
    assert!((got - want).abs() < 1e-12, "{got} for {want}");
    let side = Inputs { wind_speed: 15.0, wind_direction: std::f64::consts::FRAC_PI_2, ..Inputs::default() };
    let got = vehicle.outputs_under(&side);
    let want = 0.5 * p.rho * p.c_s * p.area_side * 25.0 * 15.0 / p.m;
    assert!((got.a_lat - want).abs() < 1e-12, "{} for {want}", got.a_lat);
    let want = -0.5 * p.rho * p.c_d * p.area * 25.0 * 20.0 / p.m;
    assert!((got.a_long - want).abs() < 1e-12, "{} for {want}", got.a_long);
    let moment = vehicle.outputs_rate(&side).yaw_rate_true * p.i_z;
    let want = p.arm_side * got.a_lat * p.m;
    assert!((moment - want).abs() < 1e-9 * want, "{moment} for {want}");
}

#[test]
fn coasting_uphill_trades_speed_for_height() {
    let p = Parameters { c_d: 0.0, c_s: 0.0, c_rr: 0.0, grade: 0.1, v_x_0: 25.0, ..Parameters::default() };
    let mut vehicle = vehicle("straight", p.clone());
    vehicle.advance(5.0, &Inputs::default()).unwrap();
    let o = vehicle.outputs();
    let height = o.s * p.grade.sin();
    let want = (25.0_f64.powi(2) - 2.0 * p.g * height).sqrt();
    assert!((o.v_x_true - want).abs() < 1e-9, "{} for {want}", o.v_x_true);
}

#[test]
fn a_banked_circle_needs_no_lateral_force() {
    // v^2 / r = g tan(bank): the outer, right side is up in a left circle, so the bank is negative.
    let (radius, bank) = (100.0, -0.2_f64);
    let v = (radius * 9.81 * (-bank).sin()).sqrt();
    let p = Parameters { bank, radius, speed: v, c_d: 0.0, c_s: 0.0, c_rr: 0.0, ..Parameters::default() };
    let mut vehicle = vehicle("constant_radius", p);
    drive(&mut vehicle, 900, 1, |_| ()).unwrap();
    let o = vehicle.outputs();
    assert!(o.s > 150.0 && !o.finished, "not in the circle: {} m", o.s);
    // The driver's proportional feedback leaves offsets of centimetres; the tyres then carry percents of m v^2 / r.
    let needed = 1575.0 * v * v / radius;
    assert!((o.f_yf + o.f_yr).abs() < 0.02 * needed, "{} N of {needed} N", o.f_yf + o.f_yr);
}

#[test]
fn braking_leaves_the_rest_of_the_friction_circle() {
    let p = Parameters { combined_slip: true, v_x_0: 20.0, brake_front: 0.5, ..Parameters::default() };
    let mut vehicle = vehicle("straight", p.clone());
    vehicle.advance(0.2, &Inputs { delta: 0.2, ..Inputs::default() }).unwrap();
    let free = vehicle.outputs_under(&Inputs { delta: 0.2, ..Inputs::default() });
    let a_x = -4.0;
    let braked = vehicle.outputs_under(&Inputs { delta: 0.2, a_x, ..Inputs::default() });
    let load = p.m * p.g * p.l_f / (p.l_f + p.l_r);
    let share = 0.5 * p.m * a_x / (p.mu * load);
    let want = free.f_yr * (1.0 - share * share).sqrt();
    assert!((braked.f_yr - want).abs() < 1e-9 * want.abs(), "{} for {want}", braked.f_yr);
    // More than there is: the brakes saturate at the sum of both axles' grip.
    let locked = vehicle.outputs_under(&Inputs { a_x: -8.0, mu_scale: 0.5, ..Inputs::default() });
    assert!((locked.a_x_actual + 0.98 * 0.5 * p.mu * p.g).abs() < 1e-9, "{}", locked.a_x_actual);
    assert!((locked.grip_usage - 1.0).abs() < 0.02, "{}", locked.grip_usage);
}

#[test]
fn braking_loads_the_front_axle() {
    let p = Parameters { load_transfer: true, tyre: Preset::Linear, v_x_0: 20.0, ..Parameters::default() };
    let vehicle = vehicle("straight", Parameters { e_psi_0: 0.0, ..p.clone() });
    let a_x = -5.0;
    let ratio = |a_x| vehicle.outputs_under(&Inputs { delta: 0.01, a_x, ..Inputs::default() }).f_yf;
    let want = 1.0 - a_x * p.h_cg / (p.g * p.l_r);
    assert!((ratio(a_x) / ratio(0.0) - want).abs() < 1e-12, "{} for {want}", ratio(a_x) / ratio(0.0));
}

#[test]
fn tyre_force_builds_up_over_the_relaxation_length() {
    let p = Parameters { relaxation_length: 0.5, ..bare() };
    let mut vehicle = vehicle("straight", p);
    let inputs = Inputs { delta: 1e-3, ..Inputs::default() };
    // 1 ms at 20 m/s rolls 2 cm: the vehicle has hardly moved sideways, the slip is still the steering angle.
    vehicle.advance(1e-3, &inputs).unwrap();
    let want = C_F * 1e-3 * (1.0 - (-0.02_f64 / 0.5).exp());
    let got = vehicle.outputs().f_yf;
    assert!((got / want - 1.0).abs() < 2e-2, "{got} N for {want} N");
}

#[test]
fn ice_begins_where_the_patch_does() {
    let p = Parameters { patch_start: 50.0, patch_length: 20.0, patch_mu: 0.1, c_d: 0.0, ..Parameters::default() };
    let mut vehicle = vehicle("straight", Parameters { speed: 20.0, ..p });
    let inputs = Inputs { delta: 0.2, ..Inputs::default() };
    let mut peaks = [0.0_f64; 2];
    while vehicle.outputs().s < 68.0 {
        vehicle.advance(1e-3, &Inputs::default()).unwrap();
        let o = vehicle.outputs_under(&inputs);
        let slot = if o.s < 46.0 { 0 } else { 1 };
        if !(46.0..50.0).contains(&o.s) {
            peaks[slot] = peaks[slot].max(o.f_yf);
        }
    }
    assert!((peaks[1] / peaks[0] - 0.1).abs() < 1e-3, "{} N on ice, {} N before", peaks[1], peaks[0]);
}

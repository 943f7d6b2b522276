//! From standstill to speed and back: no singularity, no creeping, no free energy.

mod driver;

use driver::vehicle;
use vehicle::{
    Inputs, Parameters, Road, Vehicle,
    dynamics::{self, BLEND_FROM, BLEND_TO, Drive, Dynamics, NX},
};

fn speed(vehicle: &Vehicle) -> f64 {
    vehicle.truth().x[dynamics::V_X]
}

#[test]
fn starts_stops_stays_and_drives_away() {
    let mut vehicle = vehicle("straight", Parameters { v_x_0: 0.0, ..Parameters::default() });
    let run = |vehicle: &mut Vehicle, seconds: u32, a_x: f64| {
        for _ in 0..seconds * 100 {
            vehicle.advance(0.01, &Inputs { delta: 0.3, a_x, ..Inputs::default() }).unwrap();
        }
    };
    run(&mut vehicle, 5, 0.0);
    // Steering at rest moves nothing, bit for bit.
    assert!(vehicle.truth().x[..6].iter().all(|x| *x == 0.0), "{:?}", vehicle.truth().x);
    run(&mut vehicle, 4, 2.0);
    assert!(speed(&vehicle) > 4.0, "{} m/s", speed(&vehicle));
    run(&mut vehicle, 5, -4.0);
    let stopped = vehicle.truth().clone();
    assert!(speed(&vehicle).abs() < 1e-9, "{} m/s", speed(&vehicle));
    run(&mut vehicle, 60, -4.0);
    let crept = vehicle.truth().x[dynamics::X] - stopped.x[dynamics::X];
    assert!(crept.abs() < 1e-9, "crept by {crept} m");
    run(&mut vehicle, 3, 2.0);
    assert!(speed(&vehicle) > 3.0, "{} m/s", speed(&vehicle));
}

#[test]
fn from_standstill_to_forty_metres_per_second_nothing_jumps() {
    let mut car = vehicle("straight", Parameters { v_x_0: 0.0, c_d: 0.0, c_s: 0.0, ..Parameters::default() });
    let inputs = Inputs { delta: 0.002, a_x: 3.0, ..Inputs::default() };
    car.advance(1e-3, &inputs).unwrap();
    let mut before = car.outputs();
    while before.v_x_true < 40.0 {
        car.advance(1e-3, &inputs).unwrap();
        let now = car.outputs();
        assert!(now.v_x_true > before.v_x_true && now.yaw_rate_true > before.yaw_rate_true, "{now:?}");
        // The fastest changes are the fading-in of rolling resistance, 0.15 m/s2 over 0.17 s, and of the blend.
        for (name, a, b) in [("a_lat", now.a_lat, before.a_lat), ("a_long", now.a_long, before.a_long)] {
            assert!((a - b).abs() < 5e-3, "{name} jumps from {b} to {a} at {} m/s", now.v_x_true);
        }
        before = now;
    }
}

#[test]
fn brakes_end_in_standstill_and_never_in_reverse() {
    for a_x in [-0.5, -2.0, -8.0] {
        let mut vehicle = vehicle("straight", Parameters { v_x_0: 6.0, ..Parameters::default() });
        for _ in 0..20_000 {
            vehicle.advance(1e-3, &Inputs { a_x, ..Inputs::default() }).unwrap();
            assert!(speed(&vehicle) > -1e-12, "{} m/s", speed(&vehicle));
        }
    }
}

#[test]
fn below_the_blend_the_wheels_roll_where_they_point() {
    let p = Parameters { v_x_0: 0.5, c_rr: 0.0, c_d: 0.0, c_s: 0.0, ..Parameters::default() };
    let mut vehicle = vehicle("straight", p.clone());
    let delta: f64 = 0.4;
    // Stay below 1 m/s for a while: a circle around the rear axle's extension.
    vehicle.advance(10.0, &Inputs { delta, ..Inputs::default() }).unwrap();
    let o = vehicle.outputs();
    let yaw_rate = o.v_x_true * delta.tan() / (p.l_f + p.l_r);
    assert!((o.yaw_rate_true - yaw_rate).abs() < 1e-12, "{} for {yaw_rate}", o.yaw_rate_true);
    assert!((o.v_y_true - p.l_r * yaw_rate).abs() < 1e-12);
    assert!((o.alpha_f, o.alpha_r) == (0.0, 0.0));
}

#[test]
fn rolling_at_walking_pace_keeps_its_energy() {
    // With no resistance the rolling vehicle keeps its energy while it steers, but for the share that follows the rolling
    // motion with a lag: d(energy)/dt vanishes on the constraint, where the constraint forces do no work.
    let p = Parameters { v_x_0: 0.9, c_rr: 0.0, c_d: 0.0, c_s: 0.0, ..Parameters::default() };
    let mut vehicle = vehicle("straight", p.clone());
    let energy = |vehicle: &Vehicle| {
        let o = vehicle.outputs();
        0.5 * p.m * (o.v_x_true.powi(2) + o.v_y_true.powi(2)) + 0.5 * p.i_z * o.yaw_rate_true.powi(2)
    };
    let inputs = Inputs { delta: 0.5, ..Inputs::default() };
    vehicle.advance(1.0, &inputs).unwrap();
    let start = energy(&vehicle);
    vehicle.advance(20.0, &inputs).unwrap();
    assert!((energy(&vehicle) / start - 1.0).abs() < 1e-12, "{} of {start} J", energy(&vehicle));
    // And through the blend, steering may not create energy: what is gained is what the drive has given.
    let (start, mut driven) = (energy(&vehicle), 0.0);
    while vehicle.outputs().v_x_true < BLEND_TO + 0.5 {
        let before = vehicle.outputs().v_x_true;
        vehicle.advance(0.01, &Inputs { delta: 0.3, a_x: 1.0, ..Inputs::default() }).unwrap();
        driven += p.m * 0.01 * 0.5 * (before + vehicle.outputs().v_x_true);
    }
    let gained = energy(&vehicle) - start;
    // The two models disagree on side slip inside the blend; their mixture may create or lose 2 % of the drive's work.
    assert!(gained < driven * 1.02 && gained > driven * 0.9, "{gained} J of {driven} J");
    assert!(vehicle.outputs().v_x_true > BLEND_TO);
}

#[test]
fn right_hand_side_is_smooth_in_the_speed() {
    let p = Parameters::default();
    let (road, dynamics) = (Road::named("straight", &p).unwrap(), Dynamics::new(&p));
    let delta: f64 = 0.3;
    let drive = Drive {
        delta,
        sin_delta: delta.sin(),
        cos_delta: delta.cos(),
        a_x: -1.0,
        wind_x: 5.0,
        wind_y: 3.0,
        mu_scale: 1.0,
    };
    let rates = |v_x: f64| {
        let mut x = [0.0; NX];
        (x[dynamics::V_X], x[dynamics::V_Y], x[dynamics::YAW_RATE]) = (v_x, 0.1, 0.05);
        dynamics.rates(&road, &x, &drive)
    };
    let h = 1e-6;
    for edge in [0.0, 0.1, 0.5, BLEND_FROM, 2.0, BLEND_TO] {
        let (low, middle, high) = (rates(edge - h), rates(edge), rates(edge + h));
        for i in 0..NX {
            let (left, right) = ((middle[i] - low[i]) / h, (high[i] - middle[i]) / h);
            // Slopes of up to 500 1/s and their change over 1e-6 m/s, plus cancellation of values of 100.
            assert!((left - right).abs() < 0.05, "{} at {edge} m/s: slopes {left}, {right}", dynamics::NAMES[i]);
        }
    }
}

#[test]
fn a_head_wind_pushes_a_loose_car_back_and_brakes_hold_it() {
    let storm = Inputs { wind_speed: 45.0, wind_direction: std::f64::consts::PI, ..Inputs::default() };
    let mut loose = vehicle("straight", Parameters { v_x_0: 0.0, ..Parameters::default() });
    loose.advance(10.0, &storm).unwrap();
    assert!(speed(&loose) < -0.1, "{} m/s", speed(&loose));
    let mut held = vehicle("straight", Parameters { v_x_0: 0.0, ..Parameters::default() });
    held.advance(10.0, &Inputs { a_x: -5.0, ..storm }).unwrap();
    // Brakes act through a slope around standstill: 0.1 m/s times the ratio of the forces, over 1.5.
    assert!(speed(&held).abs() < 0.01, "{} m/s", speed(&held));
}

#[test]
fn a_road_without_speed_is_driven_and_previewed() {
    for name in vehicle::road::NAMES {
        let mut car = vehicle(name, Parameters { speed: 0.0, ..Parameters::default() });
        for a_x in [0.0, 1.0, -3.0] {
            car.advance(2.0, &Inputs { a_x, ..Inputs::default() }).unwrap();
            let preview = car.preview();
            assert!(preview.kappa_ref.iter().chain(&preview.v_x_ref).all(|value| value.is_finite()), "{name}");
        }
    }
    let standing = Road::from_csv("s,kappa,v_x\n0,0.01,0\n90000,0.01,0\n").unwrap();
    // The reference creeps through it: the preview is what lies here.
    let preview = standing.preview(50.0, 0.033, |_| 1.0);
    assert!(preview.v_x_ref.iter().all(|v| *v == 0.0) && preview.kappa_ref.iter().all(|k| (k - 0.01).abs() < 1e-12));
}

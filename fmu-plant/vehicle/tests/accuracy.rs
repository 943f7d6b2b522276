//! How exact the motion is, and that it does not depend on how time is cut.

mod driver;

use driver::{T_S, drive, vehicle};
use vehicle::{Inputs, Parameters, Road, Vehicle, dynamics};

/// Largest difference between two vehicles' states.
fn distance(a: &Vehicle, b: &Vehicle) -> f64 {
    a.truth().x.iter().zip(b.truth().x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Parameters with every dynamic extra of the actuators on.
fn with_actuators() -> Parameters {
    Parameters {
        delay_delta: 0.05,
        tau_delta: 0.05,
        delta_rate_max: 0.6,
        delay_a_x: 0.02,
        tau_a_x: 0.1,
        noise_scale: 0.1,
        ..Parameters::default()
    }
}

/// Drives the lane change with the commands of the first vehicle given to all, and returns all of them.
fn driven(parameters: &Parameters, road: &str, samples: u32, substeps: &[u32]) -> Vec<Vehicle> {
    let mut vehicles: Vec<Vehicle> = substeps.iter().map(|_| vehicle(road, parameters.clone())).collect();
    for _ in 0..samples {
        let inputs = driver::command(&vehicles[0]);
        for (vehicle, &n) in vehicles.iter_mut().zip(substeps) {
            for _ in 0..n {
                vehicle.advance(T_S / f64::from(n), &inputs).expect("the driver stays in range");
            }
        }
    }
    vehicles
}

#[test]
fn error_after_the_lane_change_is_below_1e_7() {
    // Steps of 50 us have an error 20^4 = 160000 times smaller than those of 1 ms: a reference by far.
    let vehicles = driven(&Parameters::default(), "double_lane_change", 420, &[33, 660]);
    assert!(vehicles[0].outputs().s > 190.0, "only {} m", vehicles[0].outputs().s);
    let error = distance(&vehicles[0], &vehicles[1]);
    assert!(error < 1e-9, "{error}");
}

#[test]
fn the_lane_change_is_driven_at_all() {
    let mut worst: f64 = 0.0;
    let mut vehicle = vehicle("double_lane_change", Parameters::default());
    drive(&mut vehicle, 440, 1, |v| worst = worst.max(v.outputs().e_y_true.abs())).unwrap();
    assert!(worst < 0.5, "{worst} m");
    assert!(vehicle.outputs().finished);
}

#[test]
fn communication_steps_that_divide_the_sample_time_agree() {
    for (name, parameters) in [("bare", Parameters::default()), ("actuators", with_actuators())] {
        for road in ["double_lane_change", "general"] {
            let vehicles = driven(&parameters, road, 420, &[1, 33, 2, 3, 11, 66]);
            for other in &vehicles[1..] {
                let error = distance(&vehicles[0], other);
                assert!(error < 1e-9, "{name}, {road}: {error}");
                let (a, b) = (vehicles[0].measurement(), other.measurement());
                assert!((a.e_y - b.e_y).abs() < 1e-9, "{name}, {road}: noise differs");
            }
        }
    }
}

#[test]
fn saved_vehicle_continues_with_the_same_bits() {
    let table = "x,y,v_x\n0,0,9\n10,0,9\n20,1,9\n30,3,9\n45,8,9\n60,16,9\n80,30,9\n";
    let csv = Vehicle::new(with_actuators(), Road::from_csv(table).unwrap()).unwrap();
    for mut one in [vehicle("general", with_actuators()), vehicle("iso_3888_2", with_actuators()), csv] {
        drive(&mut one, 100, 4, |_| ()).unwrap();
        let mut cloned = one.clone();
        let mut read: Vehicle = postcard::from_bytes(&postcard::to_stdvec(&one).unwrap()).unwrap();
        drive(&mut one, 100, 4, |_| ()).unwrap();
        for other in [&mut cloned, &mut read] {
            drive(other, 100, 4, |_| ()).unwrap();
            assert_eq!(one.truth(), other.truth());
            assert_eq!((one.measurement(), one.preview()), (other.measurement(), other.preview()));
        }
    }
}

#[test]
fn path_and_global_coordinates_agree() {
    // The pose of the path's point, integrated here from its curvature, plus the lateral error is where the car is.
    let mut vehicle = vehicle("general", Parameters { e_y_0: 0.5, ..Parameters::default() });
    drive(&mut vehicle, 1500, 1, |_| ()).unwrap();
    let outputs = vehicle.outputs();
    let n = 200_000;
    let h = outputs.s / f64::from(n);
    let start = vehicle.road().start();
    let mut pose = [0.0, start.x, start.y, start.psi];
    for _ in 0..n {
        pose = vehicle::integrate::rk4(&pose, h, |_, p| [1.0, p[3].cos(), p[3].sin(), vehicle.road().curvature(p[0])]);
    }
    let [_, x, y, psi] = pose;
    let (x, y) = (x - outputs.e_y_true * psi.sin(), y + outputs.e_y_true * psi.cos());
    assert!((x - outputs.x).hypot(y - outputs.y) < 1e-7, "{x} {y} for {} {}", outputs.x, outputs.y);
    assert!((outputs.psi - psi - outputs.e_psi_true).abs() < 1e-9);
}

#[test]
fn standstill_and_zero_friction_stay_finite() {
    let mut vehicle = vehicle("general", Parameters { v_x_0: 0.0, ..Parameters::default() });
    for a_x in [0.0, 3.0, -8.0, -8.0, 1.0] {
        for _ in 0..100 {
            vehicle.advance(T_S, &Inputs { delta: 0.3, a_x, mu_scale: 0.0, ..Inputs::default() }).unwrap();
        }
    }
    assert!(vehicle.truth().x[dynamics::V_X].is_finite());
}

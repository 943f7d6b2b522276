//! A simple driver gets round the manoeuvres, whose cones and laps are counted.

mod driver;

use driver::{T_S, drive, vehicle};
use vehicle::{Inputs, Parameters};

#[test]
fn driver_stays_on_every_manoeuvre() {
    for (road, speed, samples) in
        [("iso_3888_1", 12.0, 700), ("iso_3888_2", 11.0, 700), ("constant_radius", 12.0, 3700), ("circuit", 12.0, 2000)]
    {
        let mut vehicle = vehicle(road, Parameters { speed, ..Parameters::default() });
        let mut worst: f64 = 0.0;
        drive(&mut vehicle, samples, 1, |v| worst = worst.max(v.outputs().e_y_true.abs())).unwrap();
        let o = vehicle.outputs();
        assert!(o.finished && worst < 0.5, "{road}: {worst} m, at {} m of {}", o.s, vehicle.road().length());
        // The second course leaves a car 0.13 m beside its planned line, less than this driver's error.
        assert!(o.cones_hit == 0 || road == "iso_3888_2", "{road}: {} cones", o.cones_hit);
    }
    let mut blind = vehicle("iso_3888_1", Parameters { speed: 20.0, ..Parameters::default() });
    blind.advance(8.0, &Inputs::default()).unwrap();
    // Straight through the middle: the second lane is 3.5 m to the left, so its right edge is off by 2.3 m: no cone there,
    // and the car is 1.77 m wide.
    assert_eq!(blind.outputs().cones_hit, 0);
    let mut offset = vehicle("iso_3888_1", Parameters { speed: 20.0, e_y_0: 0.5, ..Parameters::default() });
    offset.advance(8.0, &Inputs::default()).unwrap();
    // 0.5 m + half the width of 0.885 m covers the left edge of the first lane (1.1 m) but not of the last.
    assert_eq!(offset.outputs().cones_hit, 6);
}

#[test]
fn laps_are_counted() {
    let p = Parameters { laps: 2, ..Parameters::default() };
    let mut vehicle = vehicle("circuit", p);
    let mut first = None;
    while !vehicle.outputs().finished {
        drive(&mut vehicle, 1, 1, |_| ()).unwrap();
        if vehicle.outputs().lap == 1 && first.is_none() {
            first = Some(vehicle.truth().time);
        }
        assert!(vehicle.truth().time < 200.0, "no second lap");
    }
    let ratio = vehicle.truth().time / first.unwrap();
    assert!((ratio - 2.0).abs() < 0.01, "second lap took {ratio} of the first");
    // The previews of two laps are the same.
    let length = vehicle.road().length();
    let (one, two) =
        (vehicle.road().preview(length - 5.0, T_S, |_| 1.0), vehicle.road().preview(2.0 * length - 5.0, T_S, |_| 1.0));
    assert!((one.kappa_ref - two.kappa_ref).amax() < 1e-9 && (one.v_x_ref - two.v_x_ref).amax() < 1e-9);
}

//! What the paper prints, beside what the plant does: each test shows one row of the errata.

mod driver;

use driver::vehicle;
use vehicle::{Inputs, Parameters, dynamics, tyre};

/// Eigenvalue with the largest real part of the lateral motion (v_y, yaw rate) with slip angles
/// `alpha_f = -(v_y + sign l_f w)/v`, `alpha_r = -(v_y - sign l_r w)/v`: `sign` 1 is the plant, -1 is as printed.
fn slowest_mode(v: f64, sign: f64) -> f64 {
    let p = Parameters::default();
    let (front, rear) = tyre::Axle::pair(&p);
    let load = p.m * p.g / (p.l_f + p.l_r);
    let (c_f, c_r) = (front.cornering_stiffness(p.mu, load * p.l_r), rear.cornering_stiffness(p.mu, load * p.l_f));
    let a = [
        [-(c_f + c_r) / (p.m * v), -sign * (c_f * p.l_f - c_r * p.l_r) / (p.m * v) - v],
        [-(c_f * p.l_f - c_r * p.l_r) / (p.i_z * v), -sign * (c_f * p.l_f * p.l_f + c_r * p.l_r * p.l_r) / (p.i_z * v)],
    ];
    let (trace, det) = (a[0][0] + a[1][1], a[0][0] * a[1][1] - a[0][1] * a[1][0]);
    let root = trace * trace / 4.0 - det;
    trace / 2.0 + if root > 0.0 { root.sqrt() } else { 0.0 }
}

#[test]
fn printed_slip_angles_destabilise_the_car() {
    for v in [5.0, 15.0, 25.0] {
        assert!(slowest_mode(v, 1.0) < -1.0, "the plant at {v} m/s: {}", slowest_mode(v, 1.0));
        // Yaw damping of the wrong sign.
        assert!(slowest_mode(v, -1.0) > 1.0, "as printed at {v} m/s: {}", slowest_mode(v, -1.0));
    }
    // And the plant itself damps a disturbance.
    let mut car = vehicle("straight", Parameters { e_psi_0: 0.05, ..Parameters::default() });
    car.advance(0.3, &Inputs { delta: 0.05, ..Inputs::default() }).unwrap();
    let disturbed = car.outputs().yaw_rate_true;
    car.advance(1.0, &Inputs::default()).unwrap();
    assert!(car.outputs().yaw_rate_true.abs() < 1e-2 * disturbed.abs());
}

#[test]
fn printed_heading_error_turns_on_a_straight_road() {
    // As printed, e_psi' = w - (v_x cos - v_y sin) / (1 - e_y k): straight on a straight road that is -v_x rad/s.
    let mut car = vehicle("straight", Parameters::default());
    car.advance(1.0, &Inputs::default()).unwrap();
    assert_eq!(car.outputs().e_psi_true, 0.0);
    let o = car.outputs();
    let printed = o.yaw_rate_true - o.v_x_true;
    assert!(printed < -10.0, "{printed} rad/s");
    // In a curve the heading error still is heading minus the path's heading.
    let mut car = vehicle("constant_radius", Parameters { speed: 10.0, ..Parameters::default() });
    driver::drive(&mut car, 500, 1, |_| ()).unwrap();
    let o = car.outputs();
    let want = o.psi - car.road().pose(o.s).psi;
    assert!(o.psi > 0.5 && (o.e_psi_true - want).abs() < 1e-8, "{} for {want}", o.e_psi_true);
}

#[test]
fn printed_resistance_brakes_at_eight_metres_per_second_squared() {
    let p = Parameters::default();
    let coasting = |c_rr: f64| {
        let car = vehicle("straight", Parameters { c_rr, c_d: 0.0, ..Parameters::default() });
        car.outputs().a_long
    };
    assert!((coasting(p.c_rr) + p.c_rr * p.g).abs() < 1e-12);
    assert!(-coasting(p.c_rr) < 0.2, "rolling resistance of a car is below 0.2 m/s2");
    assert!(p.mu * p.g > 8.0, "mu m g is an emergency stop");
}

#[test]
fn secant_stiffness_continues_through_zero_slip() {
    let p = Parameters::default();
    let load = p.m * p.g * p.l_r / (p.l_f + p.l_r);
    let (front, _) = tyre::Axle::pair(&p);
    let c_0 = front.cornering_stiffness(p.mu, load);
    for alpha in [0.0, 1e-12, 1e-9, 1e-7, 1e-6, 1e-4] {
        let c = tyre::secant_stiffness(front.force(alpha, p.mu, load), alpha, c_0);
        // At 1e-4 rad the magic formula has bent by (B alpha)^2 = 1e-6.
        assert!((c / c_0 - 1.0).abs() < 2e-6, "{c} at {alpha} rad for {c_0}");
    }
    let car = vehicle("straight", Parameters::default());
    assert!((car.outputs().c_f_true / c_0 - 1.0).abs() < 1e-12 && car.truth().x[dynamics::V_Y] == 0.0);
}

#[test]
fn presets_have_the_stiffnesses_that_are_documented() {
    for (preset, c_f, c_r) in [
        (tyre::Preset::DryAsphalt, 101e3, 76e3),
        (tyre::Preset::Alcala, 58.9e3, 44.7e3),
        (tyre::Preset::Linear, 38e3, 66e3),
    ] {
        let p = Parameters { tyre: preset, ..Parameters::default() };
        let load = p.m * p.g / (p.l_f + p.l_r);
        let (front, rear) = tyre::Axle::pair(&p);
        for (axle, load, want) in [(front, load * p.l_r, c_f), (rear, load * p.l_f, c_r)] {
            let got: f64 = axle.cornering_stiffness(p.mu, load);
            assert!((got / want - 1.0).abs() < 5e-3, "{preset:?}: {got} for {want}");
        }
    }
}

//! The controller finds out what tyres and road it drives on, in loops whose tyres are a magic formula that the test knows.
#![allow(clippy::unwrap_used, reason = "a test may panic, in its helpers too")]

use std::fs;
use std::path::Path;

use lpv_mpc::jordan::Network;
use lpv_mpc::model::{A_X, DELTA, Disturbance, E_PSI, E_Y, Input, State, Tyres, V_X, V_Y, YAW_RATE, derivative};
use lpv_mpc::preview::Preview;
use lpv_mpc::{Controller, Inputs, Parameters};

/// Step of the plant and of the exchange [s].
const H: f64 = 0.001;
/// A slalom of 6 m/s2 at 15 m/s: three quarters of the grip that the controller believes in.
const CURVATURE: f64 = 0.0267;

/// Secant stiffness of the default tyre, the magic formula with B 10, C 1.4, E 0, under a load [N/rad].
fn secant(alpha: f64, mu: f64, load: f64) -> f64 {
    let alpha = alpha.abs().max(1e-6);
    mu * load * (1.4 * (10.0 * alpha).atan()).sin() / alpha
}

/// Believed over true stiffness, front and rear, after a slalom at friction `mu` that nobody tells, and the largest lateral error
/// in its last second [m].
fn slalom(mu: f64, disturbance: Disturbance) -> ([f64; 2], f64) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../resources/jordan.json");
    let network = Network::from_json(&fs::read_to_string(file).unwrap()).unwrap();
    let p = Parameters::adaptive();
    let body = p.body();
    let per_metre = p.m * p.g / (p.l_f + p.l_r);
    let kappa = |t: f64| CURVATURE * (2.0 * t).sin() * (t / 2.0).min(1.0);
    let mut controller = Controller::with_network(p.clone(), 0.0, network).unwrap();
    let mut x = State::from([15.0, 0.0, 0.0, 0.0, 0.0]);
    let (mut ratios, mut worst) = ([0.0; 2], 0.0_f64);
    for k in 0..7000 {
        let t = f64::from(k) * H;
        let inputs = Inputs {
            v_x: x[V_X],
            v_y: x[V_Y],
            yaw_rate: x[YAW_RATE],
            e_y: x[E_Y],
            e_psi: x[E_PSI],
            kappa_ref: Preview::from_fn(|i, _| kappa(t + i as f64 * p.t_s)),
            v_x_ref: Preview::repeat(15.0),
            ..Inputs::default()
        };
        let u = Input::from([controller.output().delta, controller.output().a_x]);
        let alpha_f = u[DELTA] - ((x[V_Y] + p.l_f * x[YAW_RATE]) / x[V_X]).atan();
        let alpha_r = -((x[V_Y] - p.l_r * x[YAW_RATE]) / x[V_X]).atan();
        let truth = [secant(alpha_f, mu, per_metre * p.l_r), secant(alpha_r, mu, per_metre * p.l_f)];
        controller.advance(t, H, &inputs).unwrap();
        // Secants of the present slip, held over 1 ms: they change by less than 1 % in it.
        let u = Input::from([u[DELTA], u[A_X]]);
        x += derivative(&x, &u, kappa(t), &body, &Tyres::secant(truth[0], truth[1]), &disturbance) * H;
        if t > 6.0 {
            ratios = [controller.output().c_f / truth[0], controller.output().c_r / truth[1]];
            worst = worst.max(x[E_Y].abs());
        }
    }
    (ratios, worst)
}

#[test]
fn friction_that_nobody_tells_is_found() {
    for mu in [0.68, 0.82, 1.0] {
        let ([front, rear], worst) = slalom(mu, Disturbance::zeros());
        // The belief is up to 33 ms old, in which the secants change by some percent.
        assert!((front - 1.0).abs() < 0.06 && (rear - 1.0).abs() < 0.06, "{front} {rear} of the stiffness at {mu}");
        assert!(worst < 0.02, "{worst} m at {mu}");
    }
}

#[test]
fn side_wind_leaves_the_tyres_as_they_are_believed() {
    let ([front, rear], _) = slalom(0.82, Disturbance::from([0.0, 1.5, 0.3]));
    assert!((front - 1.0).abs() < 0.06 && (rear - 1.0).abs() < 0.06, "{front} {rear}");
}

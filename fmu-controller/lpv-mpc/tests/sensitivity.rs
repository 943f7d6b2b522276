//! The exact derivative of command and plan against central differences of whole controller steps.
#![allow(clippy::unwrap_used, reason = "a test may panic, in its helpers too")]

use std::fs;
use std::path::Path;

use lpv_mpc::jordan::Network;
use lpv_mpc::preview::Preview;
use lpv_mpc::{Adaptation, Controller, Error, Estimation, Inputs, Output, Parameters, Status, TerminalCost};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const H: f64 = 0.011;

/// A slalom whose measurements wander, so that no derivative vanishes by symmetry.
fn inputs(t: f64) -> Inputs {
    inputs_at(14.0, t)
}

/// The slalom at a speed [m/s].
fn inputs_at(speed: f64, t: f64) -> Inputs {
    Inputs {
        v_x: speed + 0.3 * t.sin(),
        v_y: 0.1 * (2.0 * t).sin(),
        yaw_rate: 0.1 * (1.5 * t).sin(),
        e_y: 0.02 * (1.1 * t).cos(),
        e_psi: 0.01 * (0.7 * t).sin(),
        kappa_ref: Preview::from_fn(|i, _| 0.006 * (1.5 * (t + i as f64 * 0.033)).sin()),
        v_x_ref: Preview::from_fn(|i, _| speed + 0.2 * (t + i as f64 * 0.033).cos()),
        mu_ref: Preview::from_fn(|i, _| 0.7 + 0.2 * (2.0 * t + i as f64 * 0.066).sin()),
        ..Inputs::default()
    }
}

fn zero() -> Inputs {
    Inputs::default()
}

fn directions() -> Vec<(&'static str, Inputs)> {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut draw = || rng.random_range(-1.0..1.0);
    let curvature = Preview::from_fn(|_, _| 0.01 * draw());
    let speed = Preview::from_fn(|_, _| draw());
    let friction = Preview::from_fn(|_, _| draw());
    vec![
        ("v_x", Inputs { v_x: 1.0, ..zero() }),
        ("v_y", Inputs { v_y: 1.0, ..zero() }),
        ("yaw_rate", Inputs { yaw_rate: 1.0, ..zero() }),
        ("e_y", Inputs { e_y: 1.0, ..zero() }),
        ("e_psi", Inputs { e_psi: 1.0, ..zero() }),
        ("kappa_ref", Inputs { kappa_ref: curvature, ..zero() }),
        ("v_x_ref", Inputs { v_x_ref: speed, ..zero() }),
        ("mu_ref", Inputs { mu_ref: friction, ..zero() }),
    ]
}

fn quantities(o: &Output) -> Vec<f64> {
    let mut all = vec![o.delta, o.a_x];
    for trajectory in [o.e_y_pred, o.e_psi_pred, o.v_x_pred, o.v_y_pred, o.yaw_rate_pred, o.delta_pred, o.a_x_pred] {
        all.extend(trajectory.iter());
    }
    all
}

fn advanced(controller: &Controller, t: f64, inputs: &Inputs) -> Controller {
    let mut next = controller.clone();
    next.advance(t, H, inputs).unwrap();
    next
}

fn compare(parameters: &Parameters) {
    compare_from(Controller::new(parameters.clone(), 0.0).unwrap(), inputs);
}

fn compare_from(mut controller: Controller, inputs: impl Fn(f64) -> Inputs) {
    for k in 0..30 {
        let t = f64::from(k) * H;
        let at = inputs(t);
        let after = advanced(&controller, t, &at);
        if k > 3 && after.samples() > controller.samples() {
            assert_eq!(after.output().status, Status::Optimal);
            for (name, direction) in directions() {
                let exact = quantities(&after.along(&direction).unwrap());
                // Central differences: third derivatives times 1e-12, rounding of 1e-16 times a gain over 1e-6, and few bends
                // of the speed limits within.
                let eps = 1e-6;
                let ahead = quantities(advanced(&controller, t, &at.moved(&direction, eps)).output());
                let behind = quantities(advanced(&controller, t, &at.moved(&direction, -eps)).output());
                for (i, exact) in exact.into_iter().enumerate() {
                    let difference = (ahead[i] - behind[i]) / (2.0 * eps);
                    let tolerance = 1e-5 * (1.0 + difference.abs());
                    assert!((exact - difference).abs() < tolerance, "{name}, quantity {i}: {exact} for {difference}");
                }
            }
        }
        controller = after;
    }
}

#[test]
fn derivative_is_the_limit_of_differences() {
    compare(&Parameters::default());
}

#[test]
fn derivative_goes_through_lags_and_delay() {
    compare(&Parameters { tau_delta: 0.1, tau_a_x: 0.2, input_delay: 0.05, ..Parameters::default() });
}

#[test]
fn derivative_goes_through_the_limit_of_speed() {
    // 0.1 of the grip: the slalom then asks for less speed nearly everywhere.
    compare(&Parameters { grip_max: 0.1, ..Parameters::default() });
}

#[test]
fn derivative_of_the_papers_controller() {
    compare(&Parameters { estimation: Estimation::Measured, ..Parameters::default() });
}

#[test]
fn derivative_with_the_cost_of_driving_on() {
    compare(&Parameters { terminal_cost: TerminalCost::Riccati, ..Parameters::default() });
}

#[test]
fn derivative_where_steering_is_dear() {
    // 25 m/s and 0.2 s of delay make the increments of steering weigh more than twenty times as much.
    for terminal_cost in [TerminalCost::StageWeights, TerminalCost::Riccati] {
        let parameters = Parameters { input_delay: 0.2, terminal_cost, ..Parameters::default() };
        compare_from(Controller::new(parameters, 0.0).unwrap(), |t| inputs_at(25.0, t));
    }
}

fn network() -> Network {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../resources/jordan.json");
    Network::from_json(&fs::read_to_string(file).unwrap()).unwrap()
}

#[test]
fn derivative_follows_the_network_along_the_horizon() {
    compare_from(Controller::with_network(Parameters::adaptive(), 0.0, network()).unwrap(), inputs);
}

#[test]
fn derivative_goes_through_what_the_network_believes_now() {
    let parameters = Parameters { adaptation: Adaptation::NetworkNow, ..Parameters::default() };
    compare_from(Controller::with_network(parameters, 0.0, network()).unwrap(), inputs);
}

#[test]
fn an_unmeasured_velocity_has_no_influence() {
    let parameters = Parameters { v_y_measured: false, ..Parameters::default() };
    compare(&parameters);
    let mut controller = Controller::new(parameters, 0.0).unwrap();
    controller.advance(0.0, 0.033, &inputs(0.0)).unwrap();
    controller.advance(0.033, 0.033, &inputs(0.033)).unwrap();
    assert_eq!(controller.along(&Inputs { v_y: 1.0, ..zero() }).unwrap().delta, 0.0);
}

#[test]
fn between_samples_nothing_depends_on_the_inputs() {
    let mut controller = Controller::new(Parameters::default(), 0.0).unwrap();
    controller.advance(0.0, 0.001, &inputs(0.0)).unwrap();
    controller.advance(0.001, 0.001, &inputs(0.001)).unwrap();
    let derivative = controller.along(&Inputs { e_y: 1.0, ..zero() }).unwrap();
    assert!(quantities(&derivative).iter().all(|d| *d == 0.0));
}

#[test]
fn where_there_is_no_derivative_the_reason_is_given() {
    let mut controller = Controller::new(Parameters::default(), 0.0).unwrap();
    controller.advance(0.0, 0.001, &inputs(0.0)).unwrap();
    assert!(matches!(controller.along(&zero()), Err(Error::NoDerivative(_))), "the first plan");
    controller.advance(0.001, 0.1, &inputs(0.0)).unwrap();
    assert!(matches!(controller.along(&zero()), Err(Error::NoDerivative(_))), "three samples in one step");
}

//! A step of the whole controller allocates nothing, whatever is chosen: counted by the allocator itself.
#![allow(clippy::unwrap_used, reason = "a test may panic, in its helpers too")]

use std::hint::black_box;

use allocation_counter::measure;
use lpv_mpc::jordan::Network;
use lpv_mpc::model::{Disturbance, E_PSI, E_Y, Input, State, V_X, V_Y, YAW_RATE, derivative};
use lpv_mpc::preview::Preview;
use lpv_mpc::{Adaptation, Controller, Inputs, Parameters, Status, TerminalCost};

const SAMPLES: u32 = 150;

/// What was seen on a drive.
#[derive(Default)]
struct Drive {
    /// Allocations of all steps.
    allocations: u64,
    /// Samples with an optimal plan.
    optimal: u32,
    /// Samples with an optimal plan from an estimate.
    estimated: u32,
    /// Samples in which the steering moved as fast as it may.
    saturated: u32,
}

/// Drives a slalom that is braked from 20 to 8 m/s, from `e_y` [m] beside it. Every `missing`th sample lacks lateral
/// velocity and lateral error.
fn drive(parameters: Parameters, e_y: f64, missing: Option<u32>) -> Drive {
    let network = Network::from_json(include_str!("../../resources/jordan.json")).unwrap();
    let (t_s, body, tyres) = (parameters.t_s, parameters.body(), parameters.nominal_tyres());
    let steering_step = parameters.delta_rate_max * t_s;
    let mut controller = Controller::with_network(parameters, 0.0, network).unwrap();
    let copied = measure(|| drop(black_box(controller.clone())));
    assert!(copied.count_total > 0, "nothing is counted");
    let mut x = State::from([20.0, 0.0, 0.0, e_y, 0.0]);
    let mut seen = Drive::default();
    for k in 0..SAMPLES {
        let t = f64::from(k) * t_s;
        let kappa = |t: f64| 0.008 * (1.5 * t).sin();
        let mut inputs = Inputs {
            v_x: x[V_X],
            v_y: x[V_Y],
            yaw_rate: x[YAW_RATE],
            e_y: x[E_Y],
            e_psi: x[E_PSI],
            kappa_ref: Preview::from_fn(|i, _| kappa(t + i as f64 * t_s)),
            v_x_ref: Preview::from_fn(|i, _| (20.0 - 3.0 * (t + i as f64 * t_s)).max(8.0)),
            ..Inputs::default()
        };
        if missing.is_some_and(|every| k % every == every - 1) {
            (inputs.v_y, inputs.e_y) = (f64::NAN, f64::NAN);
        }
        let applied = Input::from([controller.output().delta, controller.output().a_x]);
        seen.allocations += measure(|| controller.advance(t, t_s, &inputs).unwrap()).count_total;
        seen.optimal += u32::from(controller.output().status == Status::Optimal);
        seen.estimated += u32::from(controller.output().status == Status::Estimated);
        // Less by the rounding of a difference.
        seen.saturated += u32::from((controller.output().delta - applied[0]).abs() > steering_step * (1.0 - 1e-9));
        for _ in 0..33 {
            // Euler's rule: the car only has to be plausible.
            x += derivative(&x, &applied, kappa(t), &body, &tyres, &Disturbance::zeros()) * (t_s / 33.0);
        }
    }
    seen
}

#[test]
fn steps_do_not_allocate() {
    let constant = Parameters { adaptation: Adaptation::Constant, ..Parameters::default() };
    let riccati = Parameters { terminal_cost: TerminalCost::Riccati, ..constant.clone() };
    let lags = |p: &Parameters| Parameters { tau_delta: 0.05, tau_a_x: 0.1, input_delay: 0.02, ..p.clone() };
    for (name, parameters, e_y) in [
        ("paper", Parameters::paper(), 0.0),
        ("constant", constant.clone(), 0.0),
        ("network now", Parameters { adaptation: Adaptation::NetworkNow, ..constant.clone() }, 0.0),
        ("network along the horizon", Parameters::adaptive(), 0.0),
        ("lags and delay", lags(&constant), 0.0),
        ("Riccati", riccati.clone(), 0.0),
        ("Riccati, lags and delay", lags(&riccati), 0.0),
        ("far off the path", constant, 3.0),
    ] {
        let Drive { allocations, optimal, .. } = drive(parameters, e_y, None);
        assert_eq!(allocations, 0, "{name}");
        assert!(optimal > SAMPLES * 9 / 10, "{name}: the drive must be one, {optimal} optimal plans");
    }
}

#[test]
fn samples_without_some_measurements_do_not_allocate() {
    let every = 7;
    let seen = drive(Parameters { adaptation: Adaptation::Constant, ..Parameters::default() }, 0.0, Some(every));
    assert_eq!(seen.allocations, 0);
    let missing = SAMPLES / every;
    assert_eq!((seen.estimated, seen.optimal), (missing, SAMPLES - missing));
}

#[test]
fn steering_at_its_fastest_does_not_allocate() {
    // The slalom asks for about 0.03 rad/s.
    let slow = Parameters { delta_rate_max: 0.02, adaptation: Adaptation::Constant, ..Parameters::default() };
    let seen = drive(slow, 0.0, None);
    assert_eq!(seen.allocations, 0);
    assert!(seen.optimal > SAMPLES * 9 / 10, "the drive must be one, {} optimal plans", seen.optimal);
    assert!(seen.saturated > SAMPLES / 4, "the rate must bind, {} samples at it", seen.saturated);
}

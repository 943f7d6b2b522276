//! A step of the whole controller allocates nothing, whatever is chosen: counted by the allocator itself.
#![allow(clippy::unwrap_used, reason = "a test may panic, in its helpers too")]

mod counting;

use counting::allocations;
use lpv_mpc::jordan::Network;
use lpv_mpc::model::{Disturbance, E_PSI, E_Y, Input, State, V_X, V_Y, YAW_RATE, derivative};
use lpv_mpc::preview::Preview;
use lpv_mpc::{Adaptation, Controller, Inputs, Parameters, Status, TerminalCost};

const SAMPLES: u32 = 150;

/// Drives a slalom that is braked from 20 to 8 m/s, from `e_y` [m] beside it. Returns the allocations of all steps and how many
/// samples had an optimal plan.
fn drive(parameters: Parameters, e_y: f64) -> (usize, u32) {
    let network = Network::from_json(include_str!("../../resources/jordan.json")).unwrap();
    let (t_s, body, tyres) = (parameters.t_s, parameters.body(), parameters.nominal_tyres());
    let (built, controller) = allocations(|| Controller::with_network(parameters, 0.0, network).unwrap());
    assert!(built > 0, "nothing is counted");
    let mut controller = controller;
    let mut x = State::from([20.0, 0.0, 0.0, e_y, 0.0]);
    let (mut count, mut optimal) = (0, 0);
    for k in 0..SAMPLES {
        let t = f64::from(k) * t_s;
        let kappa = |t: f64| 0.008 * (1.5 * t).sin();
        let inputs = Inputs {
            v_x: x[V_X],
            v_y: x[V_Y],
            yaw_rate: x[YAW_RATE],
            e_y: x[E_Y],
            e_psi: x[E_PSI],
            kappa_ref: Preview::from_fn(|i, _| kappa(t + i as f64 * t_s)),
            v_x_ref: Preview::from_fn(|i, _| (20.0 - 3.0 * (t + i as f64 * t_s)).max(8.0)),
            ..Inputs::default()
        };
        let applied = Input::from([controller.output().delta, controller.output().a_x]);
        let (allocated, step) = allocations(|| controller.advance(t, t_s, &inputs));
        step.unwrap();
        count += allocated;
        optimal += u32::from(controller.output().status == Status::Optimal);
        for _ in 0..33 {
            // Euler's rule: the car only has to be plausible.
            x += derivative(&x, &applied, kappa(t), &body, &tyres, &Disturbance::zeros()) * (t_s / 33.0);
        }
    }
    (count, optimal)
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
        let (allocations, optimal) = drive(parameters, e_y);
        assert_eq!(allocations, 0, "{name}");
        assert!(optimal > SAMPLES * 9 / 10, "{name}: the drive must be one, {optimal} optimal plans");
    }
}

//! The whole controller while its inputs are wrong, missing, extreme or no numbers, and after it.
#![allow(clippy::unwrap_used, reason = "a test may panic, in its helpers too")]

mod loop_support;

use loop_support::{Loop, slalom, straight, turn};
use lpv_mpc::model::{A_X, DELTA, E_PSI, E_Y, Input, State, V_X, V_Y, YAW_RATE};
use lpv_mpc::{Controller, Estimation, Inputs, Parameters, Status};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

#[test]
fn commands_respect_bounds_and_rates_whatever_is_measured() {
    let parameters = Parameters { horizon: 20, ..Parameters::default() };
    let (delta_step, a_x_step) = (parameters.delta_rate_max * parameters.t_s, parameters.a_x_rate_max * parameters.t_s);
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let road = Loop::new(parameters.clone(), straight);
    let mut controller = Controller::new(parameters.clone(), 0.0).unwrap();
    let mut before: Input = Input::zeros();
    for k in 0..500 {
        let mut draw = |bound: f64| rng.random_range(-bound..bound);
        let x = State::from([15.0 + draw(15.0), draw(4.0), draw(2.0), draw(5.0), draw(1.5)]);
        controller.advance(f64::from(k) * 0.033, 0.033, &road.inputs(0.0, &x)).unwrap();
        let o = controller.output();
        let slack = 1e-9;
        assert!(o.delta.abs() <= parameters.delta_max + slack, "{}", o.delta);
        assert!((parameters.a_x_min - slack..=parameters.a_x_max + slack).contains(&o.a_x), "{}", o.a_x);
        assert!((o.delta - before[DELTA]).abs() <= delta_step + slack);
        assert!((o.a_x - before[A_X]).abs() <= a_x_step + slack);
        before = Input::from([o.delta, o.a_x]);
    }
}

/// Drives a straight with `spoil` applied to the inputs from 1 s on and returns the statuses and commands afterwards.
fn spoiled(spoil: fn(&mut Inputs)) -> Vec<(Status, f64, f64)> {
    let parameters = Parameters { horizon: 10, ..Parameters::default() };
    let road = Loop::new(parameters.clone(), slalom);
    let mut controller = Controller::new(parameters, 0.0).unwrap();
    let mut seen = Vec::new();
    for k in 0..100 {
        let t = f64::from(k) * 0.033;
        let mut inputs = road.inputs(t, &State::from([15.0, 0.0, 0.0, 0.02, 0.0]));
        if t > 1.0 {
            spoil(&mut inputs);
        }
        controller.advance(t, 0.033, &inputs).unwrap();
        let o = controller.output();
        assert!(o.delta.is_finite() && o.a_x.is_finite());
        if t > 1.0 {
            seen.push((o.status, o.delta, o.a_x));
        }
    }
    seen
}

#[test]
fn a_lost_sensor_is_replaced_by_its_estimate() {
    let seen = spoiled(|inputs| inputs.yaw_rate = f64::NAN);
    assert!(seen.iter().all(|(status, ..)| *status == Status::Estimated), "{:?}", seen[0]);
}

#[test]
fn a_car_that_sees_nothing_stops_and_holds_its_steering() {
    let seen = spoiled(|inputs| inputs.e_y = f64::INFINITY);
    assert_eq!(seen[0].0, Status::Estimated);
    let stop = seen.iter().position(|(status, ..)| *status == Status::SafeStop).expect("it never stops");
    assert_eq!(stop, 9, "after a horizon without position");
    let (_, held, _) = seen[stop];
    assert!(seen[stop..].iter().all(|(status, delta, _)| *status == Status::SafeStop && *delta == held));
    assert!(seen.last().unwrap().2 < -3.0, "it brakes");
}

#[test]
fn without_a_road_the_plan_is_executed_to_its_end() {
    let seen = spoiled(|inputs| inputs.kappa_ref[3] = f64::NAN);
    assert_eq!(seen[0].0, Status::PreviousPlan);
    assert_eq!(seen[8].0, Status::PreviousPlan);
    assert_eq!(seen[9].0, Status::SafeStop);
}

#[test]
fn one_spoiled_sample_spoils_no_other() {
    let spoils: [fn(&mut Inputs); 5] = [
        |inputs| inputs.kappa_ref[0] = f64::NAN,
        |inputs| inputs.kappa_ref[1] = f64::INFINITY,
        |inputs| inputs.v_x_ref[0] = f64::NAN,
        |inputs| inputs.v_x = f64::NAN,
        |inputs| inputs.v_y = f64::INFINITY,
    ];
    for (i, spoil) in spoils.into_iter().enumerate() {
        for estimation in [Estimation::Measured, Estimation::Kalman] {
            let parameters = Parameters { estimation, ..Parameters::default() };
            let road = Loop::new(parameters.clone(), slalom);
            let mut controller = Controller::new(parameters, 0.0).unwrap();
            let x = State::from([15.0, 0.0, 0.0, 0.0, 0.0]);
            for k in 0..10 {
                let t = k as f64 * 0.033;
                let mut inputs = road.inputs(t, &x);
                if k == 5 {
                    spoil(&mut inputs);
                }
                controller.advance(t, 0.033, &inputs).unwrap();
                let status = controller.output().status;
                assert!(status == Status::Optimal || k == 5, "{i}, {estimation:?}, sample {k}: {status:?}");
            }
        }
    }
}

#[test]
fn a_huge_value_before_a_lost_sensor_does_not_stay() {
    for spoils in [
        [|inputs: &mut Inputs| inputs.v_x = 1e40, |inputs: &mut Inputs| inputs.v_x = f64::NAN],
        [|inputs: &mut Inputs| inputs.v_y = 1e100, |inputs: &mut Inputs| inputs.e_y = f64::NAN],
    ] {
        let road = Loop::new(Parameters::default(), slalom);
        let mut controller = Controller::new(Parameters::default(), 0.0).unwrap();
        for k in 0..100 {
            let t = f64::from(k) * 0.033;
            let mut inputs = road.inputs(t, &State::from([15.0, 0.0, 0.0, 0.0, 0.0]));
            if let Some(spoil) = (k as usize).checked_sub(20).and_then(|after| spoils.get(after)) {
                spoil(&mut inputs);
            }
            controller.advance(t, 0.033, &inputs).unwrap();
            let status = controller.output().status;
            // This car does not obey, so the filter may doubt what it measures.
            assert!(k < 30 || status <= Status::Estimated, "sample {k}: {status:?}");
        }
    }
}

#[test]
fn a_car_that_may_steer_again_plans_as_quickly_as_one_that_always_could() {
    let parameters = Parameters::default();
    let mut controller = Controller::new(parameters.clone(), 0.0).unwrap();
    for k in 0..60 {
        let t = f64::from(k) * parameters.t_s;
        // Standing for a second, with the steering held, then told to drive off along a bend.
        let speed = if k < 30 { 0.0 } else { 5.0 };
        let road = Loop { speed, ..Loop::new(parameters.clone(), turn) };
        controller.advance(t, parameters.t_s, &road.inputs(t, &State::zeros())).unwrap();
        let output = controller.output();
        // The acceleration's bounds take a few sweeps where the speed begins to be wanted.
        assert!(output.iterations <= 4, "sample {k}: {} iterations", output.iterations);
    }
}

#[test]
fn the_previous_plan_is_executed_as_it_was_made() {
    let parameters = Parameters::default();
    let road = Loop::new(parameters.clone(), slalom);
    let mut controller = Controller::new(parameters, 0.0).unwrap();
    let x = State::from([15.0, 0.0, 0.0, 0.02, 0.0]);
    controller.advance(0.0, 0.033, &road.inputs(0.0, &x)).unwrap();
    let plan = controller.output().clone();
    let mut blind = road.inputs(0.0, &x);
    blind.v_x_ref[5] = f64::NAN;
    for k in 1..10 {
        controller.advance(k as f64 * 0.033, 0.033, &blind).unwrap();
        assert_eq!(controller.output().delta, plan.delta_pred[k], "sample {k}");
        assert_eq!(controller.output().a_x, plan.a_x_pred[k], "sample {k}");
    }
    assert_ne!(plan.delta_pred[0], plan.delta_pred[9], "a plan that steers");
}

#[test]
fn zeros_before_the_first_exchange_are_forgotten() {
    for h in [0.001, 0.033] {
        let mut worst: f64 = 0.0;
        Loop { h, ..Loop::new(Parameters::default(), slalom) }.drive(
            8.0,
            |t, x| if t == 0.0 { State::zeros() } else { *x },
            |_, x, _| worst = worst.max(x[E_Y].abs()),
        );
        // At 1 ms the next measurement comes a whole sample after the zeros.
        assert!(worst < 0.03, "step {h} s: {worst} m");
    }
}

#[test]
fn extreme_inputs_leave_every_output_finite() {
    let road = Loop::new(Parameters::default(), slalom);
    let mut controller = Controller::new(Parameters::default(), 0.0).unwrap();
    for k in 0..60 {
        let t = f64::from(k) * 0.033;
        let mut x = State::from([15.0, 0.0, 0.0, 0.02, 0.0]);
        x[k as usize % 5] *= if (20..40).contains(&k) { 1e300 } else { 1.0 };
        let mut inputs = road.inputs(t, &x);
        if (30..35).contains(&k) {
            inputs.kappa_ref[0] = 1e300;
        }
        controller.advance(t, 0.033, &inputs).unwrap();
        let o = controller.output();
        assert!(
            [o.delta, o.a_x, o.c_f, o.c_r, o.kkt_residual, o.slack_e_y].iter().all(|v| v.is_finite()),
            "sample {k}"
        );
        let trajectories =
            [&o.e_y_pred, &o.e_psi_pred, &o.v_x_pred, &o.v_y_pred, &o.yaw_rate_pred, &o.delta_pred, &o.a_x_pred];
        assert!(trajectories.iter().all(|t| t.iter().all(|v| v.is_finite())), "sample {k}");
    }
    // This car does not obey, so the filter may doubt its measurements; the plans are optimal again.
    assert!(controller.output().status <= Status::Estimated, "valid inputs recover");
}

#[test]
fn good_inputs_recover_from_a_safe_stop() {
    let parameters = Parameters { horizon: 5, ..Parameters::default() };
    let road = Loop::new(parameters.clone(), straight);
    let mut controller = Controller::new(parameters, 0.0).unwrap();
    for k in 0..60 {
        let t = f64::from(k) * 0.033;
        let mut inputs = road.inputs(t, &State::from([15.0, 0.0, 0.0, 0.02, 0.0]));
        if (20..40).contains(&k) {
            inputs.v_x = f64::NAN;
        }
        controller.advance(t, 0.033, &inputs).unwrap();
        let status = controller.output().status;
        if !(20..=40).contains(&k) {
            assert!(status <= Status::InteriorPoint, "sample {k}");
        } else if (30..40).contains(&k) {
            assert_eq!(status, Status::SafeStop, "sample {k}");
        }
    }
}

#[test]
fn one_wrong_measurement_is_not_believed_and_a_lasting_change_is() {
    let spike = |state: usize, size: f64, last: usize| {
        let mut worst: f64 = 0.0;
        let mut k = 0;
        Loop { h: 0.033, ..Loop::new(Parameters::default(), slalom) }.drive(
            4.0,
            |_, x| {
                k += 1;
                let mut measured = *x;
                if (60..60 + last).contains(&k) {
                    measured[state] += size;
                }
                measured
            },
            |_, x, _| worst = worst.max(x[E_Y].abs()),
        );
        worst
    };
    let undisturbed = spike(V_Y, 0.0, 0);
    for (state, size) in [(V_X, 1.0), (V_Y, 1.5), (YAW_RATE, 0.8), (E_Y, 1.0), (E_PSI, 0.3)] {
        let once = spike(state, size, 1);
        assert!(once < undisturbed + 1e-3, "state {state}: {once} m, without {undisturbed} m");
    }
    // The car is steered by what is measured when that stays.
    assert!(spike(E_Y, 1.0, 40) > 0.5);
}

//! The whole controller in loops whose plant is known exactly.
#![allow(clippy::unwrap_used, reason = "a test may panic, in its helpers too")]
#![allow(clippy::cast_possible_truncation, reason = "counts of steps of a few seconds")]

mod loop_support;

use loop_support::{Loop, slalom, straight, turn};
use lpv_mpc::estimator::SENSOR_DEVIATION;
use lpv_mpc::model::{Disturbance, E_Y, State, V_Y};
use lpv_mpc::{Controller, Estimation, Inputs, Parameters, Status, TerminalCost};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

#[test]
fn a_known_car_stays_on_the_path_at_every_communication_step() {
    for h in [0.001, 0.011, 0.033] {
        let worst = Loop { h, ..Loop::new(Parameters::default(), slalom) }.worst_e_y(10.0, 0.0);
        // The slalom begins with its full rate, which the ideal car does not know beforehand: 1.2 mm at the longest step. Weighed
        // against zero the steering increments would cost 10 mm.
        assert!(worst < 0.002, "step {h} s: {worst} m");
    }
}

#[test]
fn the_papers_tuning_follows_more_closely_in_the_ideal_loop() {
    let worst = Loop::new(Parameters::paper(), slalom).worst_e_y(10.0, 0.0);
    assert!(worst < 0.003, "{worst} m");
}

#[test]
fn a_terminal_cost_from_the_riccati_equation_replaces_horizon() {
    // 0.13 s of preview.
    let worst = |terminal_cost| {
        Loop::new(Parameters { horizon: 4, terminal_cost, ..Parameters::default() }, slalom).worst_e_y(10.0, 2.0)
    };
    let (riccati, weights) = (worst(TerminalCost::Riccati), worst(TerminalCost::StageWeights));
    // What forty periods of horizon leave is 0.4 mm.
    assert!(riccati < 0.005, "{riccati} m");
    assert!(weights > 1.0, "the stage weights would do: {weights} m");
}

#[test]
fn steps_longer_than_the_period_and_irregular_ones_work() {
    let long = Loop { h: 0.1, ..Loop::new(Parameters::default(), turn) }.worst_e_y(10.0, 0.0);
    assert!(long < 0.05, "{long} m");

    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let road = Loop::new(Parameters::default(), straight);
    let mut controller = Controller::new(Parameters::default(), 0.0).unwrap();
    let mut t = 0.0;
    while t < 3.0 {
        let h = rng.random_range(0.0005..0.12);
        controller.advance(t, h, &road.inputs(t, &State::from([15.0, 0.0, 0.0, 0.01, 0.0]))).unwrap();
        t += h;
    }
    // One sample for each period that has begun.
    assert_eq!(controller.samples(), (t / 0.033).ceil() as u64);
}

#[test]
fn a_mirrored_road_gives_mirrored_commands() {
    let record = |kappa: fn(f64) -> f64| {
        let mut commands = Vec::new();
        Loop::new(Parameters::default(), kappa).drive(
            5.0,
            |_, x| *x,
            |_, _, c| commands.push((c.output().delta, c.output().a_x)),
        );
        commands
    };
    for ((left, drive), (right, same_drive)) in record(slalom).into_iter().zip(record(|t| -slalom(t))) {
        // Sums are taken in the same order, so the mirror holds to rounding.
        assert!((left + right).abs() < 1e-9, "{left} {right}");
        assert!((drive - same_drive).abs() < 1e-9, "{drive} {same_drive}");
    }
}

#[test]
fn what_is_predicted_is_what_happens() {
    // One period of latency: the plan made at t begins at t + h. The steering goes on being optimised, so only the near
    // future can be compared; it is the one that is executed.
    let mut looped = Loop { h: 0.033, ..Loop::new(Parameters::default(), slalom) };
    let mut foreseen: Vec<(f64, State)> = Vec::new();
    let mut worst: f64 = 0.0;
    looped.drive(
        6.0,
        |_, x| *x,
        |t, x, c| {
            // The first planned state belongs to one period after the command is visible.
            let o = c.output();
            let next = State::from([o.v_x_pred[0], o.v_y_pred[0], o.yaw_rate_pred[0], o.e_y_pred[0], o.e_psi_pred[0]]);
            if let Some((_, expected)) = foreseen.iter().find(|(due, _)| (due - t).abs() < 1e-9) {
                worst = worst.max((x - expected).amax());
            }
            foreseen = vec![(t + 0.033, next)];
        },
    );
    // Linear interpolation of the curvature and the middle of the stage: second order in 33 ms.
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn wind_and_steering_offset_leave_no_steady_error() {
    // 1 m/s2 of head wind, 0.5 m/s2 of side wind with its yaw moment: a gale.
    let disturbance = Disturbance::from([-1.0, 0.5, 0.1]);
    let offset_free = Loop { disturbance, ..Loop::new(Parameters::default(), turn) }.worst_e_y(12.0, 8.0);
    let parameters = Parameters { estimation: Estimation::Measured, ..Parameters::default() };
    let measured = Loop { disturbance, ..Loop::new(parameters, turn) }.worst_e_y(12.0, 8.0);
    assert!(offset_free < 1e-3, "{offset_free} m");
    assert!(measured > 5.0 * offset_free, "the estimator makes no difference: {measured} m, {offset_free} m");
}

#[test]
fn lateral_velocity_need_not_be_measured() {
    let parameters = Parameters { v_y_measured: false, ..Parameters::default() };
    let mut worst: f64 = 0.0;
    Loop::new(parameters, slalom).drive(
        8.0,
        |_, x| {
            let mut measured = *x;
            measured[V_Y] = 7.0; // nonsense that must not be used
            measured
        },
        |_, x, c| {
            worst = worst.max(x[E_Y].abs());
            assert!(c.output().status <= Status::InteriorPoint);
        },
    );
    assert!(worst < 0.02, "{worst} m");
}

#[test]
fn noise_stays_out_of_the_steering() {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    let mut noisy = |x: &State| {
        // Uniform noise with the standard deviations of the interface.
        State::from_fn(|i, _| x[i] + SENSOR_DEVIATION[i] * rng.random_range(-1.0..1.0) * 3.0_f64.sqrt())
    };
    let mut worst: f64 = 0.0;
    Loop { h: 0.033, ..Loop::new(Parameters::default(), slalom) }.drive(
        10.0,
        |_, x| noisy(x),
        |_, x, _| worst = worst.max(x[E_Y].abs()),
    );
    assert!(worst < 0.03, "{worst} m");
}

#[test]
fn a_saved_state_repeats_the_same_bits() {
    let record = |save_at: usize| {
        let parameters = Parameters { tau_delta: 0.1, input_delay: 0.05, ..Parameters::default() };
        let road = Loop::new(parameters.clone(), slalom);
        let mut controller = Controller::new(parameters, 0.0).unwrap();
        let mut bits = Vec::new();
        for k in 0..200 {
            if k == save_at {
                let bytes = postcard::to_stdvec(&controller).unwrap();
                controller = postcard::from_bytes(&bytes).unwrap();
            }
            let t = k as f64 * 0.01;
            controller.advance(t, 0.01, &road.inputs(t, &State::from([15.0, 0.01, 0.0, 0.02, 0.01]))).unwrap();
            bits.push((controller.output().delta.to_bits(), controller.output().a_x.to_bits()));
        }
        bits
    };
    assert_eq!(record(usize::MAX), record(77));
}

#[test]
fn a_step_that_is_no_step_is_refused() {
    let mut controller = Controller::new(Parameters::default(), 0.0).unwrap();
    for h in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert!(controller.advance(0.0, h, &Inputs::default()).is_err(), "{h}");
    }
    for t in [f64::NAN, f64::INFINITY] {
        let error = controller.advance(t, 0.033, &Inputs::default()).unwrap_err().to_string();
        assert!(error.starts_with("time must be finite"), "{error}");
    }
    assert_eq!(controller.samples(), 0);
}

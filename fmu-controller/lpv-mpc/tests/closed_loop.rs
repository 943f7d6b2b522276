//! The whole controller in loops whose plant is known exactly: its own nonlinear equations, integrated finely.
#![allow(clippy::unwrap_used, reason = "a test may panic, in its helpers too")]
#![allow(clippy::cast_possible_truncation, reason = "counts of steps of a few seconds")]

use lpv_mpc::estimator::SENSOR_DEVIATION;
use lpv_mpc::model::{A_X, DELTA, Disturbance, E_PSI, E_Y, Input, State, Tyres, V_X, V_Y, YAW_RATE, derivative};
use lpv_mpc::preview::Preview;
use lpv_mpc::{Controller, Estimation, Inputs, Parameters, Status, TerminalCost};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Car and road of a test.
struct Loop {
    parameters: Parameters,
    /// Curvature over time, since the wanted speed is constant [1/m].
    kappa: fn(f64) -> f64,
    speed: f64,
    tyres: Tyres,
    disturbance: Disturbance,
    /// Communication step [s].
    h: f64,
    x: State,
}

impl Loop {
    fn new(parameters: Parameters, kappa: fn(f64) -> f64) -> Self {
        let tyres = parameters.nominal_tyres();
        let speed = 15.0;
        let x = State::from([speed, 0.0, 0.0, 0.0, 0.0]);
        Self { parameters, kappa, speed, tyres, disturbance: Disturbance::zeros(), h: 0.001, x }
    }

    fn inputs(&self, t: f64, x: &State) -> Inputs {
        let t_s = self.parameters.t_s;
        Inputs {
            v_x: x[V_X],
            v_y: x[V_Y],
            yaw_rate: x[YAW_RATE],
            e_y: x[E_Y],
            e_psi: x[E_PSI],
            kappa_ref: Preview::from_fn(|i, _| (self.kappa)(t + i as f64 * t_s)),
            v_x_ref: Preview::repeat(self.speed),
            ..Inputs::default()
        }
    }

    /// Drives for `duration` [s] and shows every communication point: time, true state, controller after its step.
    fn drive(
        &mut self,
        duration: f64,
        mut measure: impl FnMut(f64, &State) -> State,
        mut see: impl FnMut(f64, &State, &Controller),
    ) {
        let mut controller = Controller::new(self.parameters.clone(), 0.0).unwrap();
        let body = self.parameters.body();
        let steps = (duration / self.h).round() as usize;
        for k in 0..steps {
            let t = k as f64 * self.h;
            let applied = Input::from([controller.output().delta, controller.output().a_x]);
            let measured = measure(t, &self.x);
            controller.advance(t, self.h, &self.inputs(t, &measured)).unwrap();
            // Classic Runge-Kutta in millisecond steps: its error at 25 1/s is (0.025)^5 / 120 a step, below 1e-10.
            let pieces = (self.h / 0.001).round().max(1.0) as usize;
            let dt = self.h / pieces as f64;
            for j in 0..pieces {
                let now = t + j as f64 * dt;
                let f = |x: &State, at: f64| {
                    derivative(x, &applied, (self.kappa)(at), &body, &self.tyres, &self.disturbance)
                };
                let k1 = f(&self.x, now);
                let k2 = f(&(self.x + k1 * (dt / 2.0)), now + dt / 2.0);
                let k3 = f(&(self.x + k2 * (dt / 2.0)), now + dt / 2.0);
                let k4 = f(&(self.x + k3 * dt), now + dt);
                self.x += (k1 + (k2 + k3) * 2.0 + k4) * (dt / 6.0);
            }
            see(t + self.h, &self.x, &controller);
        }
    }

    fn worst_e_y(&mut self, duration: f64, after: f64) -> f64 {
        let mut worst: f64 = 0.0;
        self.drive(
            duration,
            |_, x| *x,
            |t, x, _| {
                if t > after {
                    worst = worst.max(x[E_Y].abs());
                }
            },
        );
        worst
    }
}

/// Left and right turns at 0.3 of gravity at 15 m/s.
fn slalom(t: f64) -> f64 {
    0.013 * (t * 2.0).sin()
}

fn turn(t: f64) -> f64 {
    // A ramp over one second: a car cannot follow a step of the curvature.
    0.013 * t.clamp(0.0, 1.0)
}

fn straight(_: f64) -> f64 {
    0.0
}

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
    assert_eq!(controller.samples(), 0);
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

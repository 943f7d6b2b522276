//! The ideal car against the model that it inverts, and from sample to sample.

use super::*;
use crate::Parameters;
use crate::model::{E_PSI, E_Y, Input, YAW_RATE, derivative};

const PERIOD: f64 = 0.033;
const V: f64 = 15.0;

fn body() -> Body {
    Parameters::default().body()
}

fn tyres() -> Tyres {
    Tyres::secant(1.0e5, 7.6e4)
}

/// Curvature of a slalom that asks for 2.2 m/s2 [1/m].
fn slalom(t: f64) -> f64 {
    0.01 * (0.5 * t).min(1.0).powi(3) * (2.5 * t).sin()
}

/// Ends of a stage on a road of this curvature.
fn ends(kappa: impl Fn(f64) -> f64, i: usize) -> [f64; 2] {
    [i, i + 1].map(|i| kappa(i as f64 * PERIOD))
}

fn path(kappa: [f64; 2]) -> Path<f64> {
    Path { kappa, mu: 0.82, wanted: V, permitted: V, v_x: V, disturbance: Disturbance::zeros() }
}

fn straight_ahead(past: Option<Past>, body: &Body) -> FeedForward<'_, f64> {
    let x = State::from([V, 0.0, 0.0, 0.0, 0.0]);
    FeedForward::new(body, PERIOD, &x, past, Before { v_x: V, disturbance: Disturbance::zeros() })
}

/// Increments for a car that begins straight ahead.
fn increments(kappa: impl Fn(f64) -> f64, stages: usize) -> Vec<f64> {
    let body = body();
    let mut ideal = straight_ahead(None, &body);
    (0..stages).map(|i| ideal.advance(V, &path(ends(&kappa, i)), &tyres())).collect()
}

/// Largest lateral error [m] of the model on the slalom when it is steered by increments alone, at constant speed.
fn open_loop(increments: &[f64]) -> f64 {
    const PIECES: usize = 100;
    let (body, h) = (body(), PERIOD / PIECES as f64);
    let mut x = State::from([V, 0.0, 0.0, 0.0, 0.0]);
    let (mut delta, mut worst) = (0.0, 0.0_f64);
    for (i, increment) in increments.iter().enumerate() {
        delta += increment;
        let [from, to] = ends(slalom, i);
        for k in 0..PIECES {
            let rate = |x: &State, part: f64| {
                let kappa = from + (to - from) * (k as f64 + part) / PIECES as f64;
                let mut rate = derivative(x, &Input::from([delta, 0.0]), kappa, &body, &tyres(), &Disturbance::zeros());
                rate[V_X] = 0.0;
                rate
            };
            let middle = x + rate(&x, 0.0) * (0.5 * h);
            x += rate(&middle, 0.5) * h;
        }
        worst = worst.max(x[E_Y].abs());
    }
    worst
}

#[test]
fn a_car_that_is_steered_by_the_increments_alone_stays_on_the_path() {
    let stages = 120;
    let wheelbase = body().l_f + body().l_r;
    let geometry = |i: usize| {
        let [from, to] = ends(slalom, i);
        wheelbase * (to - from)
    };
    // The trapezoidal rule on the preview's straight lines; the large angles that the ideal car does not know are 0.1 rad.
    let (ideal, geometric) =
        (open_loop(&increments(slalom, stages)), open_loop(&(0..stages).map(geometry).collect::<Vec<_>>()));
    assert!(ideal < 1e-3, "{ideal} m");
    assert!(geometric > 0.1, "the slalom must be one: {geometric} m");
}

#[test]
fn a_steady_turn_takes_the_angle_of_the_understeer_gradient() {
    let kappa = 0.01;
    let total: f64 = increments(|t| kappa * (0.5 * t).min(1.0).powi(3), 200).iter().sum();
    let (Body { m, l_f, l_r, .. }, Tyres { c_f, c_r, .. }) = (body(), tyres());
    let l = l_f + l_r;
    let expected = kappa * (l + m * V * V * (l_r / c_f - l_f / c_r) / l);
    // The first stage's own angle is no increment: a part in 10^5 of the curvature, and in 10^4 of its rate.
    assert!((total - expected).abs() < 1e-3 * expected, "{total} for {expected}");
}

#[test]
fn plans_of_two_samples_agree_on_their_common_stages() {
    let (body, stages) = (body(), 20);
    let plan = |first: usize, past: Option<Past>| {
        let mut ideal = straight_ahead(past, &body);
        let all: Vec<f64> =
            (first..first + stages).map(|i| ideal.advance(V, &path(ends(slalom, i)), &tyres())).collect();
        (all, ideal.next)
    };
    let mut past = None;
    let mut before = Vec::new();
    for first in 0..40 {
        let (now, next) = plan(first, past);
        for (before, now) in before.iter().skip(1).zip(&now) {
            // The same operations on the same numbers.
            assert_eq!(before, now, "plan {first}");
        }
        (past, before) = (next, now);
    }
}

#[test]
fn wind_that_is_steady_asks_for_no_increment() {
    let body = body();
    let gale = Disturbance::from([0.0, 2.0, 0.3]);
    let x = State::from([V, 0.0, 0.0, 0.0, 0.0]);
    let mut past = None;
    for _ in 0..200 {
        let mut ideal = FeedForward::new(&body, PERIOD, &x, past, Before { v_x: V, disturbance: gale });
        let increment = ideal.advance(V, &Path { disturbance: gale, ..path([0.0; 2]) }, &tyres());
        let next = ideal.next;
        if past.is_some_and(|past| next.is_some_and(|next| (past.sideslip.beta - next.sideslip.beta).abs() < 1e-9)) {
            assert!(increment.abs() < 1e-7, "{increment}");
            return;
        }
        past = next;
    }
    panic!("the sideslip must settle");
}

#[test]
fn what_the_steering_cannot_follow_is_reduced_and_more_from_there_on() {
    let body = body();
    let possible = [0.1, -0.2, 0.2, 0.0];
    let mut all = possible;
    straight_ahead(None, &body).executable(&mut all, 0.0, 0.2);
    assert_eq!(all, possible);
    let mut all = [0.1, 0.2, -0.4, 0.1, 0.8, 0.1];
    straight_ahead(None, &body).executable(&mut all, 0.0, 0.2);
    // All by (0.2 / 0.8)^2; the third and fourth by (0.2 / 0.4)^2 too, the last two by (0.2 / 0.8)^2.
    let expected = [0.1, 0.2, -0.4 / 4.0, 0.1 / 4.0, 0.8 / 16.0, 0.1 / 16.0].map(|increment: f64| increment / 16.0);
    for (reduced, expected) in all.iter().zip(expected) {
        assert!((reduced - expected).abs() < 1e-15, "{all:?} for {expected}");
    }
    // A steering that is held has no reference, and zero times infinity does not make it no number.
    let mut held = [f64::MIN_POSITIVE / 4.0, 0.0];
    straight_ahead(None, &body).executable(&mut held, 0.0, 0.0);
    assert_eq!(held, [0.0; 2]);
}

#[test]
fn commands_behind_a_lag_deliver_the_ideal_steering_in_the_mean_of_each_stage() {
    let body = body();
    let ideal = increments(slalom, 60);
    let mut commands = ideal.clone();
    let decay = (-PERIOD / 0.1_f64).exp();
    straight_ahead(None, &body).executable(&mut commands, decay, f64::INFINITY);
    let (mut wanted, mut command, mut delivered) = (0.0, 0.0, 0.0);
    for (i, (ideal, increment)) in ideal.iter().zip(&commands).enumerate() {
        wanted += ideal;
        command += increment;
        let end = command + (delivered - command) * decay;
        // From its nodes to its middle a stage differs by an eighth of the second difference of the steering: 1 % of it here.
        assert!((0.5 * (delivered + end) - wanted).abs() < 1e-3, "stage {i}: {delivered} to {end} for {wanted}");
        delivered = end;
    }
}

#[test]
fn a_car_that_slides_is_not_helped() {
    let body = body();
    let x = State::from([V, 3.0, 0.0, 0.0, 0.0]);
    let past = Past { sideslip: Sideslip { beta: 0.0, rate: 0.0 }, kappa: [0.0; 2], increment: 0.0 };
    let mut ideal =
        FeedForward::new(&body, PERIOD, &x, Some(past), Before { v_x: V, disturbance: Disturbance::zeros() });
    let whole = ideal.advance(V, &path([0.0, 1e-3]), &tyres());
    let mut increments = [whole];
    ideal.executable(&mut increments, 0.0, 1.0);
    // 0.2 rad apart: one in 1 + 10^2.
    assert!((increments[0] - whole / 101.0).abs() < 1e-12 && whole.abs() > 1e-3, "{increments:?} of {whole}");
}

#[test]
fn the_ideal_car_in_a_wind_is_the_steady_solution_of_the_model() {
    let (body, kappa) = (body(), 0.01);
    let tangent = Tyres { c_f: 6.0e4, c_r: 5.0e4, f_f0: 900.0, f_r0: 700.0 };
    let wind = Disturbance::from([0.0, 1.5, -0.4]);
    let mut sideslip = Sideslip { beta: 0.0, rate: 0.0 };
    let mut delta = 0.0;
    for _ in 0..300 {
        delta = sideslip.advance(V, &[kappa; 2], &wind, &tangent, &body, PERIOD);
    }
    let Sideslip { beta, rate } = sideslip;
    let x = State::from([V, V * beta, V * kappa, 0.0, -beta]);
    let change = derivative(&x, &Input::from([delta, 0.0]), kappa, &body, &tangent, &wind);
    assert!(rate.abs() < 1e-9, "{rate}");
    // Small angles: the front tyres' force times half the square of 0.06 rad, and v_x beta^2 / 2 of the path's own speed.
    assert!(change[V_Y].abs() < 0.02 && change[YAW_RATE].abs() < 0.02, "{change}");
    assert!(change[E_Y].abs() < 1e-2 && change[E_PSI].abs() < 1e-3, "{change}");
}

#[test]
fn the_first_commands_of_successive_plans_behind_a_lag_steer_the_ideal_car() {
    let (body, stages, samples) = (body(), 20, 120);
    let decay = (-PERIOD / 0.2_f64).exp();
    let ideal = increments(slalom, samples);
    let (mut past, mut wanted, mut command, mut delivered) = (None, 0.0, 0.0, 0.0);
    for (first, increment) in ideal.iter().enumerate() {
        let mut plan = straight_ahead(past, &body);
        let mut all: Vec<f64> =
            (first..first + stages).map(|i| plan.advance(V, &path(ends(slalom, i)), &tyres())).collect();
        // The real car moves as the ideal one does, so that the whole increment counts.
        plan.apart = 0.0;
        past = plan.executable(&mut all, decay, f64::INFINITY);
        wanted += increment;
        command += all[0];
        let end = command + (delivered - command) * decay;
        // As below: 1 % of the 0.03 rad that are steered.
        assert!((0.5 * (delivered + end) - wanted).abs() < 5e-4, "sample {first}: {delivered} to {end} for {wanted}");
        delivered = end;
    }
}

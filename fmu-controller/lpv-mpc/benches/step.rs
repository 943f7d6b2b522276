//! Does a controller step fit in its period, and what does it cost beyond its quadratic programme?
//!
//! A slalom in which no bound is active is driven once, by a car with the delay and the lags that the controller is told, and
//! its measurements are recorded; each bench replays them through whole controllers that have begun before, one sample per
//! communication step. `quadratic programme` is the structured solver alone on the problems of the same drive with ideal
//! actuators, warm-started the same way, and few enough of them to stay in the processor's cache: in a step the problem has
//! just been written. Everything else of a step is measured with it: the tyres, the prediction over the latency, the linear
//! models of all stages and their discretisation, the outputs.
//!
//! `network now` is the paper's step: one answer of the network for all stages, from the state as it is measured. The filter and
//! the network along the horizon, both on by default, come on top of it.
//!
//! First come the ratios that the question asks for, from turns that all kinds of step take one after the other, so that a
//! machine that slows down slows all of them; each kind counts with its best turn. Criterion's times follow, per sample.

use std::fs;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lpv_mpc::jordan::Network;
use lpv_mpc::model::{Disturbance, Input, State, derivative};
use lpv_mpc::preview::Preview;
use lpv_mpc::qp::{Problem, Solution, Structured};
use lpv_mpc::{Adaptation, Controller, Estimation, Inputs, Parameters};

const T_S: f64 = 0.033;
/// Samples before those that are measured: a first plan takes several passes, and the filter settles.
const BEFORE: usize = 20;
/// Samples of a turn. At N = 40 their problems take 0.6 MB.
const SAMPLES: usize = 40;
/// Turns of each kind for the ratios; the best of fewer still jumps on a machine with other work.
const TURNS: usize = 800;

fn kappa(t: f64) -> f64 {
    0.008 * (1.5 * t).sin()
}

fn controller(parameters: &Parameters) -> Controller {
    if parameters.adaptation == Adaptation::Constant {
        return Controller::new(parameters.clone(), 0.0).expect("valid parameters");
    }
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../resources/jordan.json");
    let network = Network::from_json(&fs::read_to_string(file).expect("the network ships")).expect("it is whole");
    Controller::with_network(parameters.clone(), 0.0, network).expect("valid parameters")
}

/// A drive along the slalom.
struct Drive {
    /// The controller before the first sample of a turn.
    controller: Controller,
    /// What it measures in a turn.
    measured: Vec<Inputs>,
    /// The problems that it solves, if the actuators are ideal.
    problems: Vec<Problem<5, 2>>,
}

fn time(sample: usize) -> f64 {
    sample as f64 * T_S
}

fn drive(parameters: &Parameters) -> Drive {
    let mut controller = controller(parameters);
    let mut begun = controller.clone();
    let (body, tyres) = (parameters.body(), parameters.nominal_tyres());
    let mut x = State::from([15.0, 0.0, 0.0, 0.0, 0.0]);
    // The actuators that the controller believes in: with others the loop would swing into its bounds.
    let (tau, mut applied, mut on_their_way) = ([parameters.tau_delta, parameters.tau_a_x], Input::zeros(), Vec::new());
    let (mut measured, mut problems) = (Vec::new(), Vec::new());
    for k in 0..BEFORE + SAMPLES {
        let t = time(k);
        if k == BEFORE {
            begun = controller.clone();
            problems.clear();
            measured.clear();
        }
        let inputs = Inputs {
            v_x: x[0],
            v_y: x[1],
            yaw_rate: x[2],
            e_y: x[3],
            e_psi: x[4],
            kappa_ref: Preview::from_fn(|i, _| kappa(t + i as f64 * T_S)),
            v_x_ref: Preview::repeat(15.0),
            ..Inputs::default()
        };
        let command = Input::from([controller.output().delta, controller.output().a_x]);
        on_their_way.push((t + parameters.input_delay, command));
        controller.advance(t, T_S, &inputs).expect("a valid step");
        problems.extend(controller.problem().cloned());
        measured.push(inputs);
        for j in 0..33 {
            // Euler's rule at 1 ms: the bench needs a plausible car, not an exact one.
            let at = t + f64::from(j) * 1e-3;
            let acting = on_their_way
                .iter()
                .rfind(|(acts, _)| *acts < at + 0.5e-3)
                .map_or(Input::zeros(), |(_, command)| *command);
            applied = Input::from_fn(|i, _| applied[i] + (acting[i] - applied[i]) * (1e-3 / tau[i].max(1e-3)));
            x += derivative(&x, &applied, kappa(at), &body, &tyres, &Disturbance::zeros()) * 1e-3;
        }
    }
    Drive { controller: begun, measured, problems }
}

/// Kinds of steps, from the cheapest to all that there is.
fn kinds(horizon: usize) -> [(&'static str, Parameters); 7] {
    let measured =
        |adaptation| Parameters { horizon, adaptation, estimation: Estimation::Measured, ..Parameters::default() };
    let kalman = |adaptation| Parameters { estimation: Estimation::Kalman, ..measured(adaptation) };
    let all = kalman(Adaptation::NetworkHorizon);
    [
        ("constant", measured(Adaptation::Constant)),
        ("network now", measured(Adaptation::NetworkNow)),
        ("network along the horizon", measured(Adaptation::NetworkHorizon)),
        ("Kalman filter, constant", kalman(Adaptation::Constant)),
        ("Kalman filter, network now", kalman(Adaptation::NetworkNow)),
        ("Kalman filter, network along the horizon", all.clone()),
        ("the same with lags and delay", Parameters { tau_delta: 0.1, tau_a_x: 0.2, input_delay: 0.05, ..all }),
    ]
}

/// One turn of a controller through its recorded measurements.
fn replay(controller: &mut Controller, measured: &[Inputs]) -> f64 {
    for (k, inputs) in measured.iter().enumerate() {
        controller.advance(time(BEFORE + k), T_S, black_box(inputs)).expect("a valid step");
    }
    controller.output().delta
}

/// One turn of the solver alone.
fn solve_all(problems: &[Problem<5, 2>], solver: &mut Structured<5, 2>, solution: &mut Solution<5, 2>) -> u32 {
    solver.reset();
    for problem in problems {
        solver.shift();
        solver.solve(black_box(problem), solution);
    }
    solution.iterations
}

/// Prints what each kind of step costs, as a multiple of the quadratic programme alone.
#[allow(clippy::print_stdout, reason = "the answer of this bench")]
fn ratios(horizon: usize) {
    let kinds = kinds(horizon);
    let drives = kinds.each_ref().map(|(_, parameters)| drive(parameters));
    let problems = &drives[0].problems;
    let (mut solver, mut solution) = (Structured::new(horizon), Solution::new(horizon));
    let mut best = [f64::INFINITY; 8];
    let mut take = |place: usize, turn: &mut dyn FnMut()| {
        let start = Instant::now();
        turn();
        best[place] = best[place].min(start.elapsed().as_secs_f64() / SAMPLES as f64);
    };
    for _ in 0..TURNS {
        take(0, &mut || {
            black_box(solve_all(problems, &mut solver, &mut solution));
        });
        for (place, drive) in drives.iter().enumerate() {
            let mut controller = drive.controller.clone();
            take(place + 1, &mut || {
                black_box(replay(&mut controller, &drive.measured));
            });
        }
    }
    println!("N = {horizon}: quadratic programme alone {:.2} us", best[0] * 1e6);
    for (time, (name, _)) in best[1..].iter().zip(&kinds) {
        println!("{name:>42}: {:6.2} us, {:.2} times the programme", time * 1e6, time / best[0]);
    }
}

fn step(c: &mut Criterion) {
    for horizon in [10, 20, 40] {
        ratios(horizon);
        let kinds = kinds(horizon);
        let mut group = c.benchmark_group(format!("step, N = {horizon}"));
        group.throughput(Throughput::Elements(SAMPLES as u64));
        let problems = drive(&kinds[0].1).problems;
        group.bench_function("quadratic programme", |b| {
            let (mut solver, mut solution) = (Structured::new(horizon), Solution::new(horizon));
            b.iter(|| solve_all(&problems, &mut solver, &mut solution));
        });
        for (name, parameters) in &kinds {
            let Drive { controller, measured, .. } = drive(parameters);
            group.bench_with_input(BenchmarkId::new("step", name), &measured, |b, measured| {
                b.iter_batched_ref(
                    || controller.clone(),
                    |controller| replay(controller, measured),
                    BatchSize::SmallInput,
                );
            });
        }
        group.finish();
    }
}

criterion_group!(benches, step);
criterion_main!(benches);

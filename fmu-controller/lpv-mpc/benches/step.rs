//! Does a controller step fit in its period, and what does it cost beyond its quadratic programme?
//!
//! A slalom in which no bound is active is driven once and its measurements are recorded; each bench replays them through whole
//! controllers. `quadratic programme` is the structured solver alone on the problems of the same drive, warm-started the same
//! way. Times are per sample.

use std::fs;
use std::hint::black_box;
use std::path::Path;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use lpv_mpc::jordan::Network;
use lpv_mpc::model::{Disturbance, Input, State, derivative};
use lpv_mpc::preview::Preview;
use lpv_mpc::qp::{Problem, Solution, Structured};
use lpv_mpc::{Adaptation, Controller, Estimation, Inputs, Parameters};

const T_S: f64 = 0.033;
const SAMPLES: usize = 300;

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

/// What a controller with these parameters measures on the slalom, and the problems that it solves.
fn drive(parameters: &Parameters) -> (Vec<Inputs>, Vec<Problem<5, 2>>) {
    let mut controller = controller(parameters);
    let (body, tyres) = (parameters.body(), parameters.nominal_tyres());
    let mut x = State::from([15.0, 0.0, 0.0, 0.0, 0.0]);
    let (mut measured, mut problems) = (Vec::new(), Vec::new());
    for k in 0..SAMPLES {
        let t = k as f64 * T_S;
        let inputs = Inputs {
            v_x: x[0],
            v_y: x[1],
            yaw_rate: x[2],
            e_y: x[3],
            e_psi: x[4],
            kappa_ref: Preview::from_fn(|i, _| kappa(t + i as f64 * T_S)),
            v_x_ref: Preview::repeat(15.0),
            hold_preview: false,
        };
        let applied = Input::from([controller.output().delta, controller.output().a_x]);
        controller.advance(t, T_S, &inputs).expect("a valid step");
        problems.extend(controller.problem().cloned());
        measured.push(inputs);
        for j in 0..33 {
            // Euler's rule at 1 ms: the bench needs a plausible car, not an exact one.
            let at = t + f64::from(j) * 1e-3;
            x += derivative(&x, &applied, kappa(at), &body, &tyres, &Disturbance::zeros()) * 1e-3;
        }
    }
    (measured, problems)
}

fn step(c: &mut Criterion) {
    for horizon in [10, 40] {
        let mut group = c.benchmark_group(format!("step, N = {horizon}"));
        group.throughput(Throughput::Elements(SAMPLES as u64));
        let plain = Parameters { horizon, estimation: Estimation::Measured, ..Parameters::default() };
        let (_, problems) = drive(&plain);
        group.bench_function("quadratic programme", |b| {
            let (mut solver, mut solution) = (Structured::new(horizon), Solution::new(horizon));
            b.iter(|| {
                solver.reset();
                for problem in &problems {
                    solver.shift();
                    solver.solve(black_box(problem), &mut solution);
                }
                solution.iterations
            });
        });
        let kalman = Parameters { estimation: Estimation::Kalman, ..plain.clone() };
        let network = Parameters { adaptation: Adaptation::NetworkHorizon, ..kalman.clone() };
        let lags = Parameters { tau_delta: 0.1, tau_a_x: 0.2, input_delay: 0.05, ..network.clone() };
        for (name, parameters) in
            [("measured", plain), ("Kalman filter", kalman), ("and network", network), ("and lags, delay", lags)]
        {
            let (measured, _) = drive(&parameters);
            let fresh = controller(&parameters);
            group.bench_with_input(BenchmarkId::new("step", name), &measured, |b, measured| {
                b.iter_batched_ref(
                    || fresh.clone(),
                    |controller| {
                        for (k, inputs) in measured.iter().enumerate() {
                            controller.advance(k as f64 * T_S, T_S, black_box(inputs)).expect("a valid step");
                        }
                        controller.output().delta
                    },
                    criterion::BatchSize::SmallInput,
                );
            });
        }
        group.finish();
    }
}

criterion_group!(benches, step);
criterion_main!(benches);

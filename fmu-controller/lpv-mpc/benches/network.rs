//! Does one inference of the network fit into 0.3 us?

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use lpv_mpc::jordan::{Measured, Network};

/// A lane change at its steepest.
const TURN: Measured =
    Measured { v_x: 16.0, v_y: -0.3, yaw_rate: 0.4, delta: 0.06, a_x: 1.0, a_y: 6.4, yaw_acceleration: 0.2 };

fn inference(criterion: &mut Criterion) {
    let network =
        Network::from_json(include_str!("../../resources/jordan.json")).expect("the shipped network is valid");
    let memory = network.nominal();
    criterion.bench_function("step", |bencher| bencher.iter(|| network.step(black_box(&memory), black_box(&TURN))));
    criterion.bench_function("linearise", |bencher| {
        bencher.iter(|| network.linearise(black_box(&memory), black_box(&TURN)));
    });
}

criterion_group!(benches, inference);
criterion_main!(benches);

//! Is the plant fast enough? How much faster than real time is the general track at a communication step of 1 ms, and
//! how much does a step cost above its bare right-hand sides?

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use vehicle::{Inputs, Parameters, Road, Vehicle, dynamics::Drive, dynamics::Dynamics};

/// A vehicle in the middle of a curve of the general track.
fn in_a_curve() -> (Vehicle, Inputs) {
    let parameters = Parameters::default();
    let road = Road::named("general", &parameters).expect("the name is known");
    let mut vehicle = Vehicle::new(parameters, road).expect("the defaults are valid");
    let mut inputs = Inputs::default();
    for _ in 0..150 {
        let (preview, measured) = (vehicle.preview(), vehicle.measurement());
        inputs.delta = 2.8 * preview.kappa_ref[6] - 0.1 * measured.e_y - 0.6 * measured.e_psi;
        inputs.a_x = 2.0 * (preview.v_x_ref[0] - measured.v_x);
        vehicle.advance(0.033, &inputs).expect("the inputs are valid");
    }
    (vehicle, inputs)
}

fn plant(c: &mut Criterion) {
    let (vehicle, inputs) = in_a_curve();
    let (parameters, road) = (vehicle.parameters(), vehicle.road());
    let dynamics = Dynamics::new(parameters);
    let x = vehicle.truth().x;
    let drive =
        Drive { delta: 0.0, sin_delta: 0.0, cos_delta: 1.0, a_x: inputs.a_x, wind_x: 0.0, wind_y: 0.0, mu_scale: 1.0 }
            .steered(inputs.delta);

    c.bench_function("four right-hand sides", |b| {
        b.iter(|| {
            for _ in 0..4 {
                black_box(dynamics.rates(road, black_box(&x), black_box(&drive)));
            }
        });
    });
    c.bench_function("communication step of 1 ms", |b| {
        // Driven in place: 20 ms of motion at most leave the curve as it is.
        b.iter_batched_ref(
            || vehicle.clone(),
            |v| {
                for _ in 0..20 {
                    v.advance(black_box(1e-3), black_box(&inputs)).expect("the inputs are valid");
                }
            },
            criterion::BatchSize::SmallInput,
        );
    });
    c.bench_function("communication step of 33 ms", |b| {
        b.iter_batched_ref(
            || vehicle.clone(),
            |v| v.advance(black_box(0.033), black_box(&inputs)).expect("the inputs are valid"),
            criterion::BatchSize::SmallInput,
        );
    });
    c.bench_function("preview", |b| b.iter(|| black_box(&vehicle).preview()));
    c.bench_function("outputs", |b| b.iter(|| black_box(&vehicle).outputs()));
}

criterion_group!(benches, plant);
criterion_main!(benches);

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;

/// Weights of the given size, uniform in `+-spread`.
fn layer(rng: &mut Pcg64Mcg, rows: usize, columns: usize, spread: f64) -> Layer {
    let mut draw = || rng.random_range(-spread..spread);
    Layer {
        weights: (0..rows).map(|_| (0..columns).map(|_| draw()).collect()).collect(),
        biases: (0..rows).map(|_| draw()).collect(),
    }
}

/// A network with random weights and plausible scales.
fn random(seed: u64, sizes: &[usize]) -> Document {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let layers = sizes.windows(2).map(|w| layer(&mut rng, w[1], w[0], 1.0)).collect();
    let n = sizes[0] - FEEDBACK;
    let deviations = [5.0, 0.5, 0.3, 0.05, 2.0, 4.0, 1.0];
    let half_widths = [10.0, 2.0, 1.0, 0.4, 5.0, 8.0, 5.0];
    let mean = |i: usize| if i == 0 { 15.0 } else { 0.0 };
    Document {
        t_s: 0.033,
        l_f: 1.2,
        l_r: 1.6,
        c_f_nominal: 1.0e5,
        c_r_nominal: 7.6e4,
        inputs: (0..n).map(|i| Scaling { mean: mean(i), deviation: deviations[i] }).collect(),
        outputs: [Scaling { mean: 9e4, deviation: 1e4 }, Scaling { mean: 7e4, deviation: 8e3 }],
        layers,
        envelope: Envelope {
            inputs: (0..n).map(|i| Range { min: mean(i) - half_widths[i], max: mean(i) + half_widths[i] }).collect(),
            alpha_f: Range { min: -0.1, max: 0.1 },
            alpha_r: Range { min: -0.1, max: 0.1 },
        },
        scores: Scores::default(),
        provenance: Provenance {
            recipe: String::new(),
            preset: "test".to_owned(),
            tyre: "dry_asphalt".to_owned(),
            mu: [0.82, 0.82],
            noise: 0.0,
            wind: 0.0,
            seed,
            manoeuvres: 0,
            beyond: 0,
            data: String::new(),
        },
    }
}

fn network(seed: u64, sizes: &[usize]) -> Network {
    random(seed, sizes).try_into().unwrap()
}

const TURN: Measured =
    Measured { v_x: 16.0, v_y: -0.3, yaw_rate: 0.4, delta: 0.06, a_x: 1.0, a_y: 6.4, yaw_acceleration: 0.2 };

/// The paper's formula, row by row, with the exponential of the standard library.
fn by_the_formula(document: &Document, memory: &Memory, measured: &Measured) -> Memory {
    let mut x: Vec<f64> =
        document.inputs.iter().zip(measured.values()).map(|(s, v)| (v - s.mean) / s.deviation).collect();
    x.extend([memory.c_f, memory.c_r]);
    for (i, Layer { weights, biases }) in document.layers.iter().enumerate() {
        let z = weights.iter().zip(biases).map(|(row, b)| b + row.iter().zip(&x).map(|(w, x)| w * x).sum::<f64>());
        let last = i + 1 == document.layers.len();
        x = z.map(|z| if last { z } else { 1.0 / (1.0 + (-z).exp()) }).collect();
    }
    Memory { c_f: x[0], c_r: x[1] }
}

#[test]
fn packed_layers_compute_the_formula() {
    let shapes = [&[7, 8, 5, 2][..], &[7, 12, 6, 2], &[9, 16, 8, 2], &[7, 3, 2], &[7, 2], &[7, 32, 20, 2], &[9, 24, 2]];
    for (seed, sizes) in (1..).zip(shapes) {
        let network = network(seed, sizes);
        let mut memory = network.nominal();
        for _ in 0..20 {
            let expected = by_the_formula(network.document(), &memory, &TURN);
            memory = network.step(&memory, &TURN);
            let error = (memory.c_f - expected.c_f).abs().max((memory.c_r - expected.c_r).abs());
            // A few dozen roundings of numbers of order one.
            assert!(error < 1e-13, "{sizes:?}: {error:e}");
        }
    }
}

#[test]
fn reading_what_was_written_gives_the_same_bits() {
    let network = network(1, &[7, 12, 6, 2]);
    let read = Network::from_json(&network.document().to_json()).unwrap();
    assert_eq!(read, network);
}

#[test]
fn tangent_is_the_slope_of_the_force() {
    for (seed, sizes) in (2..).zip([&[7, 12, 6, 2][..], &[9, 16, 8, 2], &[9, 32, 24, 2], &[7, 2]]) {
        tangent_is_the_slope(&network(seed, sizes));
    }
}

fn tangent_is_the_slope(network: &Network) {
    let memory = network.nominal();
    let (_, belief) = network.linearise(&memory, &TURN);
    let document = network.document();
    // Forces beside the stage: steer for the front axle, turn about the front axle for the rear one.
    let force = |step: f64, rear: bool| {
        let mut m = TURN;
        if rear {
            m.yaw_rate += step;
            m.v_y -= document.l_f * step;
        } else {
            m.delta += step;
        }
        let (c_f, c_r) = network.stiffness(&network.step(&memory, &m));
        let (alpha_f, alpha_r) = network.slip_angles(&m);
        if rear { (c_r * alpha_r, alpha_r, alpha_f) } else { (c_f * alpha_f, alpha_f, alpha_r) }
    };
    for (rear, axle) in [(false, belief.front), (true, belief.rear)] {
        let ((f_1, a_1, other_1), (f_0, a_0, other_0)) = (force(1e-5, rear), force(-1e-5, rear));
        assert!((other_1 - other_0).abs() < 1e-12, "the other axle's slip moved");
        let slope = (f_1 - f_0) / (a_1 - a_0);
        // Central differences: 1e-10 from the step, 1e-16 / 1e-5 from rounding, both relative to a smooth force.
        assert!((axle.tangent - slope).abs() < 1e-6 * slope.abs(), "rear {rear}: {} against {slope}", axle.tangent);
    }
}

#[test]
fn linearising_steps_like_stepping() {
    let network = network(3, &[9, 16, 8, 2]);
    let memory = network.memory(8e4, 6e4);
    let (next, belief) = network.linearise(&memory, &TURN);
    assert_eq!(next, network.step(&memory, &TURN));
    let (c_f, c_r) = network.stiffness(&next);
    assert_eq!((belief.front.secant, belief.rear.secant, belief.confidence), (c_f, c_r, network.confidence(&TURN)));
}

#[test]
fn secant_and_tangent_give_the_same_force_where_the_stage_is() {
    let network = network(4, &[7, 8, 5, 2]);
    let (_, belief) = network.linearise(&network.nominal(), &TURN);
    let (secant, tangent) = (belief.secant(), belief.tangent(0.1));
    for (from_secant, from_tangent) in [
        (secant.c_f * belief.front.alpha, tangent.f_f0 + tangent.c_f * belief.front.alpha),
        (secant.c_r * belief.rear.alpha, tangent.f_r0 + tangent.c_r * belief.rear.alpha),
    ] {
        assert!((from_secant - from_tangent).abs() < 1e-9 * from_secant.abs());
    }
}

#[test]
fn outside_the_envelope_nothing_is_believed() {
    let network = network(5, &[7, 8, 5, 2]);
    assert_eq!(network.confidence(&TURN), 1.0);
    for measured in [
        Measured { v_x: 60.0, ..TURN },
        Measured { delta: 0.3, ..TURN },
        Measured { yaw_rate: f64::NAN, ..TURN },
        Measured { v_x: 0.0, ..TURN },
    ] {
        let (_, belief) = network.linearise(&network.nominal(), &measured);
        assert_eq!(belief.confidence, 0.0, "{measured:?}");
    }
}

#[test]
fn inputs_that_are_no_numbers_leave_the_memory() {
    let network = network(6, &[7, 8, 5, 2]);
    let memory = network.memory(9.5e4, 7e4);
    let blind = Measured { v_y: f64::NAN, ..TURN };
    assert_eq!(network.step(&memory, &blind), memory);
    assert_eq!(network.linearise(&memory, &blind).0, memory);
}

#[test]
fn certificate_bounds_the_distance_of_any_two_memories() {
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    for seed in 0..20 {
        let network = network(seed, &[7, 8, 5, 2]);
        for _ in 0..200 {
            let mut draw = |width: f64| rng.random_range(-width..width);
            let measured = Measured { v_y: draw(2.0), delta: draw(0.3), yaw_rate: draw(1.0), ..TURN };
            let (a, b) = (Memory { c_f: draw(3.0), c_r: draw(3.0) }, Memory { c_f: draw(3.0), c_r: draw(3.0) });
            let distance = |a: &Memory, b: &Memory| (a.c_f - b.c_f).hypot(a.c_r - b.c_r);
            let after = distance(&network.step(&a, &measured), &network.step(&b, &measured));
            assert!(after <= network.contraction() * distance(&a, &b) + 1e-14);
        }
    }
}

#[test]
fn damaged_and_foreign_files_are_refused_by_name() {
    let text = random(1, &[7, 8, 5, 2]).to_json();
    let message = |text: &str| Network::from_json(text).unwrap_err().to_string();
    assert!(message("weights").starts_with("network file is not readable: expected value"));
    assert!(message(&text[..text.len() / 2]).starts_with("network file is not readable: EOF"));
    assert_eq!(
        message("{\"format\": \"onnx\"}"),
        "network file has the format \"onnx\", expected \"lpv-mpc jordan network\""
    );
    assert!(message("{}").starts_with("network file has the format \"\""));
    assert_eq!(message(&text.replace("\"version\": 1", "\"version\": 9")), "network file has version 9, expected 1");
    let damaged = text.replacen("\"l_f\": 1.2", "\"l_f\": 1.3", 1);
    assert_ne!(damaged, text);
    assert!(
        message(&damaged).starts_with("network file is damaged: its content has the checksum"),
        "{}",
        message(&damaged)
    );
}

#[test]
fn impossible_sizes_and_numbers_are_refused_by_name() {
    let refuse = |change: &dyn Fn(&mut Document)| {
        let mut document = random(1, &[7, 8, 5, 2]);
        change(&mut document);
        // The checksum is right: these are files of a broken writer.
        let from_text = Network::from_json(&document.to_json()).unwrap_err().to_string();
        assert!(Network::try_from(document).is_err());
        from_text
    };
    assert_eq!(refuse(&|d| d.layers.clear()), "network is impossible: 0 layers, expected 1 to 8");
    assert_eq!(
        refuse(&|d| d.layers[1].weights[2].push(0.0)),
        "network is impossible: layer 1 has a row of 9 weights, expected 8"
    );
    assert_eq!(refuse(&|d| d.inputs.truncate(3)), "network is impossible: 3 measured inputs, expected 5 or 7");
    assert_eq!(
        refuse(&|d| d.outputs[0].deviation = 0.0),
        "network is impossible: a scaling with mean 90000 and deviation 0"
    );
    assert_eq!(refuse(&|d| d.envelope.alpha_f.max = -1.0), "network is impossible: an envelope from -0.1 to -1");
    assert_eq!(
        refuse(&|d| d.c_f_nominal = -1.0),
        "network is impossible: c_f_nominal of -1, expected a positive number"
    );
    // JSON has no word for it: what is not finite is written as null and cannot be read as a number.
    assert!(
        refuse(&|d| d.layers[0].biases[0] = f64::NAN).starts_with("network file is not readable: invalid type: null")
    );
}

#[test]
fn a_friction_that_no_road_has_is_refused() {
    let good: Document = network(8, &[7, 8, 5, 2]).into();
    for mu in [[0.9, 0.4], [0.0, 0.8], [-1.0, 0.8], [0.4, f64::INFINITY], [f64::NAN, 0.8]] {
        let mut wrong = good.clone();
        wrong.provenance.mu = mu;
        let error = Network::try_from(wrong).unwrap_err().to_string();
        assert!(error.contains("friction"), "{error}");
    }
}

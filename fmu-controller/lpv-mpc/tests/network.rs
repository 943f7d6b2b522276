//! The network that ships, held against the tyre's own formula and against what the controller needs of it.

use std::hint::black_box;

use allocation_counter::measure;
use lpv_mpc::jordan::{Measured, Memory, Network};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Geometry and weight of the trained vehicle, [Kebbati, Table 2].
const L_F: f64 = 1.2;
const L_R: f64 = 1.6;
const M: f64 = 1575.0;
const G: f64 = 9.81;

fn shipped() -> Network {
    Network::from_json(include_str!("../../resources/jordan.json")).expect("the shipped network is valid")
}

/// `dry_asphalt`, written down again: force over `mu F_z` and its slope at slip `alpha`, [Pacejka, eq. (4.49)].
fn magic_formula(alpha: f64) -> (f64, f64) {
    let (b, c) = (10.0, 1.4);
    let angle = c * (b * alpha).atan();
    (angle.sin(), angle.cos() * c * b / (1.0 + (b * alpha).powi(2)))
}

/// A motion with these slip angles: the yaw rate is what the forces sustain, and a bit of what a transient adds.
fn motion(v_x: f64, alpha_f: f64, alpha_r: f64, transient: f64) -> Measured {
    let force = 0.82 * G / (L_F + L_R) * (L_R * magic_formula(alpha_f).0 + L_F * magic_formula(alpha_r).0);
    let yaw_rate = force / v_x + transient;
    let v_y = L_R * yaw_rate - v_x * alpha_r.tan();
    let delta = alpha_f + ((v_y + L_F * yaw_rate) / v_x).atan();
    Measured { v_x, v_y, yaw_rate, delta, ..Measured::default() }
}

/// Motions within `slip` that the network calls familiar.
fn motions(network: &Network, slip: f64, count: usize) -> Vec<Measured> {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    std::iter::from_fn(|| {
        let mut draw = |width: f64| rng.random_range(-width..width);
        let front = draw(slip);
        // Both axles carry the same turn, so their slip angles differ by little compared with what they have in common.
        let rear = (front + draw(0.3 * slip)).clamp(-slip, slip);
        Some(motion(15.0 + draw(8.0), front, rear, draw(0.05)))
    })
    .filter(|measured| network.confidence(measured) == 1.0)
    .take(count)
    .collect()
}

/// The network's answer once the memory has settled.
fn settled(network: &Network, measured: &Measured) -> Memory {
    (0..30).fold(network.nominal(), |memory, _| network.step(&memory, measured))
}

#[test]
fn secant_and_tangent_follow_the_tyres_formula() {
    let network = shipped();
    let load = [0.82 * M * G * L_R / (L_F + L_R), 0.82 * M * G * L_F / (L_F + L_R)];
    let mut squares = [0.0; 2];
    let motions = motions(&network, 0.1, 2000);
    for measured in &motions {
        let (_, belief) = network.linearise(&settled(&network, measured), measured);
        for (axle, peak) in [belief.front, belief.rear].iter().zip(load) {
            let (force, slope) = magic_formula(axle.alpha);
            squares[0] += (axle.secant * axle.alpha / peak - force).powi(2);
            squares[1] += (axle.tangent / peak - slope).powi(2);
        }
    }
    let [force, slope] = squares.map(|sum| (sum / (2.0 * motions.len() as f64)).sqrt());
    // Motions of this test's own making, not of the training's manoeuvres: 0.4 % of the grip as promised for those, and the
    // tangent to 2 % of the stiffness at zero slip, 14 per radian.
    assert!(force < 0.004, "rms force error {force} of the grip");
    assert!(slope < 0.02 * 14.0, "rms tangent error {slope} of the grip per radian");
}

#[test]
fn a_wrong_memory_is_forgotten_within_20_samples() {
    let network = shipped();
    let distance = |a: &Memory, b: &Memory| (a.c_f - b.c_f).hypot(a.c_r - b.c_r);
    assert!(network.contraction().powi(20) < 0.01, "the certificate promises {}", network.contraction());
    for motion in motions(&network, 0.25, 200) {
        let mut right = settled(&network, &motion);
        let mut wrong = Memory { c_f: right.c_f + 2.0, c_r: right.c_r - 2.0 };
        let before = distance(&right, &wrong);
        for _ in 0..20 {
            (right, wrong) = (network.step(&right, &motion), network.step(&wrong, &motion));
        }
        let left = distance(&right, &wrong) / before;
        assert!(left < 0.01, "{left} is left at {motion:?}");
    }
}

#[test]
fn mirrored_motions_have_the_same_stiffness() {
    let network = shipped();
    let mut worst: f64 = 0.0;
    for motion in motions(&network, 0.1, 500) {
        let Measured { v_y, yaw_rate, delta, .. } = motion;
        let mirrored = Measured { v_y: -v_y, yaw_rate: -yaw_rate, delta: -delta, ..motion };
        let (a, b) = (settled(&network, &motion), settled(&network, &mirrored));
        worst = worst.max((a.c_f - b.c_f).abs()).max((a.c_r - b.c_r).abs());
    }
    // Nothing in the network forces the symmetry; the data teach it. In units of the stiffness' spread.
    assert!(worst < 0.1, "left and right differ by {worst}");
}

#[test]
fn the_file_carries_scores_that_meet_the_promise() {
    let scores = shipped().document().scores;
    assert!(scores.free_running.c_f >= 0.999 && scores.free_running.c_r >= 0.998, "{scores:?}");
    assert!(scores.force_error.c_f <= 0.004 && scores.force_error.c_r <= 0.004, "{scores:?}");
}

#[test]
fn inference_allocates_nothing() {
    let network = shipped();
    let measured = motion(16.0, 0.05, 0.05, 0.0);
    let memory = network.nominal();
    let counted = measure(|| {
        black_box(network.linearise(&network.step(&memory, &measured), &measured));
    });
    assert_eq!(counted.count_total, 0);
}

//! The packed FMUs against the cores that they are made of.
#![allow(clippy::unwrap_used, reason = "a test may panic, in its helpers too")]

use std::sync::OnceLock;

use fmu_tools::demo::drive;
use fmu_tools::output::Output;
use fmu_tools::pack::{Packed, pack};
use fmu_tools::recording::{Recording, columns};
use fmu_tools::simulate::{build, native, settings::Settings};

const QUIET: Output = Output { quiet: true };

/// The archives, packed once for all tests: an archive of yesterday proves nothing.
fn packed() -> &'static Packed {
    static PACKED: OnceLock<Packed> = OnceLock::new();
    PACKED.get_or_init(|| pack(&QUIET).expect("both FMUs can be packed"))
}

/// Drives the FMUs and the cores with the same parameters, given as (side, name, value).
fn both_ways(step: f64, values: &[(&str, &str, &str)]) -> (Recording, Recording) {
    let imported = drive(packed(), step, values, &QUIET).unwrap();
    let assignments: Vec<String> = values.iter().map(|(side, name, value)| format!("{side}.{name}={value}")).collect();
    let settings = Settings::new("double_lane_change", &assignments).unwrap();
    let (mut plant, mut controller) = build(&settings).unwrap();
    let native = native::drive(&mut plant, &mut controller, step, None, |_| {}).unwrap();
    (imported, native)
}

fn assert_same_bits(step: f64, values: &[(&str, &str, &str)]) {
    let (imported, native) = both_ways(step, values);
    assert!(native.rows.len() > 100, "a run of {} samples shows nothing", native.rows.len());
    assert_eq!(imported.rows.len(), native.rows.len(), "samples at steps of {step} s");
    for (ours, theirs) in native.rows.iter().zip(&imported.rows) {
        for ((name, _), (a, b)) in columns().zip(ours.iter().zip(theirs)) {
            let same = a.to_bits() == b.to_bits();
            assert!(same, "{name} at {} s and steps of {step} s: native {a:e}, FMU {b:e}", ours[0]);
        }
    }
}

#[test]
fn fmus_and_cores_give_the_same_bits_at_fine_steps() {
    assert_same_bits(0.001, &[]);
}

#[test]
fn fmus_and_cores_give_the_same_bits_at_one_sample_a_step() {
    assert_same_bits(0.033, &[("plant", "speed", "15"), ("controller", "horizon", "20")]);
}

#[test]
fn fmus_and_cores_give_the_same_bits_with_lags_noise_and_wind() {
    let values = [
        ("plant", "road", "general"),
        ("plant", "noise_scale", "1"),
        ("plant", "seed", "42"),
        ("plant", "tau_delta", "0.05"),
        ("controller", "tau_delta", "0.05"),
        ("controller", "r_delta", "30"),
    ];
    // No multiple and no fraction of the controller's period.
    assert_same_bits(0.0137, &values);
}

#[test]
fn packing_twice_gives_the_same_bytes() {
    let bytes =
        |packed: &Packed| [&packed.controller, &packed.plant, &packed.system].map(|path| std::fs::read(path).unwrap());
    let first = bytes(packed());
    let second = bytes(&pack(&QUIET).unwrap());
    assert!(first == second, "an archive changed between two packs of the same sources");
}

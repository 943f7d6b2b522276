//! Saved states.

use std::ptr;

use proptest::prelude::*;

use crate::importer::*;
use crate::{guid, vr};

/// Steps from `from` to `to` with an input that depends on time; the outputs on the way.
fn run(slave: &Slave, from: u32, to: u32) -> Vec<u64> {
    let mut outputs = Vec::new();
    for k in from..to {
        let t = f64::from(k) * 0.1;
        assert_eq!(slave.set(vr("u"), t.sin()), OK);
        assert_eq!(slave.step(t, 0.1), OK);
        outputs.extend(["y", "history[2]", "double_u"].map(|name| slave.get(vr(name)).unwrap().to_bits()));
    }
    outputs
}

#[test]
fn rollback_repeats_every_bit() {
    let slave = Slave::started(&guid(), 0.0);
    run(&slave, 0, 10);
    let mut state = ptr::null_mut();
    assert_eq!(unsafe { fmi2GetFMUstate(slave.component, &raw mut state) }, OK);
    let first = run(&slave, 10, 30);
    for _ in 0..3 {
        assert_eq!(unsafe { fmi2SetFMUstate(slave.component, state) }, OK);
        assert_eq!(run(&slave, 10, 30), first);
    }
    assert_eq!(unsafe { fmi2FreeFMUstate(slave.component, &raw mut state) }, OK);
}

#[test]
fn a_state_continues_in_another_instance() {
    let (slave, other) = (Slave::started(&guid(), 0.0), Slave::new(&guid()));
    run(&slave, 0, 10);
    assert_eq!(other.restore(&slave.serialized()), OK);
    assert_eq!(run(&slave, 10, 20), run(&other, 10, 20));
}

#[test]
fn a_state_is_overwritten_when_its_handle_is_passed_again() {
    let slave = Slave::started(&guid(), 0.0);
    let mut state = ptr::null_mut();
    unsafe { fmi2GetFMUstate(slave.component, &raw mut state) };
    let before = state;
    run(&slave, 0, 5);
    assert_eq!(unsafe { fmi2GetFMUstate(slave.component, &raw mut state) }, OK);
    assert_eq!(state, before);
    let first = run(&slave, 5, 8);
    unsafe { fmi2SetFMUstate(slave.component, state) };
    assert_eq!(run(&slave, 5, 8), first);
    unsafe { fmi2FreeFMUstate(slave.component, &raw mut state) };
}

#[test]
fn memory_that_is_no_state_is_refused() {
    let slave = Slave::started(&guid(), 0.0);
    let mut memory = [7_u64; 512];
    let mut state: State = memory.as_mut_ptr().cast();
    let mut size = 0;
    unsafe {
        assert_eq!(fmi2SetFMUstate(slave.component, state), ERROR);
        assert_eq!(fmi2GetFMUstate(slave.component, &raw mut state), ERROR);
        assert_eq!(fmi2SerializedFMUstateSize(slave.component, state, &raw mut size), ERROR);
        assert_eq!(fmi2FreeFMUstate(slave.component, &raw mut state), ERROR);
        assert_eq!(fmi2SetFMUstate(slave.component, state.byte_add(1)), ERROR, "not even aligned");
    }
    assert_eq!(memory, [7; 512]);
    assert_eq!(slave.step(0.0, 0.1), OK);
}

#[test]
fn a_state_from_before_an_error_revives_the_instance() {
    let slave = Slave::started(&guid(), 0.0);
    run(&slave, 0, 5);
    let saved = slave.serialized();
    let first = run(&slave, 5, 8);
    let broken = Slave::new(&guid());
    broken.set_integer(vr("trouble"), 3);
    broken.initialize();
    assert_eq!(broken.step(0.0, 0.1), ERROR);
    assert_eq!(broken.restore(&saved), OK);
    assert_eq!(run(&broken, 5, 8), first);
}

#[test]
fn a_state_of_initialisation_mode_carries_its_phase() {
    let (slave, other) = (Slave::new(&guid()), Slave::started(&guid(), 0.0));
    unsafe { fmi2EnterInitializationMode(slave.component) };
    slave.set_integer(vr("limit"), 7);
    assert_eq!(other.restore(&slave.serialized()), OK);
    assert_eq!(other.step(0.0, 0.1), ERROR, "it is in initialisation mode now");
    assert_eq!(unsafe { fmi2ExitInitializationMode(other.component) }, OK);
    assert_eq!(other.get_integer(vr("limit")), Ok(7));
}

#[test]
fn reset_and_the_same_calls_give_the_same_bits() {
    let slave = Slave::started(&guid(), 0.0);
    let first = run(&slave, 0, 20);
    assert_eq!(unsafe { fmi2Reset(slave.component) }, OK);
    assert_eq!(slave.setup(0.0, None), OK);
    assert_eq!(slave.initialize(), OK);
    assert_eq!(run(&slave, 0, 20), first);
}

#[test]
fn a_buffer_that_is_too_small_is_refused() {
    let slave = Slave::started(&guid(), 0.0);
    let mut state = ptr::null_mut();
    unsafe { fmi2GetFMUstate(slave.component, &raw mut state) };
    let mut bytes = vec![0; slave.serialized().len() - 1];
    assert_eq!(unsafe { fmi2SerializeFMUstate(slave.component, state, bytes.as_mut_ptr(), bytes.len()) }, ERROR);
    assert!(bytes.iter().all(|byte| *byte == 0));
    unsafe { fmi2FreeFMUstate(slave.component, &raw mut state) };
}

#[test]
fn every_truncation_and_every_flipped_bit_is_refused() {
    let slave = Slave::started(&guid(), 0.0);
    run(&slave, 0, 3);
    let bytes = slave.serialized();
    for len in 0..bytes.len() {
        assert_eq!(slave.restore(&bytes[..len]), ERROR, "{len} of {} bytes", bytes.len());
    }
    for bit in 0..8 * bytes.len() {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(slave.restore(&damaged), ERROR, "bit {bit}");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert_eq!(slave.restore(&longer), ERROR);
    assert_eq!(slave.restore(&bytes), OK);
}

proptest! {
    #[test]
    fn garbage_is_refused(garbage in prop::collection::vec(any::<u8>(), 0..400), keep in 0_usize..120) {
        let slave = Slave::started(&guid(), 0.0);
        let mut bytes = slave.serialized();
        let before = bytes.clone();
        bytes.truncate(keep);
        bytes.extend(garbage);
        prop_assume!(bytes != before);
        prop_assert_eq!(slave.restore(&bytes), ERROR);
        prop_assert_eq!(slave.serialized(), before);
    }
}

//! Call sequences against a model of the life cycle that was written down from the standard once more, here as transitions.

use std::ptr;

use proptest::prelude::*;

use crate::importer::*;
use crate::{guid, vr};

#[derive(Clone, Copy, Debug)]
enum Call {
    SetDebugLogging,
    SetupExperiment,
    Enter,
    Exit,
    Terminate,
    Reset,
    GetReal,
    SetInput,
    SetFixed,
    SaveAndRestore,
    DirectionalDerivative,
    InputDerivative,
    OutputDerivative,
    DoStep,
    Cancel,
    Status,
    Panic,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Instantiated,
    Initialization,
    Stepping,
    Terminated,
    Error,
}

/// Whether FMI 2.0.4 allows the call (table of section 4.2.4), and the phase after it.
fn expected(phase: Phase, call: Call) -> (bool, Phase) {
    use Phase::{Error, Initialization, Instantiated, Stepping, Terminated};
    let (allowed, next) = match call {
        Call::SetDebugLogging | Call::SaveAndRestore => (true, phase),
        Call::Reset => (true, Instantiated),
        Call::SetupExperiment => (phase == Instantiated, Instantiated),
        Call::Enter => (phase == Instantiated, Initialization),
        Call::Exit => (phase == Initialization, Stepping),
        Call::Terminate => (phase == Stepping, Terminated),
        Call::GetReal | Call::DirectionalDerivative => (phase != Instantiated, phase),
        Call::SetInput | Call::InputDerivative => (!matches!(phase, Terminated | Error), phase),
        Call::SetFixed => (matches!(phase, Instantiated | Initialization), phase),
        Call::OutputDerivative => (!matches!(phase, Instantiated | Initialization), phase),
        Call::DoStep => (phase == Stepping, Stepping),
        Call::Cancel => (false, phase),
        Call::Status => (matches!(phase, Stepping | Terminated), phase),
        // A step that panics is an error either way; only a legal one ruins the instance.
        Call::Panic => (false, if phase == Stepping { Error } else { phase }),
    };
    (allowed, if allowed || matches!(call, Call::Panic) { next } else { phase })
}

fn perform(slave: &Slave, phase: Phase, call: Call, time: &mut f64) -> i32 {
    let c = slave.component;
    let (u, y, one, mut real, value) = (vr("u"), vr("y"), 1, 0.0, 0.5);
    unsafe {
        match call {
            Call::SetDebugLogging => fmi2SetDebugLogging(c, 0, 0, ptr::null()),
            Call::SetupExperiment => slave.setup(*time, None),
            Call::Enter => fmi2EnterInitializationMode(c),
            Call::Exit => fmi2ExitInitializationMode(c),
            Call::Terminate => fmi2Terminate(c),
            Call::Reset => {
                *time = 0.0;
                fmi2Reset(c)
            }
            Call::GetReal => slave.get(y).err().unwrap_or(OK),
            Call::SetInput => slave.set(u, value),
            Call::SetFixed => slave.set_integer(vr("limit"), 9),
            Call::SaveAndRestore => slave.restore(&slave.serialized()),
            Call::DirectionalDerivative => {
                fmi2GetDirectionalDerivative(c, &raw const y, 1, &raw const u, 1, &raw const value, &raw mut real)
            }
            Call::InputDerivative => fmi2SetRealInputDerivatives(c, &raw const u, 1, &raw const one, &raw const value),
            Call::OutputDerivative => fmi2GetRealOutputDerivatives(c, &raw const y, 1, &raw const one, &raw mut real),
            Call::DoStep => {
                let status = slave.step(*time, 0.25);
                *time += if status == OK { 0.25 } else { 0.0 };
                status
            }
            Call::Cancel => fmi2CancelStep(c),
            Call::Status => fmi2GetRealStatus(c, 2, &raw mut real),
            Call::Panic => slave.step_that_panics(*time, phase == Phase::Stepping),
        }
    }
}

fn call() -> impl Strategy<Value = Call> {
    // The calls that lead onwards come more often, so that sequences get somewhere.
    prop_oneof![
        2 => Just(Call::Enter),
        2 => Just(Call::Exit),
        3 => Just(Call::DoStep),
        1 => prop::sample::select(vec![
            Call::SetDebugLogging, Call::SetupExperiment, Call::Terminate, Call::Reset, Call::GetReal, Call::SetInput, Call::SetFixed,
            Call::SaveAndRestore, Call::DirectionalDerivative, Call::InputDerivative, Call::OutputDerivative, Call::Cancel,
            Call::Status, Call::Panic,
        ]),
        4 => prop::sample::select(vec![Call::GetReal, Call::SetInput, Call::SetFixed, Call::SaveAndRestore, Call::OutputDerivative, Call::Status]),
    ]
}

proptest! {
    #[test]
    fn random_call_sequences_follow_the_standard(calls in prop::collection::vec(call(), 1..60)) {
        let slave = Slave::new(&guid());
        let (mut phase, mut time) = (Phase::Instantiated, 0.0);
        for (k, &call) in calls.iter().enumerate() {
            let (allowed, next) = expected(phase, call);
            let status = perform(&slave, phase, call, &mut time);
            prop_assert_eq!(status == OK, allowed, "call {} of {:?} in {:?} returned {}", k, calls, phase, status);
            phase = next;
        }
    }
}

#[test]
fn an_illegal_call_is_logged_with_function_and_phase() {
    let mut slave = Slave::new(&guid());
    slave.messages();
    assert_eq!(slave.step(0.0, 0.1), ERROR);
    let message = slave.error();
    assert!(message.contains("fmi2DoStep") && message.contains("Instantiated"), "{message}");
}

#[test]
fn time_and_status_are_kept() {
    let slave = Slave::new(&guid());
    assert_eq!(slave.setup(5.0, Some(6.0)), OK);
    assert_eq!(slave.initialize(), OK);
    let last = || {
        let mut time = f64::NAN;
        assert_eq!(unsafe { fmi2GetRealStatus(slave.component, 2, &raw mut time) }, OK);
        time
    };
    assert_eq!(last(), 5.0);
    assert_eq!(slave.step(5.0, 0.5), OK);
    assert_eq!(last(), 5.5);
    assert_eq!(slave.step(5.5, 0.6), ERROR, "past the stop time");
    assert_eq!(slave.step(5.0, 0.1), ERROR, "back in time");
    assert_eq!(last(), 5.5);
    assert_eq!(slave.step(5.5, 0.5), OK, "a refused step leaves the instance as it was");
    assert_eq!(last(), 6.0);
}

#[test]
fn status_kinds_answer_in_their_own_type() {
    let slave = Slave::started(&guid(), 0.0);
    let (mut integer, mut real, mut text) = (-1, f64::NAN, ptr::null());
    unsafe {
        assert_eq!(fmi2GetStatus(slave.component, 0, &raw mut integer), OK);
        assert_eq!(integer, OK);
        assert_eq!(fmi2GetBooleanStatus(slave.component, 3, &raw mut integer), OK);
        assert_eq!(integer, 0);
        assert_eq!(fmi2GetStringStatus(slave.component, 1, &raw mut text), OK);
        assert!(!text.is_null());
        assert_eq!(fmi2GetRealStatus(slave.component, 0, &raw mut real), DISCARD);
        assert_eq!(fmi2GetIntegerStatus(slave.component, 2, &raw mut integer), DISCARD);
        assert_eq!(fmi2GetRealStatus(slave.component, 4, &raw mut real), ERROR);
        assert_eq!(fmi2GetRealStatus(slave.component, 2, ptr::null_mut()), ERROR);
    }
}

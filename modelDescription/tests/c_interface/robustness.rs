//! What a careless importer does.

use std::ffi::{CString, c_int};
use std::ptr;
use std::thread;

use crate::guid;
use crate::importer::*;
use crate::vr;

#[test]
fn version_and_platform_are_those_of_the_standard() {
    let text = |pointer| unsafe { std::ffi::CStr::from_ptr(pointer) }.to_str().unwrap();
    assert_eq!(text(unsafe { fmi2GetVersion() }), "2.0");
    assert_eq!(text(unsafe { fmi2GetTypesPlatform() }), "default");
}

#[test]
fn a_null_instance_is_an_error() {
    let c = ptr::null_mut();
    let (mut integer, mut real, mut text, mut size, mut state) = (0, 0.0, ptr::null(), 0, ptr::null_mut());
    unsafe {
        fmi2FreeInstance(c);
        for status in [
            fmi2SetDebugLogging(c, 0, 0, ptr::null()),
            fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0),
            fmi2EnterInitializationMode(c),
            fmi2ExitInitializationMode(c),
            fmi2Terminate(c),
            fmi2Reset(c),
            fmi2GetReal(c, ptr::null(), 0, ptr::null_mut()),
            fmi2GetInteger(c, ptr::null(), 0, ptr::null_mut()),
            fmi2GetBoolean(c, ptr::null(), 0, ptr::null_mut()),
            fmi2GetString(c, ptr::null(), 0, ptr::null_mut()),
            fmi2SetReal(c, ptr::null(), 0, ptr::null()),
            fmi2SetInteger(c, ptr::null(), 0, ptr::null()),
            fmi2SetBoolean(c, ptr::null(), 0, ptr::null()),
            fmi2SetString(c, ptr::null(), 0, ptr::null()),
            fmi2GetFMUstate(c, &raw mut state),
            fmi2SetFMUstate(c, ptr::null_mut()),
            fmi2FreeFMUstate(c, &raw mut state),
            fmi2SerializedFMUstateSize(c, ptr::null_mut(), &raw mut size),
            fmi2SerializeFMUstate(c, ptr::null_mut(), ptr::null_mut(), 0),
            fmi2DeSerializeFMUstate(c, ptr::null(), 0, &raw mut state),
            fmi2GetDirectionalDerivative(c, ptr::null(), 0, ptr::null(), 0, ptr::null(), ptr::null_mut()),
            fmi2SetRealInputDerivatives(c, ptr::null(), 0, ptr::null(), ptr::null()),
            fmi2GetRealOutputDerivatives(c, ptr::null(), 0, ptr::null(), ptr::null_mut()),
            fmi2DoStep(c, 0.0, 0.1, 0),
            fmi2CancelStep(c),
            fmi2GetStatus(c, 0, &raw mut integer),
            fmi2GetRealStatus(c, 2, &raw mut real),
            fmi2GetIntegerStatus(c, 0, &raw mut integer),
            fmi2GetBooleanStatus(c, 3, &raw mut integer),
            fmi2GetStringStatus(c, 1, &raw mut text),
        ] {
            assert_eq!(status, ERROR);
        }
    }
}

#[test]
fn null_arrays_are_refused_and_logged_unless_they_are_empty() {
    let mut slave = Slave::started(&guid(), 0.0);
    let c = slave.component;
    let (u, one, real, n) = (vr("u"), 1, 1.0, 1);
    slave.messages();
    unsafe {
        let statuses = [
            fmi2GetReal(c, ptr::null(), n, ptr::null_mut()),
            fmi2GetReal(c, &raw const u, n, ptr::null_mut()),
            fmi2GetInteger(c, ptr::null(), n, ptr::null_mut()),
            fmi2GetBoolean(c, ptr::null(), n, ptr::null_mut()),
            fmi2GetString(c, ptr::null(), n, ptr::null_mut()),
            fmi2SetReal(c, &raw const u, n, ptr::null()),
            fmi2SetReal(c, ptr::null(), n, &raw const real),
            fmi2SetInteger(c, ptr::null(), n, ptr::null()),
            fmi2SetBoolean(c, ptr::null(), n, ptr::null()),
            fmi2SetString(c, ptr::null(), n, ptr::null()),
            slave.set_string_null(vr("label")),
            fmi2SetDebugLogging(c, 1, n, ptr::null()),
            fmi2SetRealInputDerivatives(c, &raw const u, n, ptr::null(), &raw const real),
            fmi2SetRealInputDerivatives(c, &raw const u, n, &raw const one, ptr::null()),
            fmi2GetRealOutputDerivatives(c, ptr::null(), n, ptr::null(), ptr::null_mut()),
            fmi2GetDirectionalDerivative(c, ptr::null(), n, ptr::null(), n, ptr::null(), ptr::null_mut()),
            fmi2GetFMUstate(c, ptr::null_mut()),
            fmi2SetFMUstate(c, ptr::null_mut()),
            fmi2FreeFMUstate(c, ptr::null_mut()),
            fmi2SerializedFMUstateSize(c, ptr::null_mut(), ptr::null_mut()),
            fmi2SerializeFMUstate(c, ptr::null_mut(), ptr::null_mut(), 10),
            fmi2DeSerializeFMUstate(c, ptr::null(), 10, ptr::null_mut()),
            fmi2GetStatus(c, 0, ptr::null_mut()),
        ];
        assert!(statuses.iter().all(|status| *status == ERROR), "{statuses:?}");
        let messages = slave.messages();
        assert_eq!(messages.len(), statuses.len(), "one message for each");
        assert_eq!(fmi2GetReal(c, ptr::null(), 0, ptr::null_mut()), OK);
        assert_eq!(fmi2SetString(c, ptr::null(), 0, ptr::null()), OK);
        assert_eq!(fmi2GetReal(c, &raw const u, usize::MAX, ptr::dangling_mut()), ERROR, "more than fits into memory");
    }
}

#[test]
fn unknown_and_mistyped_references_are_refused() {
    let mut slave = Slave::started(&guid(), 0.0);
    slave.messages();
    assert_eq!(slave.get(9999), Err(ERROR));
    assert!(slave.error().contains("9999"));
    assert_eq!(slave.get(u32::MAX), Err(ERROR));
    slave.messages();
    assert_eq!(slave.get(vr("count")), Err(ERROR));
    let message = slave.error();
    assert!(message.contains("count") && message.contains("Integer"), "{message}");
    assert_eq!(slave.get_string(vr("u")), Err(ERROR));
    assert_eq!(slave.set_integer(vr("u"), 1), ERROR);
}

#[test]
fn instantiation_checks_its_arguments() {
    let callbacks =
        Callbacks { logger: None, allocate: None, free: None, finished: None, environment: ptr::null_mut() };
    let right = CString::new(guid()).unwrap();
    let attempt = |name: *const _, kind: c_int, guid: *const _, callbacks: *const _| unsafe {
        let component = fmi2Instantiate(name, kind, guid, c"file:///nowhere".as_ptr(), callbacks, 0, 1);
        let created = !component.is_null();
        fmi2FreeInstance(component);
        created
    };
    let (name, callbacks) = (c"one".as_ptr(), &raw const callbacks);
    assert!(attempt(name, 1, right.as_ptr(), callbacks), "a logger may be missing");
    assert!(!attempt(name, 1, right.as_ptr(), ptr::null()));
    assert!(!attempt(name, 0, right.as_ptr(), callbacks), "model exchange");
    assert!(!attempt(name, 1, c"{wrong}".as_ptr(), callbacks));
    assert!(!attempt(name, 1, ptr::null(), callbacks));
    assert!(!attempt(c"".as_ptr(), 1, right.as_ptr(), callbacks));
    assert!(!attempt(ptr::null(), 1, right.as_ptr(), callbacks));
}

#[test]
fn a_wrong_guid_is_logged_with_both() {
    let mut slave = Slave::new("{wrong}");
    assert!(slave.component.is_null());
    let message = slave.error();
    assert!(message.contains("{wrong}") && message.contains(&guid()), "{message}");
}

#[test]
fn missing_resources_are_a_warning() {
    let mut slave = Slave::new(&guid());
    let messages = slave.messages();
    assert_eq!(messages.len(), 1, "{messages:?}");
    assert_eq!((messages[0].0, messages[0].1.as_str()), (WARNING, "logStatusWarning"));
}

#[test]
fn text_that_is_not_utf8_is_refused() {
    let mut slave = Slave::new(&guid());
    slave.messages();
    assert_eq!(slave.set_string(vr("label"), c"\xff"), ERROR);
    assert!(slave.error().contains("UTF-8"));
}

#[test]
fn a_failed_step_names_its_reason_and_ends_the_run() {
    let mut slave = Slave::new(&guid());
    slave.set_integer(vr("trouble"), 2);
    slave.initialize();
    slave.messages();
    assert_eq!(slave.step(0.0, 0.1), ERROR);
    assert_eq!(slave.error(), "fmi2DoStep: cannot go on at 50%% of %%s", "percent signs are doubled");
    assert_eq!(slave.step(0.0, 0.1), ERROR, "further steps are refused");
    assert!(slave.get(vr("y")).is_ok());
    assert_eq!(unsafe { fmi2Reset(slave.component) }, OK);
    assert_eq!(slave.initialize(), OK);
    assert_eq!(slave.step(0.0, 0.1), OK);
}

#[test]
fn a_panic_is_an_error_with_message_and_place() {
    let mut slave = Slave::new(&guid());
    slave.set_integer(vr("trouble"), 3);
    slave.initialize();
    slave.messages();
    assert_eq!(slave.step(0.0, 0.1), ERROR);
    let message = slave.error();
    assert!(message.contains("boom at 0 %%") && message.contains("sample.rs:"), "{message}");
    assert_eq!(slave.step(0.0, 0.1), ERROR);
}

#[test]
fn a_degraded_step_is_a_warning_and_the_run_goes_on() {
    let mut slave = Slave::new(&guid());
    slave.set_integer(vr("trouble"), 1);
    slave.initialize();
    slave.messages();
    for k in 0..3 {
        assert_eq!(slave.step(f64::from(k), 1.0), WARNING);
        let messages = slave.messages();
        assert_eq!(messages.len(), 1);
        assert!(messages[0].2.contains("held the last value"));
    }
}

#[test]
fn a_failed_initialisation_is_an_error_in_both_places() {
    let mut slave = Slave::new(&guid());
    slave.set_string(vr("label"), c"bad");
    unsafe { fmi2EnterInitializationMode(slave.component) };
    slave.messages();
    assert_eq!(slave.get(vr("y")), Err(ERROR));
    assert!(slave.error().contains("100%% bad"));
    slave.set_string(vr("label"), c"good");
    assert_eq!(slave.get(vr("y")), Ok(0.0), "the parameter may be corrected");
    slave.set_string(vr("label"), c"bad");
    assert_eq!(unsafe { fmi2ExitInitializationMode(slave.component) }, ERROR);
    assert_eq!(slave.step(0.0, 0.1), ERROR);
}

#[test]
fn log_categories_are_honoured() {
    let mut slave = Slave::new(&guid());
    assert_eq!(slave.choose(1, &[c"logEvents", c"nonsense"]), ERROR);
    assert_eq!(slave.choose(1, &[c"logEvents"]), OK);
    slave.messages();
    slave.initialize();
    assert!(slave.messages().iter().any(|(_, category, _)| category == "logEvents"));
    for (on, names, wanted) in
        [(0, &[][..], false), (1, &[c"logStatusError"][..], false), (1, &[c"logAll"][..], true), (1, &[][..], true)]
    {
        assert_eq!(slave.choose(on, names), OK);
        unsafe { fmi2Reset(slave.component) };
        slave.setup(0.0, None);
        slave.initialize();
        let events = slave.messages().iter().any(|(_, category, _)| category == "logEvents");
        assert_eq!(events, wanted, "{on} {names:?}");
    }
}

#[test]
fn a_thousand_instances_live_side_by_side() {
    let slaves: Vec<_> = (0..1000).map(|k| Slave::started(&guid(), f64::from(k))).collect();
    for (k, slave) in (0..1000).zip(&slaves) {
        slave.set(vr("u"), 0.5);
        assert_eq!(slave.step(f64::from(k), 1.0), OK);
    }
    for (k, slave) in (0..1000).zip(&slaves) {
        assert_eq!(slave.get(vr("y")), Ok(f64::from(k) + 1.0));
    }
}

struct Movable(Slave);
// SAFETY: one thread at a time uses it.
unsafe impl Send for Movable {}

#[test]
fn instances_run_on_eight_threads_and_move_between_them() {
    let mut slaves: Vec<_> = (0..8).map(|_| Movable(Slave::started(&guid(), 0.0))).collect();
    for round in 0..4 {
        slaves.rotate_left(1);
        let threads: Vec<_> = slaves
            .drain(..)
            .map(|slave| {
                thread::spawn(move || {
                    let slave = slave;
                    for k in 0..100 {
                        let t = f64::from(round * 100 + k);
                        assert_eq!(slave.0.set(vr("u"), 1.0), OK);
                        assert_eq!(slave.0.step(t, 1.0), OK);
                    }
                    slave
                })
            })
            .collect();
        slaves = threads.into_iter().map(|thread| thread.join().unwrap()).collect();
    }
    assert!(slaves.iter().all(|slave| slave.0.get(vr("y")) == Ok(800.0)));
}

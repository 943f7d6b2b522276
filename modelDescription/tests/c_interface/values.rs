//! Getting and setting.

use std::ptr;

use crate::importer::*;
use crate::{guid, vr};

#[test]
fn a_value_reference_is_the_position_among_the_flattened_rows() {
    assert_eq!(
        (vr("u"), vr("weights[1]"), vr("weights[3]"), vr("gain"), vr("history[1]"), vr("count")),
        (0, 1, 3, 4, 10, 14)
    );
}

#[test]
fn values_of_every_type_come_back() {
    let slave = Slave::started(&guid(), 0.0);
    assert_eq!(slave.set(vr("u"), 1.5), OK);
    assert_eq!(slave.set(vr("weights[2]"), 7.0), OK);
    assert_eq!(slave.get(vr("u")), Ok(1.5));
    assert_eq!(slave.get(vr("weights[2]")), Ok(7.0));
    assert_eq!(slave.get(vr("scaled[2]")), Ok(10.5));
    assert_eq!(slave.get_integer(vr("limit")), Ok(100));
    assert_eq!(slave.get_integer(vr("trouble")), Ok(0));
    assert_eq!(slave.get_string(vr("label")).unwrap(), "ü & <b>");
    assert_eq!(slave.get_string(vr("title")).unwrap(), "ü & <b>");
    let (vr, mut value) = (vr("moving"), -1);
    assert_eq!(unsafe { fmi2GetBoolean(slave.component, &raw const vr, 1, &raw mut value) }, OK);
    assert_eq!(value, 1);
}

#[test]
fn the_history_is_read_newest_first() {
    let slave = Slave::started(&guid(), 0.0);
    slave.set(vr("u"), 1.0);
    slave.step(0.0, 0.5);
    slave.step(0.5, 0.5);
    // gain 2, u 1: y grows by 1 in every half second.
    let history: Vec<_> = (1..=4).map(|k| slave.get(vr(&format!("history[{k}]"))).unwrap()).collect();
    assert_eq!(history, [2.0, 1.0, 0.0, 0.0]);
}

/// A call that is refused, and what its message must contain.
type Attempt = (fn(&Slave) -> i32, &'static [&'static str]);

#[test]
fn values_out_of_range_are_refused_with_name_value_and_range() {
    let mut slave = Slave::new(&guid());
    slave.messages();
    let attempts: [Attempt; 6] = [
        (|slave| slave.set(vr("u"), 10.5), &["u", "10.5", "[-10, 10] m/s"]),
        (|slave| slave.set(vr("gain"), -0.1), &["gain", "-0.1", "[0, inf) 1/s"]),
        (|slave| slave.set(vr("weights[2]"), f64::NAN), &["weights[2]", "NaN"]),
        (|slave| slave.set(vr("u"), f64::INFINITY), &["u", "inf"]),
        (|slave| slave.set_integer(vr("limit"), 0), &["limit", "0", "[1, 1000]"]),
        (|slave| slave.set_integer(vr("trouble"), 4), &["trouble", "4", "0 (none), 1 (degrade), 2 (fail), 3 (panic)"]),
    ];
    for (attempt, parts) in attempts {
        assert_eq!(attempt(&slave), ERROR, "{parts:?}");
        let message = slave.error();
        for part in parts {
            assert!(message.contains(part), "{message} lacks {part}");
        }
    }
}

#[test]
fn a_refused_value_leaves_the_old_one_and_the_next_recovers() {
    let slave = Slave::started(&guid(), 0.0);
    assert_eq!(slave.set(vr("u"), 1.0), OK);
    let (references, values) = ([vr("weights[1]"), vr("u")], [5.0, f64::NAN]);
    assert_eq!(unsafe { fmi2SetReal(slave.component, references.as_ptr(), 2, values.as_ptr()) }, ERROR);
    assert_eq!(slave.get(vr("u")), Ok(1.0));
    assert_eq!(slave.get(vr("weights[1]")), Ok(1.0), "all or none are set");
    assert_eq!(slave.step(0.0, 0.1), OK);
    assert_eq!(slave.set(vr("u"), 2.0), OK);
    assert_eq!(slave.step(0.1, 0.1), OK);
    assert!((slave.get(vr("y")).unwrap() - 0.6).abs() < 1e-12);
}

#[test]
fn causality_and_variability_are_enforced() {
    let mut slave = Slave::new(&guid());
    assert_eq!(slave.set(vr("y"), 1.0), ERROR, "an output before initialisation");
    assert_eq!(slave.set_integer(vr("limit"), 5), OK, "a fixed parameter before initialisation");
    slave.messages();
    slave.initialize();
    assert_eq!(slave.set_integer(vr("limit"), 6), ERROR, "a fixed parameter after initialisation");
    assert!(slave.error().contains("limit"));
    assert_eq!(slave.get_integer(vr("limit")), Ok(5));
    assert_eq!(slave.set(vr("y"), 1.0), ERROR, "an output after initialisation");
    assert_eq!(slave.set(vr("u"), 1.0), OK, "an input after initialisation");
}

#[test]
fn a_tunable_parameter_takes_effect_at_the_next_step() {
    let slave = Slave::started(&guid(), 0.0);
    slave.set(vr("u"), 1.0);
    slave.step(0.0, 1.0);
    assert_eq!(slave.get(vr("y")), Ok(2.0));
    assert_eq!(slave.set(vr("gain"), 5.0), OK);
    assert_eq!(slave.get(vr("y")), Ok(2.0));
    slave.step(1.0, 1.0);
    assert_eq!(slave.get(vr("y")), Ok(7.0));
}

#[test]
fn lazy_outputs_follow_inputs_and_are_computed_once() {
    let slave = Slave::started(&guid(), 0.0);
    for u in [1.0, -3.0] {
        slave.set(vr("u"), u);
        assert_eq!(slave.get(vr("double_u")), Ok(2.0 * u));
    }
    let before = slave.get_integer(vr("refreshed")).unwrap();
    slave.get(vr("double_u")).unwrap();
    slave.get(vr("y")).unwrap();
    assert_eq!(slave.get_integer(vr("refreshed")), Ok(before));
}

#[test]
fn outputs_in_initialisation_mode_are_those_after_it() {
    let slave = Slave::new(&guid());
    slave.setup(3.0, None);
    unsafe { fmi2EnterInitializationMode(slave.component) };
    slave.set(vr("u"), 2.0);
    let early = (slave.get(vr("y")), slave.get(vr("double_u")));
    slave.set(vr("u"), 4.0);
    let later = (slave.get(vr("y")), slave.get(vr("double_u")));
    assert_eq!(unsafe { fmi2ExitInitializationMode(slave.component) }, OK);
    assert_eq!((early, later), ((Ok(3.0), Ok(4.0)), (Ok(3.0), Ok(8.0))));
    assert_eq!((slave.get(vr("y")), slave.get(vr("double_u"))), later);
}

#[test]
fn strings_stay_valid_until_the_next_call() {
    let slave = Slave::started(&guid(), 0.0);
    let (references, mut values) = ([vr("label"), vr("title")], [ptr::null(); 2]);
    assert_eq!(unsafe { fmi2GetString(slave.component, references.as_ptr(), 2, values.as_mut_ptr()) }, OK);
    for value in values {
        assert_eq!(unsafe { std::ffi::CStr::from_ptr(value) }.to_str().unwrap(), "ü & <b>");
    }
}

#[test]
fn input_derivatives_extrapolate_inside_the_next_step_only() {
    let slave = Slave::started(&guid(), 0.0);
    slave.set(vr("u"), 1.0);
    let (u, order, slope) = (vr("u"), 1, 3.0);
    assert_eq!(
        unsafe { fmi2SetRealInputDerivatives(slave.component, &raw const u, 1, &raw const order, &raw const slope) },
        OK
    );
    slave.step(0.0, 2.0);
    // Integral of 2 (1 + 3 t) from 0 to 2.
    assert_eq!(slave.get(vr("y")), Ok(16.0));
    slave.step(2.0, 1.0);
    assert_eq!(slave.get(vr("y")), Ok(18.0));
}

#[test]
fn derivatives_that_do_not_exist_are_refused() {
    let mut slave = Slave::started(&guid(), 0.0);
    for (name, order, value) in
        [("u", 2, 1.0), ("u", 0, 1.0), ("u", -1, 1.0), ("y", 1, 1.0), ("gain", 1, 1.0), ("u", 1, f64::NAN)]
    {
        let vr = vr(name);
        slave.messages();
        let status = unsafe {
            fmi2SetRealInputDerivatives(slave.component, &raw const vr, 1, &raw const order, &raw const value)
        };
        assert_eq!(status, ERROR, "{name} of order {order}");
        assert!(slave.error().contains(name));
    }
    for (name, order) in [("y", 0), ("y", 2), ("u", 1), ("double_u", 1)] {
        let (vr, mut value) = (vr(name), 0.0);
        let status = unsafe {
            fmi2GetRealOutputDerivatives(slave.component, &raw const vr, 1, &raw const order, &raw mut value)
        };
        assert_eq!(status, ERROR, "{name} of order {order}");
    }
}

#[test]
fn output_and_directional_derivatives_reach_the_importer() {
    let slave = Slave::started(&guid(), 0.0);
    slave.set(vr("u"), 1.5);
    let (y, order, mut value) = (vr("y"), 1, 0.0);
    assert_eq!(
        unsafe { fmi2GetRealOutputDerivatives(slave.component, &raw const y, 1, &raw const order, &raw mut value) },
        OK
    );
    assert_eq!(value, 3.0, "gain 2 times u");
    let (unknown, known, seed, mut sensitivity) = (vr("double_u"), vr("u"), 0.5, 0.0);
    let directional = |unknown: u32, known: u32, sensitivity: &mut f64| unsafe {
        fmi2GetDirectionalDerivative(
            slave.component,
            &raw const unknown,
            1,
            &raw const known,
            1,
            &raw const seed,
            sensitivity,
        )
    };
    assert_eq!(directional(unknown, known, &mut sensitivity), OK);
    assert_eq!(sensitivity, 1.0);
    assert_eq!(directional(known, known, &mut sensitivity), ERROR, "an input is no unknown");
    assert_eq!(directional(unknown, unknown, &mut sensitivity), ERROR, "an output is no known");
    assert_eq!(directional(unknown, vr("limit"), &mut sensitivity), ERROR, "an integer has no derivative");
}

#[test]
fn derivatives_of_an_instance_that_was_never_initialised_are_refused_without_harm() {
    let slave = Slave::new(&guid());
    slave.set_string(vr("label"), c"bad");
    assert_eq!(slave.initialize(), ERROR);
    let (unknown, known, seed, order, mut value) = (vr("double_u"), vr("u"), 1.0, 1, 0.0);
    unsafe {
        let c = slave.component;
        let (u, k) = (&raw const unknown, &raw const known);
        assert_eq!(fmi2GetDirectionalDerivative(c, u, 1, k, 1, &raw const seed, &raw mut value), ERROR);
        assert_eq!(
            fmi2GetDirectionalDerivative(c, u, 0, k, 1, &raw const seed, &raw mut value),
            OK,
            "nothing is asked for"
        );
        assert_eq!(fmi2GetRealOutputDerivatives(c, u, 1, &raw const order, &raw mut value), ERROR);
    }
}

#[test]
fn input_derivatives_are_set_all_or_none() {
    let slave = Slave::started(&guid(), 0.0);
    let (references, orders, values) = ([vr("u"), vr("y")], [1, 1], [5.0, 5.0]);
    let status = unsafe {
        fmi2SetRealInputDerivatives(slave.component, references.as_ptr(), 2, orders.as_ptr(), values.as_ptr())
    };
    assert_eq!(status, ERROR, "y is no input");
    slave.step(0.0, 1.0);
    assert_eq!(slave.get(vr("y")), Ok(0.0), "the derivative of u was not taken over");
}

#[test]
fn values_do_not_depend_on_how_the_references_are_grouped() {
    // Runs that begin and end inside an array, cross from row to row, go backwards, repeat.
    let groups: [&[&str]; 6] = [
        &["u", "weights[1]", "weights[2]", "weights[3]", "gain"],
        &["weights[2]", "weights[3]"],
        &["weights[3]", "weights[2]", "weights[1]"],
        &["weights[1]", "weights[3]", "u"],
        &["weights[1]", "weights[1]", "weights[2]"],
        &[],
    ];
    for group in groups {
        let (slave, single) = (Slave::started(&guid(), 0.0), Slave::started(&guid(), 0.0));
        let references: Vec<_> = group.iter().map(|name| vr(name)).collect();
        let values: Vec<f64> = (0..).map(|k| 0.5 + f64::from(k)).take(group.len()).collect();
        let count = references.len();
        assert_eq!(unsafe { fmi2SetReal(slave.component, references.as_ptr(), count, values.as_ptr()) }, OK);
        for (reference, value) in references.iter().zip(&values) {
            assert_eq!(single.set(*reference, *value), OK);
        }
        let mut together = vec![0.0; count];
        assert_eq!(unsafe { fmi2GetReal(slave.component, references.as_ptr(), count, together.as_mut_ptr()) }, OK);
        let one_by_one: Vec<f64> = references.iter().map(|reference| single.get(*reference).unwrap()).collect();
        assert_eq!(together, one_by_one, "{group:?}");
    }
}

#[test]
fn a_value_out_of_range_inside_a_run_is_named() {
    let mut slave = Slave::started(&guid(), 0.0);
    let references = [vr("weights[1]"), vr("weights[2]"), vr("weights[3]")];
    let values = [1.0, 2.0, f64::INFINITY];
    assert_eq!(unsafe { fmi2SetReal(slave.component, references.as_ptr(), 3, values.as_ptr()) }, ERROR);
    let message = slave.error();
    assert!(message.contains("weights[3]") && message.contains("inf"), "{message}");
    assert_eq!(slave.get(vr("weights[1]")), Ok(1.0));
}

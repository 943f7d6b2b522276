//! Getting and setting variables and derivatives.
#![allow(clippy::missing_safety_doc, missing_docs, reason = "the standard documents and restricts these functions")]

use super::c::*;
use super::call;
use super::pointers::{input, output, text};
use crate::lifecycle as of;
use crate::model::Model;
use crate::value::{Kind, Scalar};

pub unsafe fn get_real<M: Model>(component: Component, vr: *const ValueReference, n: usize, value: *mut f64) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::GET_REAL, |slave| {
            slave.read_reals(input("vr", vr, n)?, output("value", value, n)?)?;
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn set_real<M: Model>(
    component: Component,
    vr: *const ValueReference,
    n: usize,
    value: *const f64,
) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::SET_REAL, |slave| {
            slave.write_reals(input("vr", vr, n)?, input("value", value, n)?)?;
            Ok(Status::Ok)
        })
    }
}

/// The getters and setters of the two other types that travel as plain numbers.
macro_rules! numbers {
    ($($get:ident $set:ident $get_row:ident $set_row:ident $kind:ident $type:ty, $out:expr, $in:expr;)*) => {$(
        #[inline]
        pub unsafe fn $get<M: Model>(component: Component, vr: *const ValueReference, n: usize, value: *mut $type) -> Status {
            // SAFETY: the caller's promise.
            unsafe {
                call::<M>(component, &of::$get_row, |slave| {
                    let (references, values) = (input("vr", vr, n)?, output("value", value, n)?);
                    slave.read(references, Kind::$kind, |k, scalar| {
                        if let Scalar::$kind(value) = scalar {
                            values[k] = $out(value);
                        }
                    })?;
                    Ok(Status::Ok)
                })
            }
        }

        #[inline]
        pub unsafe fn $set<M: Model>(component: Component, vr: *const ValueReference, n: usize, value: *const $type) -> Status {
            // SAFETY: the caller's promise.
            unsafe {
                call::<M>(component, &of::$set_row, |slave| {
                    let (references, values) = (input("vr", vr, n)?, input("value", value, n)?);
                    slave.write(references, Kind::$kind, |k| Scalar::$kind($in(values[k])))?;
                    Ok(Status::Ok)
                })
            }
        }
    )*};
}

numbers! {
    get_integer set_integer GET_INTEGER SET_INTEGER Integer Integer, |value| value, |value| value;
    get_boolean set_boolean GET_BOOLEAN SET_BOOLEAN Boolean Boolean, Boolean::from, |value| value != FALSE;
}

pub unsafe fn get_string<M: Model>(
    component: Component,
    vr: *const ValueReference,
    n: usize,
    value: *mut Text,
) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::GET_STRING, |slave| {
            let (references, values) = (input("vr", vr, n)?, output("value", value, n)?);
            let strings = slave.read_strings(references)?;
            for (value, string) in values.iter_mut().zip(strings) {
                *value = string.as_ptr();
            }
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn set_string<M: Model>(
    component: Component,
    vr: *const ValueReference,
    n: usize,
    value: *const Text,
) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::SET_STRING, |slave| {
            let (references, values) = (input("vr", vr, n)?, input("value", value, n)?);
            let texts = values.iter().map(|&value| text("value", value)).collect::<Result<Vec<_>, _>>()?;
            slave.write(references, Kind::String, |k| Scalar::String(texts[k]))?;
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn get_directional_derivative<M: Model>(
    component: Component,
    unknown: *const ValueReference,
    n_unknown: usize,
    known: *const ValueReference,
    n_known: usize,
    seed: *const f64,
    sensitivity: *mut f64,
) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::GET_DIRECTIONAL_DERIVATIVE, |slave| {
            let (unknowns, knowns) = (input("vUnknown_ref", unknown, n_unknown)?, input("vKnown_ref", known, n_known)?);
            let seed = input("dvKnown", seed, n_known)?;
            let sensitivity = output("dvUnknown", sensitivity, n_unknown)?;
            slave.directional_derivative(unknowns, knowns, seed, sensitivity)?;
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn set_real_input_derivatives<M: Model>(
    component: Component,
    vr: *const ValueReference,
    n: usize,
    order: *const Integer,
    value: *const f64,
) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::SET_REAL_INPUT_DERIVATIVES, |slave| {
            let (orders, values) = (input("order", order, n)?, input("value", value, n)?);
            slave.set_input_derivatives(input("vr", vr, n)?, orders, values)?;
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn get_real_output_derivatives<M: Model>(
    component: Component,
    vr: *const ValueReference,
    n: usize,
    order: *const Integer,
    value: *mut f64,
) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::GET_REAL_OUTPUT_DERIVATIVES, |slave| {
            let (orders, values) = (input("order", order, n)?, output("value", value, n)?);
            for ((&reference, &order), value) in input("vr", vr, n)?.iter().zip(orders).zip(values) {
                *value = slave.output_derivative(reference, order)?;
            }
            Ok(Status::Ok)
        })
    }
}

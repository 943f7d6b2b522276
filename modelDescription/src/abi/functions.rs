//! The functions of the standard, generic over the model. All are unsafe for one reason: they trust the importer's pointers as the
//! standard has them (FMI 2.0.4, sections 2.1 and 4.2); NULL is the only wrong pointer that can be told from a right one.
#![allow(
    clippy::missing_safety_doc,
    missing_docs,
    clippy::too_many_arguments,
    reason = "the standard documents and restricts them"
)]

use std::ffi::{CStr, CString};
use std::ptr;

use super::c::*;
use super::logger::Logger;
use super::pointers::{input, output, place, text};
use super::{Slave, call, panics};
use crate::error::Error;
use crate::guid;
use crate::lifecycle as of;
use crate::model::{Category, Log, Model, Outcome};
use crate::resources;
use crate::state::State;
use crate::value::{Kind, Scalar};

pub unsafe fn instantiate<M: Model>(
    name: Text,
    kind: Integer,
    guid: Text,
    resources: Text,
    callbacks: *const Callbacks,
    _visible: Boolean,
    logging: Boolean,
) -> Component {
    panics::install_hook();
    // SAFETY: FMI 2.0.4, section 2.1.5: callbacks points at the functions until this call returns; they are copied.
    let Some(callbacks) = (unsafe { callbacks.as_ref() }) else { return ptr::null_mut() };
    // SAFETY: FMI 2.0.4, section 2.1.2: fmi2String is a NUL-terminated string.
    let label = if name.is_null() { CString::default() } else { unsafe { CStr::from_ptr(name) }.to_owned() };
    let mut logger = Logger::new(callbacks, label, logging != FALSE);
    let created = panics::catch(|| {
        // SAFETY: as above.
        let given = unsafe { text("fmuGUID", guid) }?;
        check_instantiation::<M>(&logger, kind, given)?;
        // SAFETY: as above.
        let location = (!resources.is_null()).then(|| unsafe { CStr::from_ptr(resources) });
        Ok(resources::folder(location))
    });
    let error = match created.unwrap_or_else(|panic| Err(Error::Panic(panic))) {
        Ok(found) => {
            let folder =
                found.inspect_err(|reason| logger.log(Category::Warning, &format!("fmi2Instantiate: {reason}"))).ok();
            match panics::catch(|| Box::new(Slave::<M>::new(folder, logger))) {
                Ok(slave) => return Box::into_raw(slave).cast(),
                // The logger went down with the model's Default, which has no input that could make it panic.
                Err(_) => return ptr::null_mut(),
            }
        }
        Err(error) => error,
    };
    logger.log(Category::Error, &format!("fmi2Instantiate: {error}"));
    ptr::null_mut()
}

fn check_instantiation<M: Model>(logger: &Logger, kind: Integer, given: &str) -> Result<(), Error> {
    if logger.instance_name().is_empty() {
        return Err(Error::Name);
    }
    if kind != CO_SIMULATION {
        return Err(Error::FmuType(kind));
    }
    let expected = guid::guid::<M>();
    if given != expected {
        return Err(Error::Guid { given: given.to_owned(), expected: expected.to_owned() });
    }
    Ok(())
}

pub unsafe fn free_instance<M: Model>(component: Component) {
    if component.is_null() {
        return;
    }
    // SAFETY: FMI 2.0.4, section 2.1.5: the importer passes what fmi2Instantiate returned, once.
    let slave = unsafe { Box::from_raw(component.cast::<Slave<M>>()) };
    // A destructor that panics must not unwind into C, and there is no instance left to report it.
    drop(panics::catch(|| drop(slave)));
}

pub unsafe fn set_debug_logging<M: Model>(
    component: Component,
    on: Boolean,
    n: usize,
    categories: *const Text,
) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::SET_DEBUG_LOGGING, |slave| {
            let categories = input("categories", categories, n)?;
            let names = categories.iter().map(|&name| text("categories", name)).collect::<Result<Vec<_>, _>>()?;
            slave.log.choose(on != FALSE, &names)?;
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn setup_experiment<M: Model>(
    component: Component,
    _tolerance_defined: Boolean,
    _tolerance: f64,
    start: f64,
    stop_defined: Boolean,
    stop: f64,
) -> Status {
    let stop = (stop_defined != FALSE).then_some(stop);
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::SETUP_EXPERIMENT, |slave| slave.setup_experiment(start, stop).map(|()| Status::Ok))
    }
}

pub unsafe fn enter_initialization_mode<M: Model>(component: Component) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::ENTER_INITIALIZATION_MODE, |slave| {
            slave.enter_initialization_mode();
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn exit_initialization_mode<M: Model>(component: Component) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::EXIT_INITIALIZATION_MODE, |slave| {
            slave.exit_initialization_mode().map(|()| Status::Ok)
        })
    }
}

pub unsafe fn terminate<M: Model>(component: Component) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::TERMINATE, |slave| {
            slave.terminate();
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn reset<M: Model>(component: Component) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::RESET, |slave| {
            slave.reset();
            Ok(Status::Ok)
        })
    }
}

/// The getters and setters of the three types that travel as plain numbers.
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
                    slave.write(references, Kind::$kind, |k| Ok(Scalar::$kind($in(values[k]))))?;
                    Ok(Status::Ok)
                })
            }
        }
    )*};
}

numbers! {
    get_real    set_real    GET_REAL    SET_REAL    Real    f64,     |value| value,                |value| value;
    get_integer set_integer GET_INTEGER SET_INTEGER Integer Integer, |value| value,                |value| value;
    get_boolean set_boolean GET_BOOLEAN SET_BOOLEAN Boolean Boolean, Boolean::from,   |value| value != FALSE;
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
            slave.write(references, Kind::String, |k| text("value", values[k]).map(Scalar::String))?;
            Ok(Status::Ok)
        })
    }
}

/// The state behind an importer's handle.
unsafe fn saved<'a, M: Model>(state: FmuState) -> Result<&'a mut State<M>, Error> {
    // SAFETY: FMI 2.0.4, section 2.1.8: a state is NULL or was returned by this FMU and not freed.
    unsafe { place("FMUstate", state.cast()) }
}

/// Hands a state to the importer: into the one that its handle already names, or as a new one.
unsafe fn hand_over<M: Model>(handle: &mut FmuState, state: State<M>) {
    // SAFETY: FMI 2.0.4, section 2.1.8: a handle that is not NULL names a state that this FMU returned and may be overwritten.
    match unsafe { handle.cast::<State<M>>().as_mut() } {
        Some(known) => *known = state,
        None => *handle = Box::into_raw(Box::new(state)).cast(),
    }
}

pub unsafe fn get_fmu_state<M: Model>(component: Component, state: *mut FmuState) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::GET_FMU_STATE, |slave| {
            hand_over(place("FMUstate", state)?, slave.state.clone());
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn set_fmu_state<M: Model>(component: Component, state: FmuState) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::SET_FMU_STATE, |slave| {
            slave.restore(saved(state)?.clone());
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn free_fmu_state<M: Model>(component: Component, state: *mut FmuState) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::FREE_FMU_STATE, |_| {
            let handle = place("FMUstate", state)?;
            if !handle.is_null() {
                drop(Box::from_raw(handle.cast::<State<M>>()));
                *handle = ptr::null_mut();
            }
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn serialized_fmu_state_size<M: Model>(component: Component, state: FmuState, size: *mut usize) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::SERIALIZED_FMU_STATE_SIZE, |_| {
            *place("size", size)? = saved::<M>(state)?.to_bytes()?.len();
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn serialize_fmu_state<M: Model>(
    component: Component,
    state: FmuState,
    bytes: *mut u8,
    size: usize,
) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::SERIALIZE_FMU_STATE, |_| {
            let saved = saved::<M>(state)?.to_bytes()?;
            let bytes = output("serializedState", bytes, size)?;
            let target = bytes.get_mut(..saved.len()).ok_or(Error::Size { name: "size", size })?;
            target.copy_from_slice(&saved);
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn deserialize_fmu_state<M: Model>(
    component: Component,
    bytes: *const u8,
    size: usize,
    state: *mut FmuState,
) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::DESERIALIZE_FMU_STATE, |_| {
            let handle = place("FMUstate", state)?;
            hand_over(handle, State::<M>::from_bytes(input("serializedState", bytes, size)?)?);
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
            for ((&reference, &order), &value) in input("vr", vr, n)?.iter().zip(orders).zip(values) {
                slave.set_input_derivative(reference, order, value)?;
            }
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

pub unsafe fn do_step<M: Model>(component: Component, t: f64, h: f64, _no_rollback: Boolean) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::DO_STEP, |slave| match slave.do_step(t, h)? {
            Outcome::Ok => Ok(Status::Ok),
            Outcome::Degraded(message) => {
                slave.log.log(Category::Warning, &format!("fmi2DoStep: at {t} s: {message}"));
                Ok(Status::Warning)
            }
        })
    }
}

pub unsafe fn cancel_step<M: Model>(component: Component) -> Status {
    // SAFETY: the caller's promise.
    unsafe { call::<M>(component, &of::CANCEL_STEP, |_| Ok(Status::Error)) }
}

/// The functions that ask for the status of a step; each answers the kinds that have its type.
macro_rules! statuses {
    ($($function:ident $row:ident $type:ty, $($kind:ident => $answer:expr),*;)*) => {$(
        pub unsafe fn $function<M: Model>(component: Component, kind: Integer, value: *mut $type) -> Status {
            // SAFETY: the caller's promise.
            unsafe {
                call::<M>(component, &of::$row, |slave| {
                    let value = place("value", value)?;
                    let answer: Option<fn(&Slave<M>) -> $type> = match kind {
                        $($kind => Some($answer),)*
                        DO_STEP_STATUS..=TERMINATED => None,
                        unknown => return Err(Error::StatusKind(unknown)),
                    };
                    // fmi2Discard: the kind exists, but has no value of this type (FMI 2.0.4, section 4.2.3).
                    Ok(answer.map_or(Status::Discard, |answer| {
                        *value = answer(slave);
                        Status::Ok
                    }))
                })
            }
        }
    )*};
}

statuses! {
    // Both answers concern pending steps; a step here is complete when fmi2DoStep returns.
    get_status         GET_STATUS         Integer, DO_STEP_STATUS => |_| Status::Ok as Integer;
    get_string_status  GET_STRING_STATUS  Text,    PENDING_STATUS => |_| c"".as_ptr();
    get_real_status    GET_REAL_STATUS    f64,     LAST_SUCCESSFUL_TIME => |slave| slave.state.clock.now;
    get_integer_status GET_INTEGER_STATUS Integer, ;
    get_boolean_status GET_BOOLEAN_STATUS Boolean, TERMINATED => |_| FALSE;
}

//! The life cycle, steps, and their status.
#![allow(clippy::missing_safety_doc, missing_docs, reason = "the standard documents and restricts these functions")]

use super::c::*;
use super::pointers::place;
use super::{Slave, call};
use crate::error::Error;
use crate::lifecycle as of;
use crate::model::{Category, Log, Model, Outcome};

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

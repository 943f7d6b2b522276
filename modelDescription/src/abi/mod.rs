//! The C interface of FMI 2.0: `export_fmu!` defines its 34 functions, each of which calls one generic function here. This folder
//! holds all unsafe code of the project: pointers become slices and references, everything else happens in `Instance`.
//!
//! The functions are unsafe for one reason: they trust the importer's pointers as the standard has them (FMI 2.0.4, sections 2.1 and
//! 4.2); NULL is the only wrong pointer that can be told from a right one.
//!
//! Each function of an instance goes through `call`: NULL check, call sequence, panic guard, one log message, status.

mod c;
mod export;
mod float;
mod instances;
mod logger;
mod panics;
mod pointers;
mod states;
mod steps;
mod values;

pub use c::*;
pub use instances::*;
pub use states::*;
pub use steps::*;
pub use values::*;

use self::logger::Logger;
use crate::error::Error;
use crate::instance::Instance;
use crate::lifecycle::{Function, Phase};
use crate::model::{Category, Log, Model};

/// What a fmi2Component points at.
type Slave<M> = Instance<M, Logger>;

/// Runs the body of a function on an instance.
///
/// # Safety
/// `component` is NULL or was returned by fmi2Instantiate of the same library and not freed, and no other call on it is running.
#[inline]
unsafe fn call<M: Model>(
    component: Component,
    function: &Function,
    body: impl FnOnce(&mut Slave<M>) -> Result<Status, Error>,
) -> Status {
    // SAFETY: FMI 2.0.4, section 2.1.5: the importer passes what fmi2Instantiate returned, and calls one instance at a time.
    let Some(slave) = (unsafe { component.cast::<Slave<M>>().as_mut() }) else { return Status::Error };
    float::in_standard_mode(|| {
        let result = if function.is_allowed_in(slave.state.phase) {
            panics::catch(|| body(slave)).unwrap_or_else(|panic| Err(Error::Panic(panic)))
        } else {
            Err(Error::CallSequence(slave.state.phase))
        };
        match result {
            Ok(status) => status,
            Err(error) => refuse(slave, function, &error),
        }
    })
}

#[cold]
fn refuse<M: Model>(slave: &mut Slave<M>, function: &Function, error: &Error) -> Status {
    if error.is_fatal_to_instance() {
        slave.state.phase = Phase::Error;
    }
    slave.log.log(Category::Error, &format!("{}: {error}", function.name));
    Status::Error
}

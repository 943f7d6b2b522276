//! Creating and freeing instances, and what they log.
#![allow(clippy::missing_safety_doc, missing_docs, reason = "the standard documents and restricts these functions")]

use std::ffi::{CStr, CString};
use std::ptr;

use super::c::*;
use super::logger::Logger;
use super::pointers::{input, text};
use super::{Slave, call, float, panics};
use crate::error::Error;
use crate::guid;
use crate::lifecycle as of;
use crate::model::{Category, Log, Model};
use crate::resources;

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
    // SAFETY: the caller's promise.
    float::in_standard_mode(|| unsafe { create::<M>(name, kind, guid, resources, callbacks, logging) })
}

unsafe fn create<M: Model>(
    name: Text,
    kind: Integer,
    guid: Text,
    resources: Text,
    callbacks: *const Callbacks,
    logging: Boolean,
) -> Component {
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

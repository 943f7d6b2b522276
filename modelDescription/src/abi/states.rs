//! Saved states behind handles, and as bytes.
#![allow(clippy::missing_safety_doc, missing_docs, reason = "the standard documents and restricts these functions")]

use std::ptr;

use super::c::*;
use super::call;
use super::pointers::{input, output, place};
use crate::error::Error;
use crate::guid;
use crate::lifecycle as of;
use crate::model::Model;
use crate::state::State;

/// What a handle points at.
#[repr(C)]
struct Saved<M: Model> {
    /// Tells the states of this model from those of others, from freed ones and from other memory: not in every case, which no
    /// pointer could, but in those that careless importers produce.
    mark: u64,
    state: State<M>,
}

fn mark<M: Model>() -> u64 {
    let guid = guid::guid::<M>().as_bytes();
    guid.iter().fold(u64::from_le_bytes(*b"FMUSTATE"), |mark, byte| mark.rotate_left(7) ^ u64::from(*byte))
}

/// The state behind an importer's handle.
unsafe fn saved<'a, M: Model>(state: FmuState) -> Result<&'a mut Saved<M>, Error> {
    let pointer = state.cast::<Saved<M>>();
    let refused = || Error::State("the pointer is none that this FMU returned, or it was freed".to_owned());
    // SAFETY: FMI 2.0.4, section 2.1.8: a state is NULL or was returned by an FMU, so its first 8 bytes can be read.
    let is_ours =
        pointer.is_null() || (pointer.is_aligned() && unsafe { (&raw const (*pointer).mark).read() } == mark::<M>());
    if !is_ours {
        return Err(refused());
    }
    // SAFETY: the mark says that it is one of ours.
    unsafe { place("FMUstate", pointer) }
}

/// Hands a state to the importer: into the one that its handle already names, or as a new one.
unsafe fn hand_over<M: Model>(handle: &mut FmuState, state: State<M>) -> Result<(), Error> {
    if handle.is_null() {
        *handle = Box::into_raw(Box::new(Saved { mark: mark::<M>(), state })).cast();
    } else {
        // SAFETY: FMI 2.0.4, section 2.1.8: a handle that is not NULL names a state that this FMU returned and may be overwritten.
        unsafe { saved::<M>(*handle) }?.state = state;
    }
    Ok(())
}

pub unsafe fn get_fmu_state<M: Model>(component: Component, state: *mut FmuState) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::GET_FMU_STATE, |slave| {
            hand_over(place("FMUstate", state)?, slave.state.clone())?;
            Ok(Status::Ok)
        })
    }
}

pub unsafe fn set_fmu_state<M: Model>(component: Component, state: FmuState) -> Status {
    // SAFETY: the caller's promise.
    unsafe {
        call::<M>(component, &of::SET_FMU_STATE, |slave| {
            slave.restore(saved(state)?.state.clone());
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
                let saved = saved::<M>(*handle)?;
                // Volatile, because the compiler sees no reader; a second free through a copy of the handle is one.
                (&raw mut saved.mark).write_volatile(0);
                drop(Box::from_raw(saved));
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
            *place("size", size)? = saved::<M>(state)?.state.to_bytes()?.len();
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
            let saved = saved::<M>(state)?.state.to_bytes()?;
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
            hand_over(handle, State::<M>::from_bytes(input("serializedState", bytes, size)?)?)?;
            Ok(Status::Ok)
        })
    }
}

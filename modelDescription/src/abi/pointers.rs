//! Pointers and counts as slices, references and texts.

use std::ffi::CStr;
use std::slice;

use super::c::Text;
use crate::error::Error;

/// # Safety
/// `pointer` is NULL or points at `len` values that live and do not change during the call.
#[inline]
pub(super) unsafe fn input<'a, T>(name: &'static str, pointer: *const T, len: usize) -> Result<&'a [T], Error> {
    check(name, pointer, len)?;
    // SAFETY: FMI 2.0.4, section 2.1.7: arrays have the number of elements that is passed with them.
    Ok(if len == 0 { &[] } else { unsafe { slice::from_raw_parts(pointer, len) } })
}

/// # Safety
/// `pointer` is NULL or points at `len` values that nobody else uses during the call.
#[inline]
pub(super) unsafe fn output<'a, T>(name: &'static str, pointer: *mut T, len: usize) -> Result<&'a mut [T], Error> {
    check(name, pointer, len)?;
    // SAFETY: FMI 2.0.4, section 2.1.7: arrays have the number of elements that is passed with them.
    Ok(if len == 0 { &mut [] } else { unsafe { slice::from_raw_parts_mut(pointer, len) } })
}

#[inline]
fn check<T>(name: &'static str, pointer: *const T, len: usize) -> Result<(), Error> {
    if len > 0 && pointer.is_null() {
        return Err(Error::Null(name));
    }
    // A slice must not span more than half of the address space.
    if len > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(Error::Size { name, size: len });
    }
    Ok(())
}

/// # Safety
/// `pointer` is NULL or points at a value that nobody else uses during the call.
#[inline]
pub(super) unsafe fn place<'a, T>(name: &'static str, pointer: *mut T) -> Result<&'a mut T, Error> {
    // SAFETY: FMI 2.0.4, section 2.1.7: a pointer to a single result points at writable memory of its type.
    unsafe { pointer.as_mut() }.ok_or(Error::Null(name))
}

/// # Safety
/// `pointer` is NULL or points at a NUL-terminated string that lives during the call.
pub(super) unsafe fn text<'a>(name: &'static str, pointer: Text) -> Result<&'a str, Error> {
    if pointer.is_null() {
        return Err(Error::Null(name));
    }
    // SAFETY: FMI 2.0.4, section 2.1.2: fmi2String is a NUL-terminated string.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| Error::Text { name: name.to_owned(), value: text.to_string_lossy().into_owned() })
}

//! Panics stay inside: they are caught, and their message and place go to the importer's logger instead of stderr.

use std::any::Any;
use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::ptr;
use std::sync::OnceLock;

/// A panic hook as the standard library keeps it.
type Hook = Box<dyn Fn(&PanicHookInfo<'_>) + Sync + Send>;

// Without a destructor: one that is registered for a thread keeps the library loaded after dlclose until that thread ends.
thread_local! {
    static REPORT: Cell<*mut String> = const { Cell::new(ptr::null_mut()) };
}

static PREVIOUS: OnceLock<Hook> = OnceLock::new();

/// Puts our hook in front of the one that was there, once. In an FMU both belong to this library's own copy of the standard
/// library, so that the importer's are not touched.
pub(super) fn install_hook() {
    PREVIOUS.get_or_init(|| {
        let previous = panic::take_hook();
        panic::set_hook(Box::new(report));
        previous
    });
}

fn report(info: &PanicHookInfo<'_>) {
    let report = REPORT.get();
    if report.is_null() {
        // No call of ours is running on this thread: somebody else's panic.
        if let Some(previous) = PREVIOUS.get() {
            previous(info);
        }
        return;
    }
    let place = info.location().map(|place| format!(" at {}:{}", place.file(), place.line())).unwrap_or_default();
    // SAFETY: `catch` sets REPORT to a String on its own stack frame, which is alive while REPORT points at it, and which
    // nothing else touches until the body is done.
    unsafe { *report = format!("{}{place}", text(info.payload())) };
}

fn text(payload: &(dyn Any + Send)) -> &str {
    let owned = payload.downcast_ref::<String>().map(String::as_str);
    owned.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("panic without a message")
}

/// Runs the body; a panic becomes its message and place.
#[inline]
pub(super) fn catch<T>(body: impl FnOnce() -> T) -> Result<T, String> {
    let mut message = String::new();
    // A logger may call back into another instance, so the outer report is put back afterwards.
    let outer = REPORT.replace(&raw mut message);
    let result = panic::catch_unwind(AssertUnwindSafe(body));
    REPORT.set(outer);
    result.map_err(|payload| {
        drop(payload);
        message
    })
}

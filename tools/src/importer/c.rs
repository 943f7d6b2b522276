//! The C interface as an importer sees it: types, callbacks and the table of functions.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::sync::Mutex;

use anyhow::{Context, Result};
use libloading::Library;

pub(super) type Component = *mut c_void;
pub(super) type Status = c_int;

/// fmi2Warning of [FMI, 2.1.3]: everything above it is an error.
pub(super) const WARNING: Status = 1;
/// fmi2CoSimulation of fmi2Type, [FMI, 2.1.5].
pub(super) const CO_SIMULATION: c_int = 1;

/// Messages that an instance logged, each as "category: text".
pub(super) type Messages = Mutex<Vec<String>>;

/// fmi2CallbackFunctions of [FMI, 2.1.5].
#[repr(C)]
pub(super) struct Callbacks {
    // The standard declares the logger variadic. A function that reads only the fixed arguments may be called so on
    // every platform that we build for, since the caller removes the arguments.
    pub logger: unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char),
    pub allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    pub free: unsafe extern "C" fn(*mut c_void),
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    pub environment: *const Messages,
}

unsafe extern "C" {
    pub(super) fn calloc(count: usize, size: usize) -> *mut c_void;
    pub(super) fn free(pointer: *mut c_void);
}

pub(super) unsafe extern "C" fn log(
    environment: *mut c_void,
    _instance: *const c_char,
    _status: Status,
    category: *const c_char,
    message: *const c_char,
) {
    let text = |pointer: *const c_char| {
        if pointer.is_null() {
            return String::new();
        }
        // SAFETY: [FMI, 2.1.5] category and message are zero-terminated and live during the call.
        unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
    };
    // The message is a format string without arguments, in which a per cent sign is doubled.
    let line = format!("{}: {}", text(category), text(message).replace("%%", "%"));
    // SAFETY: [FMI, 2.1.5] the environment is handed back as it was given: the instance's own messages, which outlive it.
    let messages = unsafe { environment.cast::<Messages>().as_ref() };
    if let Some(mut messages) = messages.and_then(|messages| messages.lock().ok()) {
        messages.push(line);
    }
}

/// Declares the table of functions and its loader, one line a function.
macro_rules! functions {
    ($($field:ident = $symbol:literal: fn($($argument:ty),*) -> $result:ty;)*) => {
        #[derive(Clone, Copy)]
        pub(super) struct Functions { $(pub $field: unsafe extern "C" fn($($argument),*) -> $result,)* }

        impl Functions {
            pub fn load(library: &Library) -> Result<Self> {
                Ok(Self { $(
                    // SAFETY: [FMI, 2.1 and 4.2] a function of this name has this signature.
                    $field: *unsafe { library.get($symbol) }.with_context(|| {
                        format!("{} is not exported", String::from_utf8_lossy($symbol))
                    })?,
                )* })
            }
        }
    };
}

functions! {
    instantiate = b"fmi2Instantiate": fn(*const c_char, c_int, *const c_char, *const c_char, *const Callbacks, c_int, c_int) -> Component;
    free_instance = b"fmi2FreeInstance": fn(Component) -> ();
    setup_experiment = b"fmi2SetupExperiment": fn(Component, c_int, f64, f64, c_int, f64) -> Status;
    enter_initialization = b"fmi2EnterInitializationMode": fn(Component) -> Status;
    exit_initialization = b"fmi2ExitInitializationMode": fn(Component) -> Status;
    terminate = b"fmi2Terminate": fn(Component) -> Status;
    get_real = b"fmi2GetReal": fn(Component, *const u32, usize, *mut f64) -> Status;
    get_integer = b"fmi2GetInteger": fn(Component, *const u32, usize, *mut c_int) -> Status;
    get_boolean = b"fmi2GetBoolean": fn(Component, *const u32, usize, *mut c_int) -> Status;
    set_real = b"fmi2SetReal": fn(Component, *const u32, usize, *const f64) -> Status;
    set_integer = b"fmi2SetInteger": fn(Component, *const u32, usize, *const c_int) -> Status;
    set_boolean = b"fmi2SetBoolean": fn(Component, *const u32, usize, *const c_int) -> Status;
    set_string = b"fmi2SetString": fn(Component, *const u32, usize, *const *const c_char) -> Status;
    do_step = b"fmi2DoStep": fn(Component, f64, f64, c_int) -> Status;
}

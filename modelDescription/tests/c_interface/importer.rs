//! An importer: its own declarations of the C functions, as an importer's headers have them, and a logger that remembers.

use std::ffi::{CStr, CString, c_char, c_int, c_uint, c_void};
use std::ptr;

pub const OK: c_int = 0;
pub const WARNING: c_int = 1;
pub const DISCARD: c_int = 2;
pub const ERROR: c_int = 3;

pub type Component = *mut c_void;
pub type State = *mut c_void;

#[repr(C)]
pub struct Callbacks {
    pub logger: Option<unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char)>,
    pub allocate: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    pub free: Option<unsafe extern "C" fn(*mut c_void)>,
    pub finished: Option<unsafe extern "C" fn(*mut c_void, c_int)>,
    pub environment: *mut c_void,
}

// The prototypes are those of fmi2Functions.h, not those of the crate under test.
#[rustfmt::skip]
unsafe extern "C" {
    pub fn fmi2GetVersion() -> *const c_char;
    pub fn fmi2GetTypesPlatform() -> *const c_char;
    pub fn fmi2Instantiate(name: *const c_char, kind: c_int, guid: *const c_char, resources: *const c_char, callbacks: *const Callbacks, visible: c_int, logging: c_int) -> Component;
    pub fn fmi2FreeInstance(c: Component);
    pub fn fmi2SetDebugLogging(c: Component, on: c_int, n: usize, categories: *const *const c_char) -> c_int;
    pub fn fmi2SetupExperiment(c: Component, tolerance_defined: c_int, tolerance: f64, start: f64, stop_defined: c_int, stop: f64) -> c_int;
    pub fn fmi2EnterInitializationMode(c: Component) -> c_int;
    pub fn fmi2ExitInitializationMode(c: Component) -> c_int;
    pub fn fmi2Terminate(c: Component) -> c_int;
    pub fn fmi2Reset(c: Component) -> c_int;
    pub fn fmi2GetReal(c: Component, vr: *const c_uint, n: usize, value: *mut f64) -> c_int;
    pub fn fmi2GetInteger(c: Component, vr: *const c_uint, n: usize, value: *mut c_int) -> c_int;
    pub fn fmi2GetBoolean(c: Component, vr: *const c_uint, n: usize, value: *mut c_int) -> c_int;
    pub fn fmi2GetString(c: Component, vr: *const c_uint, n: usize, value: *mut *const c_char) -> c_int;
    pub fn fmi2SetReal(c: Component, vr: *const c_uint, n: usize, value: *const f64) -> c_int;
    pub fn fmi2SetInteger(c: Component, vr: *const c_uint, n: usize, value: *const c_int) -> c_int;
    pub fn fmi2SetBoolean(c: Component, vr: *const c_uint, n: usize, value: *const c_int) -> c_int;
    pub fn fmi2SetString(c: Component, vr: *const c_uint, n: usize, value: *const *const c_char) -> c_int;
    pub fn fmi2GetFMUstate(c: Component, state: *mut State) -> c_int;
    pub fn fmi2SetFMUstate(c: Component, state: State) -> c_int;
    pub fn fmi2FreeFMUstate(c: Component, state: *mut State) -> c_int;
    pub fn fmi2SerializedFMUstateSize(c: Component, state: State, size: *mut usize) -> c_int;
    pub fn fmi2SerializeFMUstate(c: Component, state: State, bytes: *mut u8, size: usize) -> c_int;
    pub fn fmi2DeSerializeFMUstate(c: Component, bytes: *const u8, size: usize, state: *mut State) -> c_int;
    pub fn fmi2GetDirectionalDerivative(c: Component, unknown: *const c_uint, nu: usize, known: *const c_uint, nk: usize, seed: *const f64, out: *mut f64) -> c_int;
    pub fn fmi2SetRealInputDerivatives(c: Component, vr: *const c_uint, n: usize, order: *const c_int, value: *const f64) -> c_int;
    pub fn fmi2GetRealOutputDerivatives(c: Component, vr: *const c_uint, n: usize, order: *const c_int, value: *mut f64) -> c_int;
    pub fn fmi2DoStep(c: Component, t: f64, h: f64, no_rollback: c_int) -> c_int;
    pub fn fmi2CancelStep(c: Component) -> c_int;
    pub fn fmi2GetStatus(c: Component, kind: c_int, value: *mut c_int) -> c_int;
    pub fn fmi2GetRealStatus(c: Component, kind: c_int, value: *mut f64) -> c_int;
    pub fn fmi2GetIntegerStatus(c: Component, kind: c_int, value: *mut c_int) -> c_int;
    pub fn fmi2GetBooleanStatus(c: Component, kind: c_int, value: *mut c_int) -> c_int;
    pub fn fmi2GetStringStatus(c: Component, kind: c_int, value: *mut *const c_char) -> c_int;
}

/// One message: status, category, text.
pub type Message = (c_int, String, String);

unsafe extern "C" fn remember(
    environment: *mut c_void,
    _: *const c_char,
    status: c_int,
    category: *const c_char,
    format: *const c_char,
) {
    let text = |pointer| unsafe { CStr::from_ptr(pointer) }.to_str().unwrap().to_owned();
    unsafe { &mut *environment.cast::<Vec<Message>>() }.push((status, text(category), text(format)));
}

/// An instance and what it logged.
pub struct Slave {
    pub component: Component,
    #[expect(clippy::box_collection, reason = "the importer's environment points at the Vec, which must not move")]
    log: Box<Vec<Message>>,
}

impl Drop for Slave {
    fn drop(&mut self) {
        unsafe { fmi2FreeInstance(self.component) };
    }
}

impl Slave {
    pub fn new(guid: &str) -> Self {
        let mut log = Box::new(Vec::new());
        let callbacks = Callbacks {
            logger: Some(remember),
            allocate: None,
            free: None,
            finished: None,
            environment: (&raw mut *log).cast(),
        };
        let guid = CString::new(guid).unwrap();
        let component =
            unsafe { fmi2Instantiate(c"one".as_ptr(), 1, guid.as_ptr(), ptr::null(), &raw const callbacks, 0, 0) };
        Self { component, log }
    }

    /// An instance at the given time, ready to step.
    pub fn started(guid: &str, start: f64) -> Self {
        let slave = Self::new(guid);
        assert!(!slave.component.is_null());
        assert_eq!(slave.setup(start, None), OK);
        assert_eq!(slave.initialize(), OK);
        slave
    }

    /// The messages since the last call.
    pub fn messages(&mut self) -> Vec<Message> {
        // SAFETY: a volatile read keeps the compiler from assuming that nobody wrote through the importer's environment.
        std::mem::take(unsafe { &mut *std::hint::black_box(&raw mut *self.log) })
    }

    /// The single error message since the last call.
    pub fn error(&mut self) -> String {
        let mut errors: Vec<_> = self.messages().into_iter().filter(|(status, ..)| *status == ERROR).collect();
        assert_eq!(errors.len(), 1, "{errors:?}");
        let (_, category, text) = errors.remove(0);
        assert_eq!(category, "logStatusError");
        text
    }

    /// Debug logging on or off for the named categories.
    pub fn choose(&self, on: c_int, names: &[&CStr]) -> c_int {
        let names: Vec<_> = names.iter().map(|name| name.as_ptr()).collect();
        unsafe { fmi2SetDebugLogging(self.component, on, names.len(), names.as_ptr()) }
    }

    pub fn setup(&self, start: f64, stop: Option<f64>) -> c_int {
        unsafe { fmi2SetupExperiment(self.component, 0, 0.0, start, c_int::from(stop.is_some()), stop.unwrap_or(0.0)) }
    }

    pub fn initialize(&self) -> c_int {
        unsafe {
            assert_eq!(fmi2EnterInitializationMode(self.component), OK);
            fmi2ExitInitializationMode(self.component)
        }
    }

    pub fn step(&self, t: f64, h: f64) -> c_int {
        unsafe { fmi2DoStep(self.component, t, h, 0) }
    }

    pub fn set(&self, vr: c_uint, value: f64) -> c_int {
        unsafe { fmi2SetReal(self.component, &raw const vr, 1, &raw const value) }
    }

    pub fn set_integer(&self, vr: c_uint, value: c_int) -> c_int {
        unsafe { fmi2SetInteger(self.component, &raw const vr, 1, &raw const value) }
    }

    pub fn set_string(&self, vr: c_uint, value: &CStr) -> c_int {
        let value = value.as_ptr();
        unsafe { fmi2SetString(self.component, &raw const vr, 1, &raw const value) }
    }

    pub fn set_string_null(&self, vr: c_uint) -> c_int {
        let value = ptr::null();
        unsafe { fmi2SetString(self.component, &raw const vr, 1, &raw const value) }
    }

    pub fn get(&self, vr: c_uint) -> Result<f64, c_int> {
        let mut value = f64::NAN;
        match unsafe { fmi2GetReal(self.component, &raw const vr, 1, &raw mut value) } {
            OK => Ok(value),
            status => Err(status),
        }
    }

    pub fn get_integer(&self, vr: c_uint) -> Result<c_int, c_int> {
        let mut value = c_int::MIN;
        match unsafe { fmi2GetInteger(self.component, &raw const vr, 1, &raw mut value) } {
            OK => Ok(value),
            status => Err(status),
        }
    }

    pub fn get_string(&self, vr: c_uint) -> Result<String, c_int> {
        let mut value = ptr::null();
        match unsafe { fmi2GetString(self.component, &raw const vr, 1, &raw mut value) } {
            OK => Ok(unsafe { CStr::from_ptr(value) }.to_str().unwrap().to_owned()),
            status => Err(status),
        }
    }

    pub fn serialized(&self) -> Vec<u8> {
        let (mut state, mut size) = (ptr::null_mut(), 0);
        unsafe {
            assert_eq!(fmi2GetFMUstate(self.component, &raw mut state), OK);
            assert_eq!(fmi2SerializedFMUstateSize(self.component, state, &raw mut size), OK);
            let mut bytes = vec![0; size];
            assert_eq!(fmi2SerializeFMUstate(self.component, state, bytes.as_mut_ptr(), size), OK);
            assert_eq!(fmi2FreeFMUstate(self.component, &raw mut state), OK);
            assert!(state.is_null());
            bytes
        }
    }

    pub fn restore(&self, bytes: &[u8]) -> c_int {
        let mut state = ptr::null_mut();
        unsafe {
            let status = fmi2DeSerializeFMUstate(self.component, bytes.as_ptr(), bytes.len(), &raw mut state);
            if status != OK {
                assert!(state.is_null());
                return status;
            }
            assert_eq!(fmi2SetFMUstate(self.component, state), OK);
            fmi2FreeFMUstate(self.component, &raw mut state)
        }
    }

    /// Steps with the fixed parameter that makes the model panic; it arrives in the state of another instance.
    pub fn step_that_panics(&self, t: f64, stepping: bool) -> c_int {
        // Where no step is legal the instance must stay as it is.
        if !stepping {
            return self.step(t, 0.25);
        }
        let donor = Self::new(&crate::guid());
        assert_eq!(donor.setup(t, None), OK);
        assert_eq!(donor.set_integer(crate::vr("trouble"), 3), OK);
        assert_eq!(donor.initialize(), OK);
        assert_eq!(self.restore(&donor.serialized()), OK);
        self.step(t, 0.25)
    }
}

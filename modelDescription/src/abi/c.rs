//! The C types of FMI 2.0 (fmi2TypesPlatform.h "default", fmi2FunctionTypes.h).

use std::ffi::{c_char, c_int, c_uint, c_void};

/// fmi2Component.
pub type Component = *mut c_void;
/// fmi2ComponentEnvironment.
pub type Environment = *mut c_void;
/// fmi2FMUstate.
pub type FmuState = *mut c_void;
/// fmi2ValueReference.
pub type ValueReference = c_uint;
/// fmi2Boolean.
pub type Boolean = c_int;
/// fmi2Integer, and the C enumerations that travel towards us: a Rust enum must not hold a value that it does not know.
pub type Integer = c_int;
/// fmi2String.
pub type Text = *const c_char;

/// fmi2Status, as far as this library returns it: fmi2Fatal condemns every instance, fmi2Pending needs asynchronous steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub enum Status {
    /// fmi2OK.
    Ok = 0,
    /// fmi2Warning.
    Warning = 1,
    /// fmi2Discard.
    Discard = 2,
    /// fmi2Error.
    Error = 3,
}

/// fmi2True.
pub const TRUE: Boolean = 1;
/// fmi2False.
pub const FALSE: Boolean = 0;
/// fmi2CoSimulation of fmi2Type.
pub const CO_SIMULATION: Integer = 1;
/// fmi2DoStepStatus of fmi2StatusKind.
pub const DO_STEP_STATUS: Integer = 0;
/// fmi2PendingStatus of fmi2StatusKind.
pub const PENDING_STATUS: Integer = 1;
/// fmi2LastSuccessfulTime of fmi2StatusKind.
pub const LAST_SUCCESSFUL_TIME: Integer = 2;
/// fmi2Terminated of fmi2StatusKind.
pub const TERMINATED: Integer = 3;

/// fmi2CallbackLogger, which is variadic.
pub type LoggerFunction = unsafe extern "C" fn(Environment, Text, Status, Text, Text, ...);

/// fmi2CallbackFunctions. Only the first and the last member that matter here are used: memory comes from Rust's own allocator.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Callbacks {
    /// logger.
    pub logger: Option<LoggerFunction>,
    /// allocateMemory.
    pub allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// freeMemory.
    pub free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    /// stepFinished.
    pub step_finished: Option<unsafe extern "C" fn(Environment, Status)>,
    /// componentEnvironment.
    pub environment: Environment,
}

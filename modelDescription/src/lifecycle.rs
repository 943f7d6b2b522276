//! The life cycle of a co-simulation slave as a table: which function may be called in which phase (FMI 2.0.4, section 4.2.4).
//!
//! A step is done when fmi2DoStep returns, so the phases "step in progress", "step failed" and "step canceled" do not occur and
//! fmi2CancelStep is never legal.

use serde::{Deserialize, Serialize};

/// Where an instance is in its life; each phase is one bit of a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Phase {
    /// Created or reset.
    Instantiated = INSTANTIATED,
    /// Between fmi2EnterInitializationMode and fmi2ExitInitializationMode.
    InitializationMode = INITIALIZATION,
    /// Initialised, or a step is complete.
    StepComplete = STEP_COMPLETE,
    /// After fmi2Terminate.
    Terminated = TERMINATED,
    /// After an error that makes the results useless.
    Error = ERROR,
}

const INSTANTIATED: u8 = 1;
const INITIALIZATION: u8 = 2;
const STEP_COMPLETE: u8 = 4;
const TERMINATED: u8 = 8;
const ERROR: u8 = 16;
const ANY: u8 = INSTANTIATED | INITIALIZATION | STEP_COMPLETE | TERMINATED | ERROR;
const READABLE: u8 = INITIALIZATION | STEP_COMPLETE | TERMINATED | ERROR;
const WRITABLE: u8 = INSTANTIATED | INITIALIZATION | STEP_COMPLETE;
const AFTER_STEP: u8 = STEP_COMPLETE | TERMINATED | ERROR;
const ASKABLE: u8 = STEP_COMPLETE | TERMINATED;
const NEVER: u8 = 0;

/// A function of the interface and the phases in which it may be called.
#[derive(Clone, Copy, Debug)]
pub struct Function {
    /// Its name in the standard.
    pub name: &'static str,
    allowed: u8,
}

impl Function {
    /// Whether it may be called in this phase.
    #[inline]
    #[must_use]
    pub const fn is_allowed_in(&self, phase: Phase) -> bool {
        self.allowed & phase as u8 != 0
    }
}

macro_rules! functions {
    ($($constant:ident $name:literal $allowed:expr;)*) => {
        $(pub(crate) const $constant: Function = Function { name: $name, allowed: $allowed };)*

        /// Every function that takes an instance, for tests of call sequences.
        pub const FUNCTIONS: &[Function] = &[$($constant),*];
    };
}

functions! {
    SET_DEBUG_LOGGING           "fmi2SetDebugLogging"           ANY;
    FREE_INSTANCE               "fmi2FreeInstance"              ANY;
    SETUP_EXPERIMENT            "fmi2SetupExperiment"           INSTANTIATED;
    ENTER_INITIALIZATION_MODE   "fmi2EnterInitializationMode"   INSTANTIATED;
    EXIT_INITIALIZATION_MODE    "fmi2ExitInitializationMode"    INITIALIZATION;
    TERMINATE                   "fmi2Terminate"                 STEP_COMPLETE;
    RESET                       "fmi2Reset"                     ANY;
    GET_REAL                    "fmi2GetReal"                   READABLE;
    GET_INTEGER                 "fmi2GetInteger"                READABLE;
    GET_BOOLEAN                 "fmi2GetBoolean"                READABLE;
    GET_STRING                  "fmi2GetString"                 READABLE;
    SET_REAL                    "fmi2SetReal"                   WRITABLE;
    SET_INTEGER                 "fmi2SetInteger"                WRITABLE;
    SET_BOOLEAN                 "fmi2SetBoolean"                WRITABLE;
    SET_STRING                  "fmi2SetString"                 WRITABLE;
    GET_FMU_STATE               "fmi2GetFMUstate"               ANY;
    SET_FMU_STATE               "fmi2SetFMUstate"               ANY;
    FREE_FMU_STATE              "fmi2FreeFMUstate"              ANY;
    SERIALIZED_FMU_STATE_SIZE   "fmi2SerializedFMUstateSize"    ANY;
    SERIALIZE_FMU_STATE         "fmi2SerializeFMUstate"         ANY;
    DESERIALIZE_FMU_STATE       "fmi2DeSerializeFMUstate"       ANY;
    GET_DIRECTIONAL_DERIVATIVE  "fmi2GetDirectionalDerivative"  READABLE;
    SET_REAL_INPUT_DERIVATIVES  "fmi2SetRealInputDerivatives"   WRITABLE;
    GET_REAL_OUTPUT_DERIVATIVES "fmi2GetRealOutputDerivatives"  AFTER_STEP;
    DO_STEP                     "fmi2DoStep"                    STEP_COMPLETE;
    CANCEL_STEP                 "fmi2CancelStep"                NEVER;
    GET_STATUS                  "fmi2GetStatus"                 ASKABLE;
    GET_REAL_STATUS             "fmi2GetRealStatus"             ASKABLE;
    GET_INTEGER_STATUS          "fmi2GetIntegerStatus"          ASKABLE;
    GET_BOOLEAN_STATUS          "fmi2GetBooleanStatus"          ASKABLE;
    GET_STRING_STATUS           "fmi2GetStringStatus"           ASKABLE;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_function_that_takes_an_instance_has_a_row() {
        // 34 functions of a slave, less fmi2GetVersion, fmi2GetTypesPlatform and fmi2Instantiate.
        assert_eq!(FUNCTIONS.len(), 31);
    }

    #[test]
    fn an_instance_in_error_can_only_be_read_restored_reset_or_freed() {
        let refused: Vec<_> = FUNCTIONS.iter().filter(|f| !f.is_allowed_in(Phase::Error)).map(|f| f.name).collect();
        for name in ["fmi2DoStep", "fmi2SetReal", "fmi2SetupExperiment", "fmi2Terminate", "fmi2EnterInitializationMode"]
        {
            assert!(refused.contains(&name), "{name} must be refused after an error");
        }
        for name in ["fmi2Reset", "fmi2GetReal", "fmi2SetFMUstate", "fmi2FreeInstance"] {
            assert!(!refused.contains(&name), "{name} must work after an error");
        }
    }
}

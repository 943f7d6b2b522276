//! Mistakes of the caller.

use thiserror::Error as ThisError;

/// Why a controller could not be built or stepped.
#[derive(Clone, Debug, PartialEq, ThisError)]
pub enum Error {
    /// A parameter lies outside its range.
    #[error("parameter {name} must be {expected}, got {value}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// The range in words.
        expected: &'static str,
        /// The offending value.
        value: f64,
    },
    /// A communication step that no controller can take.
    #[error("communication step must be positive and finite, got {0} s")]
    Step(f64),
}

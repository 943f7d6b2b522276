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
    /// Adaptation by a network without one.
    #[error("adaptation by a network needs a network file")]
    NoNetwork,
    /// The output cannot be differentiated now.
    #[error("no derivative: {0}")]
    NoDerivative(&'static str),
    /// A communication step that no controller can take.
    #[error("communication step must be positive and finite, got {0} s")]
    Step(f64),
    /// A time at which no communication step begins.
    #[error("time must be finite, got {0} s")]
    Time(f64),
    /// A network file that is not the JSON that it should be.
    #[error("network file is not readable: {0}")]
    NetworkUnreadable(String),
    /// A JSON file of some other kind.
    #[error("network file has the format {got:?}, expected {expected:?}")]
    NetworkFormat {
        /// The format that is read.
        expected: &'static str,
        /// What the file says; empty if it says nothing.
        got: String,
    },
    /// A network file of another version.
    #[error("network file has version {got}, expected {expected}")]
    NetworkVersion {
        /// The version that is read.
        expected: u32,
        /// What the file says; 0 if it says nothing.
        got: u32,
    },
    /// A network file that was changed after it was written.
    #[error("network file is damaged: its content has the checksum {got}, it names {expected}")]
    NetworkChecksum {
        /// The checksum in the file.
        expected: String,
        /// The checksum of what the file holds.
        got: String,
    },
    /// A network whose sizes or numbers are impossible.
    #[error("network is impossible: {0}")]
    NetworkInvalid(String),
}

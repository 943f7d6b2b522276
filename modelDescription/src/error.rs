//! Everything that a call can be refused for.

use crate::lifecycle::Phase;

/// Why a call failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A required pointer is NULL.
    #[error("argument {0} is NULL")]
    Null(&'static str),
    /// A count cannot be right.
    #[error("argument {name} has impossible size {size}")]
    Size {
        /// Name of the argument.
        name: &'static str,
        /// What was given.
        size: usize,
    },
    /// The function may not be called now.
    #[error("illegal call sequence: not allowed in phase {0:?}")]
    CallSequence(Phase),
    /// No variable has this value reference.
    #[error("unknown value reference {0}")]
    UnknownReference(u32),
    /// The variable has another type.
    #[error("variable {name} has type {actual}, not {wanted}")]
    Type {
        /// The variable.
        name: String,
        /// Its type.
        actual: &'static str,
        /// The type of the called function.
        wanted: &'static str,
    },
    /// The variable cannot be set, now or ever.
    #[error("variable {name} cannot be set: {reason}")]
    Frozen {
        /// The variable.
        name: String,
        /// Why not.
        reason: &'static str,
    },
    /// The value is not permitted.
    #[error("value {value} of variable {name} is outside of its range {range}")]
    Range {
        /// The variable.
        name: String,
        /// What was given.
        value: String,
        /// What is permitted.
        range: String,
    },
    /// Bytes that are no UTF-8 text.
    #[error("value {value:?} of argument {name} is not UTF-8")]
    Text {
        /// Name of the argument.
        name: String,
        /// What was given, damaged places replaced.
        value: String,
    },
    /// An output cannot be computed yet.
    #[error("variable {name} is not available: {reason}")]
    Unavailable {
        /// The variable.
        name: String,
        /// What failed.
        reason: String,
    },
    /// Start or stop time are unusable.
    #[error("experiment from {start} s to {stop} s is impossible")]
    Experiment {
        /// Start [s].
        start: f64,
        /// Stop [s].
        stop: f64,
    },
    /// The communication step size is unusable.
    #[error("communication step size {h} s is refused: {reason}")]
    StepSize {
        /// What was given [s].
        h: f64,
        /// Why not.
        reason: &'static str,
    },
    /// The step does not begin where the last one ended.
    #[error("communication point {given} s is not the end of the last step, {expected} s")]
    CommunicationPoint {
        /// What was given [s].
        given: f64,
        /// What continues the simulation [s].
        expected: f64,
    },
    /// The step passes the end of the experiment.
    #[error("step to {end} s passes the stop time {stop} s")]
    StopTime {
        /// End of the step [s].
        end: f64,
        /// End of the experiment [s].
        stop: f64,
    },
    /// A derivative that the model does not offer.
    #[error("derivative of order {order} of variable {name} is not available")]
    Derivative {
        /// The variable.
        name: String,
        /// What was asked for.
        order: i32,
    },
    /// A directional derivative that the model does not offer.
    #[error("directional derivative is not available: {0}")]
    Directional(String),
    /// Something that is not a saved state of this FMU.
    #[error("saved state is refused: {0}")]
    State(String),
    /// A status kind that does not exist.
    #[error("unknown status kind {0}")]
    StatusKind(i32),
    /// A log category that does not exist.
    #[error("unknown log category {0:?}")]
    Category(String),
    /// Wrong fmuType.
    #[error("type {0} is refused: this FMU offers co-simulation (1) only")]
    FmuType(i32),
    /// Missing instance name.
    #[error("instance name is empty")]
    Name,
    /// A GUID other than that of the XML.
    #[error("GUID {given:?} does not match {expected}")]
    Guid {
        /// What was given.
        given: String,
        /// What the XML says.
        expected: String,
    },
    /// The model gave up.
    #[error("{0}")]
    Model(String),
    /// A defect in the model.
    #[error("internal error: {0}")]
    Panic(String),
    /// The table contradicts itself.
    #[error("variable {name}: {reason}")]
    Table {
        /// The variable.
        name: String,
        /// What is wrong.
        reason: String,
    },
    /// XML could not be written.
    #[error("cannot write XML: {0}")]
    Xml(#[from] std::io::Error),
}

impl Error {
    /// Whether the instance is useless afterwards; a refused call leaves everything as it was.
    #[must_use]
    pub fn is_fatal_to_instance(&self) -> bool {
        matches!(self, Error::Model(_) | Error::Panic(_))
    }
}

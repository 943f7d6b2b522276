//! What can go wrong: a caller's mistake or a bad file.

/// A caller's mistake: a value out of its range, an unknown name or a malformed table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A parameter lies outside its declared range or is not a number.
    #[error("parameter {name} = {value} lies outside its range {min} to {max}")]
    Parameter {
        /// The parameter's name.
        name: &'static str,
        /// The value that was refused.
        value: f64,
        /// The smallest value allowed.
        min: f64,
        /// The largest value allowed.
        max: f64,
    },
    /// A yaw inertia that no vehicle of this mass and size has.
    #[error(
        "parameter i_z = {value} lies outside its range {} to {}, a tenth to ten times m l_f l_r = {}",
        short(0.1 * .inertia), short(10.0 * .inertia), short(*.inertia)
    )]
    Inertia {
        /// The value that was refused [kg m2].
        value: f64,
        /// Mass times both distances from the centre of gravity to the axles [kg m2].
        inertia: f64,
    },
    /// An input is not a number or lies outside its declared range.
    #[error("input {name} = {value} lies outside its range {min} to {max}")]
    Input {
        /// The input's name.
        name: &'static str,
        /// The value that was refused.
        value: f64,
        /// The smallest value allowed.
        min: f64,
        /// The largest value allowed.
        max: f64,
    },
    /// A communication step that no integration can take.
    #[error("step {0} s must be positive and at most {max} s", max = crate::plant::STEP_MAX)]
    Step(f64),
    /// No manoeuvre of this name.
    #[error("unknown road \"{name}\": known are {known}")]
    UnknownRoad {
        /// The name that was asked for.
        name: String,
        /// All names, separated by commas.
        known: String,
    },
    /// No tyre of this name.
    #[error("unknown tyre \"{name}\": known are {known}")]
    UnknownTyre {
        /// The name that was asked for.
        name: String,
        /// All names, separated by commas.
        known: String,
    },
    /// A road table that cannot be read.
    #[error("road table, line {line}, column {column}: {reason}")]
    Csv {
        /// Line, counted from 1.
        line: usize,
        /// Column (field) in the line, counted from 1.
        column: usize,
        /// What is wrong there.
        reason: String,
    },
    /// A road table that holds no road.
    #[error("road table: {0}")]
    Table(String),
    /// The motion left what numbers can hold.
    #[error("state {name} = {value} is not finite at {time} s")]
    Diverged {
        /// The state's name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Time since the start [s].
        time: f64,
    },
}

/// A number to four digits: those of a bound that has been computed say nothing beyond them.
fn short(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

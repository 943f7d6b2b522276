//! What a model implements to become a co-simulation slave.

use std::fmt::Display;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::table::Table;

/// A model that the C interface can drive.
///
/// `Default` gives the start values of all inputs and parameters. The serde form is the saved state, so it must hold everything that
/// the next step depends on: warm starts, delays, random generators, file contents read at initialisation.
pub trait Model: Default + Clone + Serialize + DeserializeOwned + Send + 'static {
    /// What the XML says about the model as a whole.
    const INFO: Info;

    /// The model's own error; its text reaches the importer's logger.
    type Error: Display;

    /// The variables, as `variables!` declares them.
    fn table() -> &'static Table<Self>;

    /// Validates the parameters, reads files and computes the first outputs.
    ///
    /// Called when initialisation mode ends, and on a copy when an output is read earlier.
    ///
    /// # Errors
    /// If a parameter or a file is unusable.
    fn initialize(&mut self, experiment: &Experiment<'_>, log: &mut dyn Log) -> Result<(), Self::Error>;

    /// Takes over tunable parameters that changed since the last step.
    ///
    /// # Errors
    /// If the parameters contradict each other.
    fn tune(&mut self, _log: &mut dyn Log) -> Result<(), Self::Error> {
        Ok(())
    }

    /// Advances from `step.t` to `step.t + step.h`.
    ///
    /// # Errors
    /// If the model cannot go on; the instance then refuses further steps.
    fn step(&mut self, step: &Step<'_>, log: &mut dyn Log) -> Result<Outcome, Self::Error>;

    /// Recomputes what is derived from state and inputs (previews, diagnostics); must be a pure function of them.
    ///
    /// Called before a lazy row is read, when a step or a changed value came before.
    fn refresh(&mut self) {}

    /// Time derivative of an output, or None if the model has none of that order.
    fn output_derivative(&self, _reference: u32, _order: u32) -> Option<f64> {
        None
    }

    /// Writes the derivative of each unknown along `seed` (one entry for each known) to `sensitivity`.
    ///
    /// All are value references of Real variables that exist; the unknowns are calculated.
    ///
    /// # Errors
    /// If a derivative does not exist.
    fn directional_derivative(
        &self,
        _unknowns: &[u32],
        _knowns: &[u32],
        _seed: &[f64],
        _sensitivity: &mut [f64],
    ) -> Result<(), Self::Error> {
        unreachable!("only called if INFO.directional_derivative promises it")
    }
}

/// What the XML says about the model as a whole.
#[derive(Clone, Copy, Debug)]
pub struct Info {
    /// Name that people see.
    pub name: &'static str,
    /// Name of the library file without its extension.
    pub identifier: &'static str,
    /// One sentence.
    pub description: &'static str,
    /// Version of the model.
    pub version: &'static str,
    /// Suggested communication step size [s].
    pub step_size: f64,
    /// Suggested end of a simulation that begins at 0 [s].
    pub stop_time: f64,
    /// Longest communication step that is accepted [s]; protects against steps that would never return.
    pub max_step: f64,
    /// Highest order of input derivatives that `step` uses; 0: none.
    pub max_input_derivative_order: u32,
    /// Highest order of output derivatives; 0: none.
    pub max_output_derivative_order: u32,
    /// Whether `directional_derivative` works.
    pub directional_derivative: bool,
}

impl Info {
    /// A model without capabilities beyond the mandatory ones, for struct update: `Info { name: "Lag", ..Info::PLAIN }`.
    pub const PLAIN: Self = Self {
        name: "",
        identifier: "",
        description: "",
        version: "",
        step_size: 0.01,
        stop_time: 1.0,
        max_step: 10.0,
        max_input_derivative_order: 0,
        max_output_derivative_order: 0,
        directional_derivative: false,
    };
}

/// What is known when initialisation mode ends.
#[derive(Clone, Copy, Debug)]
pub struct Experiment<'a> {
    /// Start of the simulation [s].
    pub start: f64,
    /// End of the simulation, if the importer fixed one [s].
    pub stop: Option<f64>,
    /// The unpacked resources folder, if the importer named one that exists.
    pub resources: Option<&'a Path>,
}

/// One communication step.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Its start [s].
    pub t: f64,
    /// Its length [s], positive and at most `Info::max_step`.
    pub h: f64,
    /// Derivatives of inputs at `t`, for extrapolation inside this step; usually empty.
    pub input_derivatives: &'a [InputDerivative],
}

/// A derivative of an input, valid in the next step only.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct InputDerivative {
    /// Value reference of the input.
    pub reference: u32,
    /// Order, from 1.
    pub order: u32,
    /// Value in the input's unit per second to the power of the order.
    pub value: f64,
}

/// How a step ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// As intended.
    Ok,
    /// With a fallback, which the text explains; the importer sees a warning.
    Degraded(String),
}

/// What a message is about; importers filter by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Category {
    /// Something worth knowing when debugging.
    Event,
    /// Something that the user should look at.
    Warning,
    /// A call that failed.
    Error,
}

impl Category {
    /// All of them.
    pub const ALL: [Category; 3] = [Category::Event, Category::Warning, Category::Error];

    /// The category that stands for all of them.
    pub const EVERYTHING: &'static str = "logAll";

    /// What the XML says about it.
    #[must_use]
    pub const fn description(self) -> &'static str {
        match self {
            Category::Event => "What happens and when",
            Category::Warning => "Fallbacks and defaults that the user should know of",
            Category::Error => "Calls that failed",
        }
    }

    /// Name in the XML and in the importer's logger, as the standard prescribes it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Category::Event => "logEvents",
            Category::Warning => "logStatusWarning",
            Category::Error => "logStatusError",
        }
    }
}

/// Where a model sends messages.
pub trait Log {
    /// Whether a message of this category would reach anybody: spares formatting it.
    fn enabled(&self, _category: Category) -> bool {
        true
    }

    /// Sends a message.
    fn log(&mut self, category: Category, message: &str);
}

/// Drops every message.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Log for Silent {
    fn enabled(&self, _category: Category) -> bool {
        false
    }

    fn log(&mut self, _category: Category, _message: &str) {}
}

/// Keeps every message.
impl Log for Vec<(Category, String)> {
    fn log(&mut self, category: Category, message: &str) {
        self.push((category, message.to_owned()));
    }
}

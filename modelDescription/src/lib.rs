//! The FMI 2.0 co-simulation contract that the FMUs of this project share: a table of variables, the XML that follows from it, the
//! life cycle, saved states, and the C interface. A model implements [`Model`], and its cdylib says [`export_fmu!`].
//!
//! ```
//! use model_description::{Experiment, Info, Log, Model, Outcome, Step, Table, variables};
//! use serde::{Deserialize, Serialize};
//!
//! /// First-order lag: y' = (u - y) / tau.
//! #[derive(Clone, Serialize, Deserialize)]
//! struct Lag {
//!     u: f64,
//!     y: f64,
//!     y_max: f64,
//!     tau: f64,
//! }
//!
//! impl Default for Lag {
//!     fn default() -> Self {
//!         Self { u: 0.0, y: 0.0, y_max: 0.0, tau: 0.5 }
//!     }
//! }
//!
//! impl Model for Lag {
//!     const INFO: Info = Info {
//!         name: "Lag",
//!         identifier: "lag",
//!         description: "First-order lag",
//!         version: env!("CARGO_PKG_VERSION"),
//!         step_size: 0.01,
//!         stop_time: 5.0,
//!         ..Info::PLAIN
//!     };
//!     type Error = String;
//!
//!     fn table() -> &'static Table<Self> {
//!         variables! { Lag;
//!             Input     u     ["m/s"] "What y follows", min -100.0, max 100.0 => u;
//!             Output    y     ["m/s"] "Follows u", depends &[], lazy false => y;
//!             Output    y_max ["m/s"] "Largest |y| so far", depends &[], lazy false => y_max;
//!             Parameter tau   ["s"]   "Time constant", min 1e-3 => tau;
//!         }
//!     }
//!
//!     fn initialize(&mut self, _: &Experiment<'_>, _: &mut dyn Log) -> Result<(), String> {
//!         Ok(())
//!     }
//!
//!     fn step(&mut self, step: &Step<'_>, _: &mut dyn Log) -> Result<Outcome, String> {
//!         self.y = self.u + (self.y - self.u) * (-step.h / self.tau).exp();
//!         self.y_max = self.y_max.max(self.y.abs());
//!         Ok(Outcome::Ok)
//!     }
//! }
//!
//! model_description::export_fmu!(Lag);
//!
//! # fn main() {
//! let xml = model_description::model_description::<Lag>().unwrap();
//! assert!(xml.contains(r#"<ScalarVariable name="tau" valueReference="3""#));
//! # }
//! ```
//!
//! A unit test of the crate keeps the committed XML current: `assert_xml_current::<Lag>("../modelDescription/lag.xml")`.
//!
//! # What a status means
//!
//! - fmi2OK, fmi2Warning: done; a warning comes with a message that says what was fallen back to.
//! - fmi2Error with the instance as it was: the call was refused (wrong argument, value out of range, NaN, illegal sequence). A correct
//!   call may follow.
//! - fmi2Error with the instance in the error phase: the model gave up, or a defect panicked. It can still be read, reset, freed, or
//!   set back to a saved state.
//!
//! Input derivatives are valid in the next step only: set them before each step that shall use them.
#![deny(unsafe_code)]

#[allow(unsafe_code, reason = "the C interface is made of pointers")]
pub mod abi;
mod clock;
mod consistency;
mod current;
mod derivatives;
mod error;
mod guid;
mod instance;
mod lifecycle;
mod model;
mod place;
mod range;
mod reals;
mod resources;
mod state;
#[doc(hidden)]
pub mod table;
mod terminals;
mod unit;
mod value;
mod variables;
mod xml;

pub use current::assert_xml_current;
pub use error::Error;
pub use lifecycle::{FUNCTIONS, Function, Phase};
pub use model::{Category, Experiment, Info, InputDerivative, Log, Model, Outcome, Silent, Step};
pub use resources::{FileError, read_file};
pub use table::{Enumeration, Item, Place, Role, Row, Table};
pub use terminals::terminals;
pub use value::{FromScalar, Kind, Scalar, Value};
pub use xml::model_description;

//! One running instance: the calls of its life, with every status looked at.

use std::ffi::{CString, c_int};

use anyhow::{Context, Result, bail, ensure};

use super::Fmu;
use super::c::{Callbacks, Component, Messages, Status, WARNING};
use crate::interface::{Interface, Kind, Variable};

/// One running instance; freed when it is dropped.
pub struct Instance<'a> {
    pub(super) fmu: &'a Fmu,
    pub(super) component: Component,
    pub(super) messages: Box<Messages>,
    pub(super) _callbacks: Box<Callbacks>,
}

impl Drop for Instance<'_> {
    fn drop(&mut self) {
        if !self.component.is_null() {
            // SAFETY: [FMI, 2.1.5] the component came from fmi2Instantiate and nobody uses it after this.
            unsafe { (self.fmu.functions.free_instance)(self.component) };
        }
    }
}

impl Instance<'_> {
    /// What the FMU offers.
    pub fn interface(&self) -> &Interface {
        &self.fmu.interface
    }

    /// Everything logged so far, in one line.
    pub fn log(&self) -> String {
        self.messages.lock().map(|messages| messages.join("; ")).unwrap_or_default()
    }

    fn check(&self, call: &str, status: Status) -> Result<()> {
        ensure!(status <= WARNING, "{} of {} failed: {}", call, self.fmu.interface.model_name, self.log());
        Ok(())
    }

    /// Initialises for a run that starts at 0 and has no set end.
    pub fn initialize(&mut self) -> Result<()> {
        let functions = &self.fmu.functions;
        // SAFETY: [FMI, 4.2.4] the component is alive and in the state Instantiated.
        let status = unsafe { (functions.setup_experiment)(self.component, 0, 0.0, 0.0, 0, 0.0) };
        self.check("setupExperiment", status)?;
        // SAFETY: [FMI, 4.2.4] as above; the experiment is set up.
        let status = unsafe { (functions.enter_initialization)(self.component) };
        self.check("enterInitializationMode", status)?;
        // SAFETY: [FMI, 4.2.4] the component is in the initialization mode.
        let status = unsafe { (functions.exit_initialization)(self.component) };
        self.check("exitInitializationMode", status)
    }

    /// Advances from `time` by `step` [s].
    pub fn do_step(&mut self, time: f64, step: f64) -> Result<()> {
        // SAFETY: [FMI, 4.2.2] the component is alive; a call in a wrong state is answered by an error status.
        let status = unsafe { (self.fmu.functions.do_step)(self.component, time, step, 1) };
        self.check("doStep", status)
    }

    /// Ends the run.
    pub fn terminate(&mut self) -> Result<()> {
        // SAFETY: [FMI, 2.1.6] the component is alive; a call in a wrong state is answered by an error status.
        let status = unsafe { (self.fmu.functions.terminate)(self.component) };
        self.check("terminate", status)
    }

    /// Reads real variables.
    pub fn get_real(&self, references: &[u32], values: &mut [f64]) -> Result<()> {
        assert_eq!(references.len(), values.len(), "a value for each reference");
        let count = references.len();
        // SAFETY: [FMI, 2.1.7] both arrays have `count` elements.
        let status =
            unsafe { (self.fmu.functions.get_real)(self.component, references.as_ptr(), count, values.as_mut_ptr()) };
        self.check("getReal", status)
    }

    /// Writes real variables.
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<()> {
        assert_eq!(references.len(), values.len(), "a value for each reference");
        let count = references.len();
        // SAFETY: [FMI, 2.1.7] both arrays have `count` elements.
        let status =
            unsafe { (self.fmu.functions.set_real)(self.component, references.as_ptr(), count, values.as_ptr()) };
        self.check("setReal", status)
    }

    /// Reads a number of any type by its variable.
    pub fn number(&self, variable: &Variable) -> Result<f64> {
        if variable.kind == Kind::Real {
            let mut value = [0.0];
            self.get_real(&[variable.reference], &mut value)?;
            return Ok(value[0]);
        }
        let get = match variable.kind {
            Kind::Integer | Kind::Enumeration => self.fmu.functions.get_integer,
            Kind::Boolean => self.fmu.functions.get_boolean,
            Kind::Real | Kind::String => bail!("{} is not a number", variable.name),
        };
        let mut value = 0;
        // SAFETY: [FMI, 2.1.7] one reference, one value; integers and Booleans have the same C type.
        let status = unsafe { get(self.component, &raw const variable.reference, 1, &raw mut value) };
        self.check(&format!("getting {}", variable.name), status)?;
        Ok(f64::from(value))
    }

    /// Sets a variable from its text, as typed by a person.
    pub fn set(&mut self, name: &str, text: &str) -> Result<()> {
        let functions = self.fmu.functions;
        let variable = self.fmu.interface.variable(name)?;
        let reference = &raw const variable.reference;
        let number = || format!("{name} takes a {}, got {text}", variable.kind.name());
        let status = match variable.kind {
            Kind::Real => {
                let value: f64 = text.parse().with_context(number)?;
                // SAFETY: [FMI, 2.1.7] one reference, one value.
                unsafe { (functions.set_real)(self.component, reference, 1, &raw const value) }
            }
            Kind::Integer | Kind::Enumeration => {
                let value: c_int = text.parse().with_context(number)?;
                // SAFETY: [FMI, 2.1.7] one reference, one value.
                unsafe { (functions.set_integer)(self.component, reference, 1, &raw const value) }
            }
            Kind::Boolean => {
                let value = c_int::from(text.parse::<bool>().with_context(number)?);
                // SAFETY: [FMI, 2.1.7] one reference, one value.
                unsafe { (functions.set_boolean)(self.component, reference, 1, &raw const value) }
            }
            Kind::String => {
                let value = CString::new(text)?;
                let pointer = value.as_ptr();
                // SAFETY: [FMI, 2.1.7] one reference, one zero-terminated text, which the FMU copies.
                unsafe { (functions.set_string)(self.component, reference, 1, &raw const pointer) }
            }
        };
        self.check(&format!("setting {name}"), status)
    }
}

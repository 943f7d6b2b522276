//! One slave: its state, and the functions of the standard on Rust types. The C interface adds pointers, nothing else.

use std::ffi::CString;
use std::path::PathBuf;

use crate::clock::Clock;
use crate::error::Error;
use crate::lifecycle::Phase;
use crate::model::{Category, Experiment, Log, Model, Outcome, Step};
use crate::state::State;
use crate::table::{Role, Row};
use crate::value::{Kind, Scalar};

/// A slave and what the importer gave it.
pub(crate) struct Instance<M: Model, L: Log> {
    pub state: State<M>,
    pub log: L,
    resources: Option<PathBuf>,
    /// The model as initialisation would leave it, when an output was read in initialisation mode.
    pub ahead: Option<Box<M>>,
    /// Strings that the importer may read until its next call.
    strings: Vec<CString>,
}

impl<M: Model, L: Log> Instance<M, L> {
    pub fn new(resources: Option<PathBuf>, log: L) -> Self {
        Self { state: State::default(), log, resources, ahead: None, strings: Vec::new() }
    }

    pub fn setup_experiment(&mut self, start: f64, stop: Option<f64>) -> Result<(), Error> {
        self.state.clock = Clock::new(start, stop)?;
        Ok(())
    }

    pub fn enter_initialization_mode(&mut self) {
        self.ahead = None;
        self.state.phase = Phase::InitializationMode;
    }

    pub fn exit_initialization_mode(&mut self) -> Result<(), Error> {
        match self.ahead.take() {
            Some(model) => self.state.model = *model,
            None => initialize(&mut self.state.model, self.state.clock, self.resources.as_deref(), &mut self.log)?,
        }
        self.state.phase = Phase::StepComplete;
        self.state.initialised = true;
        self.state.retune = false;
        self.state.stale = true;
        if self.log.enabled(Category::Event) {
            self.log.log(Category::Event, &format!("initialised at {} s", self.state.clock.now));
        }
        Ok(())
    }

    pub fn terminate(&mut self) {
        self.refresh();
        self.state.phase = Phase::Terminated;
    }

    pub fn reset(&mut self) {
        self.restore(State::default());
    }

    pub fn restore(&mut self, state: State<M>) {
        self.ahead = None;
        self.state = state;
    }

    pub fn do_step(&mut self, t: f64, h: f64) -> Result<Outcome, Error> {
        self.state.clock.check_step(t, h, M::INFO.max_step)?;
        let State { model, retune, stale, input_derivatives, .. } = &mut self.state;
        if std::mem::take(retune) {
            model.tune(&mut self.log).map_err(model_error)?;
        }
        *stale = true;
        let outcome = model.step(&Step { t, h, input_derivatives }, &mut self.log).map_err(model_error)?;
        input_derivatives.clear();
        self.state.clock.now = t + h;
        Ok(outcome)
    }

    /// Reads variables of one type and hands each value over with its position.
    #[inline]
    pub fn read(
        &mut self,
        references: &[u32],
        kind: Kind,
        mut deliver: impl FnMut(usize, Scalar<'_>),
    ) -> Result<(), Error> {
        for (position, &reference) in references.iter().enumerate() {
            let (row, element) = variable::<M>(reference, kind)?;
            if row.role.is_calculated() {
                self.update(row, element)?;
            }
            let model = self.ahead.as_deref().filter(|_| row.role.is_calculated()).unwrap_or(&self.state.model);
            deliver(position, row.read(model, element));
        }
        Ok(())
    }

    /// Writes variables of one type, all or none.
    #[inline]
    pub fn write<'v>(
        &mut self,
        references: &[u32],
        kind: Kind,
        fetch: impl Fn(usize) -> Scalar<'v>,
    ) -> Result<(), Error> {
        for (position, &reference) in references.iter().enumerate() {
            let (row, element) = variable::<M>(reference, kind)?;
            if !self.is_settable(row) {
                return Err(self.frozen_error(row, element));
            }
            let value = fetch(position);
            if !row.permits(value) {
                return Err(range_error(row, element, value));
            }
        }
        for (position, &reference) in references.iter().enumerate() {
            let (row, element) = variable::<M>(reference, kind)?;
            let value = fetch(position);
            let fits = row.set.is_some_and(|set| set(&mut self.state.model, element, value));
            if !fits {
                return Err(range_error(row, element, value));
            }
            self.state.retune |= row.role == Role::Tunable;
        }
        if !references.is_empty() {
            self.state.stale = true;
            self.ahead = None;
        }
        Ok(())
    }

    /// Reads strings and keeps them until the next call.
    pub fn read_strings(&mut self, references: &[u32]) -> Result<&[CString], Error> {
        let mut strings = std::mem::take(&mut self.strings);
        strings.clear();
        self.read(references, Kind::String, |_, value| {
            let Scalar::String(text) = value else { unreachable!("read delivers values of the type asked for") };
            // Texts come in through NUL-terminated strings; one made by the model ends at its first NUL, as it would in C.
            let bytes = text.split('\0').next().unwrap_or_default();
            strings.push(CString::new(bytes).expect("a piece without NUL has no NUL"));
        })?;
        self.strings = strings;
        Ok(&self.strings)
    }

    /// Makes a calculated variable readable.
    #[inline]
    pub fn update(&mut self, row: &Row<M>, element: usize) -> Result<(), Error> {
        match self.state.phase {
            Phase::StepComplete if row.lazy && self.state.stale => self.refresh(),
            Phase::InitializationMode if self.ahead.is_none() => {
                let mut model = Box::new(self.state.model.clone());
                initialize(model.as_mut(), self.state.clock, self.resources.as_deref(), &mut self.log).map_err(
                    |error| Error::Unavailable { name: row.element_name(element), reason: error.to_string() },
                )?;
                model.refresh();
                self.ahead = Some(model);
            }
            _ => {}
        }
        Ok(())
    }

    fn refresh(&mut self) {
        if self.state.stale {
            self.state.model.refresh();
            self.state.stale = false;
        }
    }

    #[inline]
    pub fn is_settable(&self, row: &Row<M>) -> bool {
        match row.role {
            Role::Input | Role::Tunable => true,
            Role::Parameter => self.state.phase != Phase::StepComplete,
            Role::Output | Role::Local => false,
        }
    }

    #[cold]
    pub fn frozen_error(&self, row: &Row<M>, element: usize) -> Error {
        let reason = if row.role.is_calculated() {
            "it is calculated"
        } else {
            "it is a fixed parameter and initialisation is over"
        };
        Error::Frozen { name: row.element_name(element), reason }
    }
}

fn initialize<M: Model>(
    model: &mut M,
    clock: Clock,
    resources: Option<&std::path::Path>,
    log: &mut dyn Log,
) -> Result<(), Error> {
    model.initialize(&Experiment { start: clock.start, stop: clock.stop, resources }, log).map_err(model_error)
}

#[inline]
pub(crate) fn variable<M: Model>(reference: u32, kind: Kind) -> Result<(&'static Row<M>, usize), Error> {
    match M::table().lookup(reference) {
        Some((row, element)) if row.kind == kind => Ok((row, element)),
        wrong => Err(reference_error(wrong, reference, kind)),
    }
}

#[cold]
fn reference_error<M>(found: Option<(&'static Row<M>, usize)>, reference: u32, wanted: Kind) -> Error {
    match found {
        None => Error::UnknownReference(reference),
        Some((row, element)) => {
            Error::Type { name: row.element_name(element), actual: row.kind.name(), wanted: wanted.name() }
        }
    }
}

#[cold]
pub(crate) fn range_error<M>(row: &Row<M>, element: usize, value: Scalar<'_>) -> Error {
    let value = match value {
        Scalar::Real(value) => format!("{value:?}"),
        Scalar::Integer(value) => value.to_string(),
        Scalar::Boolean(value) => value.to_string(),
        Scalar::String(value) => format!("{value:?}"),
    };
    Error::Range { name: row.element_name(element), value, range: row.range() }
}

fn model_error(error: impl std::fmt::Display) -> Error {
    Error::Model(error.to_string())
}

//! Derivatives across the interface: of inputs, to extrapolate them inside a step, of outputs, and along directions.

use crate::error::Error;
use crate::instance::{Instance, range_error, variable};
use crate::model::{InputDerivative, Log, Model};
use crate::table::Role;
use crate::value::{Kind, Scalar};

impl<M: Model, L: Log> Instance<M, L> {
    /// Takes over derivatives of inputs for the next step, all or none.
    pub fn set_input_derivatives(&mut self, references: &[u32], orders: &[i32], values: &[f64]) -> Result<(), Error> {
        let derivatives = references.iter().zip(orders).zip(values);
        let checked = derivatives.map(|((&reference, &order), &value)| input_derivative::<M>(reference, order, value));
        for new in checked.collect::<Result<Vec<_>, _>>()? {
            let pending = &mut self.state.input_derivatives;
            match pending.iter_mut().find(|known| known.reference == new.reference && known.order == new.order) {
                Some(known) => *known = new,
                None => pending.push(new),
            }
        }
        Ok(())
    }

    pub fn output_derivative(&mut self, reference: u32, order: i32) -> Result<f64, Error> {
        let (row, element) = variable::<M>(reference, Kind::Real)?;
        let unavailable = || Error::Derivative { name: row.element_name(element), order };
        let positive = u32::try_from(order).map_err(|_| unavailable())?;
        if row.role != Role::Output || !(1..=M::INFO.max_output_derivative_order).contains(&positive) {
            return Err(unavailable());
        }
        if !self.state.initialised {
            return Err(unavailable());
        }
        self.update(row, element)?;
        self.state.model.output_derivative(reference, positive).ok_or_else(unavailable)
    }

    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Result<(), Error> {
        if !M::INFO.directional_derivative {
            return Err(Error::Directional("this model provides none".to_owned()));
        }
        for &unknown in unknowns {
            let (row, element) = variable::<M>(unknown, Kind::Real)?;
            if !row.role.is_calculated() {
                return Err(Error::Directional(format!("variable {} is not calculated", row.element_name(element))));
            }
            self.update(row, element)?;
        }
        for &known in knowns {
            let (row, element) = variable::<M>(known, Kind::Real)?;
            if row.role.is_calculated() {
                return Err(Error::Directional(format!(
                    "variable {} is not an independent one",
                    row.element_name(element)
                )));
            }
        }
        if let Some(value) = seed.iter().find(|value| !value.is_finite()) {
            return Err(Error::Directional(format!("seed {value} is not finite")));
        }
        if unknowns.is_empty() {
            return Ok(());
        }
        if !self.state.initialised && self.ahead.is_none() {
            return Err(Error::Directional("initialisation failed".to_owned()));
        }
        let model = self.ahead.as_deref().unwrap_or(&self.state.model);
        model
            .directional_derivative(unknowns, knowns, seed, sensitivity)
            .map_err(|error| Error::Directional(error.to_string()))
    }
}

/// Checks a derivative of an input.
fn input_derivative<M: Model>(reference: u32, order: i32, value: f64) -> Result<InputDerivative, Error> {
    let (row, element) = variable::<M>(reference, Kind::Real)?;
    if row.role != Role::Input {
        return Err(Error::Frozen { name: row.element_name(element), reason: "only inputs have input derivatives" });
    }
    if !value.is_finite() {
        return Err(range_error(row, element, Scalar::Real(value)));
    }
    let known = u32::try_from(order).ok().filter(|order| (1..=M::INFO.max_input_derivative_order).contains(order));
    let order = known.ok_or_else(|| Error::Derivative { name: row.element_name(element), order })?;
    Ok(InputDerivative { reference, order, value })
}

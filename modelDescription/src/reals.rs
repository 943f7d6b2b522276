//! Reading and writing Real variables in runs: importers pass previews and plans as arrays whose value references follow each other,
//! and one call for each element would cost more than the whole controller.

use crate::error::Error;
use crate::instance::{Instance, range_error, variable};
use crate::model::{Log, Model};
use crate::table::{Role, Row};
use crate::value::{Kind, Scalar};

/// Consecutive elements of one row.
struct Run<M: 'static> {
    row: &'static Row<M>,
    first: usize,
    /// Where they are among the references of the call.
    from: usize,
    to: usize,
}

/// The run that begins at position `from` of the references.
#[inline]
fn run<M: Model>(references: &[u32], from: usize) -> Result<Run<M>, Error> {
    let (row, first) = variable::<M>(references[from], Kind::Real)?;
    let left = row.len.map_or(1, |len| len - first);
    let following = references[from..].iter().zip(references[from]..).take(left);
    let count = following.take_while(|(reference, expected)| *reference == expected).count();
    Ok(Run { row, first, from, to: from + count })
}

impl<M: Model, L: Log> Instance<M, L> {
    /// Reads Real variables.
    #[inline]
    pub fn read_reals(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Error> {
        let mut next = 0;
        while next < references.len() {
            let Run { row, first, from, to } = run::<M>(references, next)?;
            let calculated = row.role.is_calculated();
            if calculated {
                self.update(row, first)?;
            }
            let model = self.ahead.as_deref().filter(|_| calculated).unwrap_or(&self.state.model);
            (row.get_reals)(model, first, &mut values[from..to]);
            next = to;
        }
        Ok(())
    }

    /// Writes Real variables, all or none.
    #[inline]
    pub fn write_reals(&mut self, references: &[u32], values: &[f64]) -> Result<(), Error> {
        let mut next = 0;
        while next < references.len() {
            let Run { row, first, from, to } = run::<M>(references, next)?;
            if !self.is_settable(row) {
                return Err(self.frozen_error(row, first));
            }
            let (min, max) = row.limits();
            // Without a branch for each element, so that it takes as long as copying; NaN is within nothing.
            let refused = values[from..to]
                .iter()
                .fold(0, |refused, value| refused + u32::from(!(*value >= min && *value <= max)));
            if refused > 0 {
                return Err(first_refused(row, first, &values[from..to]));
            }
            next = to;
        }
        let mut next = 0;
        while next < references.len() {
            let Run { row, first, from, to } = run::<M>(references, next)?;
            if let Some(set) = row.set_reals {
                set(&mut self.state.model, first, &values[from..to]);
            }
            self.state.retune |= row.role == Role::Tunable;
            next = to;
        }
        if !references.is_empty() {
            self.state.stale = true;
            self.ahead = None;
        }
        Ok(())
    }
}

#[cold]
fn first_refused<M>(row: &Row<M>, first: usize, values: &[f64]) -> Error {
    let at = values.iter().position(|value| !row.permits(Scalar::Real(*value))).unwrap_or_default();
    range_error(row, first + at, Scalar::Real(values[at]))
}

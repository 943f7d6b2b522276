//! Whether a table can become XML that importers accept: names, ranges, units, dependencies.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::Error;
use crate::model::Model;
use crate::table::{Role, Row, Table};
use crate::unit;
use crate::value::Kind;

/// Refuses a table that would give XML which no importer can use.
pub(crate) fn check<M: Model>(table: &Table<M>, start: &M) -> Result<(), Error> {
    let mut names = BTreeSet::new();
    for (_, row, element) in table.variables() {
        if !names.insert(row.element_name(element)) {
            return Err(contradiction(row, "is declared twice"));
        }
        if row.items.is_some() && row.kind != Kind::Integer {
            return Err(contradiction(row, "is an enumeration, but its field is no integer"));
        }
        if row.set.is_none() && !row.role.is_calculated() {
            return Err(contradiction(row, "can be set by importers, but has no setter"));
        }
        if row.kind == Kind::Integer && [row.min, row.max].into_iter().flatten().any(|bound| bound.fract() != 0.0) {
            return Err(contradiction(row, "is an integer, but its limits are not"));
        }
        if row.nominal.is_some_and(|nominal| nominal <= 0.0) {
            return Err(contradiction(row, "has a nominal value that is not positive"));
        }
        if !row.role.is_calculated() && !row.permits(row.read(start, element)) {
            return Err(contradiction(row, "starts outside of its range"));
        }
    }
    Ok(())
}

/// The used units with their exponents.
pub(crate) fn units<M>(table: &Table<M>) -> Result<BTreeMap<&'static str, unit::Exponents>, Error> {
    let mut units = BTreeMap::new();
    for row in table.rows.iter().filter(|row| !row.unit.is_empty()) {
        let exponents =
            unit::exponents(row.unit).ok_or_else(|| contradiction(row, format!("has unknown unit {:?}", row.unit)))?;
        units.insert(row.unit, exponents);
    }
    Ok(units)
}

fn contradiction<M>(row: &Row<M>, reason: impl Into<String>) -> Error {
    Error::Table { name: row.name.to_owned(), reason: reason.into() }
}

/// Value references that dependencies may name.
pub(crate) struct Knowns {
    inputs: BTreeMap<&'static str, Vec<u32>>,
    parameters: BTreeSet<u32>,
}

impl Knowns {
    pub fn of<M>(table: &Table<M>) -> Result<Self, Error> {
        let mut inputs: BTreeMap<_, Vec<u32>> = BTreeMap::new();
        let mut parameters = BTreeSet::new();
        for (reference, row, _) in table.variables() {
            match row.role {
                Role::Input => inputs.entry(row.name).or_default().push(reference),
                Role::Parameter | Role::Tunable => _ = parameters.insert(reference),
                Role::Output | Role::Local => {}
            }
        }
        for row in table.rows {
            for name in row.depends.unwrap_or_default().iter().chain(row.depends_initially) {
                if !inputs.contains_key(name) {
                    return Err(contradiction(row, format!("depends on {name}, which is not an input")));
                }
            }
        }
        Ok(Self { inputs, parameters })
    }

    /// Inputs that the row depends on directly; None: all of them.
    pub fn of_output<M>(&self, row: &Row<M>) -> Option<BTreeSet<u32>> {
        row.depends.map(|names| names.iter().flat_map(|name| &self.inputs[name]).copied().collect())
    }

    /// At the start every output may depend on every parameter as well.
    pub fn at_start<M>(&self, row: &Row<M>) -> Option<BTreeSet<u32>> {
        let initially = row.depends_initially.iter().flat_map(|name| &self.inputs[name]);
        let more: BTreeSet<u32> = initially.chain(&self.parameters).copied().collect();
        self.of_output(row).map(|inputs| &inputs | &more)
    }
}

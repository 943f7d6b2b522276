//! The table as modelDescription.xml, in the order of the FMI 2.0 schema. The only file that knows quick-xml.

use std::collections::{BTreeMap, BTreeSet};
use std::io;

use quick_xml::Writer;
use quick_xml::writer::ElementWriter;

use crate::consistency::{Knowns, check, units};
use crate::error::Error;
use crate::guid;
use crate::model::{Category, Info, Model};
use crate::table::{Role, Row, Table};
use crate::unit;
use crate::value::{Kind, Scalar};

type Out = Writer<Vec<u8>>;

/// The XML of a model.
///
/// # Errors
/// If the table contradicts itself: unknown unit, dependency on an unknown variable, start value out of range.
pub fn model_description<M: Model>() -> Result<String, Error> {
    let bytes = write::<M>(guid::guid::<M>(), M::INFO.version)?;
    Ok(String::from_utf8(bytes).expect("quick-xml writes the UTF-8 that it was given"))
}

pub(crate) fn write<M: Model>(guid: &str, version: &str) -> Result<Vec<u8>, Error> {
    let (info, table) = (M::INFO, M::table());
    let start = M::default();
    check::<M>(table, &start)?;
    let exponents = units(table)?;
    let knowns = Knowns::of(table)?;

    let mut out = Writer::new_with_indent(Vec::new(), b' ', 2);
    out.get_mut().extend_from_slice(b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    out.create_element("fmiModelDescription")
        .with_attribute(("fmiVersion", "2.0"))
        .with_attribute(("modelName", info.name))
        .with_attribute(("guid", guid))
        .with_attribute(("description", info.description))
        .with_attribute(("version", version))
        .with_attribute(("generationTool", "model-description"))
        .with_attribute(("variableNamingConvention", "structured"))
        .write_inner_content(|out| {
            co_simulation(out, &info)?;
            unit_definitions(out, &exponents)?;
            type_definitions(out, table)?;
            log_categories(out)?;
            default_experiment(out, &info)?;
            out.create_element("ModelVariables").write_inner_content(|out| {
                for (reference, row, element) in table.variables() {
                    variable(out, reference, row, element, row.read(&start, element))?;
                }
                Ok(())
            })?;
            model_structure(out, table, &knowns)
        })?;
    let mut bytes = out.into_inner();
    bytes.push(b'\n');
    Ok(bytes)
}

fn co_simulation(out: &mut Out, info: &Info) -> io::Result<()> {
    let element = out
        .create_element("CoSimulation")
        .with_attribute(("modelIdentifier", info.identifier))
        .with_attribute(("canHandleVariableCommunicationStepSize", "true"));
    let element = flag(element, "canInterpolateInputs", info.max_input_derivative_order > 0);
    let element = match info.max_output_derivative_order {
        0 => element,
        order => element.with_attribute(("maxOutputDerivativeOrder", order.to_string().as_str())),
    };
    let element = element
        .with_attribute(("canNotUseMemoryManagementFunctions", "true"))
        .with_attribute(("canGetAndSetFMUstate", "true"))
        .with_attribute(("canSerializeFMUstate", "true"));
    flag(element, "providesDirectionalDerivative", info.directional_derivative).write_empty()?;
    Ok(())
}

fn unit_definitions(out: &mut Out, units: &BTreeMap<&str, unit::Exponents>) -> io::Result<()> {
    if units.is_empty() {
        return Ok(());
    }
    out.create_element("UnitDefinitions").write_inner_content(|out| {
        for (&name, exponents) in units {
            out.create_element("Unit").with_attribute(("name", name)).write_inner_content(|out| {
                let mut base = out.create_element("BaseUnit");
                for (symbol, exponent) in unit::BASE.iter().zip(exponents).filter(|(_, exponent)| **exponent != 0) {
                    base = base.with_attribute((*symbol, exponent.to_string().as_str()));
                }
                base.write_empty()?;
                if let Some((display, factor)) = unit::display(name) {
                    out.create_element("DisplayUnit")
                        .with_attribute(("name", display))
                        .with_attribute(("factor", real(factor).as_str()))
                        .write_empty()?;
                }
                Ok(())
            })?;
        }
        Ok(())
    })?;
    Ok(())
}

fn type_definitions<M>(out: &mut Out, table: &Table<M>) -> io::Result<()> {
    let types: BTreeMap<_, _> =
        table.rows.iter().filter_map(|row| row.items).map(|items| (items.name, items)).collect();
    if types.is_empty() {
        return Ok(());
    }
    out.create_element("TypeDefinitions").write_inner_content(|out| {
        for (name, enumeration) in types {
            out.create_element("SimpleType")
                .with_attribute(("name", name))
                .with_attribute(("description", enumeration.description))
                .write_inner_content(|out| {
                    out.create_element("Enumeration").write_inner_content(|out| {
                        for item in enumeration.items {
                            out.create_element("Item")
                                .with_attribute(("name", item.name))
                                .with_attribute(("value", item.value.to_string().as_str()))
                                .with_attribute(("description", item.description))
                                .write_empty()?;
                        }
                        Ok(())
                    })?;
                    Ok(())
                })?;
        }
        Ok(())
    })?;
    Ok(())
}

fn log_categories(out: &mut Out) -> io::Result<()> {
    out.create_element("LogCategories").write_inner_content(|out| {
        for (name, description) in Category::ALL
            .map(|category| (category.name(), category.description()))
            .into_iter()
            .chain([(Category::EVERYTHING, "Everything")])
        {
            out.create_element("Category")
                .with_attribute(("name", name))
                .with_attribute(("description", description))
                .write_empty()?;
        }
        Ok(())
    })?;
    Ok(())
}

fn default_experiment(out: &mut Out, info: &Info) -> io::Result<()> {
    out.create_element("DefaultExperiment")
        .with_attribute(("startTime", "0"))
        .with_attribute(("stopTime", real(info.stop_time).as_str()))
        .with_attribute(("stepSize", real(info.step_size).as_str()))
        .write_empty()?;
    Ok(())
}

fn variable<M>(out: &mut Out, reference: u32, row: &Row<M>, element: usize, start: Scalar<'_>) -> io::Result<()> {
    let (causality, variability, initial) = match row.role {
        Role::Input => ("input", moving(row), None),
        Role::Output => ("output", moving(row), Some("calculated")),
        Role::Local => ("local", moving(row), Some("calculated")),
        Role::Parameter => ("parameter", "fixed", Some("exact")),
        Role::Tunable => ("parameter", "tunable", Some("exact")),
    };
    let mut scalar = out
        .create_element("ScalarVariable")
        .with_attribute(("name", row.element_name(element).as_str()))
        .with_attribute(("valueReference", reference.to_string().as_str()))
        .with_attribute(("description", row.description))
        .with_attribute(("causality", causality))
        .with_attribute(("variability", variability));
    if let Some(initial) = initial {
        scalar = scalar.with_attribute(("initial", initial));
    }
    scalar.write_inner_content(|out| {
        let mut attributes = Vec::new();
        if let Some(items) = row.items {
            attributes.push(("declaredType", items.name.to_owned()));
        }
        if row.kind == Kind::Real && !row.unit.is_empty() {
            attributes.push(("unit", row.unit.to_owned()));
            if let Some((display, _)) = unit::display(row.unit).filter(|_| row.display) {
                attributes.push(("displayUnit", display.to_owned()));
            }
        }
        if row.items.is_none() {
            for (name, bound) in [("min", row.min), ("max", row.max)] {
                attributes.extend(bound.map(|bound| (name, limit(row.kind, bound))));
            }
        }
        if row.kind == Kind::Real {
            attributes.extend(row.nominal.map(|nominal| ("nominal", real(nominal))));
        }
        if !row.role.is_calculated() {
            attributes.push(("start", text(start)));
        }
        let name = if row.items.is_some() { "Enumeration" } else { row.kind.name() };
        let mut typed = out.create_element(name);
        for (name, value) in &attributes {
            typed = typed.with_attribute((*name, value.as_str()));
        }
        typed.write_empty()?;
        Ok(())
    })?;
    Ok(())
}

fn model_structure<M>(out: &mut Out, table: &Table<M>, knowns: &Knowns) -> io::Result<()> {
    out.create_element("ModelStructure").write_inner_content(|out| {
        let outputs = || table.variables().filter(|(_, row, _)| row.role == Role::Output);
        if outputs().next().is_none() {
            return Ok(());
        }
        out.create_element("Outputs").write_inner_content(|out| {
            for (reference, row, _) in outputs() {
                unknown(out, reference, knowns.of_output(row))?;
            }
            Ok(())
        })?;
        out.create_element("InitialUnknowns").write_inner_content(|out| {
            for (reference, row, _) in outputs() {
                unknown(out, reference, knowns.at_start(row))?;
            }
            Ok(())
        })?;
        Ok(())
    })?;
    Ok(())
}

/// One row of the model structure; variables are counted from 1 there, and no list of dependencies means all.
fn unknown(out: &mut Out, reference: u32, dependencies: Option<BTreeSet<u32>>) -> io::Result<()> {
    let mut element = out.create_element("Unknown").with_attribute(("index", (reference + 1).to_string().as_str()));
    if let Some(dependencies) = dependencies {
        let list = dependencies.iter().map(|known| (known + 1).to_string()).collect::<Vec<_>>().join(" ");
        element = element.with_attribute(("dependencies", list.as_str()));
    }
    element.write_empty()?;
    Ok(())
}

fn moving<M>(row: &Row<M>) -> &'static str {
    if row.kind == Kind::Real && !row.discrete { "continuous" } else { "discrete" }
}

fn flag<'a>(element: ElementWriter<'a, Vec<u8>>, name: &str, value: bool) -> ElementWriter<'a, Vec<u8>> {
    if value { element.with_attribute((name, "true")) } else { element }
}

fn text(value: Scalar<'_>) -> String {
    match value {
        Scalar::Real(value) => real(value),
        Scalar::Integer(value) => value.to_string(),
        Scalar::Boolean(value) => value.to_string(),
        Scalar::String(value) => value.to_owned(),
    }
}

/// A limit in the type of its variable: the schema wants integers of an Integer.
fn limit(kind: Kind, bound: f64) -> String {
    if kind == Kind::Integer { format!("{bound:.0}") } else { real(bound) }
}

/// The shortest text that gives the same number back.
fn real(value: f64) -> String {
    format!("{value:?}")
}

//! The wired system as an SSP 1.0 archive: both FMUs, connections by name, a parameter set for each manoeuvre.
//!
//! `[SSP]` is System Structure and Parameterization 1.0, whose schemas fix names and order of the elements.

use anyhow::{Context, Result, ensure};

use crate::archive::Files;
use crate::interface::{Interface, Kind, Variable};
use crate::workspace::{CONTROLLER, Model, PLANT, SYSTEM};
use crate::xml::Element;

/// A manoeuvre as values of the plant's parameters.
struct Manoeuvre {
    name: &'static str,
    values: &'static [(&'static str, &'static str)],
}

/// Every set gives values to the same parameters, so that the last binding of a component wins as a whole, [SSP, 4.5.4]:
/// a tool that applies all of them runs the lane change, and one that selects by name runs what was asked for.
const MANOEUVRES: [Manoeuvre; 2] = [
    Manoeuvre { name: "general", values: &[("road", "general"), ("speed", "14")] },
    Manoeuvre { name: "double_lane_change", values: &[("road", "double_lane_change"), ("speed", "14")] },
];

/// Collects the files of the system; `files` holds the two FMUs already.
pub fn of(controller: &Interface, plant: &Interface, mut files: Files) -> Result<Files> {
    let wires = wires(controller, plant)?;
    for manoeuvre in &MANOEUVRES {
        let path = format!("resources/{}.ssv", manoeuvre.name);
        files.add(&path, parameter_set(manoeuvre, plant)?.document()?)?;
    }
    let bindings = Element::new("ssd:ParameterBindings").extend(MANOEUVRES.iter().map(|manoeuvre| {
        Element::new("ssd:ParameterBinding")
            .with("type", "application/x-ssp-parameter-set")
            .with("source", &format!("resources/{}.ssv", manoeuvre.name))
    }));
    let elements = Element::new("ssd:Elements")
        .child(component(PLANT, plant, &wires, Some(bindings), 0.0))
        .child(component(CONTROLLER, controller, &wires, None, 100.0));
    let connections = Element::new("ssd:Connections").extend(wires.iter().map(|wire| {
        Element::new("ssd:Connection")
            .with("startElement", wire.from.component)
            .with("startConnector", &wire.name)
            .with("endElement", wire.to.component)
            .with("endConnector", &wire.name)
    }));
    let system = Element::new("ssd:System")
        .with("name", SYSTEM)
        .with("description", "LPV-MPC path tracking: the controller drives the vehicle")
        .child(elements)
        .child(connections);
    let experiment =
        Element::new("ssd:DefaultExperiment").with("startTime", &0).with_some("stopTime", plant.stop_time.as_ref());
    let description = Element::new("ssd:SystemStructureDescription")
        .with("xmlns:ssd", "http://ssp-standard.org/SSP1/SystemStructureDescription")
        .with("xmlns:ssc", "http://ssp-standard.org/SSP1/SystemStructureCommon")
        .with("xmlns:ssv", "http://ssp-standard.org/SSP1/SystemStructureParameterValues")
        .with("version", "1.0")
        .with("name", SYSTEM)
        .with("license", "MIT OR Apache-2.0")
        .with("generationTool", concat!("cargo fmu ", env!("CARGO_PKG_VERSION")))
        .child(system)
        .extend(enumerations(&[plant, controller]))
        .child(units(&[plant, controller]))
        .child(experiment);
    files.add("SystemStructure.ssd", description.document()?)?;
    Ok(files)
}

/// A connection between connectors of the same name.
struct Wire {
    name: String,
    from: Model,
    to: Model,
}

/// Every input of the controller has an output of the plant; commands go back; the plant's other inputs stay free.
fn wires(controller: &Interface, plant: &Interface) -> Result<Vec<Wire>> {
    let mut wires = Vec::new();
    for input in controller.with_causality("input") {
        let output = plant
            .with_causality("output")
            .find(|output| output.name == input.name)
            .with_context(|| format!("input {} of the controller has no output of the plant", input.name))?;
        ensure_alike(output, input)?;
        wires.push(Wire { name: input.name.clone(), from: PLANT, to: CONTROLLER });
    }
    for input in plant.with_causality("input") {
        if let Some(output) = controller.with_causality("output").find(|output| output.name == input.name) {
            ensure_alike(output, input)?;
            wires.push(Wire { name: input.name.clone(), from: CONTROLLER, to: PLANT });
        }
    }
    Ok(wires)
}

fn ensure_alike(output: &Variable, input: &Variable) -> Result<()> {
    ensure!(
        output.kind == input.kind && output.unit == input.unit,
        "{} is {:?} in {:?} on one side and {:?} in {:?} on the other",
        input.name,
        output.kind,
        output.unit,
        input.kind,
        input.unit
    );
    Ok(())
}

/// A component with the connectors that are wired and the outputs worth plotting. The predicted trajectories are left out:
/// a tool that records every connector would spend most of its time on them. An input without a wire is left out too,
/// because some tools take every listed input for a connected one; its start value stands.
fn component(model: Model, interface: &Interface, wires: &[Wire], bindings: Option<Element>, left: f64) -> Element {
    let wired = |variable: &Variable| wires.iter().any(|wire| wire.name == variable.name);
    let connectors = interface
        .variables
        .iter()
        .filter(|variable| match variable.causality.as_str() {
            "input" => wired(variable),
            "output" => wired(variable) || !variable.name.contains('['),
            _ => false,
        })
        .filter(|variable| variable.kind != Kind::String)
        .map(connector);
    let geometry =
        Element::new("ssd:ElementGeometry").with("x1", &left).with("y1", &0).with("x2", &(left + 60.0)).with("y2", &60);
    Element::new("ssd:Component")
        .with("name", model.component)
        .with("description", &interface.description)
        .with("type", "application/x-fmu-sharedlibrary")
        .with("source", &format!("resources/{}.fmu", model.name))
        .with("implementation", "CoSimulation")
        .child(Element::new("ssd:Connectors").extend(connectors))
        .child(geometry)
        .extend(bindings)
}

fn connector(variable: &Variable) -> Element {
    let kind = match variable.kind {
        Kind::Real => Element::new("ssc:Real").with_some("unit", variable.unit.as_ref()),
        Kind::Enumeration => Element::new("ssc:Enumeration").with_some("name", variable.declared_type.as_ref()),
        kind => Element::new(&format!("ssc:{}", kind.name())),
    };
    Element::new("ssd:Connector")
        .with("name", &variable.name)
        .with("kind", &variable.causality)
        .with("description", &variable.description)
        .child(kind)
}

/// Units of both FMUs, each once.
fn units(interfaces: &[&Interface]) -> Element {
    let mut seen = Vec::new();
    let units = interfaces
        .iter()
        .flat_map(|interface| &interface.units)
        .filter(|unit| {
            let new = !seen.contains(&unit.get("name"));
            seen.push(unit.get("name"));
            new
        })
        .map(unit);
    Element::new("ssd:Units").extend(units)
}

fn unit(unit: &Element) -> Element {
    let base = unit.find("BaseUnit").map_or(&[][..], |base| &base.attributes);
    Element::new("ssc:Unit")
        .with("name", unit.get("name").unwrap_or_default())
        .child(Element { attributes: base.to_vec(), ..Element::new("ssc:BaseUnit") })
}

fn enumerations(interfaces: &[&Interface]) -> Option<Element> {
    let list: Vec<Element> = interfaces
        .iter()
        .flat_map(|interface| &interface.enumerations)
        .map(|(name, items)| {
            let items =
                items.iter().map(|item| Element::new("ssc:Item").with("name", &item.name).with("value", &item.value));
            Element::new("ssc:Enumeration").with("name", name).extend(items)
        })
        .collect();
    (!list.is_empty()).then(|| Element::new("ssd:Enumerations").extend(list))
}

fn parameter_set(manoeuvre: &Manoeuvre, plant: &Interface) -> Result<Element> {
    let mut parameters = Element::new("ssv:Parameters");
    for (name, value) in manoeuvre.values {
        let variable = plant.variable(name)?;
        ensure!(variable.causality == "parameter", "{name} is no parameter of the plant");
        let typed = Element::new(&format!("ssv:{}", variable.kind.name()))
            .with("value", *value)
            .with_some("unit", variable.unit.as_ref());
        parameters = parameters.child(Element::new("ssv:Parameter").with("name", name).child(typed));
    }
    let mut units = units(&[plant]);
    "ssv:Units".clone_into(&mut units.name);
    Ok(Element::new("ssv:ParameterSet")
        .with("xmlns:ssv", "http://ssp-standard.org/SSP1/SystemStructureParameterValues")
        .with("xmlns:ssc", "http://ssp-standard.org/SSP1/SystemStructureCommon")
        .with("version", "1.0")
        .with("name", manoeuvre.name)
        .child(parameters)
        .child(units))
}

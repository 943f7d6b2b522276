//! The wired system as an SSP 1.0 archive: both FMUs, connections by name, parameter sets.
//!
//! `[SSP]` is System Structure and Parameterization 1.0, whose schemas fix names and order of the elements.

use anyhow::{Context, Result, ensure};

use crate::archive::Files;
use crate::interface::{Interface, Kind, Variable};
use crate::parameter_set::{ParameterSet, units};
use crate::workspace::{CONTROLLER, Model, PLANT, SYSTEM};
use crate::xml::Element;

/// All manoeuvres, the default one last.
///
/// Every set gives values to the same parameters, so that the last binding of a component wins as a whole, [SSP, 4.5.4]:
/// a tool that applies all of them runs the lane change, and one that selects by name runs what was asked for.
fn manoeuvres() -> Vec<ParameterSet> {
    let default = "double_lane_change";
    let others = vehicle::road::NAMES.into_iter().filter(|name| *name != default);
    let set = |name: &str| ParameterSet::new(name, vec![("road", name.to_owned()), ("speed", "14".to_owned())]);
    others.chain([default]).map(set).collect()
}

/// The controller's tuning: the paper's, and the shipped one, which is the default.
fn tunings(controller: &Interface) -> Result<Vec<ParameterSet>> {
    let paper = lpv_mpc::Parameters::paper();
    let values = vec![
        ("horizon", paper.horizon.to_string()),
        ("q_v_x", paper.q_v_x.to_string()),
        ("r_delta", paper.r_delta.to_string()),
        ("r_a_x", paper.r_a_x.to_string()),
    ];
    let shipped = values
        .iter()
        .map(|(name, _)| {
            let start = controller.variable(name)?.start.clone();
            Ok((*name, start.with_context(|| format!("parameter {name} has no start value"))?))
        })
        .collect::<Result<_>>()?;
    Ok(vec![ParameterSet::new("paper_weights", values), ParameterSet::new("shipped_weights", shipped)])
}

/// Collects the files of the system; `files` holds the two FMUs already.
pub fn of(controller: &Interface, plant: &Interface, mut files: Files) -> Result<Files> {
    let wires = wires(controller, plant)?;
    let (manoeuvres, tunings) = (manoeuvres(), tunings(controller)?);
    for (set, interface) in manoeuvres.iter().map(|set| (set, plant)).chain(tunings.iter().map(|set| (set, controller)))
    {
        files.add(&format!("resources/{}.ssv", set.name), set.element(interface)?.document()?)?;
    }
    let elements = Element::new("ssd:Elements")
        .child(component(PLANT, plant, &wires, &manoeuvres, 0.0))
        .child(component(CONTROLLER, controller, &wires, &tunings, 100.0));
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
fn component(model: Model, interface: &Interface, wires: &[Wire], sets: &[ParameterSet], left: f64) -> Element {
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
    let bindings = Element::new("ssd:ParameterBindings").extend(sets.iter().map(|set| {
        Element::new("ssd:ParameterBinding")
            .with("type", "application/x-ssp-parameter-set")
            .with("source", &format!("resources/{}.ssv", set.name))
    }));
    Element::new("ssd:Component")
        .with("name", model.component)
        .with("description", &interface.description)
        .with("type", "application/x-fmu-sharedlibrary")
        .with("source", &format!("resources/{}.fmu", model.name))
        .with("implementation", "CoSimulation")
        .child(Element::new("ssd:Connectors").extend(connectors))
        .child(geometry)
        .child(bindings)
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

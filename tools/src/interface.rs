//! What an FMU offers, read from its modelDescription.xml.

use anyhow::{Context, Result, bail};

use crate::xml::Element;

/// The five types of FMI 2.0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A floating-point number.
    Real,
    /// A whole number.
    Integer,
    /// True or false.
    Boolean,
    /// A text.
    String,
    /// A whole number with a name for each value.
    Enumeration,
}

impl Kind {
    /// Name of the XML element, the same in FMI and in SSP.
    pub fn name(self) -> &'static str {
        match self {
            Self::Real => "Real",
            Self::Integer => "Integer",
            Self::Boolean => "Boolean",
            Self::String => "String",
            Self::Enumeration => "Enumeration",
        }
    }

    fn parse(name: &str) -> Option<Self> {
        [Self::Real, Self::Integer, Self::Boolean, Self::String, Self::Enumeration]
            .into_iter()
            .find(|kind| kind.name() == name)
    }
}

/// One scalar variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variable {
    /// Name, with an index in brackets for an element of an array.
    pub name: String,
    /// Value reference.
    pub reference: u32,
    /// Type.
    pub kind: Kind,
    /// Role: input, output, parameter and so on.
    pub causality: String,
    /// When it may change.
    pub variability: String,
    /// What it is.
    pub description: String,
    /// Unit's name; inherited from the declared type where the variable has none.
    pub unit: Option<String>,
    /// Value that it starts from, as text.
    pub start: Option<String>,
    /// Least value, as text.
    pub min: Option<String>,
    /// Greatest value, as text.
    pub max: Option<String>,
    /// Name of the declared type.
    pub declared_type: Option<String>,
}

/// A named value of an enumeration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    /// Name.
    pub name: String,
    /// Number that the variable takes.
    pub value: i32,
    /// What it means.
    pub description: String,
}

/// An FMU's interface.
#[derive(Clone, Debug)]
pub struct Interface {
    /// Model's name.
    pub model_name: String,
    /// Library's name.
    pub identifier: String,
    /// Fingerprint that the library must know.
    pub guid: String,
    /// What the model is.
    pub description: String,
    /// Version of the model.
    pub version: String,
    /// Variables in their order.
    pub variables: Vec<Variable>,
    /// Units as they stand in the XML: the SSP repeats them.
    pub units: Vec<Element>,
    /// Enumerations by their names.
    pub enumerations: Vec<(String, Vec<Item>)>,
    /// End of the default experiment [s].
    pub stop_time: Option<f64>,
    /// Communication step of the default experiment [s].
    pub step_size: Option<f64>,
}

impl Interface {
    /// Reads a model description.
    pub fn parse(document: &str) -> Result<Self> {
        let root = Element::parse(document)?;
        if root.name != "fmiModelDescription" || root.get("fmiVersion") != Some("2.0") {
            bail!("not a model description of FMI 2.0: {}", root.name);
        }
        let slave = root.find("CoSimulation").context("the model description offers no co-simulation")?;
        let types = root.list("TypeDefinitions");
        let number = |name: &str| -> Result<Option<f64>> {
            root.find("DefaultExperiment")
                .and_then(|experiment| experiment.get(name))
                .map(|text| text.parse().with_context(|| format!("{name} is not a number: {text}")))
                .transpose()
        };
        Ok(Self {
            model_name: root.require("modelName")?.to_owned(),
            identifier: slave.require("modelIdentifier")?.to_owned(),
            guid: root.require("guid")?.to_owned(),
            description: root.get("description").unwrap_or_default().to_owned(),
            version: root.get("version").unwrap_or_default().to_owned(),
            variables: root
                .list("ModelVariables")
                .iter()
                .map(|element| variable(element, types))
                .collect::<Result<_>>()?,
            units: root.list("UnitDefinitions").to_vec(),
            enumerations: types.iter().filter_map(enumeration).collect::<Result<_>>()?,
            stop_time: number("stopTime")?,
            step_size: number("stepSize")?,
        })
    }

    /// A variable by its name.
    pub fn variable(&self, name: &str) -> Result<&Variable> {
        self.variables
            .iter()
            .find(|variable| variable.name == name)
            .with_context(|| format!("{} has no variable {name}", self.model_name))
    }

    /// Variables of one causality.
    pub fn with_causality(&self, causality: &str) -> impl Iterator<Item = &Variable> {
        self.variables.iter().filter(move |variable| variable.causality == causality)
    }
}

fn variable(element: &Element, types: &[Element]) -> Result<Variable> {
    let name = element.require("name")?.to_owned();
    let (typed, kind) = element
        .children
        .iter()
        .find_map(|child| Some((child, Kind::parse(&child.name)?)))
        .with_context(|| format!("variable {name} has no type"))?;
    let declared = typed
        .get("declaredType")
        .and_then(|declared| types.iter().find(|entry| entry.get("name") == Some(declared)))
        .and_then(|entry| entry.find(kind.name()));
    let attribute =
        |key: &str| typed.get(key).or_else(|| declared.and_then(|declared| declared.get(key))).map(str::to_owned);
    Ok(Variable {
        reference: element.require("valueReference")?.parse()?,
        kind,
        causality: element.get("causality").unwrap_or("local").to_owned(),
        variability: element.get("variability").unwrap_or("continuous").to_owned(),
        description: element.get("description").unwrap_or_default().to_owned(),
        unit: attribute("unit"),
        start: typed.get("start").map(str::to_owned),
        min: attribute("min"),
        max: attribute("max"),
        declared_type: typed.get("declaredType").map(str::to_owned),
        name,
    })
}

fn enumeration(entry: &Element) -> Option<Result<(String, Vec<Item>)>> {
    let items = &entry.find("Enumeration")?.children;
    let item = |element: &Element| -> Result<Item> {
        Ok(Item {
            name: element.require("name")?.to_owned(),
            value: element.require("value")?.parse()?,
            description: element.get("description").unwrap_or_default().to_owned(),
        })
    };
    let items: Result<Vec<Item>> = items.iter().map(item).collect();
    Some(items.and_then(|items| Ok((entry.require("name")?.to_owned(), items))))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOCUMENT: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="M" guid="{1}" description="a model">
  <CoSimulation modelIdentifier="m"/>
  <UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit></UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="Length"><Real unit="m" min="0"/></SimpleType>
    <SimpleType name="Status"><Enumeration><Item name="good" value="0"/><Item name="bad" value="1"/></Enumeration></SimpleType>
  </TypeDefinitions>
  <DefaultExperiment stopTime="8.5"/>
  <ModelVariables>
    <ScalarVariable name="x[1]" valueReference="7" causality="input"><Real declaredType="Length" start="1"/></ScalarVariable>
    <ScalarVariable name="status" valueReference="8" causality="output" variability="discrete"><Enumeration declaredType="Status"/></ScalarVariable>
  </ModelVariables>
</fmiModelDescription>"#;

    #[test]
    fn a_variable_inherits_unit_and_range_from_its_declared_type() {
        let interface = Interface::parse(DOCUMENT).unwrap();
        let x = interface.variable("x[1]").unwrap();
        assert_eq!((x.reference, x.kind, x.unit.as_deref()), (7, Kind::Real, Some("m")));
        assert_eq!((x.min.as_deref(), x.max.as_deref()), (Some("0"), None));
        assert_eq!(interface.enumerations[0].1[1].name, "bad");
        assert_eq!((interface.stop_time, interface.step_size), (Some(8.5), None));
        assert_eq!(interface.with_causality("output").count(), 1);
    }

    #[test]
    fn a_missing_variable_is_named() {
        let error = Interface::parse(DOCUMENT).unwrap().variable("y").unwrap_err();
        assert_eq!(error.to_string(), "M has no variable y");
    }
}

//! Parameter sets as SSP 1.0 keeps them, .ssv files: what tuning writes, systems bind and `simulate` reads.
//!
//! `[SSP]` is System Structure and Parameterization 1.0.

use anyhow::{Context, Result, bail, ensure};

use crate::interface::Interface;
use crate::simulate::settings::Settings;
use crate::xml::Element;

/// Values by name, as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParameterSet {
    /// Name of the set.
    pub name: String,
    /// Names of parameters with their values.
    pub values: Vec<(String, String)>,
}

impl ParameterSet {
    /// A set.
    pub fn new<N: Into<String>>(name: &str, values: Vec<(N, String)>) -> Self {
        Self { name: name.to_owned(), values: values.into_iter().map(|(name, value)| (name.into(), value)).collect() }
    }

    /// The set for a component with this interface, typed and with units.
    pub fn element(&self, interface: &Interface) -> Result<Element> {
        let mut parameters = Element::new("ssv:Parameters");
        for (name, value) in &self.values {
            let variable = interface.variable(name)?;
            ensure!(variable.causality == "parameter", "{name} is no parameter of {}", interface.model_name);
            let typed = Element::new(&format!("ssv:{}", variable.kind.name()))
                .with("value", value)
                .with_some("unit", variable.unit.as_ref());
            parameters = parameters.child(Element::new("ssv:Parameter").with("name", name).child(typed));
        }
        let mut units = units(&[interface]);
        "ssv:Units".clone_into(&mut units.name);
        Ok(Element::new("ssv:ParameterSet")
            .with("xmlns:ssv", "http://ssp-standard.org/SSP1/SystemStructureParameterValues")
            .with("xmlns:ssc", "http://ssp-standard.org/SSP1/SystemStructureCommon")
            .with("version", "1.0")
            .with("name", &self.name)
            .child(parameters)
            .child(units))
    }

    /// Reads a file's text. Prefixes of namespaces are the writer's choice, [SSP, section 4.1], so they do not count.
    pub fn parse(document: &str) -> Result<Self> {
        let root = Element::parse(document)?;
        ensure!(local(&root.name) == "ParameterSet", "not a parameter set of SSP: {}", root.name);
        let list = root.children.iter().find(|child| local(&child.name) == "Parameters");
        let values = list
            .map_or(&[][..], |list| &list.children)
            .iter()
            .filter(|child| local(&child.name) == "Parameter")
            .map(|parameter| {
                let name = parameter.require("name")?;
                let typed = parameter.children.iter().find_map(|child| child.get("value"));
                Ok((name.to_owned(), typed.with_context(|| format!("parameter {name} has no value"))?.to_owned()))
            })
            .collect::<Result<_>>()?;
        Ok(Self { name: root.get("name").unwrap_or_default().to_owned(), values })
    }

    /// The set as `simulate` takes parameters, each as `side.name=value`.
    ///
    /// A name with the component in front goes there. Without, the set belongs to the one side that knows all such names.
    pub fn assignments(&self) -> Result<Vec<String>> {
        let known: Vec<String> =
            Settings::new("", &[])?.list()?.into_iter().map(|mut row| row.swap_remove(0)).collect();
        let prefixed = |name: &str| name.starts_with("plant.") || name.starts_with("controller.");
        let bare: Vec<&str> =
            self.values.iter().map(|(name, _)| name.as_str()).filter(|name| !prefixed(name)).collect();
        let fits = |side: &str| bare.iter().all(|name| known.iter().any(|known| *known == format!("{side}.{name}")));
        let side = match (bare.is_empty(), fits("controller"), fits("plant")) {
            (true, ..) | (false, true, false) => "controller",
            (false, false, true) => "plant",
            (false, true, true) => {
                bail!("{} are parameters of both sides: put plant. or controller. in front", bare.join(", "))
            }
            (false, false, false) => bail!("neither side has all of {}", bare.join(", ")),
        };
        let assignment = |(name, value): &(String, String)| {
            if prefixed(name) { format!("{name}={value}") } else { format!("{side}.{name}={value}") }
        };
        Ok(self.values.iter().map(assignment).collect())
    }
}

fn local(name: &str) -> &str {
    name.rsplit(':').next().unwrap_or(name)
}

/// Units of FMUs as SSP writes them, each once.
pub(crate) fn units(interfaces: &[&Interface]) -> Element {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::archive::read_text;
    use crate::workspace::CONTROLLER;

    fn set(values: &[(&str, &str)]) -> ParameterSet {
        ParameterSet::new("s", values.iter().map(|(name, value)| (*name, (*value).to_owned())).collect())
    }

    #[test]
    fn what_is_written_reads_back_and_reaches_the_controller() {
        let interface = Interface::parse(&read_text(&CONTROLLER.description_file()).unwrap()).unwrap();
        let set = set(&[("q_e_y", "0.1"), ("horizon", "20")]);
        let document = set.element(&interface).unwrap().document().unwrap();
        assert!(document.contains("<ssv:Real value=\"0.1\" unit=\"1/m2\"/>"), "{document}");
        assert_eq!(ParameterSet::parse(&document).unwrap(), set);
        let settings = Settings::new("general", &set.assignments().unwrap()).unwrap();
        assert_eq!((settings.controller.q_e_y, settings.controller.horizon), (0.1, 20));
    }

    #[test]
    fn names_find_the_side_that_knows_them() {
        assert_eq!(
            set(&[("road", "general"), ("speed", "9")]).assignments().unwrap(),
            ["plant.road=general", "plant.speed=9"]
        );
        assert_eq!(
            set(&[("plant.m", "9"), ("q_e_y", "1")]).assignments().unwrap(),
            ["plant.m=9", "controller.q_e_y=1"]
        );
        let message = |names: &[(&str, &str)]| set(names).assignments().unwrap_err().to_string();
        assert_eq!(message(&[("m", "1")]), "m are parameters of both sides: put plant. or controller. in front");
        assert_eq!(message(&[("speed", "1"), ("q_e_y", "1")]), "neither side has all of speed, q_e_y");
    }
}

//! `--set side.name=value` on the flat parameter structures: names and types come from the structures themselves.

use anyhow::{Context, Result, bail};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::interface::{Interface, Variable};

/// Parameters of both sides, and the road.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Manoeuvre or file.
    pub road: String,
    /// Parameters of the plant.
    pub plant: vehicle::Parameters,
    /// Parameters of the controller.
    pub controller: lpv_mpc::Parameters,
    /// File of the controller's network; empty: the one that ships.
    pub network_file: String,
}

impl Settings {
    /// The defaults with the given assignments.
    ///
    /// The plant's preview takes the controller's sample time unless it is set itself: two clocks that differ are a trap.
    pub fn new(road: &str, assignments: &[String]) -> Result<Self> {
        let defaults = Self {
            road: road.to_owned(),
            plant: vehicle::Parameters::default(),
            controller: lpv_mpc::Parameters::adaptive(),
            network_file: String::new(),
        };
        defaults.with(assignments)
    }

    /// These settings with further assignments.
    ///
    /// # Errors
    /// If a name is unknown or a value is not what the parameter takes.
    pub fn with(self, assignments: &[String]) -> Result<Self> {
        let Self { mut road, plant, controller, mut network_file } = self;
        let (mut plant, mut controller) = (fields(&plant)?, fields(&controller)?);
        let (mut own_preview, mut other_period) = (false, false);
        for assignment in assignments {
            let (name, value) =
                assignment.split_once('=').with_context(|| format!("expected NAME=VALUE, got {assignment}"))?;
            match name.trim().split_once('.') {
                Some(("plant", "road")) => value.trim().clone_into(&mut road),
                Some(("plant", field)) => {
                    own_preview |= field == "preview_step";
                    assign::<vehicle::Parameters>(&mut plant, "plant", field, value.trim())?;
                }
                Some(("controller", "network_file")) => value.trim().clone_into(&mut network_file),
                Some(("controller", field)) => {
                    other_period |= field == "t_s";
                    assign::<lpv_mpc::Parameters>(&mut controller, "controller", field, value.trim())?;
                }
                _ => bail!("a name begins with plant. or controller., got {name}"),
            }
        }
        let mut settings = Self { road, plant: read(plant)?, controller: read(controller)?, network_file };
        if other_period && !own_preview {
            settings.plant.preview_step = settings.controller.t_s;
        }
        Ok(settings)
    }

    /// All names with their values, units and meanings, for people who look for one.
    pub fn described(&self) -> Result<Vec<Vec<String>>> {
        let described = Described::read()?;
        let mut rows = self.list()?;
        for row in &mut rows {
            let variable = row[0].split_once('.').and_then(|(side, name)| described.find(side, name));
            let unit = variable.and_then(|variable| variable.unit.clone()).unwrap_or_default();
            row.extend([unit, variable.map(|variable| variable.description.clone()).unwrap_or_default()]);
        }
        Ok(rows)
    }

    /// All names with their values.
    pub fn list(&self) -> Result<Vec<Vec<String>>> {
        let mut rows = vec![
            vec!["plant.road".to_owned(), self.road.clone()],
            vec!["controller.network_file".to_owned(), self.network_file.clone()],
        ];
        for (side, fields) in [("plant", fields(&self.plant)?), ("controller", fields(&self.controller)?)] {
            for (name, value) in fields {
                let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                rows.push(vec![format!("{side}.{name}"), value]);
            }
        }
        Ok(rows)
    }
}

/// Unit of a parameter of one side, if it has one.
pub fn unit(side: &str, name: &str) -> Option<String> {
    Described::read().ok()?.find(side, name)?.unit.clone()
}

/// Share of the letters from which on two names are alike: with less, a suggestion is farther from what was meant than none.
const ALIKE: f64 = 0.6;

/// What the FMUs' tables say of each name.
struct Described([(&'static str, Interface); 2]);

impl Described {
    fn read() -> Result<Self> {
        let plant = Interface::parse(include_str!("../../../modelDescription/plant.xml"))?;
        let controller = Interface::parse(include_str!("../../../modelDescription/controller.xml"))?;
        Ok(Self([("plant", plant), ("controller", controller)]))
    }

    fn find(&self, side: &str, name: &str) -> Option<&Variable> {
        self.0.iter().find(|(known, _)| *known == side)?.1.variable(name).ok()
    }
}

fn fields(parameters: &impl Serialize) -> Result<Map<String, Value>> {
    match serde_json::to_value(parameters)? {
        Value::Object(fields) => Ok(fields),
        other => bail!("parameters are not a flat structure but {other}"),
    }
}

fn read<T: DeserializeOwned>(fields: Map<String, Value>) -> Result<T> {
    Ok(serde_json::from_value(Value::Object(fields))?)
}

/// Puts a text into a field, as what the field is.
fn assign<T: DeserializeOwned>(fields: &mut Map<String, Value>, side: &str, name: &str, text: &str) -> Result<()> {
    let Some(old) = fields.get_mut(name) else {
        if let Some(variable) = Described::read()?.find(side, name).filter(|variable| variable.causality == "parameter")
        {
            bail!("{side}.{name} is a parameter of the FMU alone, no parameter here: {}", variable.description);
        }
        let nearest = fields
            .keys()
            .map(|known| (strsim::normalized_damerau_levenshtein(known, name), known))
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .filter(|(likeness, _)| *likeness >= ALIKE)
            .map_or_else(
                || ", see cargo fmu simulate --list".to_owned(),
                |(_, known)| format!(", did you mean {side}.{known}?"),
            );
        bail!("unknown parameter {side}.{name}{nearest}");
    };
    let wrong = |kind: &str| format!("{side}.{name} takes {kind}, got {text}");
    *old = match old {
        Value::Bool(_) => Value::Bool(text.parse().with_context(|| wrong("true or false"))?),
        Value::Number(number) if number.is_f64() => {
            let value: f64 = text.parse().with_context(|| wrong("a number"))?;
            serde_json::Number::from_f64(value).map(Value::Number).with_context(|| wrong("a finite number"))?
        }
        Value::Number(_) => {
            let value: i64 = text.parse().with_context(|| wrong("a whole number"))?;
            Value::from(value)
        }
        _ => Value::String(text.to_owned()),
    };
    // A name among others, or a whole number with a range: only the structure knows, and it does not say whose value it refuses.
    if fields[name].is_string() || fields[name].is_i64() {
        read::<T>(fields.clone()).with_context(|| format!("{side}.{name}"))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(assignments: &[&str]) -> Result<Settings> {
        let assignments: Vec<String> = assignments.iter().map(|&text| text.to_owned()).collect();
        Settings::new("general", &assignments)
    }

    #[test]
    fn values_arrive_as_what_they_are() {
        let settings = set(&["plant.speed=16", "controller.horizon = 20", "plant.seed=-3"]).unwrap();
        assert_eq!((settings.plant.speed, settings.plant.seed), (16.0, -3));
        assert_eq!(settings.controller.horizon, 20);
    }

    #[test]
    fn the_preview_follows_the_sample_time_unless_it_is_set() {
        assert_eq!(set(&["controller.t_s=0.05"]).unwrap().plant.preview_step, 0.05);
        let own = set(&["plant.preview_step=0.02", "controller.t_s=0.05"]).unwrap();
        assert_eq!(own.plant.preview_step, 0.02);
    }

    #[test]
    fn further_assignments_leave_the_others_alone() {
        let settings = set(&["plant.speed=16", "plant.preview_step=0.02"]).unwrap();
        let further = settings.with(&["controller.horizon=12".to_owned()]).unwrap();
        assert_eq!((further.plant.speed, further.plant.preview_step, further.controller.horizon), (16.0, 0.02, 12));
        // The clocks of the two sides agree from the start.
        assert_eq!(set(&[]).unwrap().plant.preview_step, set(&[]).unwrap().controller.t_s);
    }

    #[test]
    fn a_refused_value_is_named() {
        let message = |assignment| format!("{:#}", set(&[assignment]).unwrap_err());
        let text = message("controller.adaptation=foo");
        assert!(text.starts_with("controller.adaptation: unknown variant `foo`, expected one of"), "{text}");
        let text = message("controller.horizon=-1");
        assert!(text.starts_with("controller.horizon: invalid value: integer `-1`"), "{text}");
    }

    #[test]
    fn every_parameter_of_the_list_is_described() {
        for row in set(&[]).unwrap().described().unwrap() {
            assert!(row.len() == 4 && !row[3].is_empty(), "{row:?}");
        }
    }

    #[test]
    fn a_misspelt_name_is_answered_with_the_nearest() {
        let message = |assignment| set(&[assignment]).unwrap_err().to_string();
        assert_eq!(
            message("controller.horzion=5"),
            "unknown parameter controller.horzion, did you mean controller.horizon?"
        );
        assert_eq!(
            message("controller.hold_preview=true"),
            "controller.hold_preview is a parameter of the FMU alone, no parameter here: Whether only element 1 of each preview \
             is given and holds for the others"
        );
        assert_eq!(message("plant.colour=red"), "unknown parameter plant.colour, see cargo fmu simulate --list");
        assert_eq!(message("speed=5"), "a name begins with plant. or controller., got speed");
        assert_eq!(message("plant.m=heavy"), "plant.m takes a number, got heavy");
        assert_eq!(message("plant.m"), "expected NAME=VALUE, got plant.m");
    }
}

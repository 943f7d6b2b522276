//! The manoeuvres by name.

use serde::{Deserialize, Serialize};

use super::{Tables, general, iso3888, lane_change, manoeuvres};
use crate::{Error, Parameters, events::Form};

/// What a manoeuvre takes from the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Settings {
    /// Constant speed [m/s].
    pub speed: f64,
    /// Radius of the circle, positive to the left [m].
    pub radius: f64,
    /// Width of the vehicle [m].
    pub width: f64,
}

impl Settings {
    pub fn of(p: &Parameters) -> Self {
        Self { speed: p.speed, radius: p.radius, width: p.width }
    }
}

/// How a manoeuvre makes its tables.
type Make = fn(&Settings) -> Tables;

/// Every manoeuvre.
const MANOEUVRES: [(&str, Make); 9] = [
    ("double_lane_change", |s| lane_change::tables(s.speed)),
    ("general", |_| general::tables()),
    ("iso_3888_1", |s| iso3888::tables(&iso3888::Course::first(s.width), s.speed)),
    ("iso_3888_2", |s| iso3888::tables(&iso3888::Course::second(s.width), s.speed)),
    ("constant_radius", |s| manoeuvres::constant_radius(s.radius, s.speed)),
    ("step_steer", |s| manoeuvres::open_loop(Form::Step, s.speed)),
    ("sine_with_dwell", |s| manoeuvres::open_loop(Form::SineWithDwell, s.speed)),
    ("straight", |s| manoeuvres::straight(s.speed)),
    ("circuit", |_| manoeuvres::circuit()),
];

/// The names of the manoeuvres.
pub const NAMES: [&str; MANOEUVRES.len()] = {
    let mut names = [""; MANOEUVRES.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = MANOEUVRES[i].0;
        i += 1;
    }
    names
};

/// The tables of the manoeuvre with this name.
pub(super) fn tables(name: &str, settings: &Settings) -> Result<Tables, Error> {
    MANOEUVRES
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, make)| make(settings))
        .ok_or_else(|| Error::UnknownRoad { name: name.to_owned(), known: NAMES.join(", ") })
}

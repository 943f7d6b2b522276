//! Roads: curvature, speed, wind, slopes and friction over arc length, and the preview that a controller sees.

mod csv;
mod general;
mod iso3888;
mod lane_change;
mod line;
mod manoeuvres;
mod named;
mod preview;
mod profile;
mod schedule;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

pub use line::Pose;
pub use named::NAMES;
pub use preview::{PREVIEW, Preview};
pub use profile::Profile;

use crate::{Error, Parameters, Scalar, events::Form};
use line::Line;
use named::Settings;
use schedule::Schedule;

/// Where a road came from; enough to build it again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Source {
    Named { name: String, settings: Settings },
    Csv { text: String, tolerance: f64 },
}

/// The tables that a road consists of.
#[derive(Debug, Clone)]
struct Tables {
    /// Length [m].
    length: f64,
    /// Whether the end is the start.
    closed: bool,
    /// Curvature over arc length [1/m].
    kappa: Profile,
    /// Wanted speed over arc length [m/s].
    v_x: Profile,
    /// The manoeuvre's own wind.
    wind: Option<Wind>,
    /// Grade and bank over arc length [rad].
    slopes: Option<[Profile; 2]>,
    /// Factor on the friction over arc length [1].
    friction: Option<Profile>,
    /// Places of cones, global frame [m].
    cones: Vec<[f64; 2]>,
    /// Open-loop steering.
    steering: Option<Form>,
    /// Place and heading of the start.
    start: Pose,
}

impl Tables {
    /// A plain road: no wind, no slopes, no cones.
    fn plain(length: f64, kappa: Profile, v_x: Profile) -> Self {
        Self {
            length,
            closed: false,
            kappa,
            v_x,
            wind: None,
            slopes: None,
            friction: None,
            cones: Vec::new(),
            steering: None,
            start: Pose::default(),
        }
    }
}

/// A wind that blows in one direction with a speed that changes along the road.
#[derive(Debug, Clone)]
struct Wind {
    /// Speed over arc length [m/s].
    speed: Profile,
    /// Unit vector of the direction it blows to, global frame.
    direction: [f64; 2],
}

/// A road: immutable, cheap to clone.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Source", into = "Source")]
pub struct Road {
    source: Arc<Source>,
    tables: Arc<Tables>,
    schedule: Arc<Schedule>,
    line: Arc<Line>,
}

impl PartialEq for Road {
    fn eq(&self, other: &Self) -> bool {
        self.source == other.source
    }
}

impl TryFrom<Source> for Road {
    type Error = Error;

    fn try_from(source: Source) -> Result<Self, Error> {
        let tables = match &source {
            Source::Named { name, settings } => named::tables(name, settings)?,
            Source::Csv { text, tolerance } => csv::tables(text, *tolerance)?,
        };
        let schedule = Schedule::new(&tables.v_x, tables.length, tables.closed);
        let line = Line::new(&tables.kappa, tables.length, tables.closed, tables.start);
        Ok(Self {
            source: Arc::new(source),
            tables: Arc::new(tables),
            schedule: Arc::new(schedule),
            line: Arc::new(line),
        })
    }
}

impl From<Road> for Source {
    fn from(road: Road) -> Self {
        Arc::unwrap_or_clone(road.source)
    }
}

impl Road {
    /// The manoeuvre of this name, with the parameters' `speed`, `radius` and `width` where it wants them.
    pub fn named(name: &str, parameters: &Parameters) -> Result<Self, Error> {
        Source::Named { name: name.to_owned(), settings: Settings::of(parameters) }.try_into()
    }

    /// A road from a table of comma-separated values with a header line, in SI units: `x,y,v_x` for points, or
    /// `s,kappa,v_x`; `grade`, `bank` and `mu` may follow. The line through points is smoothed as far as the default
    /// parameters' `road_tolerance` allows.
    pub fn from_csv(text: &str) -> Result<Self, Error> {
        Self::from_csv_within(text, Parameters::default().road_tolerance)
    }

    /// The same with a tolerance of one's own [m], root mean square; 0 passes through every point.
    pub fn from_csv_within(text: &str, tolerance: f64) -> Result<Self, Error> {
        Source::Csv { text: text.to_owned(), tolerance }.try_into()
    }

    /// Length [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.tables.length
    }

    /// Whether the end is the start again.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.tables.closed
    }

    /// Time that the reference needs from the start to the end [s].
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.schedule.duration()
    }

    /// Place and heading of the start.
    #[must_use]
    pub fn start(&self) -> Pose {
        self.tables.start
    }

    /// Place and heading at arc length `s`; straight on before the start and beyond the end.
    #[must_use]
    pub fn pose(&self, s: f64) -> Pose {
        self.line.pose(s)
    }

    /// The path itself, for projections.
    pub(crate) fn line(&self) -> &Line {
        &self.line
    }

    /// Places of cones, global frame [m].
    #[must_use]
    pub fn cones(&self) -> &[[f64; 2]] {
        &self.tables.cones
    }

    /// Open-loop steering of the manoeuvre.
    #[must_use]
    pub fn steering(&self) -> Option<Form> {
        self.tables.steering
    }

    /// Arc length inside the table.
    #[inline]
    fn inside<D: Scalar>(&self, s: D) -> D {
        let Tables { length, closed, .. } = *self.tables;
        if closed { s - (s.re() / length).floor() * length } else { s }
    }

    /// Curvature at arc length `s` [1/m]; straight beyond the end.
    #[inline]
    pub fn curvature<D: Scalar>(&self, s: D) -> D {
        let s = self.inside(s);
        if s.re() > self.tables.length { D::zero() } else { self.tables.kappa.at(s) }
    }

    /// Wanted speed at arc length `s` [m/s].
    #[must_use]
    pub fn speed(&self, s: f64) -> f64 {
        self.tables.v_x.at(self.inside(s))
    }

    /// The manoeuvre's own wind at arc length `s`, global frame [m/s].
    #[inline]
    pub fn wind<D: Scalar>(&self, s: D) -> [D; 2] {
        match &self.tables.wind {
            None => [D::zero(), D::zero()],
            Some(Wind { speed, direction }) => {
                let speed = speed.at(self.inside(s));
                [speed * direction[0], speed * direction[1]]
            }
        }
    }

    /// Whether the road has slopes of its own.
    #[inline]
    pub(crate) fn has_slopes(&self) -> bool {
        self.tables.slopes.is_some()
    }

    /// Grade (uphill positive) and bank (left side up positive) at arc length `s` [rad].
    pub fn slopes<D: Scalar>(&self, s: D) -> [D; 2] {
        match &self.tables.slopes {
            None => [D::zero(), D::zero()],
            Some([grade, bank]) => [grade.at(self.inside(s)), bank.at(self.inside(s))],
        }
    }

    /// Whether the road has friction of its own.
    #[inline]
    pub(crate) fn has_friction(&self) -> bool {
        self.tables.friction.is_some()
    }

    /// Factor on the friction at arc length `s` [1].
    pub fn friction<D: Scalar>(&self, s: D) -> D {
        self.tables.friction.as_ref().map_or(D::one(), |friction| friction.at(self.inside(s)))
    }
}

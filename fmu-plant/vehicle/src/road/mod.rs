//! Roads: curvature, speed and wind over arc length, and the preview that a controller sees.

mod csv;
mod general;
mod lane_change;
mod profile;
mod schedule;

use std::sync::Arc;

use nalgebra::SVector;
use num_dual::Dual64;
use serde::{Deserialize, Serialize};

pub use profile::Profile;

use crate::{Error, Parameters, Scalar};
use schedule::Schedule;

/// Elements of the preview: now and the next 40 sample times.
pub const PREVIEW: usize = 41;

/// The names of the manoeuvres.
pub const NAMES: [&str; 2] = ["double_lane_change", "general"];

/// Curvature and speed of the path now and at the next 40 sample times.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Preview {
    /// Curvature, positive to the left [1/m].
    pub kappa_ref: SVector<f64, PREVIEW>,
    /// Wanted speed [m/s].
    pub v_x_ref: SVector<f64, PREVIEW>,
}

impl Default for Preview {
    fn default() -> Self {
        Self { kappa_ref: SVector::zeros(), v_x_ref: SVector::zeros() }
    }
}

/// A place and a heading in the global frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// Along the start of the road [m].
    pub x: f64,
    /// To the left of it [m].
    pub y: f64,
    /// Heading [rad].
    pub psi: f64,
}

/// Where a road came from; enough to build it again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Source {
    Named { name: String, speed: f64 },
    Csv { text: String },
}

/// The tables that a road consists of.
#[derive(Debug, Clone)]
struct Tables {
    /// Length [m].
    length: f64,
    /// Curvature over arc length [1/m].
    kappa: Profile,
    /// Wanted speed over arc length [m/s].
    v_x: Profile,
    /// The manoeuvre's own wind over arc length, where it blows to in the global frame [m/s].
    wind: Option<Wind>,
    /// Place and heading of the start.
    start: Pose,
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
            Source::Named { name, speed } => match name.as_str() {
                "double_lane_change" => lane_change::tables(*speed),
                "general" => general::tables(),
                _ => return Err(Error::UnknownRoad { name: name.clone(), known: NAMES.join(", ") }),
            },
            Source::Csv { text } => csv::tables(text)?,
        };
        let schedule = Schedule::new(&tables.v_x, tables.length);
        Ok(Self { source: Arc::new(source), tables: Arc::new(tables), schedule: Arc::new(schedule) })
    }
}

impl From<Road> for Source {
    fn from(road: Road) -> Self {
        Arc::unwrap_or_clone(road.source)
    }
}

impl Road {
    /// The manoeuvre of this name, at the parameters' `speed` if it has no speed of its own.
    pub fn named(name: &str, parameters: &Parameters) -> Result<Self, Error> {
        Source::Named { name: name.to_owned(), speed: parameters.speed }.try_into()
    }

    /// A road from a table of comma-separated values with a header line: `s,kappa,v_x` or `x,y,v_x`, in metres, 1/m and
    /// m/s.
    pub fn from_csv(text: &str) -> Result<Self, Error> {
        Source::Csv { text: text.to_owned() }.try_into()
    }

    /// Length [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.tables.length
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

    /// Curvature at arc length `s` [1/m]; straight beyond the end.
    #[inline]
    pub fn curvature<D: Scalar>(&self, s: D) -> D {
        if s.re() > self.tables.length { D::zero() } else { self.tables.kappa.at(s) }
    }

    /// Wanted speed at arc length `s` [m/s].
    #[must_use]
    pub fn speed(&self, s: f64) -> f64 {
        self.tables.v_x.at(s)
    }

    /// The manoeuvre's own wind at arc length `s`, global frame [m/s].
    #[inline]
    pub fn wind<D: Scalar>(&self, s: D) -> [D; 2] {
        match &self.tables.wind {
            None => [D::zero(), D::zero()],
            Some(Wind { speed, direction }) => {
                let speed = speed.at(s);
                [speed * direction[0], speed * direction[1]]
            }
        }
    }

    /// What lies ahead of arc length `s`: element j is where the reference, passing `s` now, will be after `j * step`
    /// seconds.
    #[must_use]
    pub fn preview(&self, s: f64, step: f64) -> Preview {
        let mut preview = Preview::default();
        self.look_ahead(s, step, |j, ahead| {
            preview.kappa_ref[j] = self.curvature(ahead);
            preview.v_x_ref[j] = self.speed(ahead);
        });
        preview
    }

    /// Time derivative of the preview while the arc length grows at `s_dot`.
    #[must_use]
    pub fn preview_rate(&self, s: f64, s_dot: f64, step: f64) -> Preview {
        let mut rate = Preview::default();
        let pace = s_dot / self.schedule.speed(s);
        self.look_ahead(s, step, |j, ahead| {
            // Every place of the reference's schedule moves at the speed there, times the pace of the whole.
            let ahead = Dual64::new(ahead, pace * self.schedule.speed(ahead));
            rate.kappa_ref[j] = self.curvature(ahead).eps;
            rate.v_x_ref[j] = self.tables.v_x.at(ahead).eps;
        });
        rate
    }

    fn look_ahead(&self, s: f64, step: f64, mut each: impl FnMut(usize, f64)) {
        let now = self.schedule.time(s);
        each(0, s);
        let mut after = 0.0;
        for j in 1..PREVIEW {
            after += step;
            each(j, self.schedule.place(now + after));
        }
    }
}

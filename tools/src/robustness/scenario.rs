//! One closed loop: which road, which parameters, what is asked in between; and what came out.

use anyhow::Result;
use vehicle::{Road, Vehicle};

use crate::recording::{Recording, Tracking};
use crate::simulate::settings::Settings;
use crate::simulate::{build, native};

/// Where a scenario drives.
#[derive(Clone, Debug, PartialEq)]
pub enum Place {
    /// A manoeuvre's name or a file.
    Named(String),
    /// The text of a road file.
    Table(String),
}

/// One closed loop that can be driven.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// What is particular about it, for a table.
    pub name: String,
    place: Place,
    /// Parameters as `side.name=value`.
    assignments: Vec<String>,
    /// End of the run [s]; none: the road's end.
    stop: Option<f64>,
    /// Wanted speed [m/s] over time [s], in place of the road's own.
    speed: Option<fn(f64) -> f64>,
    /// Whether the controller is told of the friction ahead.
    sees_friction: bool,
}

impl Scenario {
    /// A manoeuvre with the defaults of both sides.
    pub fn on(road: &str) -> Self {
        Self {
            name: road.to_owned(),
            place: Place::Named(road.to_owned()),
            assignments: Vec::new(),
            stop: None,
            speed: None,
            sees_friction: true,
        }
    }

    /// The double lane change at a speed [m/s].
    pub fn lane_change(speed: f64) -> Self {
        Self::on("double_lane_change").with(&[("plant.speed", speed)]).called(format!("{speed:.1} m/s"))
    }

    /// A road that a table describes.
    pub fn along(table: String) -> Self {
        Self { place: Place::Table(table), ..Self::on("") }
    }

    #[must_use]
    pub fn called(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// With these parameters.
    #[must_use]
    pub fn with(mut self, values: &[(&str, f64)]) -> Self {
        self.assignments.extend(values.iter().map(|(name, value)| format!("{name}={value}")));
        self
    }

    /// With parameters as a user writes them.
    #[must_use]
    pub fn assigned(mut self, assignments: &[String]) -> Self {
        self.assignments.extend_from_slice(assignments);
        self
    }

    /// Ends at a time [s].
    #[must_use]
    pub fn until(self, stop: f64) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// Asks for a speed [m/s] over time [s] in place of the road's own.
    #[must_use]
    pub fn at_speeds(self, speed: fn(f64) -> f64) -> Self {
        Self { speed: Some(speed), ..self }
    }

    /// Without a preview of the friction: the controller's parameter holds.
    #[must_use]
    pub fn unaware_of_friction(self) -> Self {
        Self { sees_friction: false, ..self }
    }

    /// With actuators that lag by `tau` [s] behind and act `delay` [s] late, and a controller that assumes `assumed` [s].
    #[must_use]
    pub fn slowed(self, tau: f64, delay: f64, assumed: f64) -> Self {
        self.with(&[
            ("plant.tau_delta", tau),
            ("controller.tau_delta", tau),
            // The controller has one delay for both commands.
            ("plant.delay_delta", delay),
            ("plant.delay_a_x", delay),
            ("controller.input_delay", assumed),
        ])
    }

    /// Drives it at communication steps of `step` [s]; none if the plant refuses to go on, as that of a car that spins may.
    ///
    /// # Errors
    /// If a parameter is unknown or out of its range.
    pub fn drive(&self, step: f64) -> Result<Option<Recording>> {
        let road = match &self.place {
            Place::Named(name) => name,
            // Only until the table's own road replaces it below.
            Place::Table(_) => "straight",
        };
        let settings = Settings::new(road, &self.assignments)?;
        let t_s = settings.controller.t_s;
        let (mut plant, mut controller) = build(&settings)?;
        if let Place::Table(text) = &self.place {
            plant = Vehicle::new(settings.plant, Road::from_csv(text)?)?;
        }
        let alter = |t: f64, seen: &mut lpv_mpc::Inputs| {
            if !self.sees_friction {
                seen.mu_ref.fill(0.0);
            }
            if let Some(speed) = self.speed {
                for (i, v_x) in seen.v_x_ref.iter_mut().enumerate() {
                    *v_x = speed(t + i as f64 * t_s);
                }
            }
        };
        Ok(native::drive_through(&mut plant, &mut controller, step, self.stop, alter, |_| {}).ok())
    }
}

/// The figures of a run that the sweeps compare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Largest lateral error [m].
    pub e_y: f64,
    /// Largest speed error [m/s].
    pub speed: f64,
}

impl Figures {
    /// Of a run; infinite if there is none.
    pub fn of(run: Option<&Recording>) -> Self {
        let nothing = Self { e_y: f64::INFINITY, speed: f64::INFINITY };
        run.map_or(nothing, |run| {
            let tracking = Tracking::of(run);
            Self { e_y: tracking.e_y_max, speed: tracking.speed_max }
        })
    }

    /// The worse of two, each figure by itself; a NaN is the worst.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        let worse = |a: f64, b: f64| if a.is_nan() || a > b { a } else { b };
        Self { e_y: worse(self.e_y, other.e_y), speed: worse(self.speed, other.speed) }
    }
}

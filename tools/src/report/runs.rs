//! Every closed loop of the report: who drives, where, and in which wind.

use anyhow::{Context, Result};
use lpv_mpc::Controller;
use rayon::prelude::*;
use vehicle::Vehicle;

use super::reference::Reference;
use crate::baselines::Baseline;
use crate::plots::{BLUE, GREEN, GREY, ORANGE, PURPLE, RED, TEAL};
use crate::recording::{Recording, Tracking};
use crate::simulate::build;
pub use crate::simulate::journey::ROAD;
use crate::simulate::native::{Driver, drive_in};
use crate::simulate::settings::Settings;

/// Communication step of all comparisons [s]: fine enough that nobody's latency matters.
pub const STEP: f64 = 0.001;
/// Colour of the nonlinear MPC that has our reference: far from the other seven also for eyes that do not tell red from green.
const OLIVE: &str = "#7d8f1c";

/// Where the controllers are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Situation {
    /// The double lane change at 14 m/s without wind.
    LaneChange,
    /// The same in a head wind of 20 to 50 m/s.
    LaneChangeWind,
    /// The general track, which has its own wind.
    General,
}

impl Situation {
    /// All of them, in the order of the page.
    pub const ALL: [Self; 3] = [Self::LaneChange, Self::LaneChangeWind, Self::General];

    /// Name in files and on the page.
    pub fn id(self) -> &'static str {
        match self {
            Self::LaneChange => "lane_change",
            Self::LaneChangeWind => "lane_change_wind",
            Self::General => "general",
        }
    }

    /// What it is called.
    pub fn title(self) -> &'static str {
        match self {
            Self::LaneChange => "Lane change",
            Self::LaneChangeWind => "Lane change in wind",
            Self::General => "General track in wind",
        }
    }

    /// The plant's road.
    pub fn road(self) -> &'static str {
        match self {
            Self::LaneChange | Self::LaneChangeWind => "double_lane_change",
            Self::General => "general",
        }
    }
}

/// What the nonlinear MPC knows of the wind, and what its increments of steering are weighed against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nonlinear {
    /// What blows now, as much as a controller with perfect sensors can know; zero, as in textbooks and in the paper.
    Felt,
    /// What is going to blow; zero.
    Foreseen,
    /// What blows now; the increments of a car that follows the path exactly, as ours are.
    Ideal,
}

/// Who drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Who {
    /// The controller of this project as it ships.
    Ours,
    /// What a user would otherwise pick.
    Baseline(Baseline),
    /// Nonlinear MPC that knows the plant, solved offline and stored.
    Nonlinear(Nonlinear),
}

impl Who {
    /// All of them, ours first.
    pub const ALL: [Self; 8] = [
        Self::Ours,
        Self::Nonlinear(Nonlinear::Felt),
        Self::Nonlinear(Nonlinear::Foreseen),
        Self::Nonlinear(Nonlinear::Ideal),
        Self::Baseline(Baseline::LinearFixed),
        Self::Baseline(Baseline::LinearMeasured),
        Self::Baseline(Baseline::Stanley),
        Self::Baseline(Baseline::PurePursuit),
    ];

    /// Name for tables and legends.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ours => "LPV-MPC (ours)",
            Self::Nonlinear(Nonlinear::Felt) => "nonlinear MPC (offline), wind felt",
            Self::Nonlinear(Nonlinear::Foreseen) => "nonlinear MPC (offline), wind foreseen",
            Self::Nonlinear(Nonlinear::Ideal) => "nonlinear MPC (offline), wind felt, our increments",
            Self::Baseline(baseline) => baseline.name(),
        }
    }

    /// Name in files.
    pub fn id(self) -> &'static str {
        match self {
            Self::Ours => "ours",
            Self::Nonlinear(Nonlinear::Felt) => "nonlinear_felt",
            Self::Nonlinear(Nonlinear::Foreseen) => "nonlinear",
            Self::Nonlinear(Nonlinear::Ideal) => "nonlinear_ideal",
            Self::Baseline(Baseline::LinearFixed) => "lmpc",
            Self::Baseline(Baseline::LinearMeasured) => "lmpc_measured",
            Self::Baseline(Baseline::Stanley) => "stanley",
            Self::Baseline(Baseline::PurePursuit) => "pure_pursuit",
        }
    }

    /// Colour of all its curves.
    pub fn color(self) -> &'static str {
        match self {
            Self::Ours => BLUE,
            Self::Nonlinear(Nonlinear::Felt) => TEAL,
            Self::Nonlinear(Nonlinear::Foreseen) => GREY,
            Self::Nonlinear(Nonlinear::Ideal) => OLIVE,
            Self::Baseline(Baseline::LinearFixed) => ORANGE,
            Self::Baseline(Baseline::LinearMeasured) => RED,
            Self::Baseline(Baseline::Stanley) => GREEN,
            Self::Baseline(Baseline::PurePursuit) => PURPLE,
        }
    }
}

/// What all tables quote of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Position, course, heading and speed.
    pub tracking: Tracking,
}

impl Figures {
    /// Of a recording.
    pub fn of(recording: &Recording) -> Self {
        Self { tracking: Tracking::of(recording) }
    }

    /// Whether the car stayed on the road.
    pub fn stayed(&self) -> bool {
        self.tracking.e_y_max <= ROAD
    }
}

/// One driven loop.
#[derive(Clone, Debug)]
pub struct Run {
    /// Where.
    pub situation: Situation,
    /// Who drove.
    pub who: Who,
    /// What happened.
    pub recording: Recording,
    /// The figures of it.
    pub figures: Figures,
}

/// The plant and our controller of a situation, with parameters as a user writes them.
pub fn prepare(situation: Situation, assignments: &[String]) -> Result<(Vehicle, Controller, Settings)> {
    let settings = Settings::new(situation.road(), assignments)?;
    let (plant, controller) = build(&settings)?;
    Ok((plant, controller, settings))
}

/// Drives a situation in its wind.
pub fn drive(situation: Situation, plant: &mut Vehicle, driver: &mut impl Driver, step: f64) -> Result<Recording> {
    let world = |t: f64, _: &mut lpv_mpc::Inputs, acting: &mut vehicle::Inputs| {
        if situation == Situation::LaneChangeWind {
            acting.wind_speed = wind(t);
            acting.wind_direction = std::f64::consts::PI;
        }
    };
    drive_in(plant, driver, step, None, world, |_| {})
}

/// Speed of the wind of [`Situation::LaneChangeWind`] [m/s] at a time [s].
///
/// It blows against the first heading, as on the general track, and between the paper's 20 and 50 m/s; two waves fit into the
/// manoeuvre.
fn wind(t: f64) -> f64 {
    35.0 - 15.0 * (std::f64::consts::TAU * t / 7.0).cos()
}

/// One run of the comparison.
pub fn run(situation: Situation, who: Who, reference: &Reference) -> Result<Run> {
    let (mut plant, mut controller, settings) = prepare(situation, &[])?;
    let recording = match who {
        Who::Ours => drive(situation, &mut plant, &mut controller, STEP)?,
        Who::Baseline(baseline) => {
            let mut driver = baseline.driver(&settings.controller, plant.road());
            drive(situation, &mut plant, &mut driver, STEP)?
        }
        Who::Nonlinear(nonlinear) => reference.run(&stored(situation, nonlinear))?,
    };
    let figures = Figures::of(&recording);
    Ok(Run { situation, who, recording, figures })
}

/// Name of the nonlinear MPC's run; without wind there is none to feel.
pub fn stored(situation: Situation, nonlinear: Nonlinear) -> String {
    let felt = nonlinear != Nonlinear::Foreseen && situation != Situation::LaneChange;
    let ideal = nonlinear == Nonlinear::Ideal;
    format!("{}{}{}", situation.id(), if felt { "_felt" } else { "" }, if ideal { "_ideal" } else { "" })
}

/// All runs, in the order of the page; `tick` is called after each.
pub fn all(reference: &Reference, tick: impl Fn() + Sync) -> Result<Vec<Run>> {
    let pairs: Vec<(Situation, Who)> =
        Situation::ALL.into_iter().flat_map(|situation| Who::ALL.map(|who| (situation, who))).collect();
    pairs
        .into_par_iter()
        .map(|(situation, who)| {
            let run =
                run(situation, who, reference).with_context(|| format!("{} on {}", who.name(), situation.title()));
            tick();
            run
        })
        .collect()
}

/// The controller with parameters as a user writes them, at a communication step.
pub fn ours(situation: Situation, assignments: &[&str], step: f64) -> Result<Figures> {
    let assignments: Vec<String> = assignments.iter().map(|&text| text.to_owned()).collect();
    let (mut plant, mut controller, _) = prepare(situation, &assignments)?;
    Ok(Figures::of(&drive(situation, &mut plant, &mut controller, step)?))
}

/// LMPC at the measured speed on the general track with other weights on the steering increment [1/rad2].
pub fn weighted(r_delta: f64) -> Result<Figures> {
    let (mut plant, _, mut settings) = prepare(Situation::General, &[])?;
    settings.controller.r_delta = r_delta;
    let mut driver = Baseline::LinearMeasured.driver(&settings.controller, plant.road());
    Ok(Figures::of(&drive(Situation::General, &mut plant, &mut driver, STEP)?))
}

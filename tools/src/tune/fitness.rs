//! How good a set of parameters is: closed loops of the native plant as one number, less is better.
//!
//! A run's own figure is the mean of its three RMSE (lateral error, heading error, speed), each divided by the paper's, so 1 is
//! what the paper reports. Its scalarisation is not printed; this one makes the three comparable without a new weight.

use anyhow::{Result, bail};
use lpv_mpc::Controller;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::situation::{self, Situation};
use crate::recording::{PAPER, Recording, Tracking};
use crate::simulate::native::{Driver, Shown};
use crate::simulate::settings::Settings;
use crate::simulate::{build, native};

/// Lateral error beyond which a car has left the road [m].
const ROAD: f64 = 2.0;
/// Figure of a run that left the road at its very end; one that never got going has twice that. Runs on the road stay below: 2 m,
/// a radian and 10 m/s all the time would be 270.
const LOST: f64 = 1000.0;

/// What is driven, and how the runs become one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// RMSE of speed, position and heading on the manoeuvre as it is, as shares of the paper's
    Paper,
    /// The manoeuvre under delay, lag, noise, low friction, gusts and other speeds: half the mean and half the worst of the
    /// runs, each as a share of what the present parameters reach there
    Robust,
}

/// A fitness that is ready to be asked.
#[derive(Clone, Debug)]
pub struct Fitness {
    kind: Kind,
    step: f64,
    situations: Vec<(Situation, Settings)>,
    /// Names of the parameters that candidates give values to, without the side.
    names: Vec<String>,
    /// Figures of the present parameters, one for each situation.
    present: Vec<f64>,
}

impl Fitness {
    /// Prepares the manoeuvres that a tuning sees; `set` applies to all of them.
    ///
    /// # Errors
    /// If a parameter is unknown or the present ones cannot be driven.
    pub fn training(kind: Kind, road: &str, set: &[String], step: f64, names: &[String]) -> Result<Self> {
        let situations = match kind {
            Kind::Paper => situation::plain(road),
            Kind::Robust => situation::ensemble(road),
        };
        Self::over(kind, situations, set, step, names)
    }

    /// Prepares the manoeuvres that it does not see.
    ///
    /// # Errors
    /// If a parameter is unknown or the present ones cannot be driven.
    pub fn held_out(kind: Kind, road: &str, set: &[String], step: f64, names: &[String]) -> Result<Self> {
        Self::over(kind, situation::held_out(road, kind == Kind::Robust), set, step, names)
    }

    fn over(kind: Kind, situations: Vec<Situation>, set: &[String], step: f64, names: &[String]) -> Result<Self> {
        let situations = situations
            .into_iter()
            .map(|situation| {
                let assignments: Vec<String> = set.iter().chain(&situation.assignments).cloned().collect();
                let settings = Settings::new(&situation.road, &assignments)?;
                build(&settings)?;
                Ok((situation, settings))
            })
            .collect::<Result<Vec<_>>>()?;
        let mut fitness = Self { kind, step, situations, names: names.to_vec(), present: Vec::new() };
        fitness.present = fitness.situations.par_iter().map(|(_, settings)| figure(settings, step)).collect();
        Ok(fitness)
    }

    /// Names of the situations, in their order.
    pub fn titles(&self) -> Vec<String> {
        self.situations.iter().map(|(situation, _)| situation.title()).collect()
    }

    /// Figures of the present parameters.
    pub fn present(&self) -> &[f64] {
        &self.present
    }

    /// Figures of a candidate, one for each situation.
    pub fn figures(&self, values: &[f64]) -> Vec<f64> {
        self.situations
            .par_iter()
            .map(|(_, settings)| {
                self.with(settings, values).map_or(2.0 * LOST, |settings| figure(&settings, self.step))
            })
            .collect()
    }

    /// The figures as one number.
    pub fn score(&self, figures: &[f64]) -> f64 {
        let count = figures.len().max(1) as f64;
        match self.kind {
            Kind::Paper => figures.iter().sum::<f64>() / count,
            Kind::Robust => {
                let ratios = || figures.iter().zip(&self.present).map(|(figure, present)| figure / present);
                0.5 * (ratios().sum::<f64>() / count + ratios().fold(0.0, f64::max))
            }
        }
    }

    /// The recordings of a candidate, or of the present parameters, in the first situation.
    pub fn picture(&self, values: Option<&[f64]>) -> Option<Recording> {
        let (_, settings) = self.situations.first()?;
        let settings = values.map_or_else(|| Ok(settings.clone()), |values| self.with(settings, values)).ok()?;
        drive(&settings, self.step)
    }

    /// A situation with a candidate's values.
    fn with(&self, settings: &Settings, values: &[f64]) -> Result<Settings> {
        let assignments: Vec<String> =
            self.names.iter().zip(values).map(|(name, value)| format!("controller.{name}={value}")).collect();
        settings.clone().with(&assignments)
    }
}

/// A controller that gives up once the car has left the road: what a spinning car does further costs time and says nothing.
struct OnTheRoad {
    controller: Controller,
    /// When it left [s].
    left: Option<f64>,
}

impl Driver for OnTheRoad {
    fn advance(&mut self, t: f64, h: f64, seen: &lpv_mpc::Inputs) -> Result<()> {
        if seen.e_y.is_nan() || seen.e_y.abs() > ROAD {
            self.left = Some(t);
            bail!("the car left the road at {t} s");
        }
        Driver::advance(&mut self.controller, t, h, seen)
    }

    fn shown(&self) -> Shown {
        self.controller.shown()
    }
}

fn drive(settings: &Settings, step: f64) -> Option<Recording> {
    let (mut plant, mut controller) = build(settings).ok()?;
    native::drive(&mut plant, &mut controller, step, None, |_| {}).ok()
}

/// A run's figure: of one that lost the road the less, the farther it got, so that a search sees where better ones are.
fn figure(settings: &Settings, step: f64) -> f64 {
    let Ok((mut plant, controller)) = build(settings) else { return 2.0 * LOST };
    let duration = plant.road().duration();
    let mut driver = OnTheRoad { controller, left: None };
    match native::drive(&mut plant, &mut driver, step, None, |_| {}) {
        Ok(recording) => judge(&Tracking::of(&recording)),
        // What the plant refuses to compute is a car that spins, wherever it was.
        Err(_) => LOST * (2.0 - driver.left.map_or(0.0, |t| (t / duration).min(1.0))),
    }
}

fn judge(tracking: &Tracking) -> f64 {
    let Tracking { e_y_rms, e_psi_rms, speed_rms, .. } = tracking;
    let shares = [e_y_rms / PAPER.e_y_rms, e_psi_rms / PAPER.e_psi_rms, speed_rms / PAPER.speed_rms];
    let figure = shares.iter().sum::<f64>() / 3.0;
    if figure.is_finite() { figure.min(LOST) } else { 2.0 * LOST }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lane_change(names: &[&str]) -> Fitness {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        // Communication steps of one sample keep the test quick.
        Fitness::training(Kind::Paper, "double_lane_change", &[], 0.033, &names).unwrap()
    }

    #[test]
    fn the_papers_own_errors_have_the_figure_1() {
        assert!((judge(&PAPER) - 1.0).abs() < 1e-15);
        assert_eq!(judge(&Tracking { e_y_rms: f64::NAN, ..PAPER }), 2.0 * LOST);
    }

    #[test]
    fn a_candidate_that_leaves_the_road_gets_a_finite_penalty_above_every_run_on_it() {
        let names = ["delta_max".to_owned()];
        // Wheels that hardly turn: the car goes straight on where the road bends.
        let stuck = ["plant.delta_max=0.001".to_owned()];
        let lost = Fitness::training(Kind::Paper, "double_lane_change", &stuck, 0.033, &names).unwrap().present()[0];
        assert!(lost > LOST && lost < 2.0 * LOST, "{lost}");
        // A controller that must hardly steer stops instead: bad, but on the road.
        let fitness = lane_change(&["delta_max"]);
        let stopped = fitness.figures(&[1e-3])[0];
        assert!(stopped > 100.0 * fitness.present()[0] && stopped < LOST, "{stopped}");
        // What the controller refuses is as bad as never having got going.
        assert_eq!(fitness.figures(&[-1.0]), [2.0 * LOST]);
    }

    #[test]
    fn present_values_give_the_present_figures_to_the_last_bit() {
        let fitness = lane_change(&["r_delta", "q_v_x"]);
        let present = lpv_mpc::Parameters::adaptive();
        assert_eq!(fitness.figures(&[present.r_delta, present.q_v_x]), fitness.present());
    }

    #[test]
    fn a_robust_score_of_the_present_is_1_and_the_worst_run_counts_twice() {
        let fitness = Fitness { kind: Kind::Robust, present: vec![2.0, 4.0], ..lane_change(&[]) };
        assert_eq!(fitness.score(&[2.0, 4.0]), 1.0);
        // Ratios 0.5 and 1: mean 0.75, worst 1.
        assert_eq!(fitness.score(&[1.0, 4.0]), 0.875);
    }
}

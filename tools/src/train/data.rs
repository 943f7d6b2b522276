//! Manoeuvres driven on the plant: what the network sees and what it should answer.

use anyhow::{Context, Result};
use lpv_mpc::jordan::Measured;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use vehicle::{Inputs, Parameters, Road, Vehicle};

use super::manoeuvre::{DURATION, Manoeuvre, SPEED, Target};

/// Largest steering angle of a manoeuvre [rad]: the paper's bound, pi/6.
const DELTA_MAX: f64 = std::f64::consts::FRAC_PI_6;
/// A flat and straight road, longer than any manoeuvre: only the body's motion matters here.
pub const STRAIGHT: &str = "s,kappa,v_x\n0,0,15\n500,0,15\n1000,0,15\n";
/// Halvings of the steering's size: its error is then far below what anybody would notice.
const HALVINGS: usize = 12;
/// Speeds may leave the standard range by this much [m/s]; a manoeuvre ends where they leave it further.
const SPEED_SLACK: f64 = 1.0;

/// One instant of a manoeuvre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// What the sensors show.
    pub measured: Measured,
    /// True stiffnesses, front and rear [N/rad].
    pub c: [f64; 2],
    /// True slip angles, front and rear [rad].
    pub alpha: [f64; 2],
    /// Share of grip in use [1].
    pub grip: f64,
}

impl Sample {
    /// The same instant seen in a mirror: left is right.
    fn mirrored(&self) -> Self {
        let Measured { v_y, yaw_rate, delta, a_y, yaw_acceleration, .. } = self.measured;
        Self {
            measured: Measured {
                v_y: -v_y,
                yaw_rate: -yaw_rate,
                delta: -delta,
                a_y: -a_y,
                yaw_acceleration: -yaw_acceleration,
                ..self.measured
            },
            alpha: self.alpha.map(|alpha| -alpha),
            ..*self
        }
    }
}

/// One manoeuvre as it was driven.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Its plan.
    pub manoeuvre: Manoeuvre,
    /// What happened, one sample a period.
    pub samples: Vec<Sample>,
}

impl Run {
    /// The same manoeuvre seen in a mirror.
    pub fn mirrored(&self) -> Self {
        Self { manoeuvre: self.manoeuvre.clone(), samples: self.samples.iter().map(Sample::mirrored).collect() }
    }
}

/// Drives all manoeuvres on the plant of these parameters, a sample every `t_s` [s].
pub fn drive(parameters: &Parameters, t_s: f64, manoeuvres: &[Manoeuvre], tick: impl Fn() + Sync) -> Result<Vec<Run>> {
    let parameters = Parameters { preview_step: t_s, ..parameters.clone() };
    manoeuvres
        .par_iter()
        .map(|manoeuvre| {
            let run = sized(&parameters, manoeuvre);
            tick();
            run
        })
        .collect()
}

/// The manoeuvre with the steering that just reaches its target.
fn sized(parameters: &Parameters, manoeuvre: &Manoeuvre) -> Result<Run> {
    let (mut low, mut high) = (0.0, DELTA_MAX);
    for _ in 0..HALVINGS {
        let size = 0.5 * (low + high);
        if once(parameters, manoeuvre, size, true)?.is_some() {
            low = size;
        } else {
            high = size;
        }
    }
    once(parameters, manoeuvre, low, false)?.context("a manoeuvre that is driven to its end has samples")
}

/// One drive with steering of this size; nothing if it exceeds the target and that matters.
fn once(parameters: &Parameters, manoeuvre: &Manoeuvre, size: f64, judged: bool) -> Result<Option<Run>> {
    let t_s = parameters.preview_step;
    let parameters = Parameters { v_x_0: manoeuvre.v_x_0, seed: manoeuvre.noise, ..parameters.clone() };
    let mut vehicle = Vehicle::new(parameters, Road::from_csv(STRAIGHT)?)?;
    let mut samples = Vec::new();
    let mut t = 0.0;
    while t < DURATION {
        let inputs = Inputs {
            delta: (size * manoeuvre.steering(t)).clamp(-DELTA_MAX, DELTA_MAX),
            a_x: manoeuvre.a_x(t, vehicle.outputs().v_x_true),
            wind_speed: manoeuvre.wind.0,
            wind_direction: manoeuvre.wind.1,
            mu_scale: manoeuvre.mu_scale,
        };
        vehicle.advance(t_s, &inputs)?;
        t += t_s;
        let sample = look(&vehicle);
        let used = match manoeuvre.target {
            Target::Grip(share) => sample.grip / share,
            Target::Slip(slip) => sample.alpha[0].abs().max(sample.alpha[1].abs()) / slip,
        };
        if judged && used > 1.0 {
            return Ok(None);
        }
        let v_x = vehicle.outputs().v_x_true;
        if !(SPEED.0 - SPEED_SLACK..=SPEED.1 + SPEED_SLACK).contains(&v_x) {
            break;
        }
        samples.push(sample);
    }
    Ok(Some(Run { manoeuvre: manoeuvre.clone(), samples }))
}

fn look(vehicle: &Vehicle) -> Sample {
    let seen = vehicle.measurement();
    let truth = vehicle.outputs();
    Sample {
        measured: Measured {
            v_x: seen.v_x,
            v_y: seen.v_y,
            yaw_rate: seen.yaw_rate,
            delta: truth.delta_actual,
            a_x: truth.a_x_actual,
            a_y: truth.a_lat,
            yaw_acceleration: vehicle.outputs_rate(&vehicle.truth().inputs).yaw_rate_true,
        },
        c: [truth.c_f_true, truth.c_r_true],
        alpha: [truth.alpha_f, truth.alpha_r],
        grip: truth.grip_usage,
    }
}

/// SHA-256 of all inputs and answers.
pub fn hash(runs: &[Run]) -> String {
    let mut digest = Sha256::new();
    for sample in runs.iter().flat_map(|run| &run.samples) {
        for value in sample.measured.values().iter().chain(&sample.c) {
            digest.update(value.to_le_bytes());
        }
    }
    digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::recipe::{Preset, Purpose, Recipe, T_S};

    fn driven(recipe: &Recipe, count: usize, beyond: bool) -> Vec<Run> {
        let manoeuvres = recipe.draw(Purpose::Evaluation, count, beyond);
        drive(&recipe.plant().unwrap(), T_S, &manoeuvres, || ()).unwrap()
    }

    #[test]
    fn steering_is_sized_to_the_target_and_never_beyond() {
        let recipe = Recipe::new(Preset::Default, 5);
        for run in driven(&recipe, 12, false) {
            let Target::Grip(target) = run.manoeuvre.target else { panic!("the standard set is sized by grip") };
            let largest = run.samples.iter().map(|sample| sample.grip).fold(0.0, f64::max);
            let steering = run.samples.iter().map(|sample| sample.measured.delta.abs()).fold(0.0, f64::max);
            assert!(largest <= target, "{largest} of {target}");
            // Slow cars reach the end of the steering first; then the target stays out of reach. Otherwise the last of the
            // halvings leaves less than a percent.
            assert!(
                largest > 0.98 * target || steering > 0.9 * DELTA_MAX,
                "{largest} of {target}, steering {steering}"
            );
        }
        for run in driven(&recipe, 6, true) {
            let Target::Slip(target) = run.manoeuvre.target else { panic!("the set beyond is sized by slip") };
            let slip =
                run.samples.iter().map(|sample| sample.alpha[0].abs().max(sample.alpha[1].abs())).fold(0.0, f64::max);
            assert!(slip <= target, "{slip} of {target}");
        }
    }

    #[test]
    fn answers_explain_the_lateral_acceleration() {
        // Newton's second law from the recorded stiffnesses; drag and wind have no lateral part in still air but for the
        // body's own side slip, below 2 % of the weight.
        let recipe = Recipe::new(Preset::Default, 5);
        let plant = recipe.plant().unwrap();
        for sample in driven(&recipe, 6, false).iter().flat_map(|run| &run.samples) {
            let Sample { measured, c, alpha, .. } = sample;
            let force = c[0] * alpha[0] * measured.delta.cos() + c[1] * alpha[1];
            let missing = (measured.a_y - force / plant.m).abs();
            assert!(missing < 0.02 * plant.g, "{missing} m/s2 at {sample:?}");
        }
    }

    #[test]
    fn no_purpose_shares_a_manoeuvre_with_another() {
        let sets: Vec<_> = [3, 4]
            .into_iter()
            .flat_map(|seed| {
                [Purpose::Training, Purpose::Validation, Purpose::Evaluation].map(|purpose| (seed, purpose))
            })
            .flat_map(|(seed, purpose)| Recipe::new(Preset::Default, seed).draw(purpose, 12, false))
            .collect();
        for (i, a) in sets.iter().enumerate() {
            assert!(sets[..i].iter().all(|b| a != b), "manoeuvre {i} is there twice");
        }
    }
}

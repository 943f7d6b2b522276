//! What is trained and how: the presets of `cargo fmu train`.

use anyhow::{Result, ensure};
use clap::ValueEnum;
use lpv_mpc::jordan::{INPUTS, INPUTS_ACCELERATIONS};
use serde::{Deserialize, Serialize};
use vehicle::Parameters;
use vehicle::tyre::Preset as Tyre;

use super::manoeuvre::{Cover, Manoeuvre};
use super::stack::Shape;
use crate::simulate::settings::Settings;

/// Sampling period [s]: the paper's controller period.
pub const T_S: f64 = 0.033;

/// Contraction factor that training keeps [1]: 0.79^20 = 0.009, so less than 1 % of a wrong memory is left after 20 samples.
pub const RHO: f64 = 0.79;

/// Starting points of a recipe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// The network that ships: 16 and 8 neurons, trained up to and beyond the peak of the tyre
    Default,
    /// The paper's network (8 and 5 neurons) trained our way, within 90 % of grip
    PaperSize,
    /// The paper's network trained the paper's way: Adam on single samples with the true previous stiffness
    Paper,
    /// Friction 0.4 to 1.0 unknown to the network, which sees lateral and yaw acceleration instead
    Friction,
}

impl Preset {
    /// The name that users type.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// Everything that determines a training; two equal recipes give the same network.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Where it came from.
    pub preset: Preset,
    /// Name of the plant's tyre.
    pub tyre: String,
    /// Other parameters of the plant, as plant.NAME=VALUE.
    #[serde(default)]
    pub set: Vec<String>,
    /// Smallest and largest friction [1].
    pub mu: (f64, f64),
    /// Neurons of the hidden layers.
    pub hidden: [usize; 2],
    /// Whether lateral and yaw acceleration are inputs.
    pub accelerations: bool,
    /// Sensor noise on the inputs, in the plant's units [1].
    pub noise: f64,
    /// Largest wind [m/s].
    pub wind: f64,
    /// Manoeuvres of the standard set to train on.
    pub manoeuvres: usize,
    /// Manoeuvres beyond the standard set to train on.
    pub beyond: usize,
    /// Random starts.
    pub starts: usize,
    /// Attempted second-order steps of each start; after a quarter of them only the best goes on.
    pub steps: usize,
    /// Seed of manoeuvres and weights.
    pub seed: u64,
}

/// What a set of manoeuvres is for; no two purposes of any two seeds share a manoeuvre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// To fit the weights.
    Training,
    /// To choose among iterates and starts.
    Validation,
    /// To score.
    Evaluation,
}

impl Recipe {
    /// The recipe of a preset.
    pub fn new(preset: Preset, seed: u64) -> Self {
        let own = Parameters::default().mu;
        let default = Self {
            preset,
            tyre: Parameters::default().tyre.name().to_owned(),
            set: Vec::new(),
            mu: (own, own),
            hidden: [16, 8],
            accelerations: false,
            noise: 0.0,
            wind: 0.0,
            manoeuvres: 60,
            beyond: 30,
            starts: 4,
            steps: 160,
            seed,
        };
        // With a quarter for validation these are the paper's 10,000 points.
        let paper = Self { hidden: [8, 5], manoeuvres: 50, beyond: 0, ..default.clone() };
        match preset {
            Preset::Default => default,
            Preset::PaperSize => paper,
            Preset::Paper => Self { starts: 1, steps: 0, ..paper },
            Preset::Friction => Self { mu: (0.4, 1.0), accelerations: true, manoeuvres: 120, beyond: 0, ..default },
        }
    }

    /// The same recipe in words.
    pub fn words(&self) -> String {
        let car: String = self.set.iter().map(|assignment| format!(", {assignment}")).collect();
        match self.preset {
            Preset::Paper => "Adam 5e-4 on batches of 16 samples, 100 epochs, teacher-forced".to_owned() + &car,
            _ => format!(
                "best of {} starts, up to {} Levenberg-Marquardt steps on the free run, contraction {RHO}, validation-best iterate{car}",
                self.starts, self.steps
            ),
        }
    }

    /// Refuses what cannot be trained.
    pub fn validate(&self) -> Result<()> {
        let (low, high) = self.mu;
        ensure!(0.0 < low && low <= high && high <= 2.0, "friction must be ordered and in 0 to 2, got {low} to {high}");
        let widest = lpv_mpc::jordan::WIDTH_MAX;
        for width in self.hidden {
            ensure!((1..=widest).contains(&width), "a hidden layer has 1 to {widest} neurons, got {width}");
        }
        for assignment in &self.set {
            ensure!(assignment.starts_with("plant."), "only the plant is trained on, got {assignment}");
            for own in ["tyre", "mu", "noise_scale"] {
                // Options of their own decide on these, and would silently win.
                let name = assignment.split_once('=').map_or(assignment.as_str(), |(name, _)| name.trim());
                ensure!(
                    name != format!("plant.{own}"),
                    "{name} is what --tyre, --mu and --noise say, got {assignment}"
                );
            }
        }
        self.plant()?;
        ensure!(self.starts >= 1 && self.manoeuvres >= 6, "at least 1 start and 6 manoeuvres are needed");
        Ok(())
    }

    /// The sizes of the network.
    pub fn shape(&self) -> Shape {
        Shape { inputs: if self.accelerations { INPUTS_ACCELERATIONS } else { INPUTS }, hidden: self.hidden }
    }

    /// The plant, on the best friction of the recipe.
    pub fn plant(&self) -> Result<Parameters> {
        let plant = Settings::new("straight", &self.set)?.plant;
        Ok(Parameters { tyre: Tyre::named(&self.tyre)?, mu: self.mu.1, noise_scale: self.noise, ..plant })
    }

    /// Manoeuvres for a purpose, `count` of the standard set or of the set beyond it.
    pub fn draw(&self, purpose: Purpose, count: usize, beyond: bool) -> Vec<Manoeuvre> {
        let (low, high) = self.mu;
        let cover = Cover { beyond, mu_scale: (low / high, 1.0), wind: self.wind };
        let stream = 2 * purpose as u64 + u64::from(beyond);
        Manoeuvre::set(self.seed.wrapping_mul(6).wrapping_add(stream), count, &cover)
    }

    /// Numbers of standard and other manoeuvres: validation takes a quarter of the whole, as in the paper.
    pub fn counts(&self, purpose: Purpose) -> (usize, usize) {
        match purpose {
            Purpose::Training => (self.manoeuvres, self.beyond),
            Purpose::Validation => (self.manoeuvres.div_ceil(3), self.beyond.div_ceil(3)),
            Purpose::Evaluation => (60, 30),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(set: &[&str]) -> Recipe {
        Recipe { set: set.iter().map(|&text| text.to_owned()).collect(), ..Recipe::new(Preset::Default, 1) }
    }

    #[test]
    fn another_car_is_what_the_plant_becomes_and_what_the_file_says() {
        let recipe = of(&["plant.m=2300", "plant.l_f = 1.55"]);
        recipe.validate().unwrap();
        let plant = recipe.plant().unwrap();
        assert_eq!((plant.m, plant.l_f, plant.l_r), (2300.0, 1.55, Parameters::default().l_r));
        assert!(recipe.words().ends_with(", plant.m=2300, plant.l_f = 1.55"));
    }

    #[test]
    fn what_has_an_option_of_its_own_or_is_unknown_is_refused() {
        for wrong in ["plant.mu=0.5", "controller.m=2300", "plant.mass=2300", "plant.tyre=linear"] {
            assert!(of(&[wrong]).validate().is_err(), "{wrong}");
        }
    }
}

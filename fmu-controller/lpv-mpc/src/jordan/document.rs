//! What a network file holds: plain numbers, where they came from and how good they are.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::envelope::Envelope;
use super::layers::WIDTH_MAX;
use super::{FEEDBACK, INPUTS, INPUTS_ACCELERATIONS};
use crate::Error;

/// Name of the format; anything else is somebody else's file.
const FORMAT: &str = "lpv-mpc jordan network";
/// Version of the format.
const VERSION: u32 = 1;
/// Largest number of layers; the paper has three.
const LAYERS_MAX: usize = 8;

/// Mean and standard deviation that bring a quantity to zero mean and unit spread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scaling {
    /// Mean of the training set.
    pub mean: f64,
    /// Standard deviation of the training set.
    pub deviation: f64,
}

/// One layer: `weights x + biases`, then the logistic function in all layers but the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// One row for each neuron.
    pub weights: Vec<Vec<f64>>,
    /// One for each neuron.
    pub biases: Vec<f64>,
}

/// Scores of both outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pair {
    /// Front axle.
    pub c_f: f64,
    /// Rear axle.
    pub c_r: f64,
}

/// How good the network was on manoeuvres that took no part in its training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scores {
    /// Seed of those manoeuvres.
    pub seed: u64,
    /// R^2 while the network runs on its own outputs, as it does in the controller [1].
    pub free_running: Pair,
    /// R^2 while it is given the true previous stiffness [1].
    pub teacher_forced: Pair,
    /// Root mean square of the force error `(c - c_true) alpha` over the grip, free-running [1].
    pub force_error: Pair,
}

/// Where the numbers came from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// The recipe in words.
    pub recipe: String,
    /// Preset of the training command.
    pub preset: String,
    /// Tyre of the plant that it was trained on.
    pub tyre: String,
    /// Smallest and largest friction of the training [1].
    pub mu: [f64; 2],
    /// Sensor noise on the inputs of the training, in the plant's units [1].
    pub noise: f64,
    /// Largest wind of the training [m/s].
    pub wind: f64,
    /// Seed of manoeuvres and initial weights.
    pub seed: u64,
    /// Training manoeuvres within 90 % of grip, before mirroring.
    pub manoeuvres: usize,
    /// Training manoeuvres beyond, before mirroring.
    pub beyond: usize,
    /// SHA-256 of the training data.
    pub data: String,
}

/// The content of a network file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    /// Sampling period that the network was trained at [s].
    pub t_s: f64,
    /// Distance from the centre of gravity to the front axle of the trained vehicle [m].
    pub l_f: f64,
    /// Distance from the centre of gravity to the rear axle of the trained vehicle [m].
    pub l_r: f64,
    /// Front stiffness at small slip, averaged over the frictions of the training [N/rad].
    pub c_f_nominal: f64,
    /// Rear stiffness at small slip, averaged over the frictions of the training [N/rad].
    pub c_r_nominal: f64,
    /// Scaling of the measured inputs `v_x, v_y, yaw_rate, delta, a_x`, then `a_y` and the yaw acceleration if used.
    pub inputs: Vec<Scaling>,
    /// Scaling of the outputs, and of the outputs that are fed back: `c_f`, `c_r`.
    pub outputs: [Scaling; 2],
    /// From the inputs, followed by the fed-back outputs, to the outputs.
    pub layers: Vec<Layer>,
    /// What the training covered.
    pub envelope: Envelope,
    /// How good it is.
    pub scores: Scores,
    /// Where it came from.
    pub provenance: Provenance,
}

/// The file: the document behind a name, a version and a checksum.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u32,
    checksum: String,
    network: serde_json::Value,
}

/// The part of any JSON object that says what it is.
#[derive(Deserialize)]
struct Header {
    #[serde(default)]
    format: String,
    #[serde(default)]
    version: u32,
}

impl Document {
    /// Reads a network file's text.
    ///
    /// # Errors
    /// Says what is wrong: not JSON, somebody else's format, an unknown version, a wrong checksum, sizes that do not fit,
    /// or a number that is not finite or not possible.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let unreadable = |error: serde_json::Error| Error::NetworkUnreadable(error.to_string());
        let Header { format, version } = serde_json::from_str(text).map_err(unreadable)?;
        if format != FORMAT {
            return Err(Error::NetworkFormat { expected: FORMAT, got: format });
        }
        if version != VERSION {
            return Err(Error::NetworkVersion { expected: VERSION, got: version });
        }
        let File { checksum, network, .. } = serde_json::from_str(text).map_err(unreadable)?;
        let document: Self = serde_json::from_value(network).map_err(unreadable)?;
        let got = document.checksum();
        if got != checksum {
            return Err(Error::NetworkChecksum { expected: checksum, got });
        }
        document.check()?;
        Ok(document)
    }

    /// The text of the network file, one that a person can read.
    #[must_use]
    pub fn to_json(&self) -> String {
        let file = File {
            format: FORMAT.to_owned(),
            version: VERSION,
            checksum: self.checksum(),
            network: serde_json::to_value(self).expect("plain numbers and texts are JSON"),
        };
        serde_json::to_string_pretty(&file).expect("plain numbers and texts are JSON") + "\n"
    }

    /// SHA-256 of the content; layout and order of the text do not matter.
    fn checksum(&self) -> String {
        let text = serde_json::to_string(self).expect("plain numbers and texts are JSON");
        Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Checks sizes and numbers.
    pub(super) fn check(&self) -> Result<(), Error> {
        let wrong = |what: String| Err(Error::NetworkInvalid(what));
        let n = self.inputs.len();
        if n != INPUTS && n != INPUTS_ACCELERATIONS {
            return wrong(format!("{n} measured inputs, expected {INPUTS} or {INPUTS_ACCELERATIONS}"));
        }
        if self.envelope.inputs.len() != n {
            return wrong(format!("an envelope of {} inputs for {n}", self.envelope.inputs.len()));
        }
        if self.layers.is_empty() || self.layers.len() > LAYERS_MAX {
            return wrong(format!("{} layers, expected 1 to {LAYERS_MAX}", self.layers.len()));
        }
        let mut width = n + FEEDBACK;
        for (i, Layer { weights, biases }) in self.layers.iter().enumerate() {
            if weights.len() != biases.len() || weights.is_empty() || weights.len() > WIDTH_MAX {
                return wrong(format!("layer {i} has {} rows and {} biases", weights.len(), biases.len()));
            }
            if let Some(row) = weights.iter().find(|row| row.len() != width) {
                return wrong(format!("layer {i} has a row of {} weights, expected {width}", row.len()));
            }
            if let Some(w) = weights.iter().flatten().chain(biases).find(|w| !w.is_finite()) {
                return wrong(format!("layer {i} has a weight of {w}"));
            }
            width = weights.len();
        }
        if width != FEEDBACK {
            return wrong(format!("{width} outputs, expected {FEEDBACK}"));
        }
        self.check_numbers()
    }

    fn check_numbers(&self) -> Result<(), Error> {
        let Self { t_s, l_f, l_r, c_f_nominal, c_r_nominal, inputs, outputs, envelope, provenance, .. } = self;
        let wrong = |what: String| Err(Error::NetworkInvalid(what));
        for (name, value) in
            [("t_s", t_s), ("l_f", l_f), ("l_r", l_r), ("c_f_nominal", c_f_nominal), ("c_r_nominal", c_r_nominal)]
        {
            if !(*value > 0.0 && value.is_finite()) {
                return wrong(format!("{name} of {value}, expected a positive number"));
            }
        }
        let [lowest, highest] = provenance.mu;
        if !(lowest > 0.0 && lowest <= highest && highest.is_finite()) {
            return wrong(format!("a friction from {lowest} to {highest}"));
        }
        for Scaling { mean, deviation } in inputs.iter().chain(outputs) {
            if !(mean.is_finite() && *deviation > 0.0 && deviation.is_finite()) {
                return wrong(format!("a scaling with mean {mean} and deviation {deviation}"));
            }
        }
        for range in envelope.inputs.iter().chain([&envelope.alpha_f, &envelope.alpha_r]) {
            if !(range.min < range.max && (range.max - range.min).is_finite()) {
                return wrong(format!("an envelope from {} to {}", range.min, range.max));
            }
        }
        Ok(())
    }
}

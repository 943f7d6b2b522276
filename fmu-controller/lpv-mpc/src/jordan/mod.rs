//! The Jordan network: axle stiffnesses from what the car measures, and from its own last answer.
//!
//! [Kebbati, section 3.2]: seven inputs (`v_x`, `v_y`, yaw rate, `delta`, `a_x` and the two stiffnesses that the network gave
//! one sample ago), two hidden layers of logistic neurons, two linear outputs. It runs on its own outputs here, so that is how
//! it is trained and scored; the paper does not say whether its scores are teacher-forced, and weights that score well so can
//! be useless when they run freely.
//!
//! A [`Network`] is read from text ([`Network::from_json`]) and never changes; what changes is the caller's [`Memory`], one for
//! each trajectory that the network is rolled along. [`Network::linearise`] is one stage of such a roll: secant and tangent of
//! both axle forces where the stage is, and how far they may be believed.

mod belief;
mod document;
mod envelope;
mod layers;
mod sigmoid;

use serde::{Deserialize, Serialize};

pub use belief::{Axle, Belief};
pub use document::{Document, Layer, Pair, Provenance, Scaling, Scores};
pub use envelope::{Envelope, MARGIN, Range};
pub use layers::WIDTH_MAX;
pub use sigmoid::sigmoid;

use crate::Error;
use crate::angles::atans;
use belief::{STEERING, turning};
use layers::{Inputs, Layers};

/// Measured inputs of the paper's network.
pub const INPUTS: usize = 5;
/// Measured inputs of the variant that also sees the accelerations.
pub const INPUTS_ACCELERATIONS: usize = 7;
/// Outputs, all fed back.
pub const FEEDBACK: usize = 2;

/// What the network looks at, at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Longitudinal velocity, body frame [m/s].
    pub v_x: f64,
    /// Lateral velocity, body frame [m/s].
    pub v_y: f64,
    /// Yaw rate [rad/s].
    pub yaw_rate: f64,
    /// Front steering angle [rad].
    pub delta: f64,
    /// Longitudinal acceleration by drive and brakes [m/s2].
    pub a_x: f64,
    /// Lateral acceleration; only networks that were trained with it look at it [m/s2].
    pub a_y: f64,
    /// Yaw acceleration; only networks that were trained with it look at it [rad/s2].
    pub yaw_acceleration: f64,
}

impl Measured {
    /// The values in the order of a network's inputs; a network of five inputs takes the first five.
    #[must_use]
    pub fn values(&self) -> [f64; INPUTS_ACCELERATIONS] {
        [self.v_x, self.v_y, self.yaw_rate, self.delta, self.a_x, self.a_y, self.yaw_acceleration]
    }
}

/// The network's last answer in its own units (zero mean, unit spread), which it sees again one sample later.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Front stiffness, standardised [1].
    pub c_f: f64,
    /// Rear stiffness, standardised [1].
    pub c_r: f64,
}

/// A trained network, ready to run. Written and read by serde as its [`Document`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Document", into = "Document")]
pub struct Network {
    document: Document,
    layers: Layers,
    contraction: f64,
}

impl TryFrom<Document> for Network {
    type Error = Error;

    fn try_from(document: Document) -> Result<Self, Error> {
        document.check()?;
        let layers = Layers::new(&document.layers, &document.inputs, [&STEERING, &turning(&document)]);
        let contraction = contraction(&document.layers);
        Ok(Self { document, layers, contraction })
    }
}

impl From<Network> for Document {
    fn from(network: Network) -> Self {
        network.document
    }
}

impl Network {
    /// Reads a network file's text.
    ///
    /// # Errors
    /// See [`Document::from_json`].
    pub fn from_json(text: &str) -> Result<Self, Error> {
        Document::from_json(text)?.try_into()
    }

    /// The plain numbers, the scores and the provenance.
    #[must_use]
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Whether the network looks at the accelerations.
    #[must_use]
    pub fn sees_accelerations(&self) -> bool {
        self.document.inputs.len() == INPUTS_ACCELERATIONS
    }

    /// Upper bound of the factor by which one step shrinks the distance between two memories, whatever the inputs.
    ///
    /// The product of the layers' spectral norms from the memory to the outputs, and 1/4, the largest slope of the logistic
    /// function, for each hidden layer. Below 1 it is a certificate that a wrong memory is forgotten; above 1 it says nothing.
    #[must_use]
    pub fn contraction(&self) -> f64 {
        self.contraction
    }

    /// The memory of these stiffnesses [N/rad].
    #[must_use]
    pub fn memory(&self, c_f: f64, c_r: f64) -> Memory {
        let [f, r] = &self.document.outputs;
        Memory { c_f: (c_f - f.mean) / f.deviation, c_r: (c_r - r.mean) / r.deviation }
    }

    /// The memory to begin with: the nominal stiffnesses.
    #[must_use]
    pub fn nominal(&self) -> Memory {
        self.memory(self.document.c_f_nominal, self.document.c_r_nominal)
    }

    /// The stiffnesses that a memory stands for, front and rear [N/rad].
    #[must_use]
    pub fn stiffness(&self, memory: &Memory) -> (f64, f64) {
        let [f, r] = &self.document.outputs;
        (f.mean + f.deviation * memory.c_f, r.mean + r.deviation * memory.c_r)
    }

    /// One sample: the network's answer to what is measured, given its last answer.
    ///
    /// Inputs that are not numbers leave the memory as it was.
    #[must_use]
    pub fn step(&self, memory: &Memory, measured: &Measured) -> Memory {
        let [c_f, c_r] = self.layers.forward(&self.seen(memory, measured));
        if c_f.is_finite() && c_r.is_finite() { Memory { c_f, c_r } } else { *memory }
    }

    /// How far the answer to these inputs may be believed: 1 inside the training envelope, 0 beyond its margin.
    #[must_use]
    pub fn confidence(&self, measured: &Measured) -> f64 {
        self.belief(measured, self.slip_angles(measured))
    }

    /// Front and rear slip angle of the trained vehicle [rad].
    #[must_use]
    pub fn slip_angles(&self, measured: &Measured) -> (f64, f64) {
        let (z_f, z_r) = self.drift(measured);
        let [drift_f, drift_r] = atans([z_f, z_r]);
        (measured.delta - drift_f, -drift_r)
    }

    /// Tangents of the angles at which the front and the rear axle move against the body [1].
    #[inline(always)]
    fn drift(&self, measured: &Measured) -> (f64, f64) {
        let Document { l_f, l_r, .. } = self.document;
        let Measured { v_x, v_y, yaw_rate, .. } = *measured;
        ((v_y + l_f * yaw_rate) / v_x, (v_y - l_r * yaw_rate) / v_x)
    }

    #[inline(always)]
    fn belief(&self, measured: &Measured, slip_angles: (f64, f64)) -> f64 {
        let n = self.document.inputs.len();
        self.document.envelope.belief(&measured.values()[..n], slip_angles)
    }

    /// What the layers see: the measured inputs, followed by the memory and by zeros, whose weights are zero too.
    #[inline(always)]
    fn seen(&self, memory: &Memory, measured: &Measured) -> Inputs {
        let Measured { v_x, v_y, yaw_rate, delta, a_x, a_y, yaw_acceleration } = *measured;
        let Memory { c_f, c_r } = *memory;
        if self.sees_accelerations() {
            [v_x, v_y, yaw_rate, delta, a_x, a_y, yaw_acceleration, c_f, c_r]
        } else {
            [v_x, v_y, yaw_rate, delta, a_x, c_f, c_r, 0.0, 0.0]
        }
    }
}

/// See [`Network::contraction`].
fn contraction(layers: &[Layer]) -> f64 {
    let norm = |layer: &Layer, skip: usize| {
        let columns = layer.weights[0].len() - skip;
        nalgebra::DMatrix::from_fn(layer.weights.len(), columns, |i, j| layer.weights[i][skip + j])
            .singular_values()
            .max()
    };
    let feedback = layers[0].weights[0].len() - FEEDBACK;
    let slopes = 0.25_f64.powi(i32::try_from(layers.len() - 1).expect("a checked document has few layers"));
    layers.iter().enumerate().map(|(i, layer)| norm(layer, if i == 0 { feedback } else { 0 })).product::<f64>() * slopes
}

#[cfg(test)]
mod tests;

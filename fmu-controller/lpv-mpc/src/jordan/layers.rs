//! The layers, laid out for the processor, and their forward pass without and with derivatives.

use super::document::Layer;
use super::sigmoid::sigmoid;

/// Largest width of a layer, inputs included; the paper has 8.
pub const WIDTH_MAX: usize = 32;
/// Neurons that are computed side by side: two registers of the oldest 64-bit processors.
const LANES: usize = 4;

/// The values of one layer.
pub type Values = [f64; WIDTH_MAX];

/// One layer in blocks of [`LANES`] neurons; the last block is filled with zeros.
#[derive(Clone, Debug, PartialEq)]
struct Packed {
    /// Number of inputs.
    width: usize,
    /// For each block and each input the weights of the block's neurons.
    weights: Vec<[f64; LANES]>,
    /// For each block the biases of its neurons.
    biases: Vec<[f64; LANES]>,
}

impl Packed {
    fn new(layer: &Layer) -> Self {
        let width = layer.weights[0].len();
        let blocks = layer.biases.len().div_ceil(LANES);
        let pick = |row: usize, value: &dyn Fn(usize) -> f64| if row < layer.biases.len() { value(row) } else { 0.0 };
        let lanes =
            |block: usize, value: &dyn Fn(usize) -> f64| std::array::from_fn(|lane| pick(block * LANES + lane, value));
        Self {
            width,
            weights: (0..blocks)
                .flat_map(|block| (0..width).map(move |i| (block, i)))
                .map(|(block, i)| lanes(block, &|row| layer.weights[row][i]))
                .collect(),
            biases: (0..blocks).map(|block| lanes(block, &|row| layer.biases[row])).collect(),
        }
    }

    /// Neurons with the filling.
    fn neurons(&self) -> usize {
        self.biases.len() * LANES
    }

    /// `weights x`, plus the biases if wanted.
    #[inline]
    fn multiply(&self, x: &Values, with_biases: bool) -> Values {
        let mut y = [0.0; WIDTH_MAX];
        let blocks = self.weights.chunks_exact(self.width).zip(&self.biases).zip(y.chunks_exact_mut(LANES));
        for ((weights, biases), y) in blocks {
            let mut sum = if with_biases { *biases } else { [0.0; LANES] };
            for (w, x) in weights.iter().zip(x) {
                for lane in 0..LANES {
                    sum[lane] += w[lane] * x;
                }
            }
            y.copy_from_slice(&sum);
        }
        y
    }
}

/// The whole stack.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    hidden: Vec<Packed>,
    last: Packed,
}

impl Layers {
    /// Packs layers whose sizes have been checked.
    pub fn new(layers: &[Layer]) -> Self {
        let (last, hidden) = layers.split_last().expect("a checked document has a layer");
        Self { hidden: hidden.iter().map(Packed::new).collect(), last: Packed::new(last) }
    }

    /// The two outputs at the input `x`.
    #[inline]
    pub fn forward(&self, mut x: Values) -> [f64; 2] {
        for layer in &self.hidden {
            x = layer.multiply(&x, true);
            sigmoid(&mut x[..layer.neurons()]);
        }
        let y = self.last.multiply(&x, true);
        [y[0], y[1]]
    }

    /// The two outputs at the input `x`, and how they change along each direction of the input.
    #[inline]
    pub fn forward_along<const D: usize>(&self, mut x: Values, mut along: [Values; D]) -> ([f64; 2], [[f64; 2]; D]) {
        for layer in &self.hidden {
            x = layer.multiply(&x, true);
            sigmoid(&mut x[..layer.neurons()]);
            for direction in &mut along {
                *direction = layer.multiply(direction, false);
                for (d, a) in direction.iter_mut().zip(&x) {
                    *d *= a * (1.0 - a);
                }
            }
        }
        let y = self.last.multiply(&x, true);
        let along = along.map(|direction| {
            let d = self.last.multiply(&direction, false);
            [d[0], d[1]]
        });
        ([y[0], y[1]], along)
    }
}

//! The layers, laid out for the processor, and their forward pass with derivatives along a few directions.
#![allow(clippy::needless_range_loop, reason = "several arrays run along the same index")]

use std::mem;

use super::document::{Layer, Scaling};
use super::sigmoid::logistic_lanes;

/// Largest width of a layer, inputs included; the paper has 8.
pub const WIDTH_MAX: usize = 32;
/// Neurons that are computed side by side: two registers of the oldest 64-bit processors.
pub const LANES: usize = 4;
/// Outputs of the last layer, one register.
const OUTPUTS: usize = 2;

/// The values of one layer.
pub type Values = [f64; WIDTH_MAX];
/// A direction of the input: the elements that are not zero, with their indices.
pub type Direction = [(usize, f64)];

/// One layer in blocks of `L` neurons; the last block is filled with zeros.
#[derive(Clone, Debug, PartialEq)]
struct Packed<const L: usize> {
    /// Number of inputs.
    width: usize,
    /// For each block and each input the weights of the block's neurons.
    weights: Vec<[f64; L]>,
    /// For each block the biases of its neurons.
    biases: Vec<[f64; L]>,
}

/// The values of one layer and their changes along the directions. They go through a layer together: every weight is loaded
/// once for all of them.
#[derive(Clone, Copy)]
struct Jets<const D: usize> {
    value: Values,
    along: [Values; D],
}

/// The same of one block of neurons.
#[derive(Clone, Copy)]
struct Block<const L: usize, const D: usize> {
    value: [f64; L],
    along: [[f64; L]; D],
}

/// `y += a x`, side by side.
#[inline(always)]
fn axpy<const L: usize>(a: f64, x: &[f64; L], y: &mut [f64; L]) {
    for lane in 0..L {
        y[lane] += a * x[lane];
    }
}

impl<const L: usize> Packed<L> {
    fn new(layer: &Layer) -> Self {
        let width = layer.weights[0].len();
        let blocks = layer.biases.len().div_ceil(L);
        let pick = |row: usize, value: &dyn Fn(usize) -> f64| if row < layer.biases.len() { value(row) } else { 0.0 };
        let lanes =
            |block: usize, value: &dyn Fn(usize) -> f64| std::array::from_fn(|lane| pick(block * L + lane, value));
        Self {
            width,
            weights: (0..blocks)
                .flat_map(|block| (0..width).map(move |i| (block, i)))
                .map(|(block, i)| lanes(block, &|row| layer.weights[row][i]))
                .collect(),
            biases: (0..blocks).map(|block| lanes(block, &|row| layer.biases[row])).collect(),
        }
    }

    /// Weights of each input and biases of a block.
    #[inline(always)]
    fn block(&self, block: usize) -> (&[[f64; L]], &[f64; L]) {
        // No layer is wider; said here, it spares the compiler a check for each input.
        let width = self.width.min(WIDTH_MAX);
        (&self.weights[block * width..][..width], &self.biases[block])
    }

    /// The sums of a block of neurons whose inputs are `x`.
    #[inline(always)]
    fn sums<const D: usize>(&self, block: usize, x: &Jets<D>) -> Block<L, D> {
        let (weights, biases) = self.block(block);
        let mut sums = Block { value: *biases, along: [[0.0; L]; D] };
        for i in 0..weights.len() {
            axpy(x.value[i], &weights[i], &mut sums.value);
            for d in 0..D {
                axpy(x.along[d][i], &weights[i], &mut sums.along[d]);
            }
        }
        sums
    }

    /// The same for the first layer, where the directions are mostly zeros.
    #[inline(always)]
    fn first_sums<const D: usize>(&self, block: usize, x: &Values, directions: &[&Direction; D]) -> Block<L, D> {
        let (weights, biases) = self.block(block);
        let mut sums = Block { value: *biases, along: [[0.0; L]; D] };
        for i in 0..weights.len() {
            axpy(x[i], &weights[i], &mut sums.value);
        }
        for d in 0..D {
            for (i, x) in directions[d] {
                axpy(*x, &weights[*i], &mut sums.along[d]);
            }
        }
        sums
    }
}

impl<const D: usize> Block<LANES, D> {
    /// The logistic function of the block, neuron by neuron, as part of a layer.
    #[inline(always)]
    fn activate(&self, block: usize, out: &mut Jets<D>) {
        let value = logistic_lanes(self.value);
        let place = |values: &mut Values, lanes: [f64; LANES]| values.as_chunks_mut().0[block] = lanes;
        place(&mut out.value, value);
        for d in 0..D {
            let mut along = self.along[d];
            for lane in 0..LANES {
                along[lane] *= value[lane] * (1.0 - value[lane]);
            }
            place(&mut out.along[d], along);
        }
    }
}

/// The whole stack.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    hidden: Vec<Packed<LANES>>,
    last: Packed<OUTPUTS>,
}

impl Layers {
    /// Packs layers whose sizes have been checked. The scaling of the first inputs goes into the weights, so these inputs are
    /// quantities in their own units.
    pub fn new(layers: &[Layer], inputs: &[Scaling]) -> Self {
        let mut layers = layers.to_vec();
        let Layer { weights, biases } = &mut layers[0];
        for (row, bias) in weights.iter_mut().zip(biases) {
            for (w, Scaling { mean, deviation }) in row.iter_mut().zip(inputs) {
                *w /= deviation;
                *bias -= *w * mean;
            }
        }
        let (last, hidden) = layers.split_last().expect("a checked document has a layer");
        Self { hidden: hidden.iter().map(Packed::new).collect(), last: Packed::new(last) }
    }

    /// The two outputs at the input `x`.
    #[inline]
    pub fn forward(&self, x: &Values) -> [f64; OUTPUTS] {
        self.forward_along(x, [&[]; 0]).0
    }

    /// The two outputs at the input `x`, and how they change along each direction of the input.
    #[inline]
    pub fn forward_along<const D: usize>(
        &self,
        x: &Values,
        directions: [&Direction; D],
    ) -> ([f64; OUTPUTS], [[f64; OUTPUTS]; D]) {
        let Some((first, inner)) = self.hidden.split_first() else {
            let Block { value, along } = self.last.first_sums(0, x, &directions);
            return (value, along);
        };
        let mut jets = [Jets { value: [0.0; WIDTH_MAX], along: [[0.0; WIDTH_MAX]; D] }; 2];
        let [one, other] = &mut jets;
        let (mut now, mut next) = (one, other);
        for block in 0..first.biases.len() {
            first.first_sums(block, x, &directions).activate(block, now);
        }
        for layer in inner {
            for block in 0..layer.biases.len() {
                layer.sums(block, now).activate(block, next);
            }
            mem::swap(&mut now, &mut next);
        }
        let Block { value, along } = self.last.sums(0, now);
        (value, along)
    }
}

//! The layers, laid out for the processor, and their forward pass with derivatives along two directions.
#![allow(clippy::needless_range_loop, reason = "several arrays run along the same index")]

use std::mem;

use super::document::{Layer, Scaling};
use super::sigmoid::{TO_EXPONENT, logistic_lanes};
use super::{FEEDBACK, INPUTS_ACCELERATIONS};
use crate::lanes::axpy;

/// Largest width of a layer, inputs included; the paper has 8.
pub const WIDTH_MAX: usize = 32;
/// Neurons that are computed side by side: with both derivatives they fill the registers of the oldest 64-bit processors.
const LANES: usize = 8;
/// Blocks of the widest layer.
const BLOCKS: usize = WIDTH_MAX / LANES;
/// Blocks of the layers of most networks: twice the paper's.
const SMALL: usize = 2;
/// Outputs of the last layer.
const OUTPUTS: usize = FEEDBACK;

/// Most numbers that a network sees.
const SEEN_MAX: usize = INPUTS_ACCELERATIONS + FEEDBACK;

/// What the first layer sees: the measured inputs, the memory, and zeros behind them.
pub type Inputs = [f64; SEEN_MAX];
/// A direction of the input: the elements that are not zero, with their indices.
pub type Direction = [(usize, f64)];

/// One block of neurons.
type Block = [f64; LANES];
/// The values of a layer of at most `B` blocks.
type Values<const B: usize> = [Block; B];

/// `x y`, side by side.
#[inline(always)]
fn times(x: &Block, y: &Block) -> Block {
    let mut products = *x;
    for lane in 0..LANES {
        products[lane] *= y[lane];
    }
    products
}

/// The sum over a block, always in the same order.
#[inline(always)]
fn sum(x: &Block) -> f64 {
    let [a, b, c, d, e, f, g, h] = *x;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// Values in blocks, with zeros behind the last.
fn in_blocks(values: impl IntoIterator<Item = f64>) -> Vec<Block> {
    let values: Vec<f64> = values.into_iter().collect();
    let block = |chunk: &[f64]| std::array::from_fn(|lane| chunk.get(lane).copied().unwrap_or(0.0));
    values.chunks(LANES).map(block).collect()
}

/// The first layer, in blocks of neurons.
#[derive(Clone, Debug, PartialEq)]
struct First {
    /// For each block the weights of its neurons, input by input; 0 for inputs that there are not.
    weights: Vec<[Block; SEEN_MAX]>,
    /// For each block the biases of its neurons.
    biases: Vec<Block>,
    /// For each output the change of the neurons' sums along the output's direction.
    along: [Vec<Block>; OUTPUTS],
}

impl First {
    /// Of a layer whose inputs are quantities in their own units; values and changes take factors.
    fn new(layer: &Layer, directions: [&Direction; OUTPUTS], (value, change): (f64, f64)) -> Self {
        let weight = |row: &[f64], i: usize| row.get(i).map_or(0.0, |weight| value * weight);
        let inputs: [_; SEEN_MAX] = std::array::from_fn(|i| in_blocks(layer.weights.iter().map(|row| weight(row, i))));
        let along = |row: &[f64], direction: &Direction| direction.iter().map(|(i, x)| row[*i] * x).sum::<f64>();
        Self {
            weights: (0..inputs[0].len()).map(|block| inputs.each_ref().map(|blocks| blocks[block])).collect(),
            biases: in_blocks(layer.biases.iter().map(|bias| value * bias)),
            along: directions.map(|to| in_blocks(layer.weights.iter().map(|row| change * along(row, to)))),
        }
    }

    /// The sums of a block of neurons whose inputs are `x`.
    #[inline(always)]
    fn sums(&self, block: usize, x: &Inputs) -> Block {
        let mut sums = self.biases[block];
        let weights = &self.weights[block];
        for i in 0..SEEN_MAX {
            axpy(x[i], &weights[i], &mut sums);
        }
        sums
    }
}

/// A hidden layer behind the first, in tiles of a block of neurons and a block of inputs: in whole tiles nothing is counted.
#[derive(Clone, Debug, PartialEq)]
struct Inner {
    /// For each block of neurons the tiles of its inputs; in a tile, input by input, the weights of the neurons.
    tiles: Vec<Vec<[Block; LANES]>>,
    /// For each block the biases of its neurons.
    biases: Vec<Block>,
}

impl Inner {
    fn new(layer: &Layer, factor: f64) -> Self {
        let weight =
            |row: usize, i: usize| layer.weights.get(row).and_then(|row| row.get(i)).map_or(0.0, |w| factor * w);
        let tile = |block: usize, inputs: usize| {
            std::array::from_fn(|i| std::array::from_fn(|lane| weight(block * LANES + lane, inputs * LANES + i)))
        };
        let inputs = layer.weights[0].len().div_ceil(LANES);
        let biases = in_blocks(layer.biases.iter().map(|bias| factor * bias));
        Self { tiles: (0..biases.len()).map(|block| (0..inputs).map(|i| tile(block, i)).collect()).collect(), biases }
    }

    /// The sums of a block of neurons whose inputs are `x`.
    #[inline(always)]
    fn sums<const B: usize>(&self, block: usize, x: &Values<B>) -> Block {
        let mut sums = self.biases[block];
        for (tile, x) in self.tiles[block].iter().zip(x) {
            for i in 0..LANES {
                axpy(x[i], &tile[i], &mut sums);
            }
        }
        sums
    }

    /// How they change with inputs that change along both directions.
    #[inline(always)]
    fn sums_along<const B: usize>(&self, block: usize, [x, y]: &[Values<B>; OUTPUTS]) -> [Block; OUTPUTS] {
        let mut sums = [[0.0; LANES]; OUTPUTS];
        for ((tile, x), y) in self.tiles[block].iter().zip(x).zip(y) {
            for i in 0..LANES {
                axpy(x[i], &tile[i], &mut sums[0]);
                axpy(y[i], &tile[i], &mut sums[1]);
            }
        }
        sums
    }
}

/// The last layer: for each output its weights in blocks, and its bias.
type Last = [(Vec<Block>, f64); OUTPUTS];

#[inline(always)]
fn dot<const B: usize>(weights: &[Block], x: &Values<B>) -> f64 {
    let mut blocks = weights.iter().zip(x);
    // Every layer has a block; from nothing the sum would begin one addition later.
    let Some((weights, x_0)) = blocks.next() else { return 0.0 };
    let mut products = times(weights, x_0);
    for (weights, x) in blocks {
        for lane in 0..LANES {
            products[lane] += weights[lane] * x[lane];
        }
    }
    sum(&products)
}

/// The values of one layer, and their changes along the directions.
struct Jets<const B: usize> {
    value: Values<B>,
    along: [Values<B>; OUTPUTS],
}

impl<const B: usize> Jets<B> {
    const ZERO: Self = Self { value: [[0.0; LANES]; B], along: [[[0.0; LANES]; B]; OUTPUTS] };

    /// The neurons of a block from their sums.
    #[inline(always)]
    fn activate(&mut self, block: usize, sums: Block) {
        self.value[block] = logistic_lanes(sums);
    }

    /// The changes of the same neurons from those of their sums.
    #[inline(always)]
    fn activate_along(&mut self, block: usize, sums: [&Block; OUTPUTS]) {
        let value = self.value[block];
        let mut slope = value;
        for lane in 0..LANES {
            slope[lane] *= 1.0 - value[lane];
        }
        for d in 0..OUTPUTS {
            self.along[d][block] = times(&slope, sums[d]);
        }
    }
}

/// The whole stack. A network without hidden layers has no last layer behind its first.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    first: First,
    inner: Vec<Inner>,
    last: Option<Last>,
    /// Most blocks of a hidden layer.
    widest: usize,
}

impl Layers {
    /// Packs layers whose sizes have been checked. The scaling of the first inputs goes into the weights, so these inputs are
    /// quantities in their own units. [`Self::forward_along`] differentiates each output along its own one of the `directions`.
    pub fn new(layers: &[Layer], inputs: &[Scaling], directions: [&Direction; OUTPUTS]) -> Self {
        let mut layers = layers.to_vec();
        let Layer { weights, biases } = &mut layers[0];
        for (row, bias) in weights.iter_mut().zip(biases) {
            for (w, Scaling { mean, deviation }) in row.iter_mut().zip(inputs) {
                *w /= deviation;
                *bias -= *w * mean;
            }
        }
        let (first, others) = layers.split_first().expect("a checked document has a layer");
        let Some((last, inner)) = others.split_last() else {
            return Self { first: First::new(first, directions, (1.0, 1.0)), inner: Vec::new(), last: None, widest: 0 };
        };
        let hidden = 0..layers.len() - 1;
        let widest = hidden.map(|i| layers[i].biases.len().div_ceil(LANES)).max().unwrap_or(0);
        // The weights of the inner layers carry the factor of the exponent, which the changes must not.
        let change = inner.iter().fold(1.0, |change, _| change / TO_EXPONENT);
        Self {
            first: First::new(first, directions, (TO_EXPONENT, change)),
            inner: inner.iter().map(|layer| Inner::new(layer, TO_EXPONENT)).collect(),
            last: Some(std::array::from_fn(|o| (in_blocks(last.weights[o].iter().copied()), last.biases[o]))),
            widest,
        }
    }

    /// The two outputs at the input `x`.
    #[inline]
    pub fn forward(&self, x: &Inputs) -> [f64; OUTPUTS] {
        if self.is_small() { self.pass::<false, SMALL>(x).0 } else { self.pass::<false, BLOCKS>(x).0 }
    }

    /// The two outputs at the input `x`, and how each changes along its direction.
    #[inline(always)]
    pub fn forward_along(&self, x: &Inputs) -> ([f64; OUTPUTS], [f64; OUTPUTS]) {
        if self.is_small() { self.pass::<true, SMALL>(x) } else { self.pass::<true, BLOCKS>(x) }
    }

    #[inline(always)]
    fn is_small(&self) -> bool {
        self.widest <= SMALL
    }

    /// Through layers of at most `B` blocks.
    #[inline(always)]
    fn pass<const ALONG: bool, const B: usize>(&self, x: &Inputs) -> ([f64; OUTPUTS], [f64; OUTPUTS]) {
        let Self { first, inner, last, .. } = self;
        let Some(last) = last else {
            let sums = first.sums(0, x);
            return (std::array::from_fn(|o| sums[o]), std::array::from_fn(|o| first.along[o][0][o]));
        };
        let (mut one, mut other) = (Jets::<B>::ZERO, Jets::<B>::ZERO);
        let (mut now, mut next) = (&mut one, &mut other);
        // No layer is wider; said here, it spares checks of every block.
        for block in 0..first.biases.len().min(B) {
            now.activate(block, first.sums(block, x));
            if ALONG {
                now.activate_along(block, first.along.each_ref().map(|along| &along[block]));
            }
        }
        for layer in inner {
            for block in 0..layer.biases.len().min(B) {
                next.activate(block, layer.sums(block, &now.value));
                if ALONG {
                    next.activate_along(block, layer.sums_along(block, &now.along).each_ref());
                }
            }
            mem::swap(&mut now, &mut next);
        }
        let output = |o: usize| last[o].1 + dot(&last[o].0, &now.value);
        let slope = |o: usize| if ALONG { dot(&last[o].0, &now.along[o]) } else { 0.0 };
        ([output(0), output(1)], [slope(0), slope(1)])
    }
}

//! The paper's recipe, [Kebbati, section 4.1]: Adam on batches of 16 samples, 100 epochs, mean squared error, each sample with
//! the true previous stiffness. Automatic differentiation and Adam are candle's.

use anyhow::Result;
use candle_core::{DType, Device, Tensor, Var};
use candle_nn::{AdamW, Optimizer, ParamsAdamW, ops};
use lpv_mpc::jordan::Layer;
use nalgebra::DVector;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;

use super::data::Run;
use super::learn::Scales;
use super::recipe::Recipe;
use super::stack::{Sequence, Shape};
use crate::output::Output;

/// Samples of a batch, [Kebbati, section 4.1].
const BATCH: usize = 16;
/// Passes through the training set, [Kebbati, section 4.1].
const EPOCHS: usize = 100;
/// Learning rate, [Kebbati, section 4.1].
const RATE: f64 = 5e-4;

/// Single samples: inputs with the true previous answer, and the true answer.
struct Samples {
    inputs: Vec<f64>,
    answers: Vec<f64>,
    width: usize,
}

impl Samples {
    fn new(sequences: &[Sequence], shape: &Shape) -> Self {
        let mut samples = Self { inputs: Vec::new(), answers: Vec::new(), width: shape.width() };
        for Sequence { inputs, answers, start } in sequences {
            let previous = std::iter::once(start).chain(answers);
            for ((inputs, previous), answer) in inputs.chunks_exact(shape.inputs).zip(previous).zip(answers) {
                samples.inputs.extend(inputs.iter().chain(previous));
                samples.answers.extend(answer);
            }
        }
        samples
    }

    /// The samples of these numbers as tensors.
    fn batch(&self, numbers: &[usize]) -> candle_core::Result<(Tensor, Tensor)> {
        let pick = |values: &[f64], width: usize| -> Vec<f64> {
            numbers.iter().flat_map(|&i| values[i * width..(i + 1) * width].to_vec()).collect()
        };
        let outputs = self.answers.len() * self.width / self.inputs.len();
        Ok((
            Tensor::from_vec(pick(&self.inputs, self.width), (numbers.len(), self.width), &Device::Cpu)?,
            Tensor::from_vec(pick(&self.answers, outputs), (numbers.len(), outputs), &Device::Cpu)?,
        ))
    }

    fn len(&self) -> usize {
        self.inputs.len() / self.width
    }
}

/// Weights and biases of the layers as candle's variables.
struct Stack(Vec<(Var, Var)>);

impl Stack {
    fn new(layers: &[Layer]) -> candle_core::Result<Self> {
        let layer = |Layer { weights, biases }: &Layer| {
            let (rows, columns) = (weights.len(), weights[0].len());
            let weights = Tensor::from_vec(weights.concat(), (rows, columns), &Device::Cpu)?;
            Ok((Var::from_tensor(&weights)?, Var::from_tensor(&Tensor::new(biases.as_slice(), &Device::Cpu)?)?))
        };
        Ok(Self(layers.iter().map(layer).collect::<candle_core::Result<_>>()?))
    }

    fn error(&self, (inputs, answers): &(Tensor, Tensor)) -> candle_core::Result<Tensor> {
        let mut x = inputs.clone();
        for (i, (weights, biases)) in self.0.iter().enumerate() {
            x = x.matmul(&weights.t()?)?.broadcast_add(biases)?;
            if i + 1 < self.0.len() {
                x = ops::sigmoid(&x)?;
            }
        }
        (x - answers)?.sqr()?.mean_all()
    }

    fn parameters(&self) -> candle_core::Result<DVector<f64>> {
        let mut values = Vec::new();
        for (weights, biases) in &self.0 {
            values.extend(weights.flatten_all()?.to_vec1::<f64>()?);
            values.extend(biases.to_vec1::<f64>()?);
        }
        Ok(DVector::from_vec(values))
    }
}

/// Trains by the paper's recipe; returns the parameters and the errors after each epoch, all teacher-forced.
pub fn train(
    recipe: &Recipe,
    scales: &Scales,
    [training, validation]: [&[Run]; 2],
    output: &Output,
) -> Result<(DVector<f64>, Vec<(usize, f64, f64)>)> {
    let shape = recipe.shape();
    let mut rng = Pcg64Mcg::seed_from_u64(recipe.seed);
    let [training, validation] = [training, validation].map(|runs| {
        let sequences: Vec<Sequence> = runs.iter().map(|run| scales.sequence(run, [0.0; 2])).collect();
        Samples::new(&sequences, &shape)
    });
    let stack = Stack::new(&shape.layers(&shape.random(&mut rng)))?;
    let variables = stack.0.iter().flat_map(|(weights, biases)| [weights.clone(), biases.clone()]).collect();
    // Without weight decay AdamW is Adam.
    let mut adam = AdamW::new(variables, ParamsAdamW { lr: RATE, weight_decay: 0.0, ..ParamsAdamW::default() })?;
    let all = validation.batch(&(0..validation.len()).collect::<Vec<usize>>())?;
    let mut order: Vec<usize> = (0..training.len()).collect();
    let mut curve = Vec::new();
    let bar = output.bar("training", EPOCHS as u64);
    for epoch in 1..=EPOCHS {
        order.shuffle(&mut rng);
        let mut sum = 0.0;
        for numbers in order.chunks(BATCH) {
            let error = stack.error(&training.batch(numbers)?)?;
            adam.backward_step(&error)?;
            sum += error.to_dtype(DType::F64)?.to_scalar::<f64>()? * numbers.len() as f64;
        }
        curve.push((epoch, sum / training.len() as f64, stack.error(&all)?.to_scalar::<f64>()?));
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok((stack.parameters()?, curve))
}

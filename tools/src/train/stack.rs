//! The network as training sees it: one vector of parameters, answers that are fed back, and their sensitivities.

use lpv_mpc::jordan::{FEEDBACK, Layer, sigmoid};
use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// Sizes of a network with two hidden layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Measured inputs.
    pub inputs: usize,
    /// Neurons of the hidden layers.
    pub hidden: [usize; 2],
}

/// A manoeuvre in the network's own units.
#[derive(Clone, Debug, PartialEq)]
pub struct Sequence {
    /// Standardised inputs of each sample, one after the other.
    pub inputs: Vec<f64>,
    /// Standardised true answers.
    pub answers: Vec<[f64; FEEDBACK]>,
    /// The memory to begin with.
    pub start: [f64; FEEDBACK],
}

/// Where the parts of the parameters begin: weights and biases of the three layers, rows one after the other.
#[derive(Clone, Copy, Debug)]
struct Parts {
    b_1: usize,
    w_2: usize,
    b_2: usize,
    w_3: usize,
    b_3: usize,
}

impl Shape {
    /// Inputs with the fed-back outputs.
    pub fn width(&self) -> usize {
        self.inputs + FEEDBACK
    }

    fn parts(&self) -> Parts {
        let [h_1, h_2] = self.hidden;
        let b_1 = h_1 * self.width();
        let w_2 = b_1 + h_1;
        let b_2 = w_2 + h_2 * h_1;
        let w_3 = b_2 + h_2;
        let b_3 = w_3 + FEEDBACK * h_2;
        Parts { b_1, w_2, b_2, w_3, b_3 }
    }

    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.parts().b_3 + FEEDBACK
    }

    /// Indices of the weights on the fed-back outputs.
    pub fn feedback(&self) -> impl Iterator<Item = usize> + use<> {
        let (width, inputs) = (self.width(), self.inputs);
        (0..self.hidden[0]).flat_map(move |row| (inputs..width).map(move |column| row * width + column))
    }

    /// Random weights, uniform with the variance that keeps signals of unit size [Glorot and Bengio, 2010]; the fed-back
    /// outputs begin with a tenth of that, so that the free run begins as a contraction.
    pub fn random(&self, rng: &mut Pcg64Mcg) -> DVector<f64> {
        let [h_1, h_2] = self.hidden;
        let Parts { b_1, w_2, b_2, w_3, b_3 } = self.parts();
        let mut theta = DVector::zeros(self.parameters());
        for (from, to, fan) in [(0, b_1, self.width() + h_1), (w_2, b_2, h_1 + h_2), (w_3, b_3, h_2 + FEEDBACK)] {
            // Four times the rule for tanh: the logistic function is a quarter as steep.
            let limit = 4.0 * (6.0 / fan as f64).sqrt();
            let limit = if from == w_3 { limit / 4.0 } else { limit };
            theta.rows_mut(from, to - from).apply(|w| *w = rng.random_range(-limit..limit));
        }
        theta.rows_mut(b_1, h_1).apply(|b| *b = rng.random_range(-1.0..1.0));
        for i in self.feedback() {
            theta[i] *= 0.1;
        }
        theta
    }

    /// The layers of a network file.
    pub fn layers(&self, theta: &DVector<f64>) -> Vec<Layer> {
        let [h_1, h_2] = self.hidden;
        let Parts { b_1, w_2, b_2, w_3, b_3 } = self.parts();
        let layer = |w: usize, b: usize, rows: usize, columns: usize| Layer {
            weights: (0..rows).map(|i| theta.as_slice()[w + i * columns..w + (i + 1) * columns].to_vec()).collect(),
            biases: theta.as_slice()[b..b + rows].to_vec(),
        };
        vec![layer(0, b_1, h_1, self.width()), layer(w_2, b_2, h_2, h_1), layer(w_3, b_3, FEEDBACK, h_2)]
    }

    /// Scales the weights on the memory down until the certificate of contraction holds with the factor `rho`.
    ///
    /// Returns whether they had to be scaled.
    pub fn contract(&self, theta: &mut DVector<f64>, rho: f64) -> bool {
        let [h_1, h_2] = self.hidden;
        let Parts { w_2, w_3, .. } = self.parts();
        let width = self.width();
        let norm = |rows: usize, columns: usize, at: &dyn Fn(usize, usize) -> usize| {
            DMatrix::from_fn(rows, columns, |i, j| theta[at(i, j)]).singular_values().max()
        };
        let bound = norm(h_1, FEEDBACK, &|i, j| i * width + self.inputs + j)
            * norm(h_2, h_1, &|i, j| w_2 + i * h_1 + j)
            * norm(FEEDBACK, h_2, &|i, j| w_3 + i * h_2 + j)
            / 16.0;
        if bound <= rho {
            return false;
        }
        for i in self.feedback() {
            theta[i] *= rho / bound;
        }
        true
    }

    /// One answer; leaves the hidden layers in `a_1` and `a_2`.
    fn forward(&self, theta: &[f64], x: &[f64], a_1: &mut [f64], a_2: &mut [f64]) -> [f64; FEEDBACK] {
        let Parts { b_1, w_2, b_2, w_3, b_3 } = self.parts();
        multiply(&theta[..b_1], &theta[b_1..w_2], x, a_1);
        sigmoid(a_1);
        multiply(&theta[w_2..b_2], &theta[b_2..w_3], a_1, a_2);
        sigmoid(a_2);
        let mut y = [0.0; FEEDBACK];
        multiply(&theta[w_3..b_3], &theta[b_3..], a_2, &mut y);
        y
    }

    /// Runs along a sequence on its own answers, `each(sample, answer)`.
    pub fn free_run(&self, theta: &DVector<f64>, sequence: &Sequence, mut each: impl FnMut(usize, [f64; FEEDBACK])) {
        let mut x = vec![0.0; self.width()];
        let (mut a_1, mut a_2) = (vec![0.0; self.hidden[0]], vec![0.0; self.hidden[1]]);
        let mut y = sequence.start;
        for (k, inputs) in sequence.inputs.chunks_exact(self.inputs).enumerate() {
            x[..self.inputs].copy_from_slice(inputs);
            x[self.inputs..].copy_from_slice(&y);
            y = self.forward(theta.as_slice(), &x, &mut a_1, &mut a_2);
            each(k, y);
        }
    }

    /// Runs along a sequence on its own answers and hands over each answer with its derivatives by all parameters, one slice
    /// for each output: `S_k = A_k S_(k-1) + B_k`, where `A_k` is how the answer depends on the last one.
    pub fn sensitivities(
        &self,
        theta: &DVector<f64>,
        sequence: &Sequence,
        mut each: impl FnMut(usize, [f64; FEEDBACK], &[Vec<f64>; FEEDBACK]),
    ) {
        let [h_1, h_2] = self.hidden;
        let Parts { b_1, w_2, b_2, w_3, b_3 } = self.parts();
        let theta = theta.as_slice();
        let width = self.width();
        let mut x = vec![0.0; width];
        let (mut a_1, mut a_2) = (vec![0.0; h_1], vec![0.0; h_2]);
        let (mut d_1, mut d_2) = (vec![0.0; h_1], vec![0.0; h_2]);
        let mut sensitivity: [Vec<f64>; FEEDBACK] = std::array::from_fn(|_| vec![0.0; self.parameters()]);
        let mut last = sensitivity.clone();
        let mut y = sequence.start;
        for (k, inputs) in sequence.inputs.chunks_exact(self.inputs).enumerate() {
            x[..self.inputs].copy_from_slice(inputs);
            x[self.inputs..].copy_from_slice(&y);
            y = self.forward(theta, &x, &mut a_1, &mut a_2);
            std::mem::swap(&mut sensitivity, &mut last);
            for o in 0..FEEDBACK {
                for j in 0..h_2 {
                    d_2[j] = theta[w_3 + o * h_2 + j] * a_2[j] * (1.0 - a_2[j]);
                }
                for i in 0..h_1 {
                    let sum: f64 = (0..h_2).map(|j| d_2[j] * theta[w_2 + j * h_1 + i]).sum();
                    d_1[i] = sum * a_1[i] * (1.0 - a_1[i]);
                }
                let a: [f64; FEEDBACK] =
                    std::array::from_fn(|m| (0..h_1).map(|i| d_1[i] * theta[i * width + self.inputs + m]).sum());
                let s = &mut sensitivity[o];
                for ((s, from_f), from_r) in s.iter_mut().zip(&last[0]).zip(&last[1]) {
                    *s = a[0] * from_f + a[1] * from_r;
                }
                for i in 0..h_1 {
                    add_scaled(&mut s[i * width..(i + 1) * width], d_1[i], &x);
                    s[b_1 + i] += d_1[i];
                }
                for j in 0..h_2 {
                    add_scaled(&mut s[w_2 + j * h_1..w_2 + (j + 1) * h_1], d_2[j], &a_1);
                    s[b_2 + j] += d_2[j];
                }
                add_scaled(&mut s[w_3 + o * h_2..w_3 + (o + 1) * h_2], 1.0, &a_2);
                s[b_3 + o] += 1.0;
            }
            each(k, y, &sensitivity);
        }
    }
}

/// `y = weights x + biases`.
fn multiply(weights: &[f64], biases: &[f64], x: &[f64], y: &mut [f64]) {
    for ((y, row), b) in y.iter_mut().zip(weights.chunks_exact(x.len())).zip(biases) {
        *y = b + row.iter().zip(x).map(|(w, x)| w * x).sum::<f64>();
    }
}

fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lpv_mpc::jordan::{Document, Envelope, Measured, Network, Provenance, Range, Scaling, Scores};
    use rand::SeedableRng;

    const SHAPE: Shape = Shape { inputs: 5, hidden: [8, 5] };

    fn sequence(rng: &mut Pcg64Mcg, samples: usize) -> Sequence {
        let mut draw = || rng.random_range(-1.5..1.5);
        Sequence {
            inputs: (0..samples * SHAPE.inputs).map(|_| draw()).collect(),
            answers: (0..samples).map(|_| [draw(), draw()]).collect(),
            start: [draw(), draw()],
        }
    }

    fn last_answer(theta: &DVector<f64>, sequence: &Sequence) -> [f64; FEEDBACK] {
        let mut last = [0.0; FEEDBACK];
        SHAPE.free_run(theta, sequence, |_, y| last = y);
        last
    }

    #[test]
    fn sensitivities_are_the_slopes_of_the_free_run() {
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let mut theta = SHAPE.random(&mut rng);
        // Feedback strong enough that the past matters.
        SHAPE.feedback().for_each(|i| theta[i] *= 10.0);
        let sequence = sequence(&mut rng, 6);
        let mut exact: [Vec<f64>; FEEDBACK] = Default::default();
        SHAPE.sensitivities(&theta, &sequence, |_, _, s| exact.clone_from(s));
        for i in 0..SHAPE.parameters() {
            let at = |step: f64| {
                let mut moved = theta.clone();
                moved[i] += step;
                last_answer(&moved, &sequence)
            };
            let (above, below) = (at(1e-5), at(-1e-5));
            for o in 0..FEEDBACK {
                let slope = (above[o] - below[o]) / 2e-5;
                // Central differences of answers of order 1 at 1e-5: 1e-10 from the step, 1e-11 from rounding.
                assert!((exact[o][i] - slope).abs() < 1e-8, "parameter {i}: {} against {slope}", exact[o][i]);
            }
        }
    }

    #[test]
    fn training_and_controller_run_the_same_network() {
        let mut rng = Pcg64Mcg::seed_from_u64(4);
        let theta = SHAPE.random(&mut rng);
        let sequence = sequence(&mut rng, 30);
        let unit = Scaling { mean: 0.0, deviation: 1.0 };
        let range = Range { min: -2.0, max: 2.0 };
        let network = Network::try_from(Document {
            t_s: 0.033,
            l_f: 1.2,
            l_r: 1.6,
            c_f_nominal: 1.0,
            c_r_nominal: 1.0,
            inputs: vec![unit; 5],
            outputs: [unit; 2],
            layers: SHAPE.layers(&theta),
            envelope: Envelope { inputs: vec![range; 5], alpha_f: range, alpha_r: range },
            scores: Scores::default(),
            provenance: Provenance {
                recipe: String::new(),
                preset: String::new(),
                tyre: String::new(),
                mu: [1.0, 1.0],
                noise: 0.0,
                wind: 0.0,
                seed: 4,
                manoeuvres: 0,
                beyond: 0,
                data: String::new(),
            },
        })
        .unwrap();
        let mut memory = network.memory(sequence.start[0], sequence.start[1]);
        SHAPE.free_run(&theta, &sequence, |k, y| {
            let x = &sequence.inputs[5 * k..];
            let measured =
                Measured { v_x: x[0], v_y: x[1], yaw_rate: x[2], delta: x[3], a_x: x[4], ..Measured::default() };
            memory = network.step(&memory, &measured);
            // The order of the sums differs.
            assert!((memory.c_f - y[0]).abs().max((memory.c_r - y[1]).abs()) < 1e-12, "sample {k}");
        });
    }

    #[test]
    fn contracted_weights_forget_a_wrong_memory_at_the_promised_rate() {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let mut theta = SHAPE.random(&mut rng);
        SHAPE.feedback().for_each(|i| theta[i] *= 1e3);
        assert!(SHAPE.contract(&mut theta, 0.79), "feedback a thousand times too strong was let through");
        assert!(!SHAPE.contract(&mut theta, 0.79 + 1e-9), "what was contracted is contracted again");
        let right = sequence(&mut rng, 20);
        let wrong = Sequence { start: [right.start[0] + 3.0, right.start[1] - 4.0], ..right.clone() };
        let (a, b) = (last_answer(&theta, &right), last_answer(&theta, &wrong));
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) <= 0.79_f64.powi(20) * 5.0, "{a:?} and {b:?}");
    }
}

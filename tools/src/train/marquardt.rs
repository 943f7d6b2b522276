//! The second-order finish: Levenberg and Marquardt's method on the free run.
//!
//! The Jacobian of a whole set would be a hundred megabytes; its products `J'J` and `J'r` are a few hundred kilobytes and are
//! summed up manoeuvre by manoeuvre. That is why no library's least squares serves here: they want the Jacobian itself.

use lpv_mpc::jordan::FEEDBACK;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::stack::{Sequence, Shape};

/// Weight decay on all parameters [1]; measured on prototypes: enough to keep `J'J` regular, too little to cost accuracy.
const DECAY: f64 = 1e-9;
/// Samples at the start of a manoeuvre that are not scored: the memory may begin wrong.
pub const UNSCORED: usize = 2;
/// Sums are formed in this many parts whatever the number of threads, so that rounding does not depend on it.
const PARTS: usize = 16;
/// Damping beyond which no step is left that would change anything.
const DAMPING_MAX: f64 = 1e8;

/// Half-way results of the method; enough to go on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Marquardt {
    /// The parameters.
    pub theta: DVector<f64>,
    /// Mean squared error of the training set at them, in the network's units.
    pub error: f64,
    /// The damping.
    pub damping: f64,
    /// Factor of the next rejected step's damping.
    growth: f64,
    /// Whether the certificate of contraction binds: then the weights on the memory rest.
    bound: bool,
    /// Follows from the parameters; kept while steps are rejected.
    #[serde(skip)]
    normal: Option<Normal>,
}

/// `J'J` and `J'r`, per residual.
#[derive(Clone, Debug, PartialEq)]
struct Normal {
    hessian: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// Mean squared error over scored samples, free-running.
pub fn error(shape: &Shape, theta: &DVector<f64>, sequences: &[Sequence]) -> f64 {
    let squares: Vec<(f64, usize)> = sequences
        .par_iter()
        .map(|sequence| {
            let mut sum = (0.0, 0);
            shape.free_run(theta, sequence, |k, y| {
                if k >= UNSCORED {
                    sum.0 += (0..FEEDBACK).map(|o| (y[o] - sequence.answers[k][o]).powi(2)).sum::<f64>();
                    sum.1 += FEEDBACK;
                }
            });
            sum
        })
        .collect();
    let (sum, count) = squares.iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    sum / count as f64
}

impl Normal {
    fn new(shape: &Shape, theta: &DVector<f64>, sequences: &[Sequence]) -> Self {
        let n = shape.parameters();
        let count: usize =
            sequences.iter().map(|sequence| FEEDBACK * sequence.answers.len().saturating_sub(UNSCORED)).sum();
        let parts: Vec<(DMatrix<f64>, DVector<f64>)> = sequences
            .par_chunks(sequences.len().div_ceil(PARTS))
            .map(|part| {
                let mut sum = (DMatrix::zeros(n, n), DVector::zeros(n));
                for sequence in part {
                    add(shape, theta, sequence, &mut sum);
                }
                sum
            })
            .collect();
        let mut normal = Self { hessian: DMatrix::zeros(n, n), gradient: DVector::zeros(n) };
        for (hessian, gradient) in parts {
            normal.hessian += hessian;
            normal.gradient += gradient;
        }
        normal.hessian /= count as f64;
        normal.gradient /= count as f64;
        for i in 0..n {
            normal.hessian[(i, i)] += DECAY;
        }
        normal.gradient += theta * DECAY;
        normal
    }
}

/// Adds one sequence's share to `J'J` and `J'r`.
fn add(
    shape: &Shape,
    theta: &DVector<f64>,
    sequence: &Sequence,
    (hessian, gradient): &mut (DMatrix<f64>, DVector<f64>),
) {
    let scored = sequence.answers.len().saturating_sub(UNSCORED);
    let mut transposed = DMatrix::zeros(shape.parameters(), FEEDBACK * scored);
    let mut residuals = DVector::zeros(FEEDBACK * scored);
    shape.sensitivities(theta, sequence, |k, y, s| {
        if k >= UNSCORED {
            for o in 0..FEEDBACK {
                let column = FEEDBACK * (k - UNSCORED) + o;
                transposed.column_mut(column).copy_from_slice(&s[o]);
                residuals[column] = y[o] - sequence.answers[k][o];
            }
        }
    });
    hessian.gemm(1.0, &transposed, &transposed.transpose(), 1.0);
    gradient.gemv(1.0, &transposed, &residuals, 1.0);
}

impl Marquardt {
    /// Begins at `theta`.
    pub fn new(shape: &Shape, theta: DVector<f64>, sequences: &[Sequence]) -> Self {
        let error = error(shape, &theta, sequences);
        Self { theta, error, damping: 1e-2, growth: 2.0, bound: false, normal: None }
    }

    /// Whether no further step makes sense.
    pub fn finished(&self) -> bool {
        self.damping > DAMPING_MAX
    }

    /// One attempt of a step; says whether it was taken. `rho` is the contraction factor that is kept.
    pub fn step(&mut self, shape: &Shape, sequences: &[Sequence], rho: f64) -> bool {
        let n = shape.parameters();
        let normal = self.normal.get_or_insert_with(|| Normal::new(shape, &self.theta, sequences));
        let mut damped = normal.hessian.clone();
        let mut right = -&normal.gradient;
        for i in 0..n {
            damped[(i, i)] += self.damping;
        }
        if self.bound {
            // The weights on the memory are held: their rows and columns become the identity.
            for i in shape.feedback() {
                damped.row_mut(i).fill(0.0);
                damped.column_mut(i).fill(0.0);
                damped[(i, i)] = 1.0;
                right[i] = 0.0;
            }
        }
        let Some(cholesky) = damped.cholesky() else { return self.reject() };
        let step = cholesky.solve(&right);
        let mut trial = &self.theta + &step;
        let bound = shape.contract(&mut trial, rho);
        let taken = &trial - &self.theta;
        let error = error(shape, &trial, sequences);
        let merit = |error: f64, theta: &DVector<f64>| 0.5 * (error + DECAY * theta.norm_squared());
        let gain = merit(self.error, &self.theta) - merit(error, &trial);
        // What the quadratic model promises for the step that was taken.
        let promised = -(normal.gradient.dot(&taken) + 0.5 * taken.dot(&(&normal.hessian * &taken)));
        // Not a number is no gain.
        if gain.is_nan() || gain <= 0.0 {
            return self.reject();
        }
        // Nielsen's rule: the better the promise was kept, the less damping.
        let ratio = if promised > 0.0 { gain / promised } else { 0.5 };
        self.damping = (self.damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-14);
        self.growth = 2.0;
        self.bound = bound;
        self.theta = trial;
        self.error = error;
        self.normal = None;
        true
    }

    fn reject(&mut self) -> bool {
        self.damping *= self.growth;
        self.growth *= 2.0;
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    const SHAPE: Shape = Shape { inputs: 5, hidden: [4, 3] };

    /// Sequences that a network of the same shape made.
    fn sequences(rng: &mut Pcg64Mcg) -> Vec<Sequence> {
        let teacher = SHAPE.random(rng);
        (0..8)
            .map(|_| {
                let inputs = (0..40 * SHAPE.inputs).map(|_| rng.random_range(-1.5..1.5)).collect();
                let mut sequence = Sequence { inputs, answers: Vec::new(), start: [0.3, -0.2] };
                let mut answers = Vec::new();
                SHAPE.free_run(&teacher, &sequence, |_, y| answers.push(y));
                sequence.answers = answers;
                sequence
            })
            .collect()
    }

    #[test]
    fn gradient_is_the_slope_of_the_merit() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let sequences = sequences(&mut rng);
        let theta = SHAPE.random(&mut rng);
        let normal = Normal::new(&SHAPE, &theta, &sequences);
        for i in 0..SHAPE.parameters() {
            let merit = |step: f64| {
                let mut moved = theta.clone();
                moved[i] += step;
                0.5 * (error(&SHAPE, &moved, &sequences) + DECAY * moved.norm_squared())
            };
            let slope = (merit(1e-5) - merit(-1e-5)) / 2e-5;
            // Central differences at 1e-5 of a merit of order 1.
            assert!((normal.gradient[i] - slope).abs() < 1e-8, "{i}: {} against {slope}", normal.gradient[i]);
        }
    }

    #[test]
    fn a_network_learns_its_own_kind() {
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        let sequences = sequences(&mut rng);
        let mut method = Marquardt::new(&SHAPE, SHAPE.random(&mut rng), &sequences);
        let first = method.error;
        for _ in 0..120 {
            let before = method.error;
            let taken = method.step(&SHAPE, &sequences, 0.79);
            assert!(method.error <= before + 1e-9 && (taken || method.error == before), "a step made it worse");
        }
        // The answers lie in the family; a local minimum of this seed's start may keep a little.
        assert!(method.error < 1e-3 * first, "{first:e} to {:e}", method.error);
        let mut theta = method.theta.clone();
        assert!(!SHAPE.contract(&mut theta, 0.79 + 1e-9), "the certificate was lost");
    }
}

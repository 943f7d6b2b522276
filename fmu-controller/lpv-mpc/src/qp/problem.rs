//! Statement of the quadratic programme.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// Prediction from one sample to the next, x⁺ = A x + B u + d, what the next state should be, and how the input should change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stage<const NX: usize, const NU: usize> {
    /// System matrix.
    pub A: SMatrix<f64, NX, NX>,
    /// Input matrix.
    pub B: SMatrix<f64, NX, NU>,
    /// Affine term.
    pub d: SVector<f64, NX>,
    /// Reference of the state that this stage leads to.
    pub x_ref: SVector<f64, NX>,
    /// Reference of the input's increment.
    pub du_ref: SVector<f64, NU>,
}

impl<const NX: usize, const NU: usize> Default for Stage<NX, NU> {
    fn default() -> Self {
        Self {
            A: SMatrix::zeros(),
            B: SMatrix::zeros(),
            d: SVector::zeros(),
            x_ref: SVector::zeros(),
            du_ref: SVector::zeros(),
        }
    }
}

impl<const NX: usize, const NU: usize> Stage<NX, NU> {
    fn is_finite(&self) -> bool {
        let vectors = self.d.iter().chain(&self.x_ref).chain(&self.du_ref);
        self.A.iter().chain(self.B.iter()).chain(vectors).all(|value| value.is_finite())
    }
}

/// Tracking problem over `N = stages.len()` samples, with `du_i = u_i - u_(i-1)` and `u_(-1) = u_prev`:
///
/// ```text
/// minimise    sum (i = 1..N)    (x_i - x_ref_i)' W_i (x_i - x_ref_i)  +  soft e_i^2
///           + sum (i = 0..N-1)  (du_i - du_ref_i)' diag(r) (du_i - du_ref_i)      (nothing is halved)
/// subject to  x_(i+1) = A_i x_i + B_i u_i + d_i
///             u_min <= u_i <= u_max,  |du_i| <= du_max,  |x_i[soft_state]| <= soft_bound + e_i
/// ```
///
/// where `W_i = diag(q)`, and `q_terminal` at `i = N`. A `u_prev` outside of its bounds is moved to the nearest bound first,
/// so a solution always exists.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Problem<const NX: usize, const NU: usize> {
    /// Prediction model and references, one element per sample of the horizon.
    pub stages: Vec<Stage<NX, NU>>,
    /// State now.
    pub x_0: SVector<f64, NX>,
    /// Input that is applied now; the first increment starts from it.
    pub u_prev: SVector<f64, NU>,
    /// Weights on the state's errors, none negative.
    pub q: SVector<f64, NX>,
    /// Weight on the last state's error, symmetric and positive semidefinite.
    pub q_terminal: SMatrix<f64, NX, NX>,
    /// Weights on the input's increments, all positive.
    pub r: SVector<f64, NU>,
    /// Lower bound of the input; may be infinite.
    pub u_min: SVector<f64, NU>,
    /// Upper bound of the input; may be infinite, may equal the lower one.
    pub u_max: SVector<f64, NU>,
    /// Bound of the increment; may be infinite, may be zero.
    pub du_max: SVector<f64, NU>,
    /// Index of the state with a soft bound.
    pub soft_state: usize,
    /// Bound of that state's magnitude.
    pub soft_bound: f64,
    /// Weight on the square by which that state exceeds its bound; zero switches the bound off.
    pub soft: f64,
}

impl<const NX: usize, const NU: usize> Problem<NX, NU> {
    /// Problem of `horizon` samples without weights on the states and without bounds.
    #[must_use]
    pub fn new(horizon: usize) -> Self {
        Self {
            stages: vec![Stage::default(); horizon],
            x_0: SVector::zeros(),
            u_prev: SVector::zeros(),
            q: SVector::zeros(),
            q_terminal: SMatrix::zeros(),
            r: SVector::repeat(1.0),
            u_min: SVector::repeat(f64::NEG_INFINITY),
            u_max: SVector::repeat(f64::INFINITY),
            du_max: SVector::repeat(f64::INFINITY),
            soft_state: 0,
            soft_bound: f64::INFINITY,
            soft: 0.0,
        }
    }

    /// The input applied now, moved into its bounds.
    #[must_use]
    pub fn u_prev_clamped(&self) -> SVector<f64, NU> {
        self.u_prev.zip_zip_map(&self.u_min, &self.u_max, |u, lower, upper| u.max(lower).min(upper))
    }

    /// Whether every number makes sense, so that a solution exists: data finite, weights not negative, bounds in order.
    ///
    /// `q_terminal` is checked on its diagonal alone; a wrong one elsewhere shows in the outcome of the solve.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.is_sensible() && self.stages.iter().all(Stage::is_finite)
    }

    /// [`Self::is_valid`] but for the stages, whose reading takes a noticeable part of a solve.
    pub(super) fn is_sensible(&self) -> bool {
        let not_negative = |weight: &f64| *weight >= 0.0 && weight.is_finite();
        let bounds = (0..NU).all(|j| {
            self.u_min[j] <= self.u_max[j]
                && self.u_min[j] < f64::INFINITY
                && self.u_max[j] > f64::NEG_INFINITY
                && self.du_max[j] >= 0.0
                && self.r[j] > 0.0
                && self.r[j].is_finite()
        });
        bounds
            && !self.stages.is_empty()
            && (self.x_0.sum() + self.u_prev.sum() + self.q_terminal.sum()).is_finite()
            && self.q.iter().all(not_negative)
            && (0..NX).all(|k| self.q_terminal[(k, k)] >= 0.0)
            && self.soft_state < NX
            && not_negative(&self.soft)
            && self.soft_bound >= 0.0
    }

    /// Whether an input cannot move: its bounds meet, or its increment is bounded by zero.
    #[must_use]
    pub fn is_frozen(&self, j: usize) -> bool {
        self.u_min[j] >= self.u_max[j] || self.du_max[j] <= 0.0
    }

    /// Whether the soft bound can have any effect.
    #[must_use]
    pub fn has_soft_bound(&self) -> bool {
        self.soft > 0.0 && self.soft_bound.is_finite()
    }

    /// Cost of a plan of states from now on and inputs; the soft bound's excess is counted with its weight.
    #[must_use]
    pub fn cost(&self, x: &[SVector<f64, NX>], u: &[SVector<f64, NU>]) -> f64 {
        self.cost_of(x[1..].iter().copied().zip(u.iter().copied()))
    }

    /// Cost of a plan, sample by sample the input and the state that it leads to.
    pub(super) fn cost_of(&self, plan: impl Iterator<Item = (SVector<f64, NX>, SVector<f64, NU>)>) -> f64 {
        let N = self.stages.len();
        let mut cost = 0.0;
        let mut u_prev = self.u_prev_clamped();
        for (i, ((x, u), stage)) in plan.zip(&self.stages).enumerate() {
            let error = x - stage.x_ref;
            cost += if i + 1 == N {
                error.dot(&(self.q_terminal * error))
            } else {
                error.component_mul(&error).dot(&self.q)
            };
            let du = u - u_prev - stage.du_ref;
            u_prev = u;
            cost += du.component_mul(&du).dot(&self.r);
            if self.soft > 0.0 {
                cost += self.soft * self.excess(&x).powi(2);
            }
        }
        cost
    }

    /// By how much a state exceeds the soft bound, zero when it does not.
    #[must_use]
    pub fn excess(&self, x: &SVector<f64, NX>) -> f64 {
        (x[self.soft_state].abs() - self.soft_bound).max(0.0)
    }
}

//! One stage of the Riccati recursion over state and previous input.
//!
//! The value of a state x and the input p applied before it is
//! `x' S x + 2 p' T' x + p' U p + 2 s' x + 2 t' p` up to a constant. Keeping the previous input as blocks of its own, instead of
//! augmenting the state, saves the algebra of the rows that are known to be identities.

use super::super::Stage;
use super::active::Hold;
use super::policy::{Policy, invert, policy_gains};
use crate::lanes::axpy;

/// Value function in front of a stage.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value<const NX: usize, const NU: usize> {
    pub S: [[f64; NX]; NX],
    /// Row k is what state k shares with the inputs.
    pub T: [[f64; NU]; NX],
    pub U: [[f64; NU]; NU],
    pub s: [f64; NX],
    pub t: [f64; NU],
}

/// What a second right-hand side needs of a stage that was factorised.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factor<const NX: usize, const NU: usize> {
    /// Mixed curvature of input and state.
    pub G: [[f64; NU]; NX],
    /// Curvature of the input with its increment's weight.
    H: [[f64; NU]; NU],
    /// Inverse of the same with the rows of held inputs replaced.
    pub inverse: [[f64; NU]; NU],
    /// S d
    Sd: [f64; NX],
    /// T' d
    Td: [f64; NU],
    /// R du_ref
    pull: [f64; NU],
}

/// What makes a stage affine instead of linear.
#[derive(Clone, Copy, Debug)]
pub(super) struct Affine<'a, const NX: usize, const NU: usize> {
    pub d: &'a [f64; NX],
    pub du_ref: &'a [f64; NU],
}

impl<'a, const NX: usize, const NU: usize> Affine<'a, NX, NU> {
    /// Nothing: that of differences.
    pub(super) const ZERO: Self = Self { d: &[0.0; NX], du_ref: &[0.0; NU] };

    /// The stage's own.
    pub(super) fn of(stage: &'a Stage<NX, NU>) -> Self {
        Self { d: &stage.d.data.0[0], du_ref: &stage.du_ref.data.0[0] }
    }
}

impl<const NX: usize, const NU: usize> Value<NX, NU> {
    pub(super) const ZERO: Self =
        Self { S: [[0.0; NX]; NX], T: [[0.0; NU]; NX], U: [[0.0; NU]; NU], s: [0.0; NX], t: [0.0; NU] };

    /// Adds `weights_k (x_k - targets_k)^2` of all states.
    #[inline(always)]
    pub(super) fn add_squares(&mut self, weights: &[f64; NX], targets: &[f64; NX]) {
        for k in 0..NX {
            self.S[k][k] += weights[k];
        }
        for k in 0..NX {
            self.s[k] -= weights[k] * targets[k];
        }
    }

    /// Adds `weight (x_k - target)^2`.
    #[inline(always)]
    pub(super) fn add_square(&mut self, k: usize, weight: f64, target: f64) {
        self.S[k][k] += weight;
        self.s[k] -= weight * target;
    }
}

impl<const NX: usize, const NU: usize> Factor<NX, NU> {
    pub(super) const ZERO: Self = Self {
        G: [[0.0; NU]; NX],
        H: [[0.0; NU]; NU],
        inverse: [[0.0; NU]; NU],
        Sd: [0.0; NX],
        Td: [0.0; NU],
        pull: [0.0; NU],
    };
}

#[inline(always)]
pub(super) fn transpose<const R: usize, const C: usize>(columns: &[[f64; R]; C]) -> [[f64; C]; R] {
    let mut rows = [[0.0; C]; R];
    for c in 0..C {
        for r in 0..R {
            rows[r][c] = columns[c][r];
        }
    }
    rows
}

/// Minimises over the input of a stage: from the value of what follows to the policy and the value in front. `before` comes in
/// with what the state in front costs by itself: written before the step instead of after it, because the next step reads whole
/// rows, and would wait for single elements written just before.
/// The affine term of the prediction and the reference of the increment are `affine` instead of the stage's own, for recursions
/// over differences.
///
/// An input that is held at a bound keeps the form of the policy: a constant, or the previous input plus a constant.
/// Returns `None` when the curvature of a free input is not positive, which rounding can bring about.
#[inline(always)]
pub(super) fn step<const NX: usize, const NU: usize>(
    stage: &Stage<NX, NU>,
    affine: Affine<'_, NX, NU>,
    after: &Value<NX, NU>,
    r: &[f64; NU],
    hold: &[Hold; NU],
    policy: &mut Policy<NX, NU>,
    before: &mut Value<NX, NU>,
) -> Option<Factor<NX, NU>> {
    let A = &stage.A.data.0;
    let B = &stage.B.data.0;
    let d = affine.d;
    let A_rows = transpose(A);
    let B_rows = transpose(B);

    // M = S B + T by rows.
    let mut M = after.T;
    let mut Sd = [0.0; NX];
    let mut Td = [0.0; NU];
    for k in 0..NX {
        for l in 0..NX {
            axpy(after.S[k][l], &B_rows[l], &mut M[k]);
        }
        // Differences have no affine term, nor have models without wind.
        if d[k] != 0.0 {
            axpy(d[k], &after.S[k], &mut Sd);
            axpy(d[k], &after.T[k], &mut Td);
        }
    }
    // G = M' A by columns.
    let mut G = [[0.0; NU]; NX];
    for c in 0..NX {
        for k in 0..NX {
            axpy(A[c][k], &M[k], &mut G[c]);
        }
    }
    // H = B' S B + B' T + T' B + U + R, the symmetric part of B' (M + T) + U + R.
    let mut BM = [[0.0; NU]; NU];
    for k in 0..NX {
        let mut MT = M[k];
        axpy(1.0, &after.T[k], &mut MT);
        for j in 0..NU {
            axpy(B[j][k], &MT, &mut BM[j]);
        }
    }
    let mut H = after.U;
    for j in 0..NU {
        for l in 0..NU {
            H[j][l] += 0.5 * (BM[j][l] + BM[l][j]);
        }
        H[j][j] += r[j];
    }
    let inverse = invert(&H, hold)?;
    let pull = std::array::from_fn(|j| r[j] * affine.du_ref[j]);
    let factor = Factor { G, H, inverse, Sd, Td, pull };
    policy_gains(&factor, r, hold, policy);
    linear_step(stage, &factor, r, hold, (&after.s, &after.t), policy, (&mut before.s, &mut before.t));

    // S = Q + A' S A + G' K, T = G' L: the terms of inputs that are free cancel to these by optimality.
    let G_rows = transpose(&G);
    for c in 0..NX {
        let mut SA = [0.0; NX];
        for k in 0..NX {
            // Prediction matrices of vehicles are half zeros, the same ones in every stage: the branch is free.
            if A[c][k] != 0.0 {
                axpy(A[c][k], &after.S[k], &mut SA);
            }
        }
        let mut column = before.S[c];
        for k in 0..NX {
            axpy(SA[k], &A_rows[k], &mut column);
        }
        for j in 0..NU {
            axpy(policy.K[c][j], &G_rows[j], &mut column);
        }
        // Rounding must not break the symmetry that the next stage relies on.
        for k in 0..c {
            column[k] = before.S[k][c];
        }
        before.S[c] = column;
    }
    if hold.iter().all(|hold| matches!(hold, Hold::Free)) {
        // T = G' H^-1 R = -K' R.
        for k in 0..NX {
            for j in 0..NU {
                before.T[k][j] = -r[j] * policy.K[k][j];
            }
        }
    } else {
        let L_rows = transpose(&policy.L);
        for k in 0..NX {
            let mut row = [0.0; NU];
            for j in 0..NU {
                axpy(G[k][j], &L_rows[j], &mut row);
            }
            before.T[k] = row;
        }
    }
    for j in 0..NU {
        for p in 0..NU {
            before.U[p][j] = -r[j] * policy.L[p][j];
        }
        before.U[j][j] += r[j];
    }
    // An input that follows the previous one hands its own curvature on.
    for j in 0..NU {
        if let Hold::Linked(_) = hold[j] {
            for p in 0..NU {
                let mut row = if p == j { -r[j] } else { 0.0 };
                for l in 0..NU {
                    row += H[l][j] * policy.L[p][l];
                }
                before.U[p][j] += row;
            }
        }
    }
    Some(factor)
}

/// The part of [`step`] that is linear in the affine terms: constant of the policy, slopes of the value in front, which come in
/// with those of the state in front by itself.
#[inline(always)]
pub(super) fn linear_step<const NX: usize, const NU: usize>(
    stage: &Stage<NX, NU>,
    factor: &Factor<NX, NU>,
    r: &[f64; NU],
    hold: &[Hold; NU],
    (s, t): (&[f64; NX], &[f64; NU]),
    policy: &mut Policy<NX, NU>,
    (s_before, t_before): (&mut [f64; NX], &mut [f64; NU]),
) {
    let A_rows = transpose(&stage.A.data.0);
    let B_rows = transpose(&stage.B.data.0);
    let G_rows = transpose(&factor.G);
    // y = S d + s, g = B' y + T' d + t - R du_ref.
    let mut y = factor.Sd;
    let mut g = factor.Td;
    for k in 0..NX {
        y[k] += s[k];
        axpy(y[k], &B_rows[k], &mut g);
    }
    for j in 0..NU {
        g[j] += t[j] - factor.pull[j];
    }
    policy.k = [0.0; NU];
    for j in 0..NU {
        let constant = match hold[j] {
            Hold::Free => -g[j],
            Hold::Fixed(value) | Hold::Linked(value) => value,
        };
        axpy(constant, &factor.inverse[j], &mut policy.k);
    }
    for k in 0..NX {
        axpy(y[k], &A_rows[k], s_before);
    }
    for j in 0..NU {
        axpy(policy.k[j], &G_rows[j], s_before);
        t_before[j] = factor.pull[j] - r[j] * policy.k[j];
        if let Hold::Linked(_) = hold[j] {
            t_before[j] += g[j];
            for l in 0..NU {
                t_before[j] += factor.H[l][j] * policy.k[l];
            }
        }
    }
}

//! Optimal input of a stage: its form, and its gains from the curvature of the inputs that are free.

use super::active::Hold;
use super::riccati::Factor;
use crate::lanes::axpy;

/// Optimal input of a stage, `u = K x + L p + k`, stored by columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Policy<const NX: usize, const NU: usize> {
    pub K: [[f64; NU]; NX],
    pub L: [[f64; NU]; NU],
    pub k: [f64; NU],
}

impl<const NX: usize, const NU: usize> Policy<NX, NU> {
    pub(super) const ZERO: Self = Self { K: [[0.0; NU]; NX], L: [[0.0; NU]; NU], k: [0.0; NU] };

    /// The input for a state and a previous input.
    #[inline(always)]
    pub(super) fn input(&self, x: &[f64; NX], p: &[f64; NU]) -> [f64; NU] {
        let mut u = self.k;
        for j in 0..NU {
            axpy(p[j], &self.L[j], &mut u);
        }
        for k in 0..NX {
            axpy(x[k], &self.K[k], &mut u);
        }
        u
    }
}

/// Inverts the curvature of the free inputs by Gauss-Jordan elimination without exchange of rows: the free block is positive
/// definite, and the rows of held inputs are rows of the identity. By columns.
#[inline(always)]
pub(super) fn invert<const NU: usize>(H: &[[f64; NU]; NU], hold: &[Hold; NU]) -> Option<[[f64; NU]; NU]> {
    let mut matrix = *H;
    for j in 0..NU {
        if !matches!(hold[j], Hold::Free) {
            for l in 0..NU {
                matrix[l][j] = if l == j { 1.0 } else { 0.0 };
            }
        }
    }
    for j in 0..NU {
        let pivot = matrix[j][j];
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        let scale = 1.0 / pivot;
        matrix[j][j] = 1.0;
        for l in 0..NU {
            matrix[l][j] *= scale;
        }
        for row in (0..NU).filter(|row| *row != j) {
            let factor = matrix[j][row];
            matrix[j][row] = 0.0;
            for l in 0..NU {
                matrix[l][row] -= factor * matrix[l][j];
            }
        }
    }
    Some(matrix)
}

/// Gains of the policy from the stationarity of the free inputs and the equations of the held ones.
#[inline(always)]
pub(super) fn policy_gains<const NX: usize, const NU: usize>(
    factor: &Factor<NX, NU>,
    r: &[f64; NU],
    hold: &[Hold; NU],
    policy: &mut Policy<NX, NU>,
) {
    let mut from_state = factor.inverse;
    for j in 0..NU {
        let (state, input) = match hold[j] {
            Hold::Free => (-1.0, r[j]),
            Hold::Fixed(_) => (0.0, 0.0),
            Hold::Linked(_) => (0.0, 1.0),
        };
        for l in 0..NU {
            policy.L[j][l] = input * factor.inverse[j][l];
            from_state[j][l] *= state;
        }
    }
    for c in 0..NX {
        let mut column = [0.0; NU];
        for j in 0..NU {
            axpy(factor.G[c][j], &from_state[j], &mut column);
        }
        policy.K[c] = column;
    }
}

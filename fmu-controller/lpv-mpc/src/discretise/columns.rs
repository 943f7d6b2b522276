//! Polynomials of the system matrix, on the three columns that are not known beforehand.

use nalgebra::{SMatrix, SVector};

use crate::Scalar;
use crate::hold::ORDER;
use crate::model::{E_PSI, E_Y, NX, State, V_X, V_Y, YAW_RATE};

/// Two columns of a matrix side by side, those of `v_y` and `yaw_rate`: a row for each state.
pub(super) type Lateral<T> = [SVector<T, 2>; NX];

/// The columns of a polynomial of `A` that inputs and affine term excite.
///
/// Below the coupling through the speed, `A` is block triangular: a lateral motion never leaves the columns of `v_y` and
/// `yaw_rate`, which are the same sums on two numbers, and the column of `v_x` reaches the errors on the path alone.
pub(super) struct Columns<T> {
    pub v_x: State<T>,
    pub lateral: Lateral<T>,
}

impl<T: Scalar> Columns<T> {
    /// The columns of `A` itself.
    #[inline(always)]
    pub(super) fn of(A: &SMatrix<T, NX, NX>) -> Self {
        Self {
            v_x: A.column(V_X).into_owned(),
            lateral: std::array::from_fn(|row| SVector::from([A[(row, V_Y)], A[(row, YAW_RATE)]])),
        }
    }

    /// `A` times the columns, with the zeros of the embedding left out.
    #[inline(always)]
    pub(super) fn multiplied(&self, A: &SMatrix<T, NX, NX>) -> Self {
        let a = |row: usize, column: usize| A[(row, column)];
        let v = &self.v_x;
        let [v_x, v_y, yaw_rate, _, e_psi] = &self.lateral;
        Self {
            v_x: State::from([
                a(V_X, V_X) * v[V_X],
                T::zero(),
                T::zero(),
                a(E_Y, E_PSI) * v[E_PSI],
                a(E_PSI, V_X) * v[V_X],
            ]),
            lateral: [
                v_x * a(V_X, V_X) + v_y * a(V_X, V_Y) + yaw_rate * a(V_X, YAW_RATE),
                v_y * a(V_Y, V_Y) + yaw_rate * a(V_Y, YAW_RATE),
                v_y * a(YAW_RATE, V_Y) + yaw_rate * a(YAW_RATE, YAW_RATE),
                v_y * a(E_Y, V_Y) + e_psi * a(E_Y, E_PSI),
                v_x * a(E_PSI, V_X) + v_y * a(E_PSI, V_Y) + yaw_rate,
            ],
        }
    }

    /// The columns plus those of the identity.
    #[inline(always)]
    pub(super) fn plus_identity(mut self) -> Self {
        self.v_x[V_X] += T::one();
        self.lateral[V_Y][0] += T::one();
        self.lateral[YAW_RATE][1] += T::one();
        self
    }

    /// `w_0 I + w_1 A + w_2 A^2 + w_3 A^3` from the powers of `A`.
    #[inline(always)]
    pub(super) fn series(powers: &[Self; ORDER - 1], weights: &[f64; ORDER]) -> Self {
        let w = weights.map(T::from);
        let [a, b, c] = powers;
        let mut sum = Self {
            v_x: a.v_x * w[1] + b.v_x * w[2] + c.v_x * w[3],
            lateral: std::array::from_fn(|i| a.lateral[i] * w[1] + b.lateral[i] * w[2] + c.lateral[i] * w[3]),
        };
        sum.v_x[V_X] += w[0];
        sum.lateral[V_Y][0] += w[0];
        sum.lateral[YAW_RATE][1] += w[0];
        sum
    }

    /// The columns times a vector that is zero in the errors on the path.
    #[inline(always)]
    pub(super) fn combine(&self, b: [T; 3]) -> State<T> {
        let lateral = SVector::from([b[V_Y], b[YAW_RATE]]);
        State::from_fn(|i, _| self.v_x[i] * b[V_X] + self.lateral[i].dot(&lateral))
    }
}

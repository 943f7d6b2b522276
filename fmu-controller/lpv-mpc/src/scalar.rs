//! The one door to automatic differentiation: the model is written once for numbers and for dual numbers.

use nalgebra::{ClosedAddAssign, ClosedMulAssign, ClosedSubAssign};
use num_dual::DualNum;

/// A real number, or a dual number that carries an exact derivative along.
pub trait Scalar:
    DualNum<Primitive = f64> + Copy + nalgebra::Scalar + ClosedAddAssign + ClosedSubAssign + ClosedMulAssign
{
    /// The larger one; of two equal ones the first.
    #[must_use]
    fn larger(self, bound: f64) -> Self {
        if self.re() < bound { Self::from(bound) } else { self }
    }
}

impl<T> Scalar for T where
    T: DualNum<Primitive = f64> + Copy + nalgebra::Scalar + ClosedAddAssign + ClosedSubAssign + ClosedMulAssign
{
}

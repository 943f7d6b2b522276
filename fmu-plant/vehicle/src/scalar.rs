//! The one door to automatic differentiation: the physics is written once for numbers and for dual numbers.

use num_dual::DualNum;

/// A real number, or a dual number that carries exact derivatives along.
pub trait Scalar: DualNum<Primitive = f64> + Copy {}

impl<D: DualNum<Primitive = f64> + Copy> Scalar for D {}

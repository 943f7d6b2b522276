//! The smooth step that edges, blends and planned lines are made of.

use crate::Scalar;

/// The step `6 t^5 - 15 t^4 + 10 t^3` from 0 to 1: first and second derivatives vanish at both ends.
#[inline]
pub(crate) fn step<D: Scalar>(t: D) -> D {
    if t.re() <= 0.0 {
        D::zero()
    } else if t.re() >= 1.0 {
        D::one()
    } else {
        t * t * t * ((t * 6.0 - 15.0) * t + 10.0)
    }
}

/// First, second and third derivative of [`step`].
pub(crate) fn step_derivatives(t: f64) -> [f64; 3] {
    if !(0.0..=1.0).contains(&t) {
        return [0.0; 3];
    }
    [30.0 * (t * (1.0 - t)).powi(2), t * (60.0 + t * (120.0 * t - 180.0)), 60.0 + t * (360.0 * t - 360.0)]
}

/// 1 between `begin` and `end` and 0 outside, with smooth edges of the length `edge` outside of both.
pub(crate) fn window<D: Scalar>(t: D, begin: f64, end: f64, edge: f64) -> D {
    let rising = (t - begin) * (1.0 / edge) + 1.0;
    let falling = (-t + end) * (1.0 / edge) + 1.0;
    step(rising) * step(falling)
}

/// An odd cubic through 0 that is exactly -1 and 1 from `full` on.
#[inline]
pub(crate) fn sign<D: Scalar>(v: D, full: f64) -> D {
    if v.re() >= full {
        D::one()
    } else if v.re() <= -full {
        -D::one()
    } else {
        let r = v * (1.0 / full);
        r * (r * r * -0.5 + 1.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_step() {
        for i in 1..100 {
            let (t, h) = (f64::from(i) * 0.01, 1e-4);
            let [first, second, third] = step_derivatives(t);
            let d = |f: &dyn Fn(f64) -> f64| (f(t + h) - f(t - h)) / (2.0 * h);
            // Central differences: h^2 times derivatives up to 720.
            assert!((d(&|t| step(t)) - first).abs() < 1e-6);
            assert!((d(&|t| step_derivatives(t)[0]) - second).abs() < 1e-5);
            assert!((d(&|t| step_derivatives(t)[1]) - third).abs() < 1e-4);
        }
    }
}

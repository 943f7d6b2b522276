//! Trigonometry at the angles that cars drive at, in operations that every machine rounds alike.
//!
//! A car slips by a few degrees, steers by at most some thirty and keeps its heading to the path, so short Taylor series are
//! exact. Side by side they cost far less than the library's functions.

use crate::Scalar;

/// Up to here the series of sine and cosine are exact: their first neglected terms, `x^16 / 17!` of `sin(x) / x` and
/// `x^16 / 16!`, are under the rounding of 1.
const SINE_MAX: f64 = 0.6;

/// Coefficients of `sin(x) / x` in powers of `-x^2`, highest first: `1 / (2 k + 1)!`.
const SINC: [f64; 8] = [
    1.0 / 1_307_674_368_000.0,
    1.0 / 6_227_020_800.0,
    1.0 / 39_916_800.0,
    1.0 / 362_880.0,
    1.0 / 5_040.0,
    1.0 / 120.0,
    1.0 / 6.0,
    1.0,
];

/// Coefficients of `cos(x)` in powers of `-x^2`, highest first: `1 / (2 k)!`.
const COSINE: [f64; 8] = [
    1.0 / 87_178_291_200.0,
    1.0 / 479_001_600.0,
    1.0 / 3_628_800.0,
    1.0 / 40_320.0,
    1.0 / 720.0,
    1.0 / 24.0,
    1.0 / 2.0,
    1.0,
];

/// Up to here the series of `atan(z) / z` is exact: its first neglected term, `z^18 / 19`, is under the rounding of 1.
const ATAN_MAX: f64 = 0.15;

/// Coefficients of `atan(z) / z` in powers of `-z^2`, highest first: `1 / (2 k + 1)`.
const ATAN: [f64; 9] =
    [1.0 / 17.0, 1.0 / 15.0, 1.0 / 13.0, 1.0 / 11.0, 1.0 / 9.0, 1.0 / 7.0, 1.0 / 5.0, 1.0 / 3.0, 1.0];

/// What the model asks of an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angle<T = f64> {
    /// Sine.
    pub sin: T,
    /// Cosine.
    pub cos: T,
    /// `sin(x) / x`, 1 at zero.
    pub sinc: T,
}

/// A polynomial at several places: Horner's rule for its even and its odd part, whose chains run side by side.
#[inline(always)]
fn polynomial<T: Scalar, const L: usize, const N: usize>(at: &[T; L], coefficients: &[f64; N]) -> [T; L] {
    let squares = at.map(|x| x * x);
    // The last coefficient is that of the even part, which comes first.
    let part = |i: usize| (N - 1 - i) % 2;
    let mut parts: [[T; L]; 2] = std::array::from_fn(|k| [T::from(coefficients[(N - 1 - k) % 2]); L]);
    for (i, coefficient) in coefficients.iter().enumerate().skip(2) {
        let sum = &mut parts[part(i)];
        for lane in 0..L {
            sum[lane] = sum[lane] * squares[lane] + *coefficient;
        }
    }
    let [even, odd] = parts;
    std::array::from_fn(|lane| odd[lane] * at[lane] + even[lane])
}

/// Sines and cosines of several angles [rad].
#[inline(always)]
pub fn angles<T: Scalar, const L: usize>(x: [T; L]) -> [Angle<T>; L] {
    // What is no number stays none in the series.
    if x.iter().any(|x| x.re().abs() > SINE_MAX) {
        return x.map(large_angle);
    }
    let at = x.map(|x| -x * x);
    let (sinc, cos) = (polynomial(&at, &SINC), polynomial(&at, &COSINE));
    std::array::from_fn(|lane| Angle { sin: x[lane] * sinc[lane], cos: cos[lane], sinc: sinc[lane] })
}

#[cold]
fn large_angle<T: Scalar>(x: T) -> Angle<T> {
    if x.re().abs() > SINE_MAX {
        let (sin, cos) = x.sin_cos();
        return Angle { sin, cos, sinc: sin / x };
    }
    angles([x])[0]
}

/// `atan(z) / z` of several numbers, 1 at zero.
#[inline(always)]
pub fn atan_ratios<T: Scalar, const L: usize>(z: [T; L]) -> [T; L] {
    if z.iter().any(|z| z.re().abs() > ATAN_MAX) {
        return z.map(large_ratio);
    }
    polynomial(&z.map(|z| -z * z), &ATAN)
}

#[cold]
fn large_ratio<T: Scalar>(z: T) -> T {
    if z.re().abs() > ATAN_MAX { z.atan() / z } else { atan_ratios([z])[0] }
}

/// `atan(z)` of several numbers [rad].
#[inline(always)]
pub fn atans<T: Scalar, const L: usize>(z: [T; L]) -> [T; L] {
    if z.iter().any(|z| z.re().abs() > ATAN_MAX) {
        return z.map(large_atan);
    }
    let ratios = atan_ratios(z);
    std::array::from_fn(|lane| z[lane] * ratios[lane])
}

#[cold]
fn large_atan<T: Scalar>(z: T) -> T {
    if z.re().abs() > ATAN_MAX { z.atan() } else { z * atan_ratios([z])[0] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    #[test]
    fn slips_are_those_of_the_arctangent() {
        for k in -3000..=3000 {
            let z = f64::from(k) * 1e-4;
            // A dozen roundings of terms that fall by 1/40 from one to the next.
            let close = |got: f64| (got - z.atan()).abs() <= 4e-16 * z.abs();
            let [got, _] = atans([z, 0.1]);
            assert!(close(got), "{z}: {got} against {}", z.atan());
            let [got, _] = atan_ratios([z, 0.2]);
            assert!(close(z * got), "{z}: {got} against {}", z.atan() / z);
        }
    }

    #[test]
    fn sines_and_cosines_are_those_of_the_library() {
        for k in -3500..=3500 {
            let x = f64::from(k) * 1e-3;
            let [Angle { sin, cos, sinc }, _] = angles([x, 0.5]);
            // A dozen roundings of terms that fall by 1/16 or faster.
            assert!((sin - x.sin()).abs() <= 4e-16 * x.sin().abs(), "{x}: {sin} against {}", x.sin());
            assert!((cos - x.cos()).abs() <= 4e-16, "{x}: {cos} against {}", x.cos());
            assert!((sinc * x - sin).abs() <= 4e-16, "{x}: {sinc}");
        }
        assert_eq!(angles([0.0, 3.0])[0], Angle { sin: 0.0, cos: 1.0, sinc: 1.0 }, "whatever is beside it");
    }

    #[test]
    fn derivatives_are_those_of_the_library() {
        for k in -100..=100 {
            let x = Dual64::new(f64::from(k) * 1e-2, 1.0);
            let [Angle { sin, cos, .. }] = angles([x]);
            // The series of the derivative ends one term earlier: 0.6^14 / 14! = 9e-15.
            assert!((sin.eps - x.re.cos()).abs() <= 2e-14, "{x}: {sin}");
            assert!((cos.eps + x.re.sin()).abs() <= 2e-14, "{x}: {cos}");
            let [atan] = atans([x * 0.3]);
            assert!((atan.eps - 0.3 / (1.0 + 0.09 * x.re * x.re)).abs() <= 1e-14, "{x}: {atan}");
        }
    }

    #[test]
    fn what_is_no_number_stays_none() {
        let [first, second] = angles([f64::NAN, 0.1]);
        assert!(first.sin.is_nan() && first.cos.is_nan() && second.sin == angles([0.1, 0.1])[0].sin);
        assert!(atans([f64::NAN])[0].is_nan());
        assert_eq!(atans([f64::INFINITY])[0], std::f64::consts::FRAC_PI_2);
    }
}

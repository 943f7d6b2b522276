//! The logistic function over a whole layer, in operations that every machine rounds alike.
//!
//! The exponential of the standard library is the platform's own, and a call for each neuron costs more than the matrices.
//! This one is straight arithmetic: the compiler turns the loop into vector instructions, and the bits do not depend on a
//! platform's library.

use std::f64::consts::{LN_2, LOG2_E};

/// `1.5 * 2^52`: adding it rounds to an integer and leaves that integer in the low bits of the mantissa.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// `2^-53` is the rounding of 1: seven powers beyond it the function is 0 or 1 within any rounding, and nothing overflows.
const SATURATED: f64 = 60.0;

/// Padé's approximant of `exp(x)` of degree 5 over 5 is `(even + odd) / (even - odd)`, with these coefficients of its powers
/// `x^(2 k)` and `x^(2 k + 1)`; `x = f ln 2` is in them. For `|f| <= 1/2` its error is 9e-16 of the value.
const EVEN: [f64; 3] = [1.0, LN_2 * LN_2 / 9.0, LN_2 * LN_2 * LN_2 * LN_2 / 1008.0];
const ODD: [f64; 3] = [LN_2 / 2.0, LN_2 * LN_2 * LN_2 / 72.0, LN_2 * LN_2 * LN_2 * LN_2 * LN_2 / 30_240.0];

/// What the sums of a neuron are multiplied by for [`logistic`]: its weights can carry it.
pub const TO_EXPONENT: f64 = -LOG2_E;

/// `1 / (1 + 2^t)`, the logistic function of `z = t / TO_EXPONENT`. Its error is below 1e-15.
///
/// `2^t = 2^k 2^f` with an integer `k`, and both fractions become one.
#[inline(always)]
fn logistic(t: f64) -> f64 {
    // The order of the comparisons maps to one instruction each and lets NaN through.
    let t = if t > SATURATED { SATURATED } else { t };
    let t = if t < -SATURATED { -SATURATED } else { t };
    let shifted = t + ROUND;
    let f = t - (shifted - ROUND);
    let square = f * f;
    let fourth = square * square;
    let even = (EVEN[0] + EVEN[1] * square) + EVEN[2] * fourth;
    let odd = f * ((ODD[0] + ODD[1] * square) + ODD[2] * fourth);
    let below = even - odd;
    below / (below + (even + odd) * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52))
}

/// [`logistic`] side by side: short chains of dependent operations hide behind each other.
#[inline(always)]
pub fn logistic_lanes<const L: usize>(exponents: [f64; L]) -> [f64; L] {
    let mut values = exponents;
    for value in &mut values {
        *value = logistic(*value);
    }
    values
}

/// `1 / (1 + exp(-z))` of every element, in place.
#[inline]
pub fn sigmoid(values: &mut [f64]) {
    let (chunks, rest) = values.as_chunks_mut::<4>();
    for chunk in chunks {
        *chunk = logistic_lanes(chunk.map(|z| z * TO_EXPONENT));
    }
    for z in rest {
        *z = logistic(*z * TO_EXPONENT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_exponential_of_the_standard_library() {
        for i in -50_000..=50_000 {
            let z = f64::from(i) * 1e-3;
            let mut value = [z];
            sigmoid(&mut value);
            let exact = 1.0 / (1.0 + (-z).exp());
            // The exponent carries a rounding of its own size, which the function makes |z| exact (1 - exact) of; the rest is
            // the approximant's error and a dozen roundings; saturation leaves 2^-60.
            let tolerance = (2.3e-16 * z.abs() * (1.0 - exact) + 2e-15) * exact + 1e-18;
            assert!((value[0] - exact).abs() <= tolerance, "{z}: {} against {exact}", value[0]);
            // Beyond, slopes would have the wrong sign.
            assert!((0.0..=1.0).contains(&value[0]), "{z}: {}", value[0]);
        }
    }

    #[test]
    fn extremes_saturate() {
        let mut values = [f64::NEG_INFINITY, -1e300, 0.0, 1e300, f64::INFINITY];
        sigmoid(&mut values);
        assert!(values[0] < 1e-17 && values[1] < 1e-17, "{values:?}");
        assert_eq!(values[2..], [0.5, 1.0, 1.0]);
        let mut values = [f64::NAN];
        sigmoid(&mut values);
        assert!(values[0].is_nan());
    }
}

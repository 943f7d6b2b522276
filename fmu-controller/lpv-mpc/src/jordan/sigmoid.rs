//! The logistic function over a whole layer, in operations that every machine rounds alike.
//!
//! The exponential of the standard library is the platform's own, and a call for each neuron costs more than the matrices.
//! This one is straight arithmetic: the compiler turns the loop into vector instructions, and the bits do not depend on a
//! platform's library.

use super::layers::LANES;

/// `1.5 * 2^52`: adding it rounds to an integer and leaves that integer in the low bits of the mantissa.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// Upper part of ln 2, short enough that its product with an exponent is exact [fdlibm, e_exp.c].
const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
/// The rest of ln 2.
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// `exp(-36.8)` is the rounding of 1: beyond this the function is 0 or 1 within it, and the exponent cannot overflow.
const SATURATED: f64 = 40.0;

/// Coefficients of Taylor's polynomial, `1 / k!`.
const TAYLOR: [f64; 13] = [
    1.0,
    1.0,
    0.5,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
];

/// `exp(x)` for `|x| <= 40`, relative error below 1e-15: `2^k exp(r)` with `|r| <= ln 2 / 2` and Taylor's polynomial of
/// degree 12, whose first neglected term is 2e-16. Estrin's scheme instead of Horner's: a third of the latency.
#[inline(always)]
fn exp(x: f64) -> f64 {
    let shifted = x * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (x - k * LN_2_HIGH) - k * LN_2_LOW;
    let c = TAYLOR;
    let (r_2, r_4) = (r * r, (r * r) * (r * r));
    let four = |i: usize| (c[i] + c[i + 1] * r) + (c[i + 2] + c[i + 3] * r) * r_2;
    let p = four(0) + (four(4) + (four(8) + c[12] * r_4) * r_4) * r_4;
    p * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52)
}

#[inline(always)]
fn logistic(z: f64) -> f64 {
    // The order of the comparisons maps to one instruction each and lets NaN through.
    let z = if z > SATURATED { SATURATED } else { z };
    let z = if z < -SATURATED { -SATURATED } else { z };
    1.0 / (1.0 + exp(-z))
}

/// The logistic function side by side: short chains of dependent operations hide behind each other.
#[inline(always)]
pub fn logistic_lanes(values: [f64; LANES]) -> [f64; LANES] {
    let mut values = values;
    for value in &mut values {
        *value = logistic(*value);
    }
    values
}

/// `1 / (1 + exp(-z))` of every element, in place.
#[inline]
pub fn sigmoid(values: &mut [f64]) {
    let (chunks, rest) = values.as_chunks_mut::<LANES>();
    for chunk in chunks {
        *chunk = logistic_lanes(*chunk);
    }
    for z in rest {
        *z = logistic(*z);
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
            // 1e-15 relative of the exponential, doubled for the sum and the division; saturation leaves exp(-40).
            assert!((value[0] - exact).abs() <= 4e-15 * exact + 4.3e-18, "{z}: {} against {exact}", value[0]);
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

//! Units as the table writes them ("kg m2", "1/m", "N/rad", "m/s2"), resolved to SI base units.

/// Exponents of the SI base units and of the radian, in the order of `BASE`.
pub(crate) type Exponents = [i32; BASE.len()];

/// The attributes of BaseUnit in the XML, in the order of the schema.
pub(crate) const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

/// Derived units that tables may use; SI brochure (9th edition), table 4.
const DERIVED: [(&str, Exponents); 6] = [
    ("N", [1, 1, -2, 0, 0, 0, 0, 0]),
    ("Pa", [1, -1, -2, 0, 0, 0, 0, 0]),
    ("J", [1, 2, -2, 0, 0, 0, 0, 0]),
    ("W", [1, 2, -3, 0, 0, 0, 0, 0]),
    ("Hz", [0, 0, -1, 0, 0, 0, 0, 0]),
    ("V", [1, 2, -3, -1, 0, 0, 0, 0]),
];

/// What people read instead: unit, display unit, and display value of one unit.
const DISPLAY: [(&str, &str, f64); 3] = [
    ("rad", "deg", 180.0 / std::f64::consts::PI),
    ("rad/s", "deg/s", 180.0 / std::f64::consts::PI),
    ("m/s", "km/h", 3.6),
];

/// Display unit and its factor.
pub(crate) fn display(unit: &str) -> Option<(&'static str, f64)> {
    DISPLAY.iter().find(|(of, ..)| *of == unit).map(|&(_, name, factor)| (name, factor))
}

/// Exponents of a unit: factors parted by blanks, with exponents as trailing digits, and what follows the only slash is divided by.
pub(crate) fn exponents(unit: &str) -> Option<Exponents> {
    let (numerator, denominator) = unit.split_once('/').unwrap_or((unit, ""));
    let mut total = [0; BASE.len()];
    for (factors, sign) in [(numerator, 1), (denominator, -1)] {
        for factor in factors.split_whitespace().filter(|factor| *factor != "1") {
            let symbol = factor.trim_end_matches(|c: char| c.is_ascii_digit());
            let power: i32 = match &factor[symbol.len()..] {
                "" => 1,
                digits => digits.parse().ok()?,
            };
            let exponents = match BASE.iter().position(|base| *base == symbol) {
                Some(base) => std::array::from_fn(|k| i32::from(k == base)),
                None => DERIVED.iter().find(|(derived, _)| *derived == symbol)?.1,
            };
            for (sum, exponent) in total.iter_mut().zip(exponents) {
                *sum += sign * power * exponent;
            }
        }
    }
    Some(total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_have_the_dimensions_of_physics() {
        // Newton's second law, the curvature of a path, and yaw inertia times angular acceleration being a torque.
        assert_eq!(exponents("N"), exponents("kg m/s2"));
        assert_eq!(exponents("1/m"), Some([0, -1, 0, 0, 0, 0, 0, 0]));
        assert_eq!(exponents("N m"), exponents("kg m2/s2"));
        assert_eq!(exponents("N/rad"), Some([1, 1, -2, 0, 0, 0, 0, -1]));
        assert_eq!(exponents("1"), Some([0; 8]));
        assert_eq!(exponents("furlong"), None);
    }

    #[test]
    fn a_full_turn_is_360_degrees() {
        let (name, factor) = display("rad").unwrap();
        assert_eq!(name, "deg");
        assert!((factor * std::f64::consts::TAU - 360.0).abs() < 1e-12);
    }
}

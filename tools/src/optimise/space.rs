//! Where to search: a box, each side of it linear or logarithmic, seen by the strategies as the unit cube.

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};

/// One side of the box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dimension {
    /// What is searched, in the words of the caller.
    pub name: String,
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
    /// Whether equal steps of the search are equal ratios of the value: weights span decades.
    pub logarithmic: bool,
}

impl Dimension {
    /// A side with equal steps.
    pub fn linear(name: &str, low: f64, high: f64) -> Self {
        Self { name: name.to_owned(), low, high, logarithmic: false }
    }

    /// A side with equal ratios.
    pub fn logarithmic(name: &str, low: f64, high: f64) -> Self {
        Self { name: name.to_owned(), low, high, logarithmic: true }
    }

    /// The value at a place between 0 and 1.
    pub fn value(&self, place: f64) -> f64 {
        // The ends as they were given: the way through the logarithm would miss them by rounding.
        if place <= 0.0 {
            self.low
        } else if place >= 1.0 {
            self.high
        } else if self.logarithmic {
            (self.low.ln() + place * (self.high.ln() - self.low.ln())).exp()
        } else {
            self.low + place * (self.high - self.low)
        }
    }

    /// The place of a value, cut at the ends.
    pub fn place(&self, value: f64) -> f64 {
        let place = if self.logarithmic {
            (value.ln() - self.low.ln()) / (self.high.ln() - self.low.ln())
        } else {
            (value - self.low) / (self.high - self.low)
        };
        place.clamp(0.0, 1.0)
    }
}

/// The box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Space {
    /// Its sides.
    pub dimensions: Vec<Dimension>,
}

impl Space {
    /// Checks the sides.
    ///
    /// # Errors
    /// If there is none, or one is empty, not finite, or logarithmic and not positive.
    pub fn new(dimensions: Vec<Dimension>) -> Result<Self> {
        ensure!(!dimensions.is_empty(), "there is nothing to search");
        for Dimension { name, low, high, logarithmic } in &dimensions {
            ensure!(low.is_finite() && high.is_finite() && low < high, "{name} is searched from {low} to {high}");
            ensure!(!logarithmic || *low > 0.0, "{name} is searched in ratios, so from above 0, got {low}");
        }
        Ok(Self { dimensions })
    }

    /// The same side several times, as test functions have it.
    pub fn cube(sides: usize, low: f64, high: f64) -> Result<Self> {
        Self::new((1..=sides).map(|k| Dimension::linear(&format!("x[{k}]"), low, high)).collect())
    }

    /// Values at a point of the unit cube.
    pub fn values(&self, point: &[f64]) -> Vec<f64> {
        self.dimensions.iter().zip(point).map(|(dimension, place)| dimension.value(*place)).collect()
    }

    /// Point of the unit cube for values.
    pub fn point(&self, values: &[f64]) -> Vec<f64> {
        self.dimensions.iter().zip(values).map(|(dimension, value)| dimension.place(*value)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_logarithmic_side_is_the_geometric_mean() {
        let side = Dimension::logarithmic("q", 1e-4, 100.0);
        assert!((side.value(0.5) - 0.1).abs() < 1e-15);
        assert_eq!((side.value(0.0), side.value(1.0)), (1e-4, 100.0));
        for place in [0.0, 0.2, 0.9, 1.0] {
            assert!((side.place(side.value(place)) - place).abs() < 1e-14);
        }
    }

    #[test]
    fn a_box_without_room_is_refused_by_name() {
        let message = |dimension| Space::new(vec![dimension]).unwrap_err().to_string();
        assert_eq!(message(Dimension::linear("a", 2.0, 2.0)), "a is searched from 2 to 2");
        assert_eq!(message(Dimension::logarithmic("b", 0.0, 2.0)), "b is searched in ratios, so from above 0, got 0");
        assert_eq!(message(Dimension::linear("c", f64::NAN, 2.0)), "c is searched from NaN to 2");
    }
}

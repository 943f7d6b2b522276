//! Which parameters are searched, and where.

use anyhow::{Context, Result, ensure};

use crate::optimise::{Dimension, Space};
use crate::simulate::settings::Settings;

/// The weights and the terminal cost, each over the decades around the paper's and the shipped values.
///
/// The paper does not print its box. `q_e_y` is left out: a common factor of all weights changes next to nothing, so one weight is
/// the unit of the others, and the search has one direction less in which nothing happens.
const WEIGHTS: [(&str, f64, f64); 7] = [
    ("q_v_x", 0.05, 500.0),
    ("q_v_y", 1e-6, 10.0),
    ("q_yaw_rate", 1e-4, 100.0),
    ("q_e_psi", 1e-4, 1000.0),
    ("r_delta", 1e-3, 1e4),
    ("r_a_x", 1e-5, 100.0),
    ("terminal_factor", 0.1, 100.0),
];

/// Ratio of the ends from which on a side is searched in ratios.
const DECADE: f64 = 10.0;

/// The box: what was asked for as `NAME=LOW:HIGH`, or the weights.
///
/// # Errors
/// If a text cannot be read, or a parameter is unknown or no number.
pub fn space(asked: &[String]) -> Result<Space> {
    if asked.is_empty() {
        return Space::new(WEIGHTS.iter().map(|(name, low, high)| Dimension::logarithmic(name, *low, *high)).collect());
    }
    let mut sides = Vec::new();
    for text in asked {
        let (name, range) = text.split_once('=').with_context(|| format!("expected NAME=LOW:HIGH, got {text}"))?;
        let name = name.trim().trim_start_matches("controller.");
        let (low, high) = range.split_once(':').with_context(|| format!("expected NAME=LOW:HIGH, got {text}"))?;
        let number = |text: &str| -> Result<f64> {
            text.trim().parse().with_context(|| format!("{name} takes a number, got {text}"))
        };
        let (low, high) = (number(low)?, number(high)?);
        // Whatever the search tries must be a value of the parameter.
        for end in [low, high] {
            let settings = Settings::new("straight", &[format!("controller.{name}={end}")])?;
            settings.controller.validate().with_context(|| format!("the range of {name}"))?;
        }
        ensure!(!sides.iter().any(|side: &Dimension| side.name == name), "{name} is searched twice");
        let logarithmic = low > 0.0 && high / low >= DECADE;
        sides.push(Dimension { name: name.to_owned(), low, high, logarithmic });
    }
    Space::new(sides)
}

/// Present values of the searched parameters.
///
/// # Errors
/// If a parameter of `set` is unknown.
pub fn present(space: &Space, set: &[String]) -> Result<Vec<f64>> {
    let rows = Settings::new("straight", set)?.list()?;
    space
        .dimensions
        .iter()
        .map(|side| {
            let name = format!("controller.{}", side.name);
            let row = rows.iter().find(|row| row[0] == name).with_context(|| format!("unknown parameter {name}"))?;
            row[1].parse().with_context(|| format!("{name} is no number"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_holds_the_papers_and_the_shipped_weights() {
        let space = space(&[]).unwrap();
        let paper = lpv_mpc::Parameters::paper();
        let papers = [
            format!("controller.q_v_x={}", paper.q_v_x),
            format!("controller.r_delta={}", paper.r_delta),
            format!("controller.r_a_x={}", paper.r_a_x),
        ];
        for set in [&papers[..], &[]] {
            for (side, value) in space.dimensions.iter().zip(present(&space, set).unwrap()) {
                assert!((side.low..=side.high).contains(&value), "{} = {value}", side.name);
            }
        }
    }

    #[test]
    fn what_is_asked_for_is_searched_and_nothing_else() {
        let asked = ["r_delta=1:100".to_owned(), "controller.sensor_noise=0.5:2".to_owned()];
        let space = space(&asked).unwrap();
        let sides: Vec<_> = space.dimensions.iter().map(|side| (side.name.as_str(), side.logarithmic)).collect();
        assert_eq!(sides, [("r_delta", true), ("sensor_noise", false)]);
    }

    #[test]
    fn what_cannot_be_searched_is_named() {
        let message = |text: &str| format!("{:#}", space(&[text.to_owned()]).unwrap_err());
        assert_eq!(message("r_delta"), "expected NAME=LOW:HIGH, got r_delta");
        assert!(message("r_delta=a:2").starts_with("r_delta takes a number, got a"));
        assert!(message("r_delta=-1:2").contains("parameter r_delta must be positive"), "{}", message("r_delta=-1:2"));
        assert!(message("r_dleta=1:2").contains("did you mean controller.r_delta?"));
    }
}

//! How far the network may be believed: what it saw in training, and how belief fades outside.

use serde::{Deserialize, Serialize};

/// Belief fades over this share of a range's width, on each side of it [1].
///
/// Our choice: a jump of the stiffness would shake the plan, so the fading needs room; the network's error grows quickly outside
/// of what it saw, so the room is small.
pub const MARGIN: f64 = 0.1;

/// Smallest and largest value seen in training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

impl Range {
    /// The range of nothing; [`Range::include`] widens it.
    pub const EMPTY: Self = Self { min: f64::INFINITY, max: f64::NEG_INFINITY };

    /// Widens the range to hold `value`.
    pub fn include(&mut self, value: f64) {
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    #[inline(always)]
    fn holds(&self, value: f64) -> bool {
        (value >= self.min) & (value <= self.max)
    }

    /// 1 inside, 0 beyond the margin and for what is not a number, a smooth step in between.
    fn belief(&self, value: f64) -> f64 {
        let outside = (self.min - value).max(value - self.max);
        if outside <= 0.0 {
            return 1.0;
        }
        let t = 1.0 - outside / (MARGIN * (self.max - self.min));
        if t > 0.0 { t * t * (3.0 - 2.0 * t) } else { 0.0 }
    }
}

/// The part of the world that the training covered: each measured input, and the slip angle of each axle.
///
/// Slip is what wears the tyre's stiffness down, and it is no input of its own: inputs that are each in range can add up to
/// a slip that never was.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Envelope {
    /// Range of each measured input, in the order of the inputs.
    pub inputs: Vec<Range>,
    /// Range of the front slip angle [rad].
    pub alpha_f: Range,
    /// Range of the rear slip angle [rad].
    pub alpha_r: Range,
}

impl Envelope {
    /// 1 where the training was, falling smoothly to 0 over [`MARGIN`] outside; several excesses multiply.
    #[inline(always)]
    pub fn belief(&self, inputs: &[f64], (alpha_f, alpha_r): (f64, f64)) -> f64 {
        // Written without branches: mostly all are inside.
        let inside = self.inputs.iter().zip(inputs).fold(true, |inside, (range, &value)| inside & range.holds(value));
        if inside & self.alpha_f.holds(alpha_f) & self.alpha_r.holds(alpha_r) {
            return 1.0;
        }
        let slips = self.alpha_f.belief(alpha_f) * self.alpha_r.belief(alpha_r);
        self.inputs.iter().zip(inputs).fold(slips, |belief, (range, &value)| belief * range.belief(value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Range = Range { min: -1.0, max: 1.0 };

    #[test]
    fn belief_is_whole_inside_and_gone_beyond_the_margin() {
        for value in [-1.0, 0.0, 1.0] {
            assert_eq!(UNIT.belief(value), 1.0);
        }
        // Past the margin by more than rounding.
        let edge = 1.0 + MARGIN * 2.0 + 1e-9;
        for value in [-edge, edge, 1e9, f64::NAN, f64::INFINITY] {
            assert_eq!(UNIT.belief(value), 0.0, "{value}");
        }
    }

    #[test]
    fn belief_fades_without_a_kink() {
        let mut last = 1.0;
        for i in 0..=3000 {
            let belief = UNIT.belief(1.0 + f64::from(i) * 1e-4);
            // The steepest slope of the smooth step is 1.5 over the margin's width of 0.2.
            assert!(belief <= last && last - belief <= 1.5 / 0.2 * 1e-4 + 1e-12, "{i}: {last} to {belief}");
            last = belief;
        }
    }
}

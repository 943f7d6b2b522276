//! The active set: which bounds each input of each sample sits on, and what that makes of it in the recursion.

use super::super::Problem;
use serde::{Deserialize, Serialize};

/// Bounds that an input sits on: -1 the lower one, +1 the upper one, 0 none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Active {
    /// Bound of the input itself.
    pub level: i8,
    /// Bound of its increment.
    pub rate: i8,
}

/// How the recursion treats an input.
#[derive(Clone, Copy, Debug)]
pub(super) enum Hold {
    /// Minimised over.
    Free,
    /// Constant.
    Fixed(f64),
    /// The previous input plus a constant.
    Linked(f64),
}

impl Active {
    pub(super) const NONE: Self = Self { level: 0, rate: 0 };

    pub(super) fn at_level(level: i8) -> Self {
        Self { level, rate: 0 }
    }

    pub(super) fn at_rate(rate: i8) -> Self {
        Self { level: 0, rate }
    }

    /// Both bounds at once: the input is where its two bounds meet, which determines the input before it as well.
    pub(super) fn is_corner(self) -> bool {
        self.level != 0 && self.rate != 0
    }
}

impl Hold {
    /// The same for differentials: bounds do not move.
    pub(super) fn still(self) -> Self {
        match self {
            Self::Free => Self::Free,
            Self::Fixed(_) => Self::Fixed(0.0),
            Self::Linked(_) => Self::Linked(0.0),
        }
    }
}

/// Value of the bound of input `j` on a side.
#[inline(always)]
pub(super) fn level<const NX: usize, const NU: usize>(problem: &Problem<NX, NU>, j: usize, side: i8) -> f64 {
    if side > 0 { problem.u_max[j] } else { problem.u_min[j] }
}

/// What an input is in the recursion, given what a later corner demands of it, and what it demands of the input before it.
///
/// Inputs linked by active increments form a block that moves as one. A corner at its end fixes the block, and the
/// recursion, which runs backwards, has to fix it at its beginning: the demand travels from the corner to there.
#[inline(always)]
pub(super) fn hold<const NX: usize, const NU: usize>(
    problem: &Problem<NX, NU>,
    j: usize,
    active: Active,
    demand: Option<f64>,
) -> (Hold, Option<f64>) {
    if active == Active::NONE {
        return (demand.map_or(Hold::Free, Hold::Fixed), None);
    }
    if active.rate == 0 {
        return (Hold::Fixed(level(problem, j, active.level)), None);
    }
    let du = f64::from(active.rate) * problem.du_max[j];
    let own = if active.level == 0 { demand } else { Some(level(problem, j, active.level)) };
    (Hold::Linked(du), own.map(|u| u - du))
}

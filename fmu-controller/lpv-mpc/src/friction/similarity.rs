//! Tyres by the similarity method: the two parts of what they give, and the factor on each.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::model::{Body, Disturbance, Input, Point, State, Tyres, V_X, V_Y, YAW_RATE};

/// What the tyres have over what is believed of them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Factors {
    /// On the slope at small slip [1].
    pub stiffness: f64,
    /// On the largest force [1].
    pub grip: f64,
}

impl Factors {
    /// The slip at which the believed tyre is asked, over the true one [1].
    pub fn slip(&self) -> f64 {
        self.stiffness / self.grip
    }

    /// The line through the force at the true slip, from that of the believed tyre at the slip it is asked at.
    pub fn apply(&self, believed: &Tyres) -> Tyres {
        let Self { stiffness, grip } = *self;
        let Tyres { c_f, c_r, f_f0, f_r0 } = *believed;
        Tyres { c_f: c_f * stiffness, c_r: c_r * stiffness, f_f0: f_f0 * grip, f_r0: f_r0 * grip }
    }

    /// These over others.
    pub fn over(&self, others: &Self) -> Self {
        Self { stiffness: self.stiffness / others.stiffness, grip: self.grip / others.grip }
    }
}

/// What the tyres give, as accelerations on the lateral velocity [m/s2] and on the yaw rate [rad/s2].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Given {
    /// By their slope.
    pub slope: Vector2<f64>,
    /// By their force at zero slip of the affine model.
    pub offset: Vector2<f64>,
}

impl Given {
    /// By these tyres at a state and input.
    pub fn by(tyres: &Tyres, x: &State, u: &Input, body: &Body) -> Self {
        let at = Point::new(*x, *u, body);
        let accelerations = |tyres: &Tyres| {
            let (rates, _) = at.motion(0.0, tyres, &Disturbance::zeros());
            // Turning with the body is no force.
            Vector2::new(rates[V_Y] + x[YAW_RATE] * x[V_X], rates[YAW_RATE])
        };
        Self {
            slope: accelerations(&Tyres::secant(tyres.c_f, tyres.c_r)),
            offset: accelerations(&Tyres { c_f: 0.0, c_r: 0.0, ..*tyres }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_scale_a_magic_formula_by_similarity() {
        let believed = |alpha: f64| 7000.0 * (1.4 * (10.0 * alpha).atan()).sin();
        let found = Factors { stiffness: 0.6, grip: 1.1 };
        let truth = |alpha: f64| found.grip * believed(found.slip() * alpha);
        let slope = |f: &dyn Fn(f64) -> f64, alpha: f64| (f(alpha + 1e-6) - f(alpha - 1e-6)) / 2e-6;
        for k in -10..=10 {
            let alpha = 0.02 * f64::from(k);
            let asked = found.slip() * alpha;
            let c = slope(&believed, asked);
            let line = Tyres { c_f: c, c_r: 0.0, f_f0: believed(asked) - c * asked, f_r0: 0.0 };
            let Tyres { c_f, f_f0, .. } = found.apply(&line);
            // Central differences: 1e-12 of the third derivative, and rounding of 1e-16 over 1e-6 of the force.
            assert!((c_f - slope(&truth, alpha)).abs() < 1e-4, "{alpha}");
            assert!((f_f0 + c_f * alpha - truth(alpha)).abs() < 1e-6, "{alpha}");
        }
        assert!((slope(&truth, 0.0) - found.stiffness * slope(&believed, 0.0)).abs() < 1e-3);
    }
}

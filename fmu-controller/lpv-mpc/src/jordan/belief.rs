//! One stage of a roll along a trajectory: both axle forces as lines through where the stage is.

use super::{Document, Measured, Memory, Network};
use crate::angles::atans;
use crate::model::Tyres;

/// Index of the lateral velocity among the inputs.
const V_Y: usize = 1;
/// Index of the yaw rate among the inputs.
const YAW_RATE: usize = 2;
/// Index of the steering angle among the inputs.
const DELTA: usize = 3;

/// Steering moves the front slip alone, by as much.
pub(super) const STEERING: [(usize, f64); 1] = [(DELTA, 1.0)];

/// Turning about the front axle, `d v_y = -l_f d yaw_rate`, moves the rear slip alone.
pub(super) fn turning(document: &Document) -> [(usize, f64); 2] {
    [(V_Y, -document.l_f), (YAW_RATE, 1.0)]
}

/// What the network says about one axle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axle {
    /// Slip angle [rad].
    pub alpha: f64,
    /// Secant stiffness, force over slip [N/rad].
    pub secant: f64,
    /// Tangent stiffness, the change of force with slip; negative beyond the peak of the force [N/rad].
    pub tangent: f64,
}

/// What the network says about one stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Belief {
    /// Front axle.
    pub front: Axle,
    /// Rear axle.
    pub rear: Axle,
    /// How far it may be believed, 0 to 1 [1].
    pub confidence: f64,
}

impl Belief {
    /// Forces proportional to slip.
    #[must_use]
    #[inline]
    pub fn secant(&self) -> Tyres {
        Tyres::secant(self.front.secant, self.rear.secant)
    }

    /// Forces as tangents, `F = F_0 + C_t alpha`.
    ///
    /// The force at the stage's own slip is the secant's. A tangent stiffness below `floor` times the secant one is held
    /// there: a prediction model with negative stiffness runs away within a horizon.
    #[must_use]
    #[inline]
    pub fn tangent(&self, floor: f64) -> Tyres {
        let line = |axle: &Axle| {
            let slope = axle.tangent.max(floor * axle.secant);
            (slope, (axle.secant - slope) * axle.alpha)
        };
        let ((c_f, f_f0), (c_r, f_r0)) = (line(&self.front), line(&self.rear));
        Tyres { c_f, c_r, f_f0, f_r0 }
    }
}

impl Network {
    /// One sample like [`Network::step`], with the slope of both axle forces and the confidence.
    ///
    /// The network gives `C` as a function of its inputs; the tangent stiffness is `C + alpha dC/dalpha`. Along the directions
    /// that move the front slip alone and the rear slip alone the network is differentiated exactly; the memory is held, being
    /// the past.
    #[must_use]
    #[inline(always)]
    pub fn linearise(&self, memory: &Memory, measured: &Measured) -> (Memory, Belief) {
        let Document { l_f, l_r, outputs, .. } = &self.document;
        let (z_f, z_r) = self.drift(measured);
        let [drift_f, drift_r] = atans([z_f, z_r]);
        let (alpha_f, alpha_r) = (measured.delta - drift_f, -drift_r);
        // alpha_r = -atan(z), so d alpha_r = -d z / (1 + z^2), and z falls by (l_f + l_r) / v_x for each unit of yaw rate.
        let turn = measured.v_x * (1.0 + z_r * z_r) / (l_f + l_r);

        let ([c_f, c_r], [steered, turned]) = self.layers.forward_along(&self.seen(memory, measured));
        if !(c_f.is_finite() && c_r.is_finite()) {
            return (*memory, self.hold(memory));
        }
        let memory = Memory { c_f, c_r };
        let (secant_f, secant_r) = self.stiffness(&memory);
        let axle = |alpha: f64, secant: f64, slope: f64| Axle { alpha, secant, tangent: secant + alpha * slope };
        let belief = Belief {
            front: axle(alpha_f, secant_f, outputs[0].deviation * steered),
            rear: axle(alpha_r, secant_r, outputs[1].deviation * (turn * turned)),
            confidence: self.belief(measured, (alpha_f, alpha_r)),
        };
        (memory, belief)
    }

    /// The last answer without belief, for inputs that are not numbers.
    fn hold(&self, memory: &Memory) -> Belief {
        let (c_f, c_r) = self.stiffness(memory);
        let axle = |c: f64| Axle { alpha: 0.0, secant: c, tangent: c };
        Belief { front: axle(c_f), rear: axle(c_r), confidence: 0.0 }
    }
}

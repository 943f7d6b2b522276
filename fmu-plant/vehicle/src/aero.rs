//! Forces of the air on the body, from the relative wind vector.

use crate::{Parameters, Scalar};

/// Constants of the air forces, per unit of mass or inertia so that the step multiplies only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aero {
    /// `1/2 rho C_d A` [kg/m].
    drag: f64,
    /// `1/2 rho C_s A_s` [kg/m].
    side: f64,
    /// Distance of the side force's point ahead of the centre of gravity [m].
    arm: f64,
    /// Whether the lateral wind acts; without it the drag is the paper's, longitudinal alone.
    crosswind: bool,
}

/// Forces [N] and yaw moment [N m] in the body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forces<D> {
    /// Longitudinal force, negative against the motion [N].
    pub f_wx: D,
    /// Lateral force, positive to the left [N].
    pub f_wy: D,
    /// Yaw moment, positive to the left [N m].
    pub m_wz: D,
}

impl Aero {
    /// The constants of a vehicle.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        let Parameters { rho, c_d, area, c_s, area_side, arm_side, crosswind, .. } = *parameters;
        Self { drag: 0.5 * rho * c_d * area, side: 0.5 * rho * c_s * area_side, arm: arm_side, crosswind }
    }

    /// Forces at the relative wind (wind minus vehicle velocity) in the body frame [m/s].
    ///
    /// A head wind alone reproduces the paper's `1/2 rho C_d A (v_x + v_w)^2`.
    pub fn forces<D: Scalar>(&self, v_rel_x: D, v_rel_y: D) -> Forces<D> {
        if !self.crosswind {
            return Forces { f_wx: v_rel_x * v_rel_x.abs() * self.drag, f_wy: D::zero(), m_wz: D::zero() };
        }
        // The root of a dual zero has no derivative: 1e-12 (m/s)^2 below it changes no force beyond rounding.
        let speed = (v_rel_x * v_rel_x + v_rel_y * v_rel_y + 1e-12).sqrt();
        let f_wy = speed * v_rel_y * self.side;
        Forces { f_wx: speed * v_rel_x * self.drag, f_wy, m_wz: f_wy * self.arm }
    }
}

//! The nonlinear single-track model: right-hand side and everything that it computes on the way.
//!
//! [Kebbati, eq. (1)] with its errata corrected: the slip angles carry `+l_f w` in front and `-l_r w` behind, and the
//! heading error turns with `kappa s'`, not with `s'` alone. With all extras of the parameters off this is the paper's
//! plant, from [`BLEND_TO`] on.

mod evaluate;
mod grip;
mod kinematic;

pub use kinematic::{BLEND_FROM, BLEND_TO, TAU};

use grip::Grip;
use kinematic::Kinematic;

use crate::{
    Parameters, Scalar,
    aero::Aero,
    tyre::{self, Axle},
};

/// Number of states.
pub const NX: usize = 11;
/// Longitudinal velocity, body frame [m/s].
pub const V_X: usize = 0;
/// Lateral velocity, body frame [m/s].
pub const V_Y: usize = 1;
/// Yaw rate [rad/s].
pub const YAW_RATE: usize = 2;
/// Arc length along the path [m].
pub const S: usize = 3;
/// Lateral error [m].
pub const E_Y: usize = 4;
/// Heading error [rad].
pub const E_PSI: usize = 5;
/// Global position along the start of the road [m].
pub const X: usize = 6;
/// Global position to the left of it [m].
pub const Y: usize = 7;
/// Global heading [rad].
pub const PSI: usize = 8;
/// Front slip angle behind the relaxation length [rad].
pub const ALPHA_F: usize = 9;
/// Rear slip angle behind the relaxation length [rad].
pub const ALPHA_R: usize = 10;

/// The states' names, in the order of the indices.
pub const NAMES: [&str; NX] = ["v_x", "v_y", "yaw_rate", "s", "e_y", "e_psi", "x", "y", "psi", "alpha_f", "alpha_r"];

/// Below this speed the guarded speed departs from `v_x` [m/s].
pub const V_GUARD: f64 = 2.0;

/// What acts on the vehicle at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive<D> {
    /// Front steering angle [rad].
    pub delta: D,
    /// Its sine, computed once while the angle stands still [1].
    pub sin_delta: D,
    /// Its cosine [1].
    pub cos_delta: D,
    /// Longitudinal acceleration by drive and brakes [m/s2].
    pub a_x: D,
    /// Wind in the road frame at the start, along it [m/s].
    pub wind_x: D,
    /// Wind to the left of it [m/s].
    pub wind_y: D,
    /// Factor on the friction [1].
    pub mu_scale: D,
}

impl<D: Scalar> Drive<D> {
    /// The same drive at another steering angle.
    #[must_use]
    pub fn steered(self, delta: D) -> Self {
        let (sin_delta, cos_delta) = delta.sin_cos();
        Self { delta, sin_delta, cos_delta, ..self }
    }
}

/// Derivatives and forces of one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation<D> {
    /// Derivative of the state, per second.
    pub x_dot: [D; NX],
    /// Front slip angle [rad].
    pub alpha_f: D,
    /// Rear slip angle [rad].
    pub alpha_r: D,
    /// Lateral force of the front axle [N].
    pub f_yf: D,
    /// Lateral force of the rear axle [N].
    pub f_yr: D,
    /// Grip of the front axle, mu F_z [N].
    pub peak_f: D,
    /// Grip of the rear axle, mu F_z [N].
    pub peak_r: D,
    /// Front slip angle over that of the peak force, 0 if there is no peak [1].
    pub slip_f: D,
    /// Rear slip angle over that of the peak force, 0 if there is no peak [1].
    pub slip_r: D,
    /// What drive or brakes leave of the front axle's lateral force [1].
    pub left_f: D,
    /// What they leave of the rear axle's [1].
    pub left_r: D,
    /// Secant stiffness of the front tyre law [N/rad].
    pub c_f: D,
    /// Secant stiffness of the rear tyre law [N/rad].
    pub c_r: D,
    /// Acceleration that drive and brakes reach [m/s2].
    pub a_x: D,
    /// Wind where the vehicle is, global frame [m/s].
    pub wind: [D; 2],
}

/// Constants of a vehicle, derived once from its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dynamics {
    m_inverse: f64,
    i_z_inverse: f64,
    l_f: f64,
    l_r: f64,
    g: f64,
    /// Slopes of the whole road [rad].
    grade: f64,
    bank: f64,
    c_rr: f64,
    /// Inverse of the relaxation length, 0 for none [1/m].
    relaxation: f64,
    front: Axle,
    rear: Axle,
    /// Inverse slip angles of the peak forces, 0 without a peak [1/rad].
    peak_slip_inverse: [f64; 2],
    grip: Grip,
    aero: Aero,
    kinematic: Kinematic,
}

impl Dynamics {
    /// The constants of a vehicle.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        let Parameters { m, i_z, l_f, l_r, g, c_rr, grade, bank, relaxation_length, .. } = *parameters;
        let (front, rear) = Axle::pair(parameters);
        Self {
            m_inverse: 1.0 / m,
            i_z_inverse: 1.0 / i_z,
            l_f,
            l_r,
            g,
            grade,
            bank,
            c_rr,
            relaxation: if relaxation_length > 0.0 { 1.0 / relaxation_length } else { 0.0 },
            front,
            rear,
            peak_slip_inverse: [front, rear].map(|axle| axle.peak_slip().map_or(0.0, f64::recip)),
            grip: Grip::new(parameters),
            aero: Aero::new(parameters),
            kinematic: Kinematic { mass: m, i_z, l_f, l_r },
        }
    }

    /// Friction of the road at arc length `s`, before the inputs' factor on it [1].
    pub fn friction<D: Scalar>(&self, road: &crate::Road, s: D) -> D {
        self.grip.friction(road, s)
    }

    /// Rate of the fastest mode [1/s]: the tyres at the lowest guarded speed, and the relaxation at the highest speed.
    #[must_use]
    pub fn fastest_rate(&self, parameters: &Parameters) -> f64 {
        /// Highest speed that the parameters allow [m/s].
        const V_TOP: f64 = Parameters::MAX.v_x_0;
        let Parameters { m, i_z, l_f, l_r, g, mu, .. } = *parameters;
        let load = m * g / (l_f + l_r);
        let c_f = self.front.cornering_stiffness(mu, load * l_r);
        let c_r = self.rear.cornering_stiffness(mu, load * l_f);
        let slip = ((c_f + c_r) / m).max((c_f * l_f * l_f + c_r * l_r * l_r) / i_z) / (0.5 * V_GUARD);
        slip.max(self.relaxation * V_TOP)
    }
}

/// The speed that slip angles divide by: `v_x` itself above [`V_GUARD`], and a parabola that meets it there with the
/// same slope and never falls below half of it.
#[inline]
fn guarded<D: Scalar>(v_x: D) -> D {
    if v_x.re() >= V_GUARD {
        v_x
    } else if v_x.re() <= 0.0 {
        D::from(0.5 * V_GUARD)
    } else {
        v_x * v_x * (0.5 / V_GUARD) + 0.5 * V_GUARD
    }
}

/// How near to the centre of the curve the arc length still counts: `1 - e_y kappa` there [1].
pub(crate) const NEAREST: f64 = 0.1;

/// `1 - e_y kappa`, kept away from the centre of the curve, where no arc length belongs to a position.
#[inline]
fn progress<D: Scalar>(e_y_kappa: D) -> D {
    if e_y_kappa.re() > 1.0 - NEAREST { D::from(NEAREST) } else { -e_y_kappa + 1.0 }
}

/// Rate of the arc length [m/s] at these velocities, errors and curvature.
#[must_use]
pub fn progress_rate((v_x, v_y): (f64, f64), (e_y, e_psi): (f64, f64), kappa: f64) -> f64 {
    let (sin, cos) = e_psi.sin_cos();
    (v_x * cos - v_y * sin) / progress(e_y * kappa)
}

/// Force of a tyre and its secant stiffness at a slip angle.
fn tyre_force<D: Scalar>(axle: &Axle, alpha: D, mu: D, load: D) -> (D, D) {
    let force = axle.force(alpha, mu, load);
    (force, tyre::secant_stiffness(force, alpha, axle.cornering_stiffness(mu, load)))
}

//! The nonlinear single-track model: right-hand side and everything that it computes on the way.
//!
//! [Kebbati, eq. (1)] with its errata corrected: the slip angles carry `+l_f w` in front and `-l_r w` behind, and the
//! heading error turns with `kappa s'`, not with `s'` alone.

use crate::{
    Parameters, Scalar,
    aero::{Aero, Forces},
    road::Road,
    tyre::{self, Axle},
};

/// Number of states.
pub const NX: usize = 9;
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

/// The states' names, in the order of the indices.
pub const NAMES: [&str; NX] = ["v_x", "v_y", "yaw_rate", "s", "e_y", "e_psi", "x", "y", "psi"];

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
    /// Largest lateral force of the front axle [N].
    pub peak_f: D,
    /// Largest lateral force of the rear axle [N].
    pub peak_r: D,
    /// Wind speed where the vehicle is [m/s].
    pub wind: [D; 2],
}

/// Constants of a vehicle, derived once from its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dynamics {
    m_inverse: f64,
    i_z_inverse: f64,
    l_f: f64,
    l_r: f64,
    /// Peak forces `mu F_z` at rest [N].
    peak_f: f64,
    peak_r: f64,
    front: Axle,
    rear: Axle,
    aero: Aero,
    /// Deceleration of the rolling resistance [m/s2].
    rolling: f64,
}

impl Dynamics {
    /// The constants of a vehicle.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        let Parameters { m, i_z, l_f, l_r, g, mu, c_rr, .. } = *parameters;
        let (front, rear) = Axle::pair(parameters);
        let per_wheelbase = mu * m * g / (l_f + l_r);
        Self {
            m_inverse: 1.0 / m,
            i_z_inverse: 1.0 / i_z,
            l_f,
            l_r,
            peak_f: per_wheelbase * l_r,
            peak_r: per_wheelbase * l_f,
            front,
            rear,
            aero: Aero::new(parameters),
            rolling: c_rr * g,
        }
    }

    /// Everything at state `x`, on `road`, under `drive`.
    #[inline]
    pub fn evaluate<D: Scalar>(&self, road: &Road, x: &[D; NX], drive: &Drive<D>) -> Evaluation<D> {
        let [v_x, v_y, w, s, e_y, e_psi, _, _, psi] = *x;
        let Drive { delta, sin_delta, cos_delta, a_x, mu_scale, .. } = *drive;
        let (sin_e_psi, cos_e_psi) = e_psi.sin_cos();
        let (sin_psi, cos_psi) = psi.sin_cos();

        let v_inverse = guarded(v_x).recip();
        let alpha_f = delta - ((v_y + w * self.l_f) * v_inverse).atan();
        let alpha_r = -((v_y - w * self.l_r) * v_inverse).atan();
        let peak_f = mu_scale * self.peak_f;
        let peak_r = mu_scale * self.peak_r;
        let f_yf = self.front.force(alpha_f, peak_f);
        let f_yr = self.rear.force(alpha_r, peak_r);

        let [own_x, own_y] = road.wind(s);
        let (wind_x, wind_y) = (drive.wind_x + own_x, drive.wind_y + own_y);
        let Forces { f_wx, f_wy, m_wz } =
            self.aero.forces(wind_x * cos_psi + wind_y * sin_psi - v_x, wind_y * cos_psi - wind_x * sin_psi - v_y);

        let f_yf_y = f_yf * cos_delta;
        let kappa = road.curvature(s);
        let s_dot = (v_x * cos_e_psi - v_y * sin_e_psi) / progress(e_y * kappa);
        let x_dot = [
            a_x + w * v_y - (f_yf * sin_delta - f_wx) * self.m_inverse - rolling(v_x) * self.rolling,
            (f_yf_y + f_yr + f_wy) * self.m_inverse - w * v_x,
            (f_yf_y * self.l_f - f_yr * self.l_r + m_wz) * self.i_z_inverse,
            s_dot,
            v_x * sin_e_psi + v_y * cos_e_psi,
            w - kappa * s_dot,
            v_x * cos_psi - v_y * sin_psi,
            v_x * sin_psi + v_y * cos_psi,
            w,
        ];
        Evaluation { x_dot, alpha_f, alpha_r, f_yf, f_yr, peak_f, peak_r, wind: [wind_x, wind_y] }
    }

    /// Secant stiffnesses of both axles [N/rad].
    pub fn stiffness<D: Scalar>(&self, evaluation: &Evaluation<D>) -> (D, D) {
        let Evaluation { alpha_f, alpha_r, f_yf, f_yr, peak_f, peak_r, .. } = *evaluation;
        (
            tyre::secant_stiffness(f_yf, alpha_f, self.front.cornering_stiffness(peak_f)),
            tyre::secant_stiffness(f_yr, alpha_r, self.rear.cornering_stiffness(peak_r)),
        )
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

/// `1 - e_y kappa`, kept away from the centre of the curve, where no arc length belongs to a position.
#[inline]
fn progress<D: Scalar>(e_y_kappa: D) -> D {
    /// A tenth: nine tenths of the way to the centre.
    const NEAREST: f64 = 0.1;
    if e_y_kappa.re() > 1.0 - NEAREST { D::from(NEAREST) } else { -e_y_kappa + 1.0 }
}

/// Rate of the arc length [m/s] at these velocities, errors and curvature.
#[must_use]
pub fn progress_rate((v_x, v_y): (f64, f64), (e_y, e_psi): (f64, f64), kappa: f64) -> f64 {
    let (sin, cos) = e_psi.sin_cos();
    (v_x * cos - v_y * sin) / progress(e_y * kappa)
}

/// Rolling resistance over its value at speed: 1 from 0.5 m/s on, and a smooth odd cubic through standstill below.
#[inline]
fn rolling<D: Scalar>(v_x: D) -> D {
    const FULL: f64 = 0.5;
    if v_x.re() >= FULL {
        D::one()
    } else if v_x.re() <= -FULL {
        -D::one()
    } else {
        let r = v_x * (1.0 / FULL);
        r * (r * r * -0.5 + 1.5)
    }
}

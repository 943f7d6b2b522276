//! The right-hand side itself.

use super::{
    Drive, Dynamics, Evaluation, NX, guarded,
    kinematic::{BLEND_TO, Kinematic, Motion, Push},
    progress, tyre_force,
};
use crate::{Scalar, aero::Forces, road::Road, smooth};

/// Speed from which rolling resistance acts in full; below it fades to 0 at standstill [m/s].
const ROLLING_FROM: f64 = 0.5;
/// Speed from which brakes act in full; below they fade, so that braking ends in standstill and not in reverse [m/s].
const BRAKING_FROM: f64 = 0.1;

impl Dynamics {
    /// Derivative of the state `x`, on `road`, under `drive`.
    #[inline]
    pub fn rates<D: Scalar>(&self, road: &Road, x: &[D; NX], drive: &Drive<D>) -> [D; NX] {
        self.run::<D, false>(road, x, drive).x_dot
    }

    /// Everything at state `x`, on `road`, under `drive`.
    pub fn evaluate<D: Scalar>(&self, road: &Road, x: &[D; NX], drive: &Drive<D>) -> Evaluation<D> {
        self.run::<D, true>(road, x, drive)
    }

    /// `ALL` adds what the derivative does not need.
    #[inline(always)]
    fn run<D: Scalar, const ALL: bool>(&self, road: &Road, x: &[D; NX], drive: &Drive<D>) -> Evaluation<D> {
        let [v_x, v_y, w, s, e_y, e_psi, _, _, psi, lagged_f, lagged_r] = *x;
        let Drive { delta, sin_delta, cos_delta, mu_scale, .. } = *drive;
        let (sin_e_psi, cos_e_psi) = e_psi.sin_cos();
        let (sin_psi, cos_psi) = psi.sin_cos();

        let ([g_x, g_y], g_z) = self.gravity(road, s, (sin_e_psi, cos_e_psi));
        let braking = drive.a_x.re() < 0.0 && v_x.re() < BRAKING_FROM;
        let a_x = if braking { drive.a_x * smooth::sign(v_x, BRAKING_FROM) } else { drive.a_x };
        let (front, rear, a_x) = self.grip.axles(road, s, a_x, g_z, mu_scale);

        let v = guarded(v_x);
        let v_inverse = v.recip();
        let mut alpha_f = delta - ((v_y + w * self.l_f) * v_inverse).atan();
        let mut alpha_r = -((v_y - w * self.l_r) * v_inverse).atan();
        let mut alpha_dot = [D::zero(); 2];
        if self.relaxation > 0.0 {
            let pace = v * self.relaxation;
            alpha_dot = [(alpha_f - lagged_f) * pace, (alpha_r - lagged_r) * pace];
            (alpha_f, alpha_r) = (lagged_f, lagged_r);
        }
        let mut f_yf = self.front.force(alpha_f, front.mu, front.load) * front.left;
        let mut f_yr = self.rear.force(alpha_r, rear.mu, rear.load) * rear.left;

        let [own_x, own_y] = road.wind(s);
        let (wind_x, wind_y) = (drive.wind_x + own_x, drive.wind_y + own_y);
        let Forces { f_wx, f_wy, m_wz } =
            self.aero.forces(wind_x * cos_psi + wind_y * sin_psi - v_x, wind_y * cos_psi - wind_x * sin_psi - v_y);
        let push = Push {
            a_x: a_x + g_x + f_wx * self.m_inverse - smooth::sign(v_x, ROLLING_FROM) * g_z * self.c_rr,
            a_y: f_wy * self.m_inverse + g_y,
            moment: m_wz,
        };

        let f_yf_y = f_yf * cos_delta;
        let mut rates = [
            push.a_x + w * v_y - f_yf * sin_delta * self.m_inverse,
            push.a_y + (f_yf_y + f_yr) * self.m_inverse - w * v_x,
            (f_yf_y * self.l_f - f_yr * self.l_r + push.moment) * self.i_z_inverse,
        ];
        let (mut c_f, mut c_r) = (D::zero(), D::zero());
        if ALL {
            c_f = tyre_force(&self.front, alpha_f, front.mu, front.load).1 * front.left;
            c_r = tyre_force(&self.rear, alpha_r, rear.mu, rear.load).1 * rear.left;
        }
        if v_x.re() < BLEND_TO {
            let share = Kinematic::share(v_x);
            let rolling: Motion<D> = self.kinematic.motion([v_x, v_y, w], &push, (sin_delta, cos_delta));
            let mix = |dynamic: D, kinematic: D| kinematic + (dynamic - kinematic) * share;
            rates = std::array::from_fn(|i| mix(rates[i], rolling.rates[i]));
            (f_yf, f_yr) = (mix(f_yf, rolling.f_yf), mix(f_yr, rolling.f_yr));
            (alpha_f, alpha_r) = (alpha_f * share, alpha_r * share);
        }

        let kappa = road.curvature(s);
        let s_dot = (v_x * cos_e_psi - v_y * sin_e_psi) / progress(e_y * kappa);
        let [v_x_dot, v_y_dot, w_dot] = rates;
        let x_dot = [
            v_x_dot,
            v_y_dot,
            w_dot,
            s_dot,
            v_x * sin_e_psi + v_y * cos_e_psi,
            w - kappa * s_dot,
            v_x * cos_psi - v_y * sin_psi,
            v_x * sin_psi + v_y * cos_psi,
            w,
            alpha_dot[0],
            alpha_dot[1],
        ];
        Evaluation {
            x_dot,
            alpha_f,
            alpha_r,
            f_yf,
            f_yr,
            peak_f: front.mu * front.load,
            peak_r: rear.mu * rear.load,
            slip_f: alpha_f.abs() * self.peak_slip_inverse[0],
            slip_r: alpha_r.abs() * self.peak_slip_inverse[1],
            left_f: front.left,
            left_r: rear.left,
            c_f,
            c_r,
            a_x,
            wind: [wind_x, wind_y],
        }
    }

    /// Gravity along the surface, forward and to the left of the vehicle, and onto it [m/s2].
    #[inline]
    fn gravity<D: Scalar>(&self, road: &Road, s: D, (sin_e_psi, cos_e_psi): (D, D)) -> ([D; 2], D) {
        if self.grade == 0.0 && self.bank == 0.0 && !road.has_slopes() {
            return ([D::zero(), D::zero()], D::from(self.g));
        }
        let [grade, bank] = road.slopes(s);
        let (sin_grade, cos_grade) = (grade + self.grade).sin_cos();
        let (sin_bank, cos_bank) = (bank + self.bank).sin_cos();
        // Grade turns the road up ahead of it, bank then lifts its left side.
        let along = -sin_grade * self.g;
        let left = -cos_grade * sin_bank * self.g;
        let onto = cos_grade * cos_bank * self.g;
        ([along * cos_e_psi + left * sin_e_psi, left * cos_e_psi - along * sin_e_psi], onto)
    }
}

//! The model's terms where it is asked: at one state and input of a car.

use nalgebra::SMatrix;

use super::{A_X, Body, DELTA, Disturbance, E_PSI, E_Y, Input, Lpv, NU, NX, State, Tyres, V_GUARD, V_X, V_Y, YAW_RATE};
use crate::Scalar;
use crate::angles::{Angle, angles, atan_ratios, atans};

/// Smallest value of `1 - kappa e_y`: closer to the centre of curvature the path coordinates lose their meaning.
const PATH_FACTOR_MIN: f64 = 0.1;

/// Guarded speed of the slip angles, and the ratio of true to guarded speed that scales the steering.
fn guarded<T: Scalar>(v_x: T) -> (T, T) {
    let v = v_x.larger(V_GUARD);
    (v, v_x / v)
}

/// A state and an input of a car, with its speed and the functions of its angles as the model needs them: these cost as much
/// as the rest of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<'a, T = f64> {
    /// State.
    pub x: State<T>,
    /// Input.
    pub u: Input<T>,
    /// The car's body.
    pub body: &'a Body,
    delta: Angle<T>,
    e_psi: Angle<T>,
    /// One over the guarded speed [s/m].
    per_v: T,
    /// Tangents of the angles at which the front and the rear axle move against the body [1].
    z: [T; 2],
    /// These angles over their tangents [1].
    n: [T; 2],
}

impl<'a, T: Scalar> Point<'a, T> {
    /// The point of a state and an input of a car with this body.
    #[inline(always)]
    pub fn new(x: State<T>, u: Input<T>, body: &'a Body) -> Self {
        let [delta, e_psi] = angles([u[DELTA], x[E_PSI]]);
        let per_v = guarded(x[V_X]).0.recip();
        let z = drift(&x, per_v, body);
        Self { x, u, body, delta, e_psi, per_v, z, n: atan_ratios(z) }
    }

    /// Progress along the path [m/s], `s'` of [Kebbati, eq. (1)].
    #[inline(always)]
    pub fn progress(&self, kappa: T) -> T {
        (self.x[V_X] * self.e_psi.cos - self.x[V_Y] * self.e_psi.sin) / path_factor(kappa, self.x[E_Y])
    }

    /// Right-hand side of the prediction model, [Kebbati, eq. (1)] corrected, and the progress along the path [m/s].
    ///
    /// Differs from the printed equations in the signs of the slip angles, the factor `kappa` and the signs in `e_psi'`, and
    /// rolling resistance that is `c_rr m g` instead of the tyre's friction times the weight.
    #[inline(always)]
    pub fn motion(&self, kappa: T, tyres: &Tyres<T>, disturbance: &Disturbance<T>) -> (State<T>, T) {
        let [v_x, v_y, yaw_rate, _, _] = self.x.into();
        let Body { m, i_z, l_f, l_r, drag, rolling } = *self.body;
        let (per_m, per_i) = (m.recip(), i_z.recip());
        let ratio = v_x * self.per_v;
        let ([z_f, z_r], [n_f, n_r]) = (self.z, self.n);
        let (alpha_f, alpha_r) = (self.u[DELTA] * ratio - z_f * n_f, -z_r * n_r);
        let f_yf = alpha_f * tyres.c_f + tyres.f_f0;
        let f_yr = alpha_r * tyres.c_r + tyres.f_r0;
        let (Angle { sin: s, cos: c, .. }, Angle { sin: s_psi, cos: c_psi, .. }) = (self.delta, self.e_psi);
        let progress = self.progress(kappa);

        let rate = State::from([
            self.u[A_X] + yaw_rate * v_y - f_yf * s * per_m - ratio * rolling - v_x.abs() * v_x * (drag * per_m)
                + disturbance[0],
            (f_yf * c + f_yr) * per_m - yaw_rate * v_x + disturbance[1],
            (f_yf * c * l_f - f_yr * l_r) * per_i + disturbance[2],
            v_x * s_psi + v_y * c_psi,
            yaw_rate - kappa * progress,
        ]);
        (rate, progress)
    }

    /// The LPV embedding with this as the scheduling point, on curvature `kappa` [1/m], [Kebbati, eqs. (6) to (8)] corrected.
    ///
    /// Exact: `A x + B u + d` at the scheduling point equals [`Self::motion`]. Differs from the printed matrices in the signs of
    /// `A52`, `B21`, `B31` and of the rear term in `A32`, in the misplaced cosines of `A32` and `A33`, and in the lateral
    /// error's row: the printed `A41 = sin e_psi` with `A45 = 0` makes (A, B) uncontrollable, `A45 = v_x sinc e_psi` does not.
    #[inline(always)]
    pub fn embed(&self, kappa: T, tyres: &Tyres<T>, disturbance: &Disturbance<T>) -> Lpv<T> {
        let [v_x, v_y, _, e_y, _] = self.x.into();
        let Body { m, i_z, l_f, l_r, drag, rolling } = *self.body;
        let Tyres { c_f, c_r, f_f0, f_r0 } = *tyres;
        // Reciprocals once: a division costs five products.
        let (per_m, per_i) = (m.recip(), i_z.recip());
        let (Angle { sin: s, cos: c, .. }, Angle { sin: s_psi, cos: c_psi, sinc }) = (self.delta, self.e_psi);
        let ([n_f, n_r], per_v) = (self.n, self.per_v);
        let ratio = v_x * per_v;
        // Stiffness per metre per second of lateral velocity at the axle.
        let (k_f, k_r) = (n_f * per_v * c_f, n_r * per_v * c_r);
        let k_path = kappa / path_factor(kappa, e_y);
        let (k_fs, k_fc) = (k_f * s, k_f * c);
        let moment = k_fc * l_f - k_r * l_r;
        let steering = ratio * c_f * per_m;

        let mut A = SMatrix::<T, NX, NX>::zeros();
        A[(V_X, V_X)] = -per_v * rolling - v_x.abs() * (drag * per_m);
        A[(V_X, V_Y)] = k_fs * per_m;
        A[(V_X, YAW_RATE)] = k_fs * (l_f * per_m) + v_y;
        A[(V_Y, V_Y)] = -(k_fc + k_r) * per_m;
        A[(V_Y, YAW_RATE)] = -moment * per_m - v_x;
        A[(YAW_RATE, V_Y)] = -moment * per_i;
        A[(YAW_RATE, YAW_RATE)] = -(k_fc * (l_f * l_f) + k_r * (l_r * l_r)) * per_i;
        A[(E_Y, V_Y)] = c_psi;
        A[(E_Y, E_PSI)] = v_x * sinc;
        A[(E_PSI, V_X)] = -k_path * c_psi;
        A[(E_PSI, V_Y)] = k_path * s_psi;
        A[(E_PSI, YAW_RATE)] = T::one();

        let mut B = SMatrix::<T, NX, NU>::zeros();
        B[(V_X, DELTA)] = -steering * s;
        B[(V_X, A_X)] = T::one();
        B[(V_Y, DELTA)] = steering * c;
        B[(YAW_RATE, DELTA)] = steering * c * (l_f * m * per_i);

        let d = State::from([
            -s * f_f0 * per_m + disturbance[0],
            (c * f_f0 + f_r0) * per_m + disturbance[1],
            (c * (f_f0 * l_f) - f_r0 * l_r) * per_i + disturbance[2],
            T::zero(),
            T::zero(),
        ]);
        Lpv { A, B, d }
    }
}

/// Tangents of the angles at which the front and the rear axle move against the body [1].
#[inline(always)]
fn drift<T: Scalar>(x: &State<T>, per_v: T, body: &Body) -> [T; 2] {
    [(x[V_Y] + x[YAW_RATE] * body.l_f) * per_v, (x[V_Y] - x[YAW_RATE] * body.l_r) * per_v]
}

/// `1 - kappa e_y`, held away from zero.
fn path_factor<T: Scalar>(kappa: T, e_y: T) -> T {
    (-kappa * e_y + 1.0).larger(PATH_FACTOR_MIN)
}

/// Front and rear slip angles [rad], [Kebbati, eq. (2)] with the signs of the yaw terms corrected.
#[inline]
pub fn slip_angles<T: Scalar>(x: &State<T>, delta: T, body: &Body) -> (T, T) {
    let (v, ratio) = guarded(x[V_X]);
    let [drift_f, drift_r] = atans(drift(x, v.recip(), body));
    (delta * ratio - drift_f, -drift_r)
}

//! The prediction model: nonlinear single-track equations in path coordinates and their exact LPV embedding.
//!
//! [`Point::motion`] states the equations of motion, [`Point::embed`] writes the same right-hand side as
//! `A(psi) x + B(psi) u + d`. The two agree to rounding for every state and for any tyre whose axle force is written
//! `F = F_0 + C alpha`: a secant stiffness has `F_0 = 0`, a tangent model carries the rest of the force in `F_0`.

mod point;

use nalgebra::{SMatrix, SVector};
use num_dual::Dual64;
use serde::{Deserialize, Serialize};

use crate::Scalar;
pub use point::{Point, slip_angles};

/// Number of vehicle states.
pub const NX: usize = 5;
/// Number of inputs.
pub const NU: usize = 2;

/// Index of the longitudinal velocity [m/s].
pub const V_X: usize = 0;
/// Index of the lateral velocity [m/s].
pub const V_Y: usize = 1;
/// Index of the yaw rate [rad/s].
pub const YAW_RATE: usize = 2;
/// Index of the lateral error [m].
pub const E_Y: usize = 3;
/// Index of the heading error [rad].
pub const E_PSI: usize = 4;
/// Index of the front steering angle in the input [rad].
pub const DELTA: usize = 0;
/// Index of the longitudinal acceleration in the input [m/s2].
pub const A_X: usize = 1;

/// State `[v_x, v_y, yaw_rate, e_y, e_psi]`.
pub type State<T = f64> = SVector<T, NX>;
/// Input `[delta, a_x]`.
pub type Input<T = f64> = SVector<T, NU>;

/// Speed below which slip angles are taken as if the car moved this fast [m/s].
///
/// Slip is undefined at standstill ([Kebbati] adds an unvalued epsilon to some of its terms). Dividing by
/// `max(v_x, V_GUARD)` bounds the rate of the lateral modes, and scaling the steering by the same ratio keeps the
/// kinematic bicycle as the steady state: at rest steering moves nothing. 3 m/s keeps the fastest mode of the stiffest tyre
/// preset (about 40 1/s) resolvable by the fourth-order discretisation at a period of 33 ms.
pub const V_GUARD: f64 = 3.0;

/// What the controller believes about the car's body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Mass [kg].
    pub m: f64,
    /// Yaw inertia [kg m2].
    pub i_z: f64,
    /// Distance from the centre of gravity to the front axle [m].
    pub l_f: f64,
    /// Distance from the centre of gravity to the rear axle [m].
    pub l_r: f64,
    /// Drag per squared speed, `rho C_d A / 2` [kg/m].
    pub drag: f64,
    /// Rolling deceleration, `c_rr g` [m/s2].
    pub rolling: f64,
}

/// Axle forces as affine functions of the slip angles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tyres<T = f64> {
    /// Front cornering stiffness [N/rad].
    pub c_f: T,
    /// Rear cornering stiffness [N/rad].
    pub c_r: T,
    /// Front lateral force at zero slip of the affine model; 0 for a secant stiffness [N].
    pub f_f0: T,
    /// Rear lateral force at zero slip of the affine model; 0 for a secant stiffness [N].
    pub f_r0: T,
}

impl Tyres {
    /// Secant stiffnesses: forces proportional to slip.
    pub fn secant(c_f: f64, c_r: f64) -> Self {
        Self { c_f, c_r, f_f0: 0.0, f_r0: 0.0 }
    }

    /// These tyres with the derivatives `slope`.
    pub(crate) fn with_slope(&self, slope: &Self) -> Tyres<Dual64> {
        Tyres {
            c_f: Dual64::new(self.c_f, slope.c_f),
            c_r: Dual64::new(self.c_r, slope.c_r),
            f_f0: Dual64::new(self.f_f0, slope.f_f0),
            f_r0: Dual64::new(self.f_r0, slope.f_r0),
        }
    }
}

/// Accelerations that the model cannot explain: `[m/s2, m/s2, rad/s2]` on `v_x`, `v_y` and `yaw_rate`.
pub type Disturbance<T = f64> = SVector<T, 3>;

/// The linear system `x' = A x + B u + d` at one scheduling point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lpv<T = f64> {
    /// System matrix.
    pub A: SMatrix<T, NX, NX>,
    /// Input matrix.
    pub B: SMatrix<T, NX, NU>,
    /// Affine term: forces at zero slip and disturbances.
    pub d: State<T>,
}

/// Right-hand side of the prediction model, [`Point::motion`].
#[inline]
pub fn derivative<T: Scalar>(
    x: &State<T>,
    u: &Input<T>,
    kappa: T,
    body: &Body,
    tyres: &Tyres<T>,
    disturbance: &Disturbance<T>,
) -> State<T> {
    Point::new(*x, *u, body).motion(kappa, tyres, disturbance).0
}

/// Rate of the fastest lateral mode for small slip, a bound by the traces of the velocity and the yaw equation [1/s].
pub fn fastest_rate<T: Scalar>(v_x: f64, body: &Body, tyres: &Tyres<T>) -> f64 {
    let Body { m, i_z, l_f, l_r, .. } = *body;
    let (c_f, c_r) = (tyres.c_f.re().abs(), tyres.c_r.re().abs());
    ((c_f + c_r) / m).max((c_f * l_f * l_f + c_r * l_r * l_r) / i_z) / v_x.max(V_GUARD)
}

/// Lateral velocity [m/s] in steady cornering at speed `v_x` [m/s] on curvature `kappa` [1/m], [Rajamani, section 3.3].
pub fn steady_lateral_velocity<T: Scalar>(v_x: T, kappa: T, body: &Body, tyres: &Tyres) -> T {
    let Body { m, l_f, l_r, .. } = *body;
    kappa * v_x * (-v_x * v_x * (m * l_f / (tyres.c_r * (l_f + l_r))) + l_r)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    fn body() -> Body {
        crate::Parameters::default().body()
    }

    #[test]
    fn embedding_equals_the_nonlinear_right_hand_side() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let body = body();
        let mut worst: f64 = 0.0;
        for _ in 0..100_000 {
            let mut draw = |low: f64, high: f64| rng.random_range(low..high);
            let x = State::from([draw(0.0, 40.0), draw(-5.0, 5.0), draw(-2.0, 2.0), draw(-3.0, 3.0), draw(-1.5, 1.5)]);
            let u = Input::from([draw(-0.6, 0.6), draw(-9.0, 5.0)]);
            let kappa = draw(-0.1, 0.1);
            let tyres =
                Tyres { c_f: draw(1e3, 2e5), c_r: draw(1e3, 2e5), f_f0: draw(-5e3, 5e3), f_r0: draw(-5e3, 5e3) };
            let disturbance = Disturbance::from([draw(-2.0, 2.0), draw(-2.0, 2.0), draw(-1.0, 1.0)]);
            let Lpv { A, B, d } = Point::new(x, u, &body).embed(kappa, &tyres, &disturbance);
            let exact = derivative(&x, &u, kappa, &body, &tyres, &disturbance);
            let residual = A * x + B * u + d - exact;
            for row in 0..NX {
                // Relative to the largest product in the row: the sum itself may cancel to nothing.
                let scale = (0..NX)
                    .map(|j| (A[(row, j)] * x[j]).abs())
                    .chain((0..NU).map(|j| (B[(row, j)] * u[j]).abs()))
                    .fold(1.0, f64::max);
                worst = worst.max(residual[row].abs() / scale);
            }
        }
        assert!(worst < 1e-12, "worst residual {worst:e}");
    }

    #[test]
    fn lateral_error_row_makes_the_pair_controllable_and_the_printed_one_does_not() {
        // Straight driving on the path, where every lane change begins.
        let x = State::from([15.0, 0.0, 0.0, 0.0, 0.0]);
        let u = Input::zeros();
        let tyres = Tyres::secant(1.0e5, 7.6e4);
        let Lpv { A, B, .. } = Point::new(x, u, &body()).embed(0.0, &tyres, &Disturbance::zeros());
        let rank = |A: &SMatrix<f64, NX, NX>| {
            let mut blocks = SMatrix::<f64, NX, { NX * NU }>::zeros();
            let mut power = B;
            for k in 0..NX {
                // Scaled by the size of each block: powers of A span many decades.
                blocks.fixed_columns_mut::<NU>(k * NU).copy_from(&(power / power.norm()));
                power = A * power;
            }
            blocks.svd(false, false).singular_values.iter().filter(|s| **s > 1e-9).count()
        };
        assert_eq!(rank(&A), 5);
        let mut printed = A;
        printed[(E_Y, V_X)] = x[E_PSI].sin();
        printed[(E_Y, E_PSI)] = 0.0;
        assert_eq!(rank(&printed), 4);
    }

    #[test]
    fn forces_are_those_of_the_slip_angles() {
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        let (body, mut steep, mut slow) = (body(), 0, 0);
        let Body { m, i_z, l_f, l_r, .. } = body;
        for _ in 0..10_000 {
            let mut draw = |low: f64, high: f64| rng.random_range(low..high);
            let (v_x, v_y, yaw_rate, delta) = (draw(0.0, 20.0), draw(-3.0, 3.0), draw(-1.0, 1.0), draw(-0.6, 0.6));
            let tyres = Tyres::secant(draw(1e4, 1e5), draw(1e4, 1e5));
            // The library's arctangent, and the signs of the errata.
            let v = v_x.max(V_GUARD);
            let alpha_f = delta * v_x / v - ((v_y + l_f * yaw_rate) / v).atan();
            let alpha_r = -((v_y - l_r * yaw_rate) / v).atan();
            let (f_f, f_r) = (tyres.c_f * alpha_f * delta.cos(), tyres.c_r * alpha_r);
            let x = State::from([v_x, v_y, yaw_rate, 0.0, 0.0]);
            let rates = derivative(&x, &Input::from([delta, 0.0]), 0.0, &body, &tyres, &Disturbance::zeros());
            // A few roundings of forces of up to 1e5 N.
            assert!((rates[V_Y] - ((f_f + f_r) / m - yaw_rate * v_x)).abs() < 1e-12, "{x} {delta}");
            assert!((rates[YAW_RATE] - (l_f * f_f - l_r * f_r) / i_z).abs() < 1e-12, "{x} {delta}");
            let (of_function_f, of_function_r) = slip_angles(&x, delta, &body);
            assert!((of_function_f - alpha_f).abs().max((of_function_r - alpha_r).abs()) < 1e-15, "{x} {delta}");
            steep += usize::from(((v_y + l_f * yaw_rate) / v).abs() > 0.15);
            slow += usize::from(v_x < V_GUARD);
        }
        assert!(steep > 1000 && slow > 1000, "{steep} {slow}");
    }

    #[test]
    fn steady_cornering_is_an_equilibrium_for_small_angles() {
        let body = body();
        let tyres = Tyres::secant(1.0e5, 7.6e4);
        let (v_x, kappa) = (15.0, 1e-5);
        let Body { m, l_f, l_r, .. } = body;
        let v_y = steady_lateral_velocity(v_x, kappa, &body, &tyres);
        // Understeer gradient form of the steering angle, [Rajamani, eq. (3.13)].
        let gradient = m * (l_r / tyres.c_f - l_f / tyres.c_r) / (l_f + l_r);
        let delta = kappa * (l_f + l_r + gradient * v_x * v_x);
        let x = State::from([v_x, v_y, kappa * v_x, 0.0, -v_y / v_x]);
        let rate = derivative(&x, &Input::from([delta, 0.0]), kappa, &body, &tyres, &Disturbance::zeros());
        // Second-order terms in angles of 1e-4 rad.
        for row in [V_Y, YAW_RATE, E_Y, E_PSI] {
            assert!(rate[row].abs() < 1e-9, "row {row}: {:e}", rate[row]);
        }
    }

    #[test]
    fn steering_at_rest_moves_nothing() {
        let rate = derivative(
            &State::zeros(),
            &Input::from([0.4, 0.0]),
            0.01,
            &body(),
            &Tyres::secant(1.0e5, 7.6e4),
            &Disturbance::zeros(),
        );
        assert_eq!(rate, State::zeros());
    }
}

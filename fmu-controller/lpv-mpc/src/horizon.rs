//! One stage of the prediction model: frozen in the middle of the schedule, discretised, with the reference it leads to.

use nalgebra::{SMatrix, SVector};

use crate::Scalar;
use crate::discretise::discretise_into;
use crate::guide::Path;
use crate::hold::Hold;
use crate::latency::Predicted;
use crate::model::{
    A_X, Body, DELTA, E_PSI, Input, NU, NX, Point, State, Tyres, V_GUARD, V_X, V_Y, YAW_RATE, steady_lateral_velocity,
};
use crate::qp::Stage;

/// Number of states with the actuators' lags.
pub const NX_LAGS: usize = NX + NU;

/// What is the same for every stage of a plan.
pub struct Surroundings<'a> {
    /// Tyres at small slip, for the reference.
    pub nominal: Tyres,
    /// Period and lags.
    pub hold: &'a Hold,
}

/// One stage of the quadratic programme to be filled, `x+ = A x + B u + d` with the reference of `x+`.
pub struct Linear<'a, T, const N_X: usize> {
    /// System matrix.
    pub A: &'a mut SMatrix<T, N_X, N_X>,
    /// Input matrix.
    pub B: &'a mut SMatrix<T, N_X, NU>,
    /// Affine term.
    pub d: &'a mut SVector<T, N_X>,
    /// Reference.
    pub x_ref: &'a mut SVector<T, N_X>,
}

impl<'a, const N_X: usize> From<&'a mut Stage<N_X, NU>> for Linear<'a, f64, N_X> {
    #[inline(always)]
    fn from(Stage { A, B, d, x_ref, .. }: &'a mut Stage<N_X, NU>) -> Self {
        Self { A, B, d, x_ref }
    }
}

/// Where a stage is linearised: in the middle between its nodes, at the angle and acceleration that the actuators deliver.
///
/// The frozen system then is a second-order approximation of the varying one.
#[inline(always)]
pub fn middle<'a, T: Scalar, const N_X: usize>(
    before: &SVector<T, N_X>,
    after: &SVector<T, N_X>,
    u: &Input<T>,
    body: &'a Body,
) -> Point<'a, T> {
    let middle = (before + after) * T::from(0.5);
    let acting = if N_X == NX { *u } else { Input::from([middle[NX + DELTA], middle[NX + A_X]]) };
    Point::new(vehicle_part(&middle), acting, body)
}

/// Fills the stage at a scheduling point.
#[inline(always)]
pub fn linearise<T: Scalar, const N_X: usize>(
    at: &Point<'_, T>,
    path: &Path<T>,
    tyres: &Tyres<T>,
    around: &Surroundings<'_>,
    Linear { A, B, d, x_ref }: Linear<'_, T, N_X>,
) {
    let Surroundings { nominal, hold } = around;
    let kappa = (path.kappa[0] + path.kappa[1]) * 0.5;
    discretise_into(&at.embed(kappa, tyres, &path.disturbance), hold, A, B, d);
    *x_ref = steady_state(path.v_x, path.kappa[1], at.body, nominal);
}

/// Reference of the states: steady cornering at the wanted speed without lateral error.
///
/// [Kebbati] tracks the speed alone and pulls the other states to zero. In a turn the yaw rate, the lateral velocity and the
/// sideslip that it takes are not zero; with weights larger than the paper's that pull would drag the car off the path.
pub fn steady_state<T: Scalar, const N_X: usize>(v_x: T, kappa: T, body: &Body, tyres: &Tyres) -> SVector<T, N_X> {
    let v_y = steady_lateral_velocity(v_x, kappa, body, tyres);
    let mut x = SVector::zeros();
    x[V_X] = v_x;
    x[V_Y] = v_y;
    x[YAW_RATE] = kappa * v_x;
    x[E_PSI] = -v_y / v_x.larger(V_GUARD);
    x
}

/// State of the quadratic programme from the vehicle's and the actuators'.
pub fn full_state<T: Scalar, const N_X: usize>(at: &Predicted<T>) -> SVector<T, N_X> {
    SVector::from_fn(|i, _| if i < NX { at.x[i] } else { T::from(at.actual[i - NX]) })
}

/// The vehicle's part of a planned state.
pub fn vehicle_part<T: Scalar, const N_X: usize>(x: &SVector<T, N_X>) -> State<T> {
    x.fixed_rows::<NX>(0).into_owned()
}

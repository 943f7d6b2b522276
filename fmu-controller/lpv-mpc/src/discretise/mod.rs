//! From the continuous LPV system to one sample: zero-order hold, with first-order lags of the actuators held exactly.
//!
//! The paper steps with `x + A x + B u dt` (a misprint of Euler's rule, which is itself unstable below about 2.4 m/s). Here
//! the matrix exponential is a fourth-order Taylor series, evaluated on the three columns that are not known beforehand; a
//! dense evaluation costs more than the quadratic programme it feeds. The powers of the matrix serve the commands and the
//! lags alike.

use nalgebra::{SMatrix, SVector};

use crate::Scalar;
use crate::hold::{Hold, ORDER};
use crate::model::{A_X, DELTA, E_PSI, E_Y, Lpv, NU, NX, State, V_X, V_Y, YAW_RATE};
use columns::Columns;

mod columns;

/// Largest `step * rate` for one evaluation of the series [1]: its error there is 1.5^5 / 5! = 6 % of a mode that has
/// decayed to 22 %; it would be unstable from 2.78 on.
const STIFFNESS_MAX: f64 = 1.5;

/// Most halvings of a stiff sample. They keep the series stable for 1.5e9 time constants in a sample; each costs a binary digit
/// of the slow modes, of which twenty-two are left then.
const HALVINGS_MAX: i32 = 30;

/// One sample: `x+ = Phi x + Gamma u + d`. With `N_X` of 7 the last states are what the actuators deliver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discrete<T = f64, const N_X: usize = NX> {
    /// State transition.
    pub Phi: SMatrix<T, N_X, N_X>,
    /// Response to commands held over the sample.
    pub Gamma: SMatrix<T, N_X, NU>,
    /// Response to the affine term.
    pub d: SVector<T, N_X>,
}

impl<T: Scalar, const N_X: usize> Discrete<T, N_X> {
    /// To be filled.
    pub fn zeros() -> Self {
        Self { Phi: SMatrix::zeros(), Gamma: SMatrix::zeros(), d: SVector::zeros() }
    }
}

/// Discretises the system over a hold, the actuators being ideal.
#[inline(always)]
pub fn discretise<T: Scalar>(lpv: &Lpv<T>, hold: &Hold) -> Discrete<T> {
    let mut sample = Discrete::zeros();
    let Discrete { Phi, Gamma, d } = &mut sample;
    discretise_into(lpv, hold, Phi, Gamma, d);
    sample
}

/// Discretises the system over a hold, behind the lags if there is room for what the actuators deliver.
#[inline(always)]
pub fn discretise_into<T: Scalar, const N_X: usize>(
    lpv: &Lpv<T>,
    hold: &Hold,
    Phi: &mut SMatrix<T, N_X, N_X>,
    Gamma: &mut SMatrix<T, N_X, NU>,
    d: &mut SVector<T, N_X>,
) {
    let stiffness = stiffness(lpv, hold);
    if stiffness > STIFFNESS_MAX {
        #[expect(clippy::cast_possible_truncation, reason = "clamped to a small count before the cast")]
        let halvings = (stiffness / STIFFNESS_MAX).log2().ceil().min(f64::from(HALVINGS_MAX)) as i32;
        let whole = compose(lpv, hold, halvings);
        (*Phi, *Gamma, *d) = (whole.Phi, whole.Gamma, whole.d);
    } else {
        one_piece(lpv, hold, Phi, Gamma, d);
    }
}

/// Where the hold takes a state under an input, the actuators being ideal: what [`discretise`] says, without its matrices.
#[inline(always)]
pub fn reached<T: Scalar>(lpv: &Lpv<T>, x: &State<T>, u: &SVector<T, NU>, hold: &Hold) -> State<T> {
    if stiffness(lpv, hold) > STIFFNESS_MAX {
        let Discrete { Phi, Gamma, d } = discretise(lpv, hold);
        return Phi * x + Gamma * u + d;
    }
    let (a, b) = (|row, column| lpv.A[(row, column)], |row| lpv.B[(row, DELTA)]);
    // With the zeros of the embedding left out.
    let times = |[v_x, v_y, yaw_rate, _, e_psi]: [T; NX]| {
        State::from([
            a(V_X, V_X) * v_x + a(V_X, V_Y) * v_y + a(V_X, YAW_RATE) * yaw_rate,
            a(V_Y, V_Y) * v_y + a(V_Y, YAW_RATE) * yaw_rate,
            a(YAW_RATE, V_Y) * v_y + a(YAW_RATE, YAW_RATE) * yaw_rate,
            a(E_Y, V_Y) * v_y + a(E_Y, E_PSI) * e_psi,
            a(E_PSI, V_X) * v_x + a(E_PSI, V_Y) * v_y + yaw_rate,
        ])
    };
    let mut term = times((*x).into()) + lpv.d;
    term[V_X] += b(V_X) * u[DELTA] + u[A_X];
    term[V_Y] += b(V_Y) * u[DELTA];
    term[YAW_RATE] += b(YAW_RATE) * u[DELTA];
    let mut moved = term * T::from(hold.held[0]);
    for weight in &hold.held[1..] {
        term = times(term.into());
        moved += term * T::from(*weight);
    }
    x + moved
}

/// The fastest lateral mode over the hold [1].
fn stiffness<T: Scalar>(lpv: &Lpv<T>, hold: &Hold) -> f64 {
    hold.step * lpv.A[(V_Y, V_Y)].re().abs().max(lpv.A[(YAW_RATE, YAW_RATE)].re().abs())
}

/// The series over the whole hold.
#[inline(always)]
fn one_piece<T: Scalar, const N_X: usize>(
    lpv: &Lpv<T>,
    hold: &Hold,
    Phi: &mut SMatrix<T, N_X, N_X>,
    Gamma: &mut SMatrix<T, N_X, NU>,
    d: &mut SVector<T, N_X>,
) {
    let Lpv { A, B, d: affine } = lpv;
    let first = Columns::of(A);
    let second = first.multiplied(A);
    let third = second.multiplied(A);
    let powers = [first, second, third];
    // Columns of the integral of the exponential: everything the inputs and the affine term excite lies in their span.
    let Psi = Columns::series(&powers, &hold.held);

    Phi.fill(T::zero());
    let moved = Psi.multiplied(A).plus_identity();
    for i in 0..NX {
        Phi[(i, V_X)] = moved.v_x[i];
        Phi[(i, V_Y)] = moved.lateral[i][0];
        Phi[(i, YAW_RATE)] = moved.lateral[i][1];
    }
    // The columns of e_y and e_psi are exact after one term.
    Phi[(E_Y, E_Y)] = T::one();
    Phi[(E_Y, E_PSI)] = A[(E_Y, E_PSI)] * hold.step;
    Phi[(E_PSI, E_PSI)] = T::one();

    let b = [B[(V_X, DELTA)], B[(V_Y, DELTA)], B[(YAW_RATE, DELTA)]];
    *d = extended(&Psi.combine([affine[V_X], affine[V_Y], affine[YAW_RATE]]));
    if N_X == NX {
        Gamma.set_column(DELTA, &extended(&Psi.combine(b)));
        Gamma.set_column(A_X, &extended(&Psi.v_x));
        return;
    }
    let steering = [extended(&b.into()), powers[0].combine(b), powers[1].combine(b), powers[2].combine(b)];
    let drive = [State::ith(V_X, T::one()), powers[0].v_x, powers[1].v_x, powers[2].v_x];
    for (j, excited) in [(DELTA, steering), (A_X, drive)] {
        let respond = |weights: &[f64; ORDER]| {
            let [a, b, c, d] = &excited;
            let w = weights.map(T::from);
            a * w[0] + b * w[1] + c * w[2] + d * w[3]
        };
        Phi.set_column(NX + j, &extended(&respond(&hold.distant[j])));
        Gamma.set_column(j, &extended(&respond(&hold.reached[j])));
        Phi[(NX + j, NX + j)] = T::from(hold.decay[j]);
        Gamma[(NX + j, j)] = T::from(1.0 - hold.decay[j]);
    }
}

/// A vector with zeros behind its end.
#[inline(always)]
fn extended<T: Scalar, const N: usize, const N_X: usize>(x: &SVector<T, N>) -> SVector<T, N_X> {
    SVector::from_fn(|i, _| if i < N { x[i] } else { T::zero() })
}

/// The hold halved until the series resolves it, and doubled again, for modes too fast for the series.
#[cold]
fn compose<T: Scalar, const N_X: usize>(lpv: &Lpv<T>, hold: &Hold, halvings: i32) -> Discrete<T, N_X> {
    let mut sample = Discrete::zeros();
    let Discrete { Phi, Gamma, d } = &mut sample;
    one_piece(lpv, &Hold::new(hold.step * 0.5_f64.powi(halvings), hold.tau), Phi, Gamma, d);
    for _ in 0..halvings {
        let Discrete { Phi, Gamma, d } = sample;
        sample = Discrete { Phi: Phi * Phi, Gamma: Phi * Gamma + Gamma, d: Phi * d + d };
    }
    sample
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hold::decay;
    use crate::model::{Body, Disturbance, Input, Point, Tyres};

    fn system(v_x: f64) -> Lpv {
        let body: Body = crate::Parameters::default().body();
        let x = State::from([v_x, 0.3, 0.2, 0.4, 0.1]);
        let tyres = Tyres { c_f: 1.0e5, c_r: 7.6e4, f_f0: 300.0, f_r0: -200.0 };
        Point::new(x, Input::from([0.05, 1.0]), &body).embed(0.02, &tyres, &Disturbance::from([0.1, -0.2, 0.3]))
    }

    /// Independent route: classic Runge-Kutta steps on the continuous equations with lags, 2000 per sample.
    fn integrate(lpv: &Lpv, x: State, a: Input, u: Input, step: f64, tau: [f64; NU]) -> State {
        let pieces = 2000;
        let h = step / f64::from(pieces);
        let actual = |t: f64| Input::from_fn(|j, _| u[j] + (a[j] - u[j]) * decay(t, tau[j]));
        let f = |t: f64, x: State| lpv.A * x + lpv.B * actual(t) + lpv.d;
        let mut x = x;
        for k in 0..pieces {
            let t = f64::from(k) * h;
            let k1 = f(t, x);
            let k2 = f(t + h / 2.0, x + k1 * (h / 2.0));
            let k3 = f(t + h / 2.0, x + k2 * (h / 2.0));
            let k4 = f(t + h, x + k3 * h);
            x += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
        }
        x
    }

    fn with_actuators(lpv: &Lpv, hold: &Hold) -> Discrete<f64, 7> {
        let mut sample = Discrete::zeros();
        let Discrete { Phi, Gamma, d } = &mut sample;
        discretise_into(lpv, hold, Phi, Gamma, d);
        sample
    }

    fn error_of_one_sample(v_x: f64, step: f64, tau: [f64; NU]) -> f64 {
        let lpv = system(v_x);
        let (x, a, u) = (State::from([v_x, 0.3, 0.2, 0.4, 0.1]), Input::from([0.02, -0.5]), Input::from([0.05, 1.0]));
        let Discrete { Phi, Gamma, d } = with_actuators(&lpv, &Hold::new(step, tau));
        let from = SVector::<f64, 7>::from([x[0], x[1], x[2], x[3], x[4], a[0], a[1]]);
        let sampled = Phi * from + Gamma * u + d;
        for j in 0..NU {
            let delivered = u[j] + (a[j] - u[j]) * decay(step, tau[j]);
            assert!((sampled[NX + j] - delivered).abs() < 1e-14, "actuator {j}: {}", sampled[NX + j]);
        }
        (sampled.fixed_rows::<NX>(0) - integrate(&lpv, x, a, u, step, tau)).norm()
    }

    #[test]
    fn a_sample_is_the_solution_of_the_continuous_system() {
        // The series leaves (h rate)^5 / 5! of the lateral state: rate is 12 1/s at 10 m/s, h = 33 ms, so 8e-5 of 0.4.
        for tau in [[0.0, 0.0], [0.1, 0.0], [0.0, 0.3], [0.1, 0.3], [0.01, 0.02]] {
            let error = error_of_one_sample(10.0, 0.033, tau);
            assert!(error < 1e-4, "tau {tau:?}: {error:e}");
        }
    }

    #[test]
    fn the_state_reached_is_that_of_the_matrices() {
        for (v_x, step) in [(0.0, 0.033), (1.0, 0.2), (10.0, 0.033), (30.0, 0.001)] {
            let (lpv, hold) = (system(v_x), Hold::new(step, [0.0; NU]));
            let (x, u) = (State::from([v_x, 0.3, 0.2, 0.4, 0.1]), Input::from([0.05, 1.0]));
            let Discrete { Phi, Gamma, d } = discretise(&lpv, &hold);
            let error = (reached(&lpv, &x, &u, &hold) - (Phi * x + Gamma * u + d)).norm();
            // The same series in another order: rounding of states of up to 30.
            assert!(error < 1e-13, "{v_x} m/s, {step} s: {error:e}");
        }
    }

    #[test]
    fn error_falls_with_the_fifth_power_of_the_step() {
        let tau = [0.1, 0.3];
        let ratio = error_of_one_sample(10.0, 0.04, tau) / error_of_one_sample(10.0, 0.02, tau);
        // 2^5 = 32, up to the next order.
        assert!((20.0..50.0).contains(&ratio), "ratio {ratio}");
    }

    #[test]
    fn crawling_with_a_long_period_stays_stable_and_accurate() {
        for v_x in [0.0, 1.0, 3.0] {
            let Discrete { Phi, .. } = discretise(&system(v_x), &Hold::new(0.2, [0.0, 0.0]));
            let block = Phi.fixed_view::<2, 2>(V_Y, V_Y);
            assert!(block.norm() < 0.1, "v_x {v_x}: {block}");
            // 0.2 s is eight time constants of the slowest lateral mode; each piece leaves at most 6 % of what is left.
            assert!(error_of_one_sample(v_x, 0.2, [0.1, 0.1]) < 2e-2, "v_x {v_x}");
        }
    }

    #[test]
    fn after_very_many_time_constants_the_lateral_motion_is_steady() {
        // At 3 m/s the fastest mode has 40 1/s; the longest communication step is 10 s.
        let (lpv, u) = (system(3.0), Input::from([0.05, 1.0]));
        for step in [5.0, 10.0, 1e6] {
            let Discrete { Phi, Gamma, d } = discretise(&lpv, &Hold::new(step, [0.0; NU]));
            let block = Phi.fixed_view::<2, 2>(V_Y, V_Y);
            // The slower lateral mode has 16 1/s: e^-80 is left after 5 s.
            assert!(block.norm() < 1e-20, "{step} s: {block}");
            let [a, b, c, e] = [(V_Y, V_Y), (V_Y, YAW_RATE), (YAW_RATE, V_Y), (YAW_RATE, YAW_RATE)].map(|i| lpv.A[i]);
            let [f, g] = [V_Y, YAW_RATE].map(|row| -(lpv.B[(row, DELTA)] * u[DELTA] + lpv.d[row]));
            // Cramer's rule on the equations of the equilibrium.
            let steady = [(f * e - b * g) / (a * e - b * c), (a * g - f * c) / (a * e - b * c)];
            let reached = Gamma * u + d;
            for (row, steady) in [(V_Y, steady[0]), (YAW_RATE, steady[1])] {
                assert!((reached[row] - steady).abs() < 1e-10 * steady.abs(), "{step} s: {} {steady}", reached[row]);
            }
        }
    }

    #[test]
    fn a_very_fast_lag_is_no_lag() {
        let lpv = system(15.0);
        let ideal = discretise(&lpv, &Hold::new(0.033, [0.0, 0.0])).Gamma;
        let delivered = |sample: &Discrete<f64, 7>| sample.Phi.fixed_view::<NX, NU>(0, NX).into_owned();
        let lag = with_actuators(&lpv, &Hold::new(0.033, [1e-9, 1e-9]));
        assert!(delivered(&lag).norm() < 1e-6, "{}", lag.Phi);
        assert!((lag.Gamma.fixed_rows::<NX>(0) - ideal).norm() < 1e-6, "{}", lag.Gamma);
        // A lag that never moves: the actuator's value acts instead of the command.
        let frozen = with_actuators(&lpv, &Hold::new(0.033, [1e9, 1e9]));
        assert!((delivered(&frozen) - ideal).norm() < 1e-9, "{}", frozen.Phi);
        assert!(frozen.Gamma.norm() < 1e-9, "{}", frozen.Gamma);
    }
}

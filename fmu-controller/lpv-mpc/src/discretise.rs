//! From the continuous LPV system to one sample: zero-order hold, with first-order lags of the actuators held exactly.
//!
//! The paper steps with `x + A x + B u dt` (a misprint of Euler's rule, which is itself unstable below about 2.4 m/s). Here
//! the matrix exponential is a fourth-order Taylor series, evaluated on the three columns that are not known beforehand; a
//! dense evaluation costs more than the quadratic programme it feeds. The powers of the matrix serve the commands and the
//! lags alike.

use nalgebra::{SMatrix, SVector};

use crate::Scalar;
use crate::model::{A_X, DELTA, E_PSI, E_Y, Lpv, NU, NX, State, V_X, V_Y, YAW_RATE};

/// Largest `step * rate` for one evaluation of the series [1]: its error there is 1.5^5 / 5! = 6 % of a mode that has
/// decayed to 22 %; it would be unstable from 2.78 on.
const STIFFNESS_MAX: f64 = 1.5;

/// Most pieces into which a stiff sample is cut.
const PIECES_MAX: u32 = 64;

/// Terms of the series.
const ORDER: usize = 4;

/// What depends on the step and the lags alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// Step [s].
    pub step: f64,
    /// Time constants of the actuators [s].
    tau: [f64; NU],
    /// What is left of a lag's distance to its command after the step [1].
    pub decay: [f64; NU],
    /// Moments of the decaying distance.
    moments: [[f64; ORDER]; NU],
}

impl Hold {
    /// A hold over `step` [s] behind lags with time constants `tau` [s]; 0 is no lag.
    pub fn new(step: f64, tau: [f64; NU]) -> Self {
        Self { step, tau, decay: tau.map(|tau| decay(step, tau)), moments: tau.map(|tau| moments(step, tau)) }
    }
}

/// `exp(-step / tau)`, 0 without a lag.
pub(crate) fn decay(step: f64, tau: f64) -> f64 {
    if tau > 0.0 { (-step / tau).exp() } else { 0.0 }
}

/// The moments `m_k = integral of (h - s)^k / k! exp(-s / tau)`.
fn moments(step: f64, tau: f64) -> [f64; ORDER] {
    if tau <= 0.0 {
        return [0.0; ORDER];
    }
    let z = step / tau;
    // m_k = h^(k+1) sum_j (-z)^j / (k + 1 + j)!: the forward recursion loses all digits for slow lags, the series does so for
    // fast ones, and both hold around z = 1.
    let mut moments = [0.0_f64; ORDER];
    if z < 1.0 {
        for (k, moment) in moments.iter_mut().enumerate() {
            let mut term = (1..=k + 1).fold(1.0, |product, i| product * step / i as f64);
            let mut j = k + 1;
            while term.abs() > 1e-18 * moment.abs() {
                *moment += term;
                j += 1;
                term *= -z / j as f64;
            }
        }
    } else {
        moments[0] = tau * (1.0 - (-z).exp());
        let mut power = 1.0;
        for k in 1..ORDER {
            power *= step / k as f64;
            moments[k] = tau * (power - moments[k - 1]);
        }
    }
    moments
}

/// One sample: `x+ = Phi x + Gamma u + Lag (a - u) + d`, where `a` is what the actuators deliver at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discrete<T = f64> {
    /// State transition.
    pub Phi: SMatrix<T, NX, NX>,
    /// Response to commands held over the sample, as if there were no lags.
    pub Gamma: SMatrix<T, NX, NU>,
    /// Response to the decaying distance between actuator and command.
    pub Lag: SMatrix<T, NX, NU>,
    /// Response to the affine term.
    pub d: State<T>,
}

/// Two columns of a matrix side by side, those of `v_y` and `yaw_rate`: a row for each state.
type Lateral<T> = [SVector<T, 2>; NX];

/// The columns of a polynomial of `A` that inputs and affine term excite.
///
/// Below the coupling through the speed, `A` is block triangular: a lateral motion never leaves the columns of `v_y` and
/// `yaw_rate`, which are the same sums on two numbers, and the column of `v_x` reaches the errors on the path alone.
struct Columns<T> {
    v_x: State<T>,
    lateral: Lateral<T>,
}

impl<T: Scalar> Columns<T> {
    /// The columns of `A` itself.
    #[inline(always)]
    fn of(A: &SMatrix<T, NX, NX>) -> Self {
        Self {
            v_x: A.column(V_X).into_owned(),
            lateral: std::array::from_fn(|row| SVector::from([A[(row, V_Y)], A[(row, YAW_RATE)]])),
        }
    }

    /// `A` times the columns, with the zeros of the embedding left out.
    #[inline(always)]
    fn multiplied(&self, A: &SMatrix<T, NX, NX>) -> Self {
        let a = |row: usize, column: usize| A[(row, column)];
        let v = &self.v_x;
        let [v_x, v_y, yaw_rate, _, e_psi] = &self.lateral;
        Self {
            v_x: State::from([
                a(V_X, V_X) * v[V_X],
                T::zero(),
                T::zero(),
                a(E_Y, E_PSI) * v[E_PSI],
                a(E_PSI, V_X) * v[V_X],
            ]),
            lateral: [
                v_x * a(V_X, V_X) + v_y * a(V_X, V_Y) + yaw_rate * a(V_X, YAW_RATE),
                v_y * a(V_Y, V_Y) + yaw_rate * a(V_Y, YAW_RATE),
                v_y * a(YAW_RATE, V_Y) + yaw_rate * a(YAW_RATE, YAW_RATE),
                v_y * a(E_Y, V_Y) + e_psi * a(E_Y, E_PSI),
                v_x * a(E_PSI, V_X) + v_y * a(E_PSI, V_Y) + yaw_rate,
            ],
        }
    }

    /// The columns plus those of the identity.
    #[inline(always)]
    fn plus_identity(mut self) -> Self {
        self.v_x[V_X] += T::one();
        self.lateral[V_Y][0] += T::one();
        self.lateral[YAW_RATE][1] += T::one();
        self
    }

    /// `w_0 I + w_1 A + w_2 A^2 + w_3 A^3` from the powers of `A`.
    #[inline(always)]
    fn series(powers: &[Self; ORDER - 1], weights: &[f64; ORDER]) -> Self {
        let w = weights.map(T::from);
        let [a, b, c] = powers;
        let mut sum = Self {
            v_x: a.v_x * w[1] + b.v_x * w[2] + c.v_x * w[3],
            lateral: std::array::from_fn(|i| a.lateral[i] * w[1] + b.lateral[i] * w[2] + c.lateral[i] * w[3]),
        };
        sum.v_x[V_X] += w[0];
        sum.lateral[V_Y][0] += w[0];
        sum.lateral[YAW_RATE][1] += w[0];
        sum
    }

    /// The columns times a vector that is zero in the errors on the path.
    #[inline(always)]
    fn combine(&self, b: [T; 3]) -> State<T> {
        let lateral = SVector::from([b[V_Y], b[YAW_RATE]]);
        State::from_fn(|i, _| self.v_x[i] * b[V_X] + self.lateral[i].dot(&lateral))
    }
}

/// Discretises the system over a hold.
#[inline(always)]
pub fn discretise<T: Scalar>(lpv: &Lpv<T>, hold: &Hold) -> Discrete<T> {
    let rate = lpv.A[(V_Y, V_Y)].re().abs().max(lpv.A[(YAW_RATE, YAW_RATE)].re().abs());
    let stiffness = hold.step * rate;
    if stiffness <= STIFFNESS_MAX {
        return one_piece(lpv, hold);
    }
    #[expect(clippy::cast_possible_truncation, reason = "clamped to a small count before the cast")]
    let pieces = (stiffness / STIFFNESS_MAX).ceil().min(f64::from(PIECES_MAX)) as u32;
    compose(lpv, hold, pieces)
}

/// The series over the whole hold.
#[inline(always)]
fn one_piece<T: Scalar>(lpv: &Lpv<T>, hold: &Hold) -> Discrete<T> {
    let Lpv { A, B, d } = lpv;
    let h = hold.step;
    let first = Columns::of(A);
    let second = first.multiplied(A);
    let third = second.multiplied(A);
    let powers = [first, second, third];
    // Columns of the integral of the exponential: everything the inputs and the affine term excite lies in their span.
    let Psi = Columns::series(&powers, &[h, h * h / 2.0, h * h * h / 6.0, h * h * h * h / 24.0]);

    let moved = Psi.multiplied(A).plus_identity();
    let mut Phi = SMatrix::<T, NX, NX>::identity();
    for i in 0..NX {
        Phi[(i, V_X)] = moved.v_x[i];
        Phi[(i, V_Y)] = moved.lateral[i][0];
        Phi[(i, YAW_RATE)] = moved.lateral[i][1];
    }
    // The columns of e_y and e_psi are exact after one term.
    Phi[(E_Y, E_PSI)] = A[(E_Y, E_PSI)] * h;

    let b_delta = [B[(V_X, DELTA)], B[(V_Y, DELTA)], B[(YAW_RATE, DELTA)]];
    let mut Lag = SMatrix::<T, NX, NU>::zeros();
    if hold.tau[DELTA] > 0.0 {
        Lag.set_column(DELTA, &Columns::series(&powers, &hold.moments[DELTA]).combine(b_delta));
    }
    if hold.tau[A_X] > 0.0 {
        Lag.set_column(A_X, &Columns::series(&powers, &hold.moments[A_X]).v_x);
    }
    Discrete {
        Phi,
        Gamma: SMatrix::from_columns(&[Psi.combine(b_delta), Psi.v_x]),
        Lag,
        d: Psi.combine([d[V_X], d[V_Y], d[YAW_RATE]]),
    }
}

/// The hold cut into equal pieces and put together again, for modes too fast for the series.
#[cold]
fn compose<T: Scalar>(lpv: &Lpv<T>, hold: &Hold, pieces: u32) -> Discrete<T> {
    let short = Hold::new(hold.step / f64::from(pieces), hold.tau);
    let piece = one_piece(lpv, &short);
    let decay = SMatrix::<T, NU, NU>::from_diagonal(&SVector::from(short.decay.map(T::from)));
    let mut left = SMatrix::<T, NU, NU>::identity();
    let mut whole =
        Discrete { Phi: SMatrix::identity(), Gamma: SMatrix::zeros(), Lag: SMatrix::zeros(), d: State::zeros() };
    for _ in 0..pieces {
        whole = Discrete {
            Phi: piece.Phi * whole.Phi,
            Gamma: piece.Phi * whole.Gamma + piece.Gamma,
            Lag: piece.Phi * whole.Lag + piece.Lag * left,
            d: piece.Phi * whole.d + piece.d,
        };
        left *= decay;
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Body, Disturbance, Input, Tyres, embed};

    fn system(v_x: f64) -> Lpv {
        let body: Body = crate::Parameters::default().body();
        let x = State::from([v_x, 0.3, 0.2, 0.4, 0.1]);
        let tyres = Tyres { c_f: 1.0e5, c_r: 7.6e4, f_f0: 300.0, f_r0: -200.0 };
        embed(&x, &Input::from([0.05, 1.0]), 0.02, &body, &tyres, &Disturbance::from([0.1, -0.2, 0.3]))
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

    fn error_of_one_sample(v_x: f64, step: f64, tau: [f64; NU]) -> f64 {
        let lpv = system(v_x);
        let (x, a, u) = (State::from([v_x, 0.3, 0.2, 0.4, 0.1]), Input::from([0.02, -0.5]), Input::from([0.05, 1.0]));
        let Discrete { Phi, Gamma, Lag, d } = discretise(&lpv, &Hold::new(step, tau));
        let sampled = Phi * x + Gamma * u + Lag * (a - u) + d;
        (sampled - integrate(&lpv, x, a, u, step, tau)).norm()
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
    fn a_very_fast_lag_is_no_lag() {
        let lpv = system(15.0);
        let lag = discretise(&lpv, &Hold::new(0.033, [1e-9, 1e-9]));
        assert!(lag.Lag.norm() < 1e-6, "{}", lag.Lag);
        // A lag that never moves: the actuator's value acts instead of the command.
        let frozen = discretise(&lpv, &Hold::new(0.033, [1e9, 1e9]));
        assert!((frozen.Lag - frozen.Gamma).norm() < 1e-9, "{}", frozen.Lag - frozen.Gamma);
    }
}

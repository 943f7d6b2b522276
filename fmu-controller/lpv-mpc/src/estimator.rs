//! State and disturbance from noisy measurements: an extended Kalman filter on the prediction model.
//!
//! The vehicle states are augmented by three accelerations that the model cannot explain, on `v_x`, `v_y` and `yaw_rate`,
//! each a random walk: wind, grade, bank, a steering offset and tyres that differ from the nominal ones all show there. The
//! plan takes them on along the horizon, with their [`Trend`], which makes the tracking offset-free.
//!
//! How noisy the sensors are at most is told, how noisy they are is found out ([`NoiseLevel`]). Measurements enter one by one,
//! so a value that is missing (`v_y` without its sensor) or not finite is left out and the model carries on. So is, once, a value
//! that no car in the estimated state would show: a second one in a row is believed. Beyond [`JUMP_MAX`] the filter starts again.

use nalgebra::{SMatrix, SVector};
use num_dual::Dual64;
use serde::{Deserialize, Serialize};

use crate::Scalar;
use crate::discretise::{Discrete, discretise, reached};
use crate::hold::Hold;
use crate::model::{Body, Disturbance, E_PSI, E_Y, Input, NX, Point, State, Tyres, V_X, V_Y, YAW_RATE};
use crate::noise::NoiseLevel;
use crate::trend::Trend;

/// States and disturbances.
const NZ: usize = NX + 3;

/// Standard deviations of the sensors: one unit of the plant's noise in the public interface [m/s, m/s, rad/s, m, rad].
pub const SENSOR_DEVIATION: [f64; NX] = [0.03, 0.03, 0.002, 0.01, 0.002];

/// Intensities of the random walks of the disturbances [m/s2, m/s2, rad/s2 per root second].
///
/// A gust of the general track changes the drag by about 1 m/s2 within a second; the mismatch between a constant stiffness
/// and a tyre at 80 % of its grip changes the lateral acceleration by 2 to 3 m/s2 and the yaw acceleration by about as much
/// within a lane change of one second.
const WALK: [f64; 3] = [1.0, 3.0, 3.0];

/// Intensities of what is wrong with the model's states themselves [unit per root second]: the rounding of the schedule and
/// of the preview, a tenth of a sensor's deviation a second.
const MODEL: [f64; NX] = [0.003, 0.003, 0.0002, 0.001, 0.0002];

/// Standard deviations of the disturbances before anything is known [m/s2, m/s2, rad/s2]: those of a strong wind from the side,
/// and along the car of a steep road (1 m/s2 at 10 %) in a head wind of 50 m/s (1.2 m/s2).
pub(crate) const INITIAL: [f64; 3] = [2.0, 1.0, 0.5];

/// Largest difference between a measurement and its estimate that is no other situation [m/s, m/s, rad/s, m, rad]: 60 and
/// more standard deviations of the sensors, and more than any car does between two samples.
const JUMP_MAX: [f64; NX] = [2.0, 2.0, 1.0, 2.0, 0.5];

/// Growth of that difference with the time since the last measurement [1/s]: 20 m/s2 for the velocities, twice what tyres give.
const JUMP_RATE: f64 = 10.0;

/// Innovation, in its own standard deviations, beyond which a measurement is an outlier [1]: noise that is four times what is
/// assumed reaches it once in twenty measurements, the assumed one never.
const OUTLIER: f64 = 8.0;

/// Time after a start until the disturbances are those that the car shows [s]: six samples.
const SETTLED: f64 = 0.2;

/// Part of the trend by which the filter moves a disturbance on between two measurements [1]: a random walk lags behind a ramp.
///
/// With half of it the general track is followed to 0.012 cm (root mean square, `cargo fmu simulate --road general`) instead of
/// 0.021; with all of it to 0.015, and the lane change with lag, delay 20 ms wrong and noise is steered to 3.4 cm instead of 2.6
/// (`cargo fmu robustness --case slow_noise`).
const TREND_SHARE: f64 = 0.5;

/// Extended Kalman filter of the vehicle states and the unexplained accelerations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimator<T: Scalar = f64> {
    /// Estimated state.
    pub x: State<T>,
    /// Estimated disturbance, and where it is going.
    pub trend: Trend<T>,
    P: SMatrix<T, NZ, NZ>,
    /// Curvature at the last update [1/m].
    kappa: T,
    /// Whether a measurement has been seen to start from.
    started: bool,
    /// Which measurements were left out as outliers in the last update.
    left_out: [bool; NX],
    /// Standard deviations of the sensors in units of [`SENSOR_DEVIATION`], at most.
    sensor_noise: f64,
    /// What of it they have.
    noise: NoiseLevel,
    /// Time since the filter started [s].
    age: f64,
}

impl<T: Scalar> Estimator<T> {
    /// Nothing known yet; `sensor_noise` is in units of [`SENSOR_DEVIATION`], and found out if it is less.
    pub fn new(sensor_noise: f64) -> Self {
        Self {
            x: State::zeros(),
            trend: Trend::steady(Disturbance::zeros()),
            P: SMatrix::zeros(),
            kappa: T::zero(),
            started: false,
            left_out: [false; NX],
            sensor_noise,
            noise: NoiseLevel::new(),
            age: 0.0,
        }
    }

    /// Moves the estimate on by `duration` [s] under the mean `input`, then corrects it by the measurement.
    ///
    /// `measured` may hold NaN where nothing was measured, `kappa` is the curvature at the measurement [1/m]. Returns whether
    /// the filter had to start again, because no car gets from its estimate to that speed.
    #[inline(always)]
    pub fn update(
        &mut self,
        measured: &State<T>,
        kappa: T,
        input: &Input,
        duration: f64,
        body: &Body,
        tyres: &Tyres<T>,
    ) -> bool {
        let disturbance = self.trend.now;
        let kappa = if kappa.re().is_finite() { kappa } else { self.kappa };
        if self.started && duration > 0.0 {
            self.predict((self.kappa + kappa) * 0.5, input, duration, body, tyres);
        }
        self.kappa = kappa;
        self.age += duration;
        let far = |i: usize| {
            // Written so that an estimate that is no number any more is far from everything.
            let near = (measured[i] - self.x[i]).re().abs() <= JUMP_MAX[i] * (1.0 + JUMP_RATE * duration);
            measured[i].re().is_finite() && !near
        };
        let restarts = self.started && (0..NX).any(far) && self.start(measured);
        if restarts || !self.started && self.start(measured) {
            // What it starts from tells nothing besides.
            return restarts;
        }
        let before = self.left_out;
        for (i, z) in measured.iter().enumerate() {
            self.left_out[i] = z.re().is_finite() && !before[i] && self.is_outlier(i, *z);
            if z.re().is_finite() && !self.left_out[i] {
                self.correct(i, *z);
            }
        }
        self.noise.update(duration);
        if duration > 0.0 {
            self.trend.follow(&disturbance, duration);
        }
        false
    }

    /// The same filter on dual numbers, every derivative zero.
    pub(crate) fn to_dual(self) -> Estimator<Dual64>
    where
        T: Into<Dual64>,
    {
        Estimator {
            x: self.x.map(Into::into),
            trend: self.trend.map(Into::into),
            P: self.P.map(Into::into),
            kappa: self.kappa.into(),
            started: self.started,
            left_out: self.left_out,
            sensor_noise: self.sensor_noise,
            noise: self.noise,
            age: self.age,
        }
    }

    /// Whether a measurement was left out in the last update because no car in the estimated state would show it.
    pub fn doubts(&self) -> bool {
        self.left_out.contains(&true)
    }

    /// Whether enough has been measured since the start for the disturbances to be what the car shows.
    pub fn is_settled(&self) -> bool {
        self.age > SETTLED
    }

    /// Whether there is an estimate at all.
    pub fn is_started(&self) -> bool {
        self.started
    }

    /// Takes a measurement as it is; a lateral velocity that is not measured starts at zero. Returns whether there was enough to
    /// start from.
    fn start(&mut self, measured: &State<T>) -> bool {
        let known = [V_X, YAW_RATE, E_Y, E_PSI].iter().all(|i| measured[*i].re().is_finite());
        if !known {
            return false;
        }
        self.started = true;
        self.age = 0.0;
        self.left_out = [false; NX];
        self.trend = Trend::steady(Disturbance::zeros());
        self.x = measured.map(|z| if z.re().is_finite() { z } else { T::zero() });
        let mut deviation = SVector::<f64, NZ>::zeros();
        for i in 0..NX {
            deviation[i] = if measured[i].re().is_finite() { self.told_variance(i).sqrt() } else { 1.0 };
        }
        deviation.fixed_rows_mut::<3>(NX).copy_from(&SVector::from(INITIAL));
        self.P = SMatrix::from_diagonal(&deviation.map(|deviation| T::from(deviation * deviation)));
        true
    }

    /// Variance of a sensor, as the parameter tells it.
    fn told_variance(&self, i: usize) -> f64 {
        (SENSOR_DEVIATION[i] * self.sensor_noise).powi(2)
    }

    #[inline(always)]
    fn predict(&mut self, kappa: T, input: &Input, duration: f64, body: &Body, tyres: &Tyres<T>) {
        let hold = Hold::new(duration, [0.0, 0.0]);
        let input = input.map(T::from);
        let around = |x: &State<T>| Point::new(*x, input, body).embed(kappa, tyres, &self.trend.now);
        // Scheduled in the middle of the step, as the stages of the plan are.
        let end = reached(&around(&self.x), &self.x, &input, &hold);
        let Discrete { Phi, Gamma, d } = discretise(&around(&((self.x + end) * T::from(0.5))), &hold);
        let x = Phi * self.x + Gamma * input + d;

        // P <- F P F', once from the left and, since P stays symmetric, once more from the left on the transpose.
        for _ in 0..2 {
            for mut column in self.P.column_iter_mut() {
                let moved = move_column(
                    &column.fixed_rows::<NX>(0).into_owned(),
                    &column.fixed_rows::<3>(NX).into_owned(),
                    &Phi,
                    duration,
                );
                column.fixed_rows_mut::<NX>(0).copy_from(&moved);
            }
            self.P.transpose_mut();
        }
        for (i, intensity) in MODEL.iter().chain(&WALK).enumerate() {
            self.P[(i, i)] += T::from(intensity * intensity * duration);
        }
        self.x = x;
        self.trend.now = self.trend.after(TREND_SHARE * duration);
    }

    fn is_outlier(&self, i: usize, z: T) -> bool {
        let variance = self.P[(i, i)].re() + self.told_variance(i);
        self.started && (z - self.x[i]).re().powi(2) > OUTLIER * OUTLIER * variance
    }

    /// One measured state; the covariance stays symmetric because its column and row are the same numbers.
    #[inline(always)]
    fn correct(&mut self, i: usize, z: T) {
        if !self.started {
            return;
        }
        let column = self.P.column(i).into_owned();
        let of_sensor = self.told_variance(i) * self.noise.share();
        let gain = column * (column[i] + of_sensor).recip();
        let innovation = z - self.x[i];
        self.noise.observe(innovation.re(), column[i].re() + of_sensor, of_sensor);
        for k in 0..NX {
            self.x[k] += gain[k] * innovation;
        }
        for k in 0..3 {
            self.trend.now[k] += gain[NX + k] * innovation;
        }
        self.P -= gain * column.transpose();
    }
}

/// The state rows of `F z`: what an error of the states and of the disturbances becomes over `duration` [s].
///
/// An acceleration held over the step adds up to first order in the velocities and to second order in the errors on the
/// path; it is a random walk, so more would pretend to know it better.
#[inline(always)]
fn move_column<T: Scalar>(x: &State<T>, d: &SVector<T, 3>, Phi: &SMatrix<T, NX, NX>, duration: f64) -> State<T> {
    let mut moved = Phi * x;
    for j in 0..3 {
        moved[j] += d[j] * duration;
    }
    let half_square = 0.5 * duration * duration;
    moved[E_Y] += d[V_Y] * half_square;
    moved[E_PSI] += d[YAW_RATE] * half_square;
    moved
}

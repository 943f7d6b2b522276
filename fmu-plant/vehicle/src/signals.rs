//! What goes into the plant and what comes out of it.

use num_dual::Dual64;
use serde::{Deserialize, Serialize};

use crate::{
    Error, Scalar,
    dynamics::{E_PSI, E_Y, Evaluation, NX, PSI, S, V_X, V_Y, X, Y, YAW_RATE},
};

/// What the world does to the vehicle during one communication step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Inputs {
    /// Front steering angle command [rad].
    pub delta: f64,
    /// Longitudinal acceleration command; negative is braking [m/s2].
    pub a_x: f64,
    /// Wind, added to the manoeuvre's own [m/s].
    pub wind_speed: f64,
    /// Direction it blows to, in the road frame at the start [rad].
    pub wind_direction: f64,
    /// Factor on the friction [1].
    pub mu_scale: f64,
}

impl Default for Inputs {
    fn default() -> Self {
        Self { mu_scale: 1.0, ..Self::ZERO }
    }
}

/// Shortest time in which an input crosses its range [s]: faster is a jump, and rates such as 1e100 would overflow where
/// they multiply.
const CROSSING: f64 = 1e-6;

macro_rules! ranges {
    ($($field:ident $min:expr, $max:expr;)*) => {
        /// The smallest value of each input.
        pub const MIN: Self = Self { $($field: $min),* };
        /// The largest value of each input.
        pub const MAX: Self = Self { $($field: $max),* };

        /// Refuses a value outside its range, by name.
        pub fn validate(&self) -> Result<(), Error> {
            $(
                let (value, min, max) = (self.$field, Self::MIN.$field, Self::MAX.$field);
                if !(min..=max).contains(&value) {
                    return Err(Error::Input { name: stringify!($field), value, min, max });
                }
            )*
            Ok(())
        }

        /// These inputs after `t` seconds of changing at `rates`, each held in its range.
        #[must_use]
        pub fn after(&self, t: f64, rates: &Self) -> Self {
            Self { $($field: (self.$field + t * rates.$field).clamp(Self::MIN.$field, Self::MAX.$field)),* }
        }

        /// These rates, none faster than through its input's whole range in [`CROSSING`].
        pub(crate) fn bounded(&self) -> Self {
            Self {
                $($field: {
                    let most = (Self::MAX.$field - Self::MIN.$field) / CROSSING;
                    self.$field.clamp(-most, most)
                }),*
            }
        }
    };
}

impl Inputs {
    /// No change of any input.
    pub const ZERO: Self = Self { delta: 0.0, a_x: 0.0, wind_speed: 0.0, wind_direction: 0.0, mu_scale: 0.0 };
}

// Commands may exceed what the actuators reach: those saturate.
impl Inputs {
    ranges! {
        delta -10.0, 10.0;
        a_x -100.0, 100.0;
        wind_speed -100.0, 100.0;
        wind_direction -100.0, 100.0;
        mu_scale 0.0, 2.0;
    }
}

/// Everything that the plant shows besides the measurement and the preview.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Outputs<D = f64> {
    /// Longitudinal velocity, body frame [m/s].
    pub v_x_true: D,
    /// Lateral velocity, body frame [m/s].
    pub v_y_true: D,
    /// Yaw rate [rad/s].
    pub yaw_rate_true: D,
    /// Lateral error [m].
    pub e_y_true: D,
    /// Heading error [rad].
    pub e_psi_true: D,
    /// Global position along the start of the road [m].
    pub x: D,
    /// Global position to the left of it [m].
    pub y: D,
    /// Global heading [rad].
    pub psi: D,
    /// Arc length along the path [m].
    pub s: D,
    /// Lateral acceleration of the centre of gravity, body frame [m/s2].
    pub a_lat: D,
    /// Longitudinal acceleration of the centre of gravity, body frame [m/s2].
    pub a_long: D,
    /// Front slip angle [rad].
    pub alpha_f: D,
    /// Rear slip angle [rad].
    pub alpha_r: D,
    /// Lateral force of the front axle [N].
    pub f_yf: D,
    /// Lateral force of the rear axle [N].
    pub f_yr: D,
    /// Secant stiffness of the front axle [N/rad].
    pub c_f_true: D,
    /// Secant stiffness of the rear axle [N/rad].
    pub c_r_true: D,
    /// Steering angle after the actuator [rad].
    pub delta_actual: D,
    /// Acceleration after the actuator [m/s2].
    pub a_x_actual: D,
    /// Share of the grip that the more loaded axle uses, 0 to 1 [1].
    pub grip_usage: D,
    /// Speed of the wind where the vehicle is [m/s].
    pub wind_speed_actual: D,
    /// Front slip angle over that of the peak force, 0 if the tyre has no peak [1].
    pub slip_f: D,
    /// Rear slip angle over that of the peak force, 0 if the tyre has no peak [1].
    pub slip_r: D,
    /// Whether the end of the road is reached.
    pub finished: bool,
    /// Completed laps of a closed track.
    pub lap: i32,
    /// Cones hit so far.
    pub cones_hit: i32,
}

impl<D: Scalar> Outputs<D> {
    /// What follows from the state `x` and an evaluation there, with the actuators at `delta` and `a_x`.
    pub(crate) fn new(
        x: &[D; NX],
        evaluation: &Evaluation<D>,
        delta: D,
        (finished, lap, cones_hit): (bool, i32, i32),
    ) -> Self {
        let Evaluation { x_dot, alpha_f, alpha_r, f_yf, f_yr, c_f, c_r, a_x, wind, .. } = *evaluation;
        Self {
            v_x_true: x[V_X],
            v_y_true: x[V_Y],
            yaw_rate_true: x[YAW_RATE],
            e_y_true: x[E_Y],
            e_psi_true: x[E_PSI],
            x: x[X],
            y: x[Y],
            psi: x[PSI],
            s: x[S],
            a_lat: x_dot[V_Y] + x[V_X] * x[YAW_RATE],
            a_long: x_dot[V_X] - x[V_Y] * x[YAW_RATE],
            alpha_f,
            alpha_r,
            f_yf,
            f_yr,
            c_f_true: c_f,
            c_r_true: c_r,
            delta_actual: delta,
            a_x_actual: a_x,
            grip_usage: grip_usage(evaluation),
            wind_speed_actual: length(wind),
            slip_f: evaluation.slip_f,
            slip_r: evaluation.slip_r,
            finished,
            lap,
            cones_hit,
        }
    }
}

impl Outputs<Dual64> {
    /// The derivative parts.
    pub(crate) fn tangent(&self) -> Outputs {
        Outputs {
            v_x_true: self.v_x_true.eps,
            v_y_true: self.v_y_true.eps,
            yaw_rate_true: self.yaw_rate_true.eps,
            e_y_true: self.e_y_true.eps,
            e_psi_true: self.e_psi_true.eps,
            x: self.x.eps,
            y: self.y.eps,
            psi: self.psi.eps,
            s: self.s.eps,
            a_lat: self.a_lat.eps,
            a_long: self.a_long.eps,
            alpha_f: self.alpha_f.eps,
            alpha_r: self.alpha_r.eps,
            f_yf: self.f_yf.eps,
            f_yr: self.f_yr.eps,
            c_f_true: self.c_f_true.eps,
            c_r_true: self.c_r_true.eps,
            delta_actual: self.delta_actual.eps,
            a_x_actual: self.a_x_actual.eps,
            grip_usage: self.grip_usage.eps,
            wind_speed_actual: self.wind_speed_actual.eps,
            slip_f: self.slip_f.eps,
            slip_r: self.slip_r.eps,
            finished: self.finished,
            lap: self.lap,
            cones_hit: self.cones_hit,
        }
    }
}

/// The larger share of the axles' grip, lateral and longitudinal force together; a linear tyre can exceed its peak, and
/// the share is then all of it.
fn grip_usage<D: Scalar>(evaluation: &Evaluation<D>) -> D {
    let Evaluation { f_yf, f_yr, peak_f, peak_r, left_f, left_r, .. } = *evaluation;
    let share = |force: D, peak: D, left: D| {
        if peak.re() <= 0.0 {
            return D::one();
        }
        let lateral = force / peak;
        let longitudinal = -left * left + 1.0;
        // The root of a dual zero has no derivative.
        if longitudinal.re() > 0.0 { (lateral * lateral + longitudinal).sqrt() } else { lateral.abs() }
    };
    let (front, rear) = (share(f_yf, peak_f, left_f), share(f_yr, peak_r, left_r));
    let larger = if front.re() >= rear.re() { front } else { rear };
    if larger.re() > 1.0 { D::one() } else { larger }
}

/// Length of a vector; a zero vector has the derivative 0.
fn length<D: Scalar>([x, y]: [D; 2]) -> D {
    let square = x * x + y * y;
    if square.re() == 0.0 { D::zero() } else { square.sqrt() }
}

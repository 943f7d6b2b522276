//! The vehicle on its road, advanced one communication step at a time.

use serde::{Deserialize, Serialize};

use crate::{
    Error, Measurement, Parameters, Preview, Road,
    actuators::{self, Actuator, Ramp},
    dynamics::{self, Drive, Dynamics, E_PSI, E_Y, Evaluation, NX, PSI, S, V_X, V_Y, X, Y, YAW_RATE},
    integrate, noise,
};

/// Longest communication step [s]: a minute holds every command longer than any use, and bounds the work of one call.
pub const STEP_MAX: f64 = 60.0;

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
    /// Rate of the steering command inside the step [rad/s].
    pub delta_rate: f64,
    /// Rate of the acceleration command inside the step [m/s3].
    pub a_x_rate: f64,
}

impl Default for Inputs {
    fn default() -> Self {
        Self {
            delta: 0.0,
            a_x: 0.0,
            wind_speed: 0.0,
            wind_direction: 0.0,
            mu_scale: 1.0,
            delta_rate: 0.0,
            a_x_rate: 0.0,
        }
    }
}

/// Name, how to read it, smallest and largest value of an input.
type InputRange = (&'static str, fn(&Inputs) -> f64, f64, f64);

impl Inputs {
    /// The ranges that [`Vehicle::advance`] enforces. Commands may exceed what the actuators reach: those saturate.
    pub const RANGES: &'static [InputRange] = &[
        ("delta", |i| i.delta, -10.0, 10.0),
        ("a_x", |i| i.a_x, -100.0, 100.0),
        ("wind_speed", |i| i.wind_speed, -100.0, 100.0),
        ("wind_direction", |i| i.wind_direction, -100.0, 100.0),
        ("mu_scale", |i| i.mu_scale, 0.0, 2.0),
        ("delta_rate", |i| i.delta_rate, -1e4, 1e4),
        ("a_x_rate", |i| i.a_x_rate, -1e5, 1e5),
    ];

    fn validate(&self) -> Result<(), Error> {
        for &(name, read, min, max) in Self::RANGES {
            let value = read(self);
            if !(min..=max).contains(&value) {
                return Err(Error::Input { name, value, min, max });
            }
        }
        Ok(())
    }
}

/// Everything that the plant shows besides the measurement and the preview.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outputs {
    /// Longitudinal velocity, body frame [m/s].
    pub v_x_true: f64,
    /// Lateral velocity, body frame [m/s].
    pub v_y_true: f64,
    /// Yaw rate [rad/s].
    pub yaw_rate_true: f64,
    /// Lateral error [m].
    pub e_y_true: f64,
    /// Heading error [rad].
    pub e_psi_true: f64,
    /// Global position along the start of the road [m].
    pub x: f64,
    /// Global position to the left of it [m].
    pub y: f64,
    /// Global heading [rad].
    pub psi: f64,
    /// Arc length along the path [m].
    pub s: f64,
    /// Lateral acceleration of the centre of gravity, body frame [m/s2].
    pub a_lat: f64,
    /// Longitudinal acceleration of the centre of gravity, body frame [m/s2].
    pub a_long: f64,
    /// Front slip angle [rad].
    pub alpha_f: f64,
    /// Rear slip angle [rad].
    pub alpha_r: f64,
    /// Lateral force of the front axle [N].
    pub f_yf: f64,
    /// Lateral force of the rear axle [N].
    pub f_yr: f64,
    /// Secant stiffness of the front axle [N/rad].
    pub c_f_true: f64,
    /// Secant stiffness of the rear axle [N/rad].
    pub c_r_true: f64,
    /// Steering angle after the actuator [rad].
    pub delta_actual: f64,
    /// Acceleration after the actuator [m/s2].
    pub a_x_actual: f64,
    /// Share of the grip that the more loaded axle uses, 0 to 1 [1].
    pub grip_usage: f64,
    /// Speed of the wind where the vehicle is [m/s].
    pub wind_speed_actual: f64,
    /// Whether the end of the road is reached.
    pub finished: bool,
    /// Cones hit so far.
    pub cones_hit: i32,
}

/// What changes while the vehicle drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Time since the start [s].
    pub time: f64,
    /// The continuous states, named by the indices of [`dynamics`].
    pub x: [f64; NX],
    /// The steering.
    pub steering: actuators::State,
    /// The drive and the brakes.
    pub drive: actuators::State,
    /// The inputs of the last step.
    pub inputs: Inputs,
    /// The noise that is held at present.
    noise: Measurement,
}

/// Constants that follow from the parameters.
#[derive(Debug, Clone)]
struct Derived {
    dynamics: Dynamics,
    steering: Actuator,
    drive: Actuator,
}

impl Derived {
    fn new(p: &Parameters) -> Self {
        Self {
            dynamics: Dynamics::new(p),
            steering: Actuator {
                delay: p.delay_delta,
                tau: p.tau_delta,
                rate_max: p.delta_rate_max,
                min: -p.delta_max,
                max: p.delta_max,
            },
            drive: Actuator {
                delay: p.delay_a_x,
                tau: p.tau_a_x,
                rate_max: p.a_x_rate_max,
                min: p.a_x_min,
                max: p.a_x_max,
            },
        }
    }
}

/// A vehicle on its road. Cloning it, or writing and reading it with serde, saves and restores everything.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Saved", into = "Saved")]
pub struct Vehicle {
    parameters: Parameters,
    road: Road,
    state: State,
    derived: Derived,
}

/// What is written of a vehicle; the rest follows from it.
#[derive(Serialize, Deserialize)]
struct Saved {
    parameters: Parameters,
    road: Road,
    state: State,
}

impl TryFrom<Saved> for Vehicle {
    type Error = Error;

    fn try_from(Saved { parameters, road, state }: Saved) -> Result<Self, Error> {
        parameters.validate()?;
        let derived = Derived::new(&parameters);
        Ok(Self { parameters, road, state, derived })
    }
}

impl From<Vehicle> for Saved {
    fn from(Vehicle { parameters, road, state, .. }: Vehicle) -> Self {
        Self { parameters, road, state }
    }
}

impl Vehicle {
    /// A vehicle at the start of `road`, on the path but for the parameters' initial offsets.
    pub fn new(parameters: Parameters, road: Road) -> Result<Self, Error> {
        parameters.validate()?;
        let start = road.start();
        let mut x = [0.0; NX];
        x[V_X] = if parameters.v_x_0 < 0.0 { road.speed(0.0) } else { parameters.v_x_0 };
        x[E_Y] = parameters.e_y_0;
        x[E_PSI] = parameters.e_psi_0;
        x[X] = start.x - parameters.e_y_0 * start.psi.sin();
        x[Y] = start.y + parameters.e_y_0 * start.psi.cos();
        x[PSI] = start.psi + parameters.e_psi_0;
        let derived = Derived::new(&parameters);
        let state = State {
            time: 0.0,
            x,
            steering: actuators::State::new(&derived.steering),
            drive: actuators::State::new(&derived.drive),
            inputs: Inputs::default(),
            noise: Measurement::default(),
        };
        let mut vehicle = Self { parameters, road, state, derived };
        vehicle.draw_noise();
        Ok(vehicle)
    }

    /// The parameters.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The road.
    #[must_use]
    pub fn road(&self) -> &Road {
        &self.road
    }

    /// The state behind the measurement.
    #[must_use]
    pub fn truth(&self) -> &State {
        &self.state
    }

    /// Moves on by `h` seconds; the inputs hold, or follow their rates.
    ///
    /// After an error the vehicle is where it was before the step.
    pub fn advance(&mut self, h: f64, inputs: &Inputs) -> Result<(), Error> {
        if !(h > 0.0 && h <= STEP_MAX) {
            return Err(Error::Step(h));
        }
        inputs.validate()?;
        let before = (self.state.x, self.state.time, self.state.steering.position, self.state.drive.position);
        self.state.inputs = *inputs;
        let start = self.state.time;
        let delta = |t: f64| Ramp { value: inputs.delta + inputs.delta_rate * t, slope: inputs.delta_rate };
        let a_x = |t: f64| Ramp { value: inputs.a_x + inputs.a_x_rate * t, slope: inputs.a_x_rate };
        self.state.steering.command(&self.derived.steering, start, delta(0.0));
        self.state.drive.command(&self.derived.drive, start, a_x(0.0));

        let wind = wind(inputs);
        let mut done = 0.0;
        while done < h {
            let (now, left) = (start + done, h - done);
            let State { steering, drive, .. } = &self.state;
            let (steer, until) = steering.piece(&self.derived.steering, now, delta(done), left);
            let (push, until) = drive.piece(&self.derived.drive, now, a_x(done), until);
            // The last piece ends exactly with the step, and every piece moves time on.
            let length = if left - until <= 1e-12 { left } else { until };
            self.integrate(length, &steer, &push, wind, inputs.mu_scale);
            self.state.steering.position = steer.at(length);
            self.state.drive.position = push.at(length);
            done = if length == left { h } else { done + length };
        }
        self.state.time = start + h;
        if let Some(i) = self.state.x.iter().position(|x| !x.is_finite()) {
            let error = Error::Diverged { name: dynamics::NAMES[i], value: self.state.x[i], time: start + h };
            (self.state.x, self.state.time, self.state.steering.position, self.state.drive.position) = before;
            return Err(error);
        }
        self.draw_noise();
        Ok(())
    }

    /// Integrates over one piece of both actuators.
    fn integrate(
        &mut self,
        length: f64,
        steer: &actuators::Piece,
        push: &actuators::Piece,
        wind: [f64; 2],
        mu_scale: f64,
    ) {
        let Self { derived: Derived { dynamics, .. }, road, state, .. } = self;
        let n = integrate::count(length);
        let h = length / f64::from(n);
        let still = steer.is_constant() && push.is_constant();
        let at = |t: f64| drive(steer.at(t), push.at(t), wind, mu_scale);
        let mut drives = [at(0.0); 3];
        for i in 0..n {
            if !still {
                let t = f64::from(i) * h;
                drives = [at(t), at(t + 0.5 * h), at(t + h)];
            }
            state.x = integrate::rk4(&state.x, h, |stage, x| dynamics.evaluate(road, x, &drives[stage]).x_dot);
        }
    }

    /// Replaces the held noise when a sample time has passed.
    fn draw_noise(&mut self) {
        let Parameters { noise_scale, seed, preview_step, .. } = self.parameters;
        if noise_scale == 0.0 {
            return;
        }
        // A sample time that summed steps miss by rounding counts as reached.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of samples since time 0")]
        let index = (self.state.time / preview_step + 1e-6).floor() as u64;
        self.state.noise = noise::sample(seed, index, noise_scale);
    }

    /// What the sensors show.
    #[must_use]
    pub fn measurement(&self) -> Measurement {
        let State { x, noise, .. } = &self.state;
        Measurement {
            v_x: x[V_X] + noise.v_x,
            v_y: x[V_Y] + noise.v_y,
            yaw_rate: x[YAW_RATE] + noise.yaw_rate,
            e_y: x[E_Y] + noise.e_y,
            e_psi: x[E_PSI] + noise.e_psi,
        }
    }

    /// Curvature and speed of the path ahead.
    #[must_use]
    pub fn preview(&self) -> Preview {
        self.road.preview(self.state.x[S], self.parameters.preview_step)
    }

    /// Derivatives and forces at the present state and actuator positions.
    #[must_use]
    pub fn evaluate(&self) -> Evaluation<f64> {
        let State { x, steering, drive: push, inputs, .. } = &self.state;
        let drive = drive(steering.position, push.position, wind(inputs), inputs.mu_scale);
        self.derived.dynamics.evaluate(&self.road, x, &drive)
    }

    /// Everything else that the plant shows.
    #[must_use]
    pub fn outputs(&self) -> Outputs {
        let State { x, steering, drive, .. } = &self.state;
        let evaluation = self.evaluate();
        let Evaluation { x_dot, alpha_f, alpha_r, f_yf, f_yr, peak_f, peak_r, wind } = evaluation;
        let (c_f_true, c_r_true) = self.derived.dynamics.stiffness(&evaluation);
        let usage = |force: f64, peak: f64| if peak > 0.0 { (force / peak).abs() } else { 1.0 };
        Outputs {
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
            c_f_true,
            c_r_true,
            delta_actual: steering.position,
            a_x_actual: drive.position,
            // A linear tyre can exceed the peak; the share is then all of it.
            grip_usage: usage(f_yf, peak_f).max(usage(f_yr, peak_r)).min(1.0),
            wind_speed_actual: wind[0].hypot(wind[1]),
            finished: x[S] >= self.road.length(),
            cones_hit: 0,
        }
    }
}

/// The input wind as a vector in the global frame [m/s].
fn wind(inputs: &Inputs) -> [f64; 2] {
    let (sin, cos) = inputs.wind_direction.sin_cos();
    [inputs.wind_speed * cos, inputs.wind_speed * sin]
}

/// What acts on the vehicle at these actuator positions.
fn drive(delta: f64, a_x: f64, [wind_x, wind_y]: [f64; 2], mu_scale: f64) -> Drive<f64> {
    Drive { delta, sin_delta: 0.0, cos_delta: 1.0, a_x, wind_x, wind_y, mu_scale }.steered(delta)
}

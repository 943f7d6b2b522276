//! The vehicle on its road, advanced one communication step at a time.

use num_dual::Dual64;
use serde::{Deserialize, Serialize};

use crate::{
    Error, Inputs, Measurement, Outputs, Parameters, Preview, Road, Scalar,
    actuators::{self, Actuator, Piece, Ramp},
    dynamics::{self, Drive, Dynamics, E_PSI, E_Y, NX, PSI, S, V_X, V_Y, X, Y, YAW_RATE},
    integrate, noise,
};

/// Longest communication step [s]: a minute holds every command longer than any use, and bounds the work of one call.
pub const STEP_MAX: f64 = 60.0;

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
    /// The inputs at the end of the last step.
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

    /// Moves on by `h` seconds while the inputs hold.
    pub fn advance(&mut self, h: f64, inputs: &Inputs) -> Result<(), Error> {
        self.advance_along(h, inputs, &Inputs::ZERO)
    }

    /// Moves on by `h` seconds while the inputs change at `rates`.
    ///
    /// After an error the motion is where it was before the step.
    pub fn advance_along(&mut self, h: f64, inputs: &Inputs, rates: &Inputs) -> Result<(), Error> {
        if !(h > 0.0 && h <= STEP_MAX) {
            return Err(Error::Step(h));
        }
        inputs.validate()?;
        let before = (self.state.x, self.state.time, self.state.steering.position, self.state.drive.position);
        let start = self.state.time;
        let delta = |t: f64| Ramp { value: inputs.delta + rates.delta * t, slope: rates.delta };
        let a_x = |t: f64| Ramp { value: inputs.a_x + rates.a_x * t, slope: rates.a_x };
        self.state.steering.command(&self.derived.steering, start, delta(0.0));
        self.state.drive.command(&self.derived.drive, start, a_x(0.0));

        let mut done = 0.0;
        while done < h {
            let (now, left) = (start + done, h - done);
            let State { steering, drive, .. } = &self.state;
            let (steer, until) = steering.piece(&self.derived.steering, now, delta(done), left);
            let (push, until) = drive.piece(&self.derived.drive, now, a_x(done), until);
            // The last piece ends exactly with the step, and every piece moves time on.
            let length = if left - until <= 1e-12 { left } else { until };
            self.integrate(length, (&steer, &push), &inputs.after(done, rates), rates);
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
        self.state.inputs = inputs.after(h, rates);
        self.draw_noise();
        Ok(())
    }

    /// Integrates over one piece of both actuators.
    fn integrate(&mut self, length: f64, (steer, push): (&Piece, &Piece), inputs: &Inputs, rates: &Inputs) {
        let Self { derived: Derived { dynamics, .. }, road, state, .. } = self;
        let n = integrate::count(length);
        let h = length / f64::from(n);
        let still = steer.is_constant() && push.is_constant() && *rates == Inputs::ZERO;
        let at = |t: f64| {
            let Inputs { wind_speed, wind_direction, mu_scale, .. } = inputs.after(t, rates);
            drive((steer.at(t), push.at(t)), wind(wind_speed, wind_direction), mu_scale)
        };
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

    /// Time derivative of the preview.
    #[must_use]
    pub fn preview_rate(&self) -> Preview {
        let [v_x, v_y, _, s, e_y, e_psi, ..] = self.state.x;
        let s_dot = dynamics::progress_rate((v_x, v_y), (e_y, e_psi), self.road.curvature(s));
        self.road.preview_rate(s, s_dot, self.parameters.preview_step)
    }

    /// Everything else that the plant shows, under the inputs of the last step.
    #[must_use]
    pub fn outputs(&self) -> Outputs {
        self.outputs_under(&self.state.inputs)
    }

    /// Everything else that the plant shows, if `inputs` acted now.
    #[must_use]
    pub fn outputs_under(&self, inputs: &Inputs) -> Outputs {
        let (steer, push) = self.pieces(inputs);
        let wind = wind(inputs.wind_speed, inputs.wind_direction);
        self.signals(&self.state.x, (steer.at(0.0), push.at(0.0)), wind, inputs.mu_scale)
    }

    /// How the outputs change with the inputs along the direction `seed`, exactly, by dual numbers. A command moves its actuator at once only if that has neither delay nor lag nor rate limit.
    #[must_use]
    pub fn outputs_along(&self, inputs: &Inputs, seed: &Inputs) -> Outputs {
        let (steer, push) = self.pieces(inputs);
        let Derived { steering, drive, .. } = &self.derived;
        let dual = |value: f64, along: f64| Dual64::new(value, along);
        let actuators = (
            dual(steer.at(0.0), seed.delta * steering.gain(inputs.delta)),
            dual(push.at(0.0), seed.a_x * drive.gain(inputs.a_x)),
        );
        let wind = wind(dual(inputs.wind_speed, seed.wind_speed), dual(inputs.wind_direction, seed.wind_direction));
        let x = self.state.x.map(Dual64::from_re);
        self.signals(&x, actuators, wind, dual(inputs.mu_scale, seed.mu_scale)).tangent()
    }

    /// Time derivatives of the outputs under `inputs`, exactly, by dual numbers.
    #[must_use]
    pub fn outputs_rate(&self, inputs: &Inputs) -> Outputs {
        let (steer, push) = self.pieces(inputs);
        let input_wind = wind(inputs.wind_speed, inputs.wind_direction);
        let drive = drive((steer.at(0.0), push.at(0.0)), input_wind, inputs.mu_scale);
        let x_dot = self.derived.dynamics.evaluate(&self.road, &self.state.x, &drive).x_dot;
        let x = std::array::from_fn(|i| Dual64::new(self.state.x[i], x_dot[i]));
        let actuators = (Dual64::new(steer.at(0.0), steer.rate()), Dual64::new(push.at(0.0), push.rate()));
        self.signals(&x, actuators, input_wind.map(Dual64::from_re), Dual64::from_re(inputs.mu_scale)).tangent()
    }

    /// How both actuators move from now on under `inputs`.
    fn pieces(&self, inputs: &Inputs) -> (Piece, Piece) {
        let Self { state: State { steering, drive, time, .. }, derived, .. } = self;
        let delta = Ramp { value: inputs.delta, slope: 0.0 };
        let a_x = Ramp { value: inputs.a_x, slope: 0.0 };
        (
            steering.piece(&derived.steering, *time, delta, STEP_MAX).0,
            drive.piece(&derived.drive, *time, a_x, STEP_MAX).0,
        )
    }

    fn signals<D: Scalar>(&self, x: &[D; NX], actuators: (D, D), wind: [D; 2], mu_scale: D) -> Outputs<D> {
        let Derived { dynamics, .. } = &self.derived;
        let evaluation = dynamics.evaluate(&self.road, x, &drive(actuators, wind, mu_scale));
        let finished = x[S].re() >= self.road.length();
        Outputs::new(dynamics, x, &evaluation, actuators, (finished, 0))
    }
}

/// The input wind as a vector in the global frame [m/s].
fn wind<D: Scalar>(speed: D, direction: D) -> [D; 2] {
    let (sin, cos) = direction.sin_cos();
    [speed * cos, speed * sin]
}

/// What acts on the vehicle at these actuator positions.
fn drive<D: Scalar>((delta, a_x): (D, D), [wind_x, wind_y]: [D; 2], mu_scale: D) -> Drive<D> {
    Drive { delta, sin_delta: delta, cos_delta: delta, a_x, wind_x, wind_y, mu_scale }.steered(delta)
}

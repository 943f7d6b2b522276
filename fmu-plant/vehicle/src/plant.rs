//! The vehicle on its road, advanced one communication step at a time.

use serde::{Deserialize, Serialize};

use crate::{
    Error, Inputs, Measurement, Parameters, Road,
    actuators::{self, Actuator, Piece, Ramp},
    cones::{Body, Hits},
    dynamics::{self, Drive, Dynamics, E_PSI, E_Y, NX, PSI, S, V_X, X, Y},
    events::{Events, Gust, Steering},
    integrate::{self, H_MAX},
    noise,
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
    pub(crate) noise: Measurement,
    /// Cones hit so far.
    pub cones: Hits,
}

/// Constants that follow from the parameters and the road.
#[derive(Debug, Clone)]
pub(crate) struct Derived {
    pub dynamics: Dynamics,
    pub steering: Actuator,
    pub drive: Actuator,
    pub events: Events,
    body: Body,
    /// Longest internal step [s].
    h_max: f64,
}

impl Derived {
    fn new(p: &Parameters, road: &Road) -> Self {
        let dynamics = Dynamics::new(p);
        Self {
            dynamics,
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
            events: Events {
                gust: Gust::new(p),
                steering: road.steering().map(|form| Steering::new(form, p.steer_amplitude)),
            },
            body: Body::new(p),
            // The method of Runge and Kutta is stable up to 2.78 over the fastest rate; 1 leaves room for friction above
            // the nominal one. Ordinary cars stay at H_MAX.
            h_max: (1.0 / dynamics.fastest_rate(p)).clamp(1e-5, H_MAX),
        }
    }
}

/// A vehicle on its road. Cloning it, or writing and reading it with serde, saves and restores everything.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(try_from = "Saved", into = "Saved")]
pub struct Vehicle {
    pub(crate) parameters: Parameters,
    pub(crate) road: Road,
    pub(crate) state: State,
    pub(crate) derived: Derived,
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

    fn try_from(Saved { parameters, road, mut state }: Saved) -> Result<Self, Error> {
        parameters.validate()?;
        let derived = Derived::new(&parameters, &road);
        state.steering.make_room(&derived.steering);
        state.drive.make_room(&derived.drive);
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
        let derived = Derived::new(&parameters, &road);
        let state = State {
            time: 0.0,
            x,
            steering: actuators::State::new(&derived.steering),
            drive: actuators::State::new(&derived.drive),
            inputs: Inputs::default(),
            noise: Measurement::default(),
            cones: Hits::default(),
        };
        let mut vehicle = Self { parameters, road, state, derived };
        vehicle.draw_noise();
        Ok(vehicle)
    }

    /// This vehicle with `inputs` that act before the first step: the preview shows their friction.
    pub fn under(mut self, inputs: Inputs) -> Result<Self, Error> {
        inputs.validate()?;
        self.state.inputs = inputs;
        Ok(self)
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

    /// Moves on by `h` seconds while the inputs change at `rates`, each until it reaches the end of its range.
    ///
    /// After an error the motion is where it was before the step.
    pub fn advance_along(&mut self, h: f64, inputs: &Inputs, rates: &Inputs) -> Result<(), Error> {
        if !(h > 0.0 && h <= STEP_MAX) {
            return Err(Error::Step(h));
        }
        inputs.validate()?;
        let rates = &rates.bounded();
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
            self.integrate(now, length, (&steer, &push), &inputs.after(done, rates), rates);
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

    /// Integrates over one piece of both actuators that begins at `start`.
    fn integrate(&mut self, start: f64, length: f64, pieces: (&Piece, &Piece), inputs: &Inputs, rates: &Inputs) {
        let Self { derived, road, state, .. } = self;
        let n = integrate::count(length, derived.h_max);
        let h = length / f64::from(n);
        let still = pieces.0.is_constant()
            && pieces.1.is_constant()
            && *rates == Inputs::ZERO
            && !derived.events.act(start, start + length);
        let at = |t: f64| {
            let inputs = inputs.after(t, rates);
            derived.drive_at(start + t, (pieces.0.at(t), pieces.1.at(t)), &inputs)
        };
        let mut drives = [at(0.0); 3];
        for i in 0..n {
            if !still {
                let t = f64::from(i) * h;
                drives = [at(t), at(t + 0.5 * h), at(t + h)];
            }
            state.x = integrate::rk4(&state.x, h, |stage, x| derived.dynamics.rates(road, x, &drives[stage]));
            rejoin(road, &mut state.x);
            if !road.cones().is_empty() {
                state.cones.add(&derived.body, [state.x[X], state.x[Y]], state.x[PSI], road.cones());
            }
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
}

impl Derived {
    /// What acts on the vehicle at time `t` with the actuators at `(delta, a_x)`.
    fn drive_at(&self, t: f64, (delta, a_x): (f64, f64), inputs: &Inputs) -> Drive<f64> {
        let (sin, cos) = inputs.wind_direction.sin_cos();
        let wind = [inputs.wind_speed * cos, inputs.wind_speed * sin];
        let (delta, [wind_x, wind_y]) = self.events.add(t, delta, wind);
        let mu_scale = inputs.mu_scale;
        Drive { delta, sin_delta: 0.0, cos_delta: 1.0, a_x, wind_x, wind_y, mu_scale }.steered(delta)
    }
}

/// Finds the path again from the place in the plane when the vehicle is about to cross the centre of the path's curve,
/// where the nearest point jumps and no differential equation follows it.
fn rejoin(road: &Road, x: &mut [f64; NX]) {
    /// Distance along the path in which it is looked for [m]: half a turn of a hairpin with 15 m radius, and less than
    /// the way to its other leg.
    const REACH: f64 = 50.0;
    let line = road.line();
    // Cheap first: nearly always the vehicle is nearer to the path than the centre of its sharpest curve.
    if x[E_Y].abs() * line.kappa_max < 1.0 - dynamics::NEAREST
        || x[E_Y] * road.curvature(x[S]) < 1.0 - dynamics::NEAREST
    {
        return;
    }
    let (s, e_y) = line.project((x[X], x[Y]), x[S], REACH);
    (x[S], x[E_Y]) = (s, e_y);
    // The shorter way round: the path may have turned by more than the vehicle.
    let difference = x[PSI] - line.pose(s).psi;
    x[E_PSI] = difference - std::f64::consts::TAU * (difference / std::f64::consts::TAU).round();
}

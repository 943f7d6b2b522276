//! What the vehicle shows at an instant, and how that changes with inputs and time.

use num_dual::Dual64;

use crate::{
    Inputs, Measurement, Outputs, Preview, STEP_MAX, Scalar, Vehicle,
    actuators::{Piece, Ramp},
    dynamics::{self, Drive, E_PSI, E_Y, NX, S, V_X, V_Y, YAW_RATE},
    plant::State,
};

/// Least friction that is shown [1]: to a controller, 0 stands for an unknown one.
const FRICTION_SHOWN: f64 = 1e-3;

impl Vehicle {
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

    /// Curvature, speed and friction of the path ahead. The factor on the friction that the last step ended with counts
    /// everywhere: whoever looks ahead sees the weather.
    #[must_use]
    pub fn preview(&self) -> Preview {
        let Self { road, state: State { x, inputs, .. }, derived, .. } = self;
        let friction = |s: f64| (derived.dynamics.friction(road, s) * inputs.mu_scale).max(FRICTION_SHOWN);
        road.preview(x[S], self.parameters.preview_step, friction)
    }

    /// Time derivative of the preview.
    #[must_use]
    pub fn preview_rate(&self) -> Preview {
        let [v_x, v_y, _, s, e_y, e_psi, ..] = self.state.x;
        let s_dot = dynamics::progress_rate((v_x, v_y), (e_y, e_psi), self.road.curvature(s));
        let friction = |s| self.derived.dynamics.friction(&self.road, s) * self.state.inputs.mu_scale;
        self.road.preview_rate(s, s_dot, self.parameters.preview_step, friction)
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

    /// How the outputs change with the inputs along the direction `seed`, exactly, by dual numbers. A command moves its
    /// actuator at once only if that has neither delay nor lag nor rate limit.
    #[must_use]
    pub fn outputs_along(&self, inputs: &Inputs, seed: &Inputs) -> Outputs {
        let (steer, push) = self.pieces(inputs);
        let (steering, drive) = (&self.derived.steering, &self.derived.drive);
        let dual = Dual64::new;
        let actuators = (
            dual(steer.at(0.0), seed.delta * steering.gain(inputs.delta)),
            dual(push.at(0.0), seed.a_x * drive.gain(inputs.a_x)),
        );
        let wind = wind(dual(inputs.wind_speed, seed.wind_speed), dual(inputs.wind_direction, seed.wind_direction));
        let x = self.state.x.map(Dual64::from_re);
        self.signals(&x, actuators, wind, dual(inputs.mu_scale, seed.mu_scale)).tangent()
    }

    /// Time derivatives of the outputs under `inputs`, exactly, by dual numbers; a gust and the manoeuvre's own steering
    /// count as constant.
    #[must_use]
    pub fn outputs_rate(&self, inputs: &Inputs) -> Outputs {
        let (steer, push) = self.pieces(inputs);
        let input_wind = wind(inputs.wind_speed, inputs.wind_direction);
        let drive = self.drive((steer.at(0.0), push.at(0.0)), input_wind, inputs.mu_scale);
        let x_dot = self.derived.dynamics.rates(&self.road, &self.state.x, &drive);
        let x = std::array::from_fn(|i| Dual64::new(self.state.x[i], x_dot[i]));
        let actuators = (Dual64::new(steer.at(0.0), steer.rate()), Dual64::new(push.at(0.0), push.rate()));
        self.signals(&x, actuators, input_wind.map(Dual64::from_re), Dual64::from_re(inputs.mu_scale)).tangent()
    }

    /// How both actuators move from now on under `inputs`.
    fn pieces(&self, inputs: &Inputs) -> (Piece, Piece) {
        let State { steering, drive, time, .. } = &self.state;
        let hold = |value: f64| Ramp { value, slope: 0.0 };
        (
            steering.piece(&self.derived.steering, *time, hold(inputs.delta), STEP_MAX).0,
            drive.piece(&self.derived.drive, *time, hold(inputs.a_x), STEP_MAX).0,
        )
    }

    /// What acts on the vehicle now.
    fn drive<D: Scalar>(&self, (delta, a_x): (D, D), wind: [D; 2], mu_scale: D) -> Drive<D> {
        let (delta, [wind_x, wind_y]) = self.derived.events.add(self.state.time, delta, wind);
        Drive { delta, sin_delta: delta, cos_delta: delta, a_x, wind_x, wind_y, mu_scale }.steered(delta)
    }

    fn signals<D: Scalar>(&self, x: &[D; NX], actuators: (D, D), wind: [D; 2], mu_scale: D) -> Outputs<D> {
        let drive = self.drive(actuators, wind, mu_scale);
        let evaluation = self.derived.dynamics.evaluate(&self.road, x, &drive);
        Outputs::new(x, &evaluation, drive.delta, self.progress())
    }

    /// Whether the end is reached, the completed laps, and the cones hit.
    fn progress(&self) -> (bool, i32, i32) {
        let laps = self.state.x[S] / self.road.length();
        let cones = self.state.cones.count();
        if !self.road.is_closed() {
            return (laps >= 1.0, 0, cones);
        }
        #[expect(clippy::cast_possible_truncation, reason = "a count of laps; the cast saturates")]
        let lap = laps.floor().max(0.0) as i32;
        (lap >= self.parameters.laps, lap, cones)
    }
}

/// The input wind as a vector in the global frame [m/s].
fn wind<D: Scalar>(speed: D, direction: D) -> [D; 2] {
    let (sin, cos) = direction.sin_cos();
    [speed * cos, speed * sin]
}

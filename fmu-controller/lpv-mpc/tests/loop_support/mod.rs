//! Closed loops whose plant is known exactly: the controller's own nonlinear equations, integrated finely.
#![allow(dead_code, reason = "every test binary uses its own part")]
#![allow(clippy::unwrap_used, reason = "a test may panic, in its helpers too")]
#![allow(clippy::cast_possible_truncation, reason = "counts of steps of a few seconds")]

use lpv_mpc::model::{Disturbance, E_PSI, E_Y, Input, State, Tyres, V_X, V_Y, YAW_RATE, derivative};
use lpv_mpc::preview::Preview;
use lpv_mpc::{Controller, Inputs, Parameters};

/// Car and road of a test.
pub struct Loop {
    /// What the controller is told, the car being so.
    pub parameters: Parameters,
    /// Curvature over time, since the wanted speed is constant [1/m].
    pub kappa: fn(f64) -> f64,
    /// Wanted speed, and that at the beginning [m/s].
    pub speed: f64,
    /// The car's tyres.
    pub tyres: Tyres,
    /// What the model of the controller does not know.
    pub disturbance: Disturbance,
    /// Communication step [s].
    pub h: f64,
    /// State of the car.
    pub x: State,
}

impl Loop {
    pub fn new(parameters: Parameters, kappa: fn(f64) -> f64) -> Self {
        let tyres = parameters.nominal_tyres();
        let speed = 15.0;
        let x = State::from([speed, 0.0, 0.0, 0.0, 0.0]);
        Self { parameters, kappa, speed, tyres, disturbance: Disturbance::zeros(), h: 0.001, x }
    }

    pub fn inputs(&self, t: f64, x: &State) -> Inputs {
        let t_s = self.parameters.t_s;
        Inputs {
            v_x: x[V_X],
            v_y: x[V_Y],
            yaw_rate: x[YAW_RATE],
            e_y: x[E_Y],
            e_psi: x[E_PSI],
            kappa_ref: Preview::from_fn(|i, _| (self.kappa)(t + i as f64 * t_s)),
            v_x_ref: Preview::repeat(self.speed),
            ..Inputs::default()
        }
    }

    /// Drives for `duration` [s] and shows every communication point: time, true state, controller after its step.
    pub fn drive(
        &mut self,
        duration: f64,
        mut measure: impl FnMut(f64, &State) -> State,
        mut see: impl FnMut(f64, &State, &Controller),
    ) {
        let mut controller = Controller::new(self.parameters.clone(), 0.0).unwrap();
        let body = self.parameters.body();
        let steps = (duration / self.h).round() as usize;
        for k in 0..steps {
            let t = k as f64 * self.h;
            let applied = Input::from([controller.output().delta, controller.output().a_x]);
            let measured = measure(t, &self.x);
            controller.advance(t, self.h, &self.inputs(t, &measured)).unwrap();
            // Classic Runge-Kutta in millisecond steps: its error at 25 1/s is (0.025)^5 / 120 a step, below 1e-10.
            let pieces = (self.h / 0.001).round().max(1.0) as usize;
            let dt = self.h / pieces as f64;
            for j in 0..pieces {
                let now = t + j as f64 * dt;
                let f = |x: &State, at: f64| {
                    derivative(x, &applied, (self.kappa)(at), &body, &self.tyres, &self.disturbance)
                };
                let k1 = f(&self.x, now);
                let k2 = f(&(self.x + k1 * (dt / 2.0)), now + dt / 2.0);
                let k3 = f(&(self.x + k2 * (dt / 2.0)), now + dt / 2.0);
                let k4 = f(&(self.x + k3 * dt), now + dt);
                self.x += (k1 + (k2 + k3) * 2.0 + k4) * (dt / 6.0);
            }
            see(t + self.h, &self.x, &controller);
        }
    }

    pub fn worst_e_y(&mut self, duration: f64, after: f64) -> f64 {
        let mut worst: f64 = 0.0;
        self.drive(
            duration,
            |_, x| *x,
            |t, x, _| {
                if t > after {
                    worst = worst.max(x[E_Y].abs());
                }
            },
        );
        worst
    }
}

/// Left and right turns at 0.3 of gravity at 15 m/s.
pub fn slalom(t: f64) -> f64 {
    0.013 * (t * 2.0).sin()
}

pub fn turn(t: f64) -> f64 {
    // A ramp over one second: a car cannot follow a step of the curvature.
    0.013 * t.clamp(0.0, 1.0)
}

pub fn straight(_: f64) -> f64 {
    0.0
}

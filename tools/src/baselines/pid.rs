//! Speed by proportional, integral and derivative action, as the paper's comparison does it.

use lpv_mpc::Parameters;

/// Gains of the speed controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Acceleration per speed error [1/s].
    pub proportional: f64,
    /// Acceleration per integrated speed error [1/s2].
    pub integral: f64,
    /// Acceleration per rate of the speed error [1].
    pub derivative: f64,
}

impl Gains {
    /// Largest gains that the search may take, in the order of the fields.
    ///
    /// 5/s closes the loop at 0.8 Hz: drives and brakes with a time constant of 0.1 s then keep a phase margin of 60 degrees,
    /// which faster loops on paper would not leave a real car.
    pub const BOX: [f64; 3] = [5.0, 5.0, 0.5];

    /// Found by particle swarm on the general track in its wind: `cargo fmu report --tune-pid`, seed 1, 400 evaluations.
    pub const TUNED: Self = Self { proportional: 5.0, integral: 5.0, derivative: 0.0225 };
}

/// Discrete PID controller with bounded output; the integral stops where the output is at its bound.
#[derive(Clone, Debug)]
pub struct Pid {
    gains: Gains,
    t_s: f64,
    /// Bounds of the acceleration [m/s2] and of its change per sample [m/s2].
    a_x_min: f64,
    a_x_max: f64,
    step_max: f64,
    /// Integrated error [m].
    integral: f64,
    /// Error of the last sample [m/s].
    last: Option<f64>,
    a_x: f64,
}

impl Pid {
    /// A controller with the bounds and the period of the predictive one.
    pub fn new(gains: Gains, p: &Parameters) -> Self {
        Self {
            gains,
            t_s: p.t_s,
            a_x_min: p.a_x_min,
            a_x_max: p.a_x_max,
            step_max: p.a_x_rate_max * p.t_s,
            integral: 0.0,
            last: None,
            a_x: 0.0,
        }
    }

    /// Acceleration [m/s2] at a speed error, wanted minus measured [m/s].
    pub fn accelerate(&mut self, error: f64) -> f64 {
        let Gains { proportional, integral, derivative } = self.gains;
        let rate = (error - self.last.unwrap_or(error)) / self.t_s;
        self.last = Some(error);
        let summed = self.integral + error * self.t_s;
        let wanted = proportional * error + integral * summed + derivative * rate;
        let bounded = wanted.clamp(self.a_x_min, self.a_x_max);
        // Windup: an error that pushes further into the bound must not be remembered.
        if bounded == wanted || (wanted - bounded) * error < 0.0 {
            self.integral = summed;
        }
        self.a_x += (bounded - self.a_x).clamp(-self.step_max, self.step_max);
        self.a_x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integral_removes_the_error_that_a_constant_resistance_leaves() {
        let p = Parameters::default();
        let mut pid = Pid::new(Gains { proportional: 2.0, integral: 1.0, derivative: 0.0 }, &p);
        let (mut v, resistance) = (0.0, -1.5);
        for _ in 0..3000 {
            v += (pid.accelerate(10.0 - v) + resistance) * p.t_s;
        }
        assert!((v - 10.0).abs() < 1e-9, "{v} m/s");
        // And the integral holds exactly what balances the resistance.
        assert!((pid.accelerate(10.0 - v) - 1.5).abs() < 1e-6);
    }

    #[test]
    fn integral_stops_at_the_bound() {
        let p = Parameters::default();
        let mut pid = Pid::new(Gains { proportional: 1.0, integral: 1.0, derivative: 0.0 }, &p);
        for _ in 0..1000 {
            assert!(pid.accelerate(50.0) <= p.a_x_max);
        }
        // 33 s at an error of 50 m/s would have summed to 1650 m.
        assert!(pid.integral < 5.0, "{} m", pid.integral);
    }
}

//! A steering law behind the controller's own clock: sampled at `t_s`, held in between, within the same bounds.

use anyhow::Result;
use lpv_mpc::{Inputs, Parameters, Status};

use super::Pid;
use crate::simulate::native::{Driver, Shown};

/// Fraction of a period by which times may differ and still be one: importers add up steps in floating point.
const SAME_SAMPLE: f64 = 1e-6;

/// Steers by what it sees.
pub trait Law {
    /// Steering angle [rad] for what is `seen`, when it acts `latency` [s] later and `delta` [rad] acts until then.
    fn steer(&mut self, seen: &Inputs, latency: f64, delta: f64) -> f64;
}

/// A steering law and a speed controller as a driver.
#[derive(Clone, Debug)]
pub struct Sampled<L> {
    law: L,
    speed: Pid,
    t_s: f64,
    samples: u64,
    /// Bounds of the steering angle [rad] and of its change per sample [rad].
    delta_max: f64,
    step_max: f64,
    delta: f64,
    a_x: f64,
    /// Nominal stiffnesses, which is what these laws believe in [N/rad].
    tyres: [f64; 2],
}

impl<L> Sampled<L> {
    /// A driver with the bounds and the period of the predictive controller.
    pub fn new(p: &Parameters, law: L, speed: Pid) -> Self {
        Self {
            law,
            speed,
            t_s: p.t_s,
            samples: 0,
            delta_max: p.delta_max,
            step_max: p.delta_rate_max * p.t_s,
            delta: 0.0,
            a_x: 0.0,
            tyres: [p.c_f_nominal, p.c_r_nominal],
        }
    }
}

impl<L: Law> Driver for Sampled<L> {
    fn advance(&mut self, t: f64, h: f64, seen: &Inputs) -> Result<()> {
        let end = t + h - SAME_SAMPLE * self.t_s.min(h);
        while self.samples as f64 * self.t_s < end {
            self.samples += 1;
            let wanted = self.law.steer(seen, h, self.delta).clamp(-self.delta_max, self.delta_max);
            self.delta += (wanted - self.delta).clamp(-self.step_max, self.step_max);
            self.a_x = self.speed.accelerate(seen.v_x_ref[0] - seen.v_x);
        }
        Ok(())
    }

    fn shown(&self) -> Shown {
        Shown {
            delta: self.delta,
            a_x: self.a_x,
            c_f: self.tyres[0],
            c_r: self.tyres[1],
            status: Status::Optimal,
            iterations: 0,
            kkt_residual: 0.0,
            slack_e_y: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::Gains;

    struct Count(u32);

    impl Law for Count {
        fn steer(&mut self, _seen: &Inputs, _latency: f64, _delta: f64) -> f64 {
            self.0 += 1;
            f64::from(self.0)
        }
    }

    #[test]
    fn samples_do_not_depend_on_the_communication_step() {
        let p = Parameters::default();
        for (h, steps) in [(0.001, 330), (0.033, 10), (0.066, 5), (0.1, 3)] {
            let mut driver = Sampled::new(&p, Count(0), Pid::new(Gains::TUNED, &p));
            for k in 0..steps {
                driver.advance(f64::from(k) * h, h, &Inputs::default()).unwrap();
            }
            // Samples at 0, 33, .. 297 ms; the last case sees 300 ms in all.
            assert_eq!(driver.law.0, 10, "steps of {h} s");
        }
    }

    #[test]
    fn steering_moves_no_faster_than_its_rate() {
        let p = Parameters::default();
        let mut driver = Sampled::new(&p, Count(0), Pid::new(Gains::TUNED, &p));
        driver.advance(0.0, p.t_s, &Inputs::default()).unwrap();
        assert!((driver.shown().delta - p.delta_rate_max * p.t_s).abs() < 1e-15);
        for k in 1..100 {
            driver.advance(f64::from(k) * p.t_s, p.t_s, &Inputs::default()).unwrap();
        }
        assert!((driver.shown().delta - p.delta_max).abs() < 1e-12);
    }
}

//! What a user would otherwise pick, in the same loop as the predictive controller: same plant, same signals, same bounds.
//!
//! | baseline | steering | uses of what it is given | latency |
//! |---|---|---|---|
//! | [`LinearMpc`], fixed speed | MPC on the linear bicycle at one speed | state, path's yaw rate ahead | state predicted over the step |
//! | [`LinearMpc`], measured speed | the same, linearised anew at each sample | state, path's yaw rate ahead | state predicted over the step |
//! | [`Stanley`] | front axle's position and heading | state, curvature now | none: it has no model to predict with |
//! | [`PurePursuit`] | arc to a point ahead | position, curvature and speed ahead | none |
//!
//! All of them leave the speed to the same PID controller ([`Pid`]), tuned by particle swarm as in the paper. The first one is
//! the paper's comparison; the second is what a fair opponent would do. None of them knows the wind, as ours does not.
//!
//! # References
//! - \[Hoffmann\] G. M. Hoffmann, C. J. Tomlin, M. Montemerlo, S. Thrun: Autonomous automobile trajectory tracking for off-road
//!   driving, American Control Conference 2007.
//! - \[Coulter\] R. C. Coulter: Implementation of the pure pursuit path tracking algorithm, CMU-RI-TR-92-01, 1992.
//! - \[Rajamani\] R. Rajamani: Vehicle Dynamics and Control, 2nd edition, 2012, section 2.5: path errors of the linear bicycle.

mod linear_mpc;
mod pid;
mod pure_pursuit;
mod sampled;
mod stanley;

pub use linear_mpc::{LinearMpc, Linearisation};
pub use pid::{Gains, Pid};
pub use pure_pursuit::PurePursuit;
pub use sampled::{Law, Sampled};
pub use stanley::Stanley;

use lpv_mpc::Parameters;
use vehicle::Road;

use crate::simulate::native::Driver;

/// The baselines by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Baseline {
    /// The paper's comparison: linear MPC at one speed, and PID.
    LinearFixed,
    /// Linear MPC at the measured speed, and PID.
    LinearMeasured,
    /// Stanley's law, and PID.
    Stanley,
    /// Pure pursuit, and PID.
    PurePursuit,
}

impl Baseline {
    /// All of them, the paper's first.
    pub const ALL: [Self; 4] = [Self::LinearFixed, Self::LinearMeasured, Self::Stanley, Self::PurePursuit];

    /// Name for tables and legends.
    pub fn name(self) -> &'static str {
        match self {
            Self::LinearFixed => "LMPC + PID",
            Self::LinearMeasured => "LMPC at measured speed + PID",
            Self::Stanley => "Stanley + PID",
            Self::PurePursuit => "pure pursuit + PID",
        }
    }

    /// The baseline for a road, with the beliefs, weights and bounds of the predictive controller.
    pub fn driver(self, p: &Parameters, road: &Road) -> Box<dyn Driver> {
        self.with_gains(p, road, Gains::TUNED)
    }

    /// The same with other gains of the speed.
    pub fn with_gains(self, p: &Parameters, road: &Road, gains: Gains) -> Box<dyn Driver> {
        let speed = Pid::new(gains, p);
        match self {
            Self::LinearFixed => {
                Box::new(Sampled::new(p, LinearMpc::new(p, Linearisation::Fixed(fixed_speed(road))), speed))
            }
            Self::LinearMeasured => Box::new(Sampled::new(p, LinearMpc::new(p, Linearisation::Measured), speed)),
            Self::Stanley => Box::new(Sampled::new(p, Stanley::new(p), speed)),
            Self::PurePursuit => Box::new(Sampled::new(p, PurePursuit::new(p), speed)),
        }
    }
}

/// Speed at which the linear bicycle of a road is linear [m/s]: midway between the mean and the highest.
///
/// On the general track 14 m/s, the mean, would be the better model most of the time, but that controller spins at 25 m/s; from
/// 18 m/s on it survives, and the higher the speed the larger its errors (measured in steps of 2 m/s).
fn fixed_speed(road: &Road) -> f64 {
    /// Places at which the highest speed is looked for.
    const PLACES: u32 = 1000;
    let mean = road.length() / road.duration();
    let place = |i: u32| road.length() * f64::from(i) / f64::from(PLACES);
    let highest = (0..=PLACES).map(|i| road.speed(place(i))).fold(0.0, f64::max);
    0.5 * (mean + highest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_road_of_one_speed_has_that_speed() {
        let p = vehicle::Parameters { speed: 13.0, ..vehicle::Parameters::default() };
        let speed = fixed_speed(&Road::named("double_lane_change", &p).unwrap());
        assert!((speed - 13.0).abs() < 1e-9, "{speed} m/s");
    }
}

//! The way back of a car that is far off its path.
//!
//! A plan whose reference is the path itself asks a car that stands 3 m beside it for all that steering and tyres give, and
//! for the opposite on arrival: at speed the rate limit of the steering turns that into a spin. So the reference starts where
//! the car is and comes back with a moderate share of the grip, and a car that heads away from the path is slowed down.
//! Near the path nothing of this acts.

use crate::latency::Predicted;
use crate::model::{E_PSI, E_Y, V_X, V_Y};
use crate::parameters::{HORIZON_MAX, Parameters};

/// Share of the grip that the way back uses sideways [1]: the rest keeps the car on it in a curve.
const SIDEWAYS: f64 = 0.4;

/// Share of the grip that brakes a car on its way off the path [1]: with the above, 0.9 of it is used.
const BRAKING: f64 = 0.8;

/// Sine of the largest angle at which the way back meets the path [1]: a steeper way is hardly shorter, and a car that slows
/// down on it would turn ever more across.
const COURSE_MAX: f64 = 0.6;

/// How quickly the car takes up the speed that leads it back [s]: a few times the lag of a car's yaw response.
const TAKE_UP: f64 = 0.2;

/// Share of the largest speed across the path from which the car still stops on it [1]: the rest is for the yaw response.
/// With these, `cargo fmu robustness --case far_start` returns from all of its fifteen starts; with
/// [`SIDEWAYS`] 0.2 or [`BRAKING`] 0.6 two of them miss it. With 0.6 there, 0.9 in braking, 0.6 or 1 here, half and twice
/// [`TAKE_UP`] and [`LAST_RATE`], and 0.3 or 0.8 of [`COURSE_MAX`] all of them return.
const APPROACH: f64 = 0.8;

/// Rate of the last part of the way back [1/s]: about that of the lateral error's own loop with the default weights.
const LAST_RATE: f64 = 2.0;

/// Distance over which a car that heads away from the path should be able to turn back [m]: half a lane.
const TURN_BACK: f64 = 1.5;

/// The car is not slowed down below this [m/s]: it has to move to come back.
const PACE_MIN: f64 = 3.0;

/// Reference across the path at the stages' ends.
#[derive(Clone, Copy, Debug)]
pub struct Recovery {
    /// Lateral error [m] and its rate [m/s].
    way: [(f64, f64); HORIZON_MAX],
    /// How far the path itself still counts, from 1 beside it to 0 far off [1].
    pub path: f64,
    /// Speed that is low enough for the way back [m/s].
    pub pace: f64,
    /// By how much the soft bound gives way [m].
    pub room: f64,
}

impl Recovery {
    /// The way back from the beginning of a plan on a road of friction `mu` [1]; `None` near the path.
    pub fn new(at: &Predicted, mu: f64, p: &Parameters) -> Option<Self> {
        let x = &at.x;
        let speed = x[V_X].hypot(x[V_Y]).max(PACE_MIN);
        let (mut e, mut rate) = (x[E_Y], x[V_X] * x[E_PSI].sin() + x[V_Y] * x[E_PSI].cos());
        let course = (rate / speed).abs().min(1.0);
        let sideways = SIDEWAYS * mu * p.g;
        // Across the path a car on a steep course is slowed down by its brakes rather than by its steering.
        let braked = sideways * (1.0 - course * course).sqrt() + BRAKING * mu * p.g * course;
        // How far it gets before it can turn back.
        let away = if e * rate < 0.0 { 0.0 } else { rate * rate / (2.0 * braked) };
        let far = ((e.abs() + away) / p.e_y_max - 1.0).clamp(0.0, 1.0);
        // Fades in between one and two bounds, so that the reference does not jump; not for what is no number.
        let weight = far * far * (3.0 - 2.0 * far);
        if !(weight > 0.0 && p.grip_max > 0.0) {
            return None;
        }
        let turn_back = (2.0 * sideways * e.abs().max(TURN_BACK)).sqrt();
        let mut way = [(0.0, 0.0); HORIZON_MAX];
        let mut room: f64 = 0.0;
        for slot in &mut way {
            let fastest =
                (LAST_RATE * e.abs()).min(APPROACH * (2.0 * sideways * e.abs()).sqrt()).min(COURSE_MAX * speed);
            let wanted = -e.signum() * fastest;
            // What turns towards the path brakes where the car goes away from it.
            let most = if wanted * rate < 0.0 { braked } else { sideways };
            let change = ((wanted - rate) / TAKE_UP).clamp(-most, most) * p.t_s;
            e += (rate + 0.5 * change) * p.t_s;
            rate += change;
            *slot = (weight * e, weight * rate);
            room = room.max(weight * e.abs());
        }
        Some(Self { way, path: 1.0 - weight, pace: (turn_back / course).max(PACE_MIN) / weight, room })
    }

    /// Lateral error [m] and heading error [rad] to add to the reference at the end of stage `i`, driven at `v_x` [m/s].
    pub fn at(&self, i: usize, v_x: f64) -> (f64, f64) {
        let (e, rate) = self.way[i];
        (e, (rate / v_x.max(PACE_MIN)).clamp(-1.0, 1.0).asin())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Input, State};

    fn at(v_x: f64, e_y: f64, e_psi: f64) -> Predicted {
        Predicted { x: State::from([v_x, 0.0, 0.0, e_y, e_psi]), distance: 0.0, actual: Input::zeros() }
    }

    #[test]
    fn near_the_path_nothing_acts() {
        let p = Parameters::default();
        for (e_y, e_psi) in [(0.0, 0.0), (0.29, 0.0), (-0.29, 0.0), (0.1, 0.05)] {
            assert!(Recovery::new(&at(14.0, e_y, e_psi), p.mu, &p).is_none(), "{e_y} {e_psi}");
        }
        assert!(Recovery::new(&at(14.0, f64::NAN, 0.0), p.mu, &p).is_none());
        assert!(Recovery::new(&at(14.0, 3.0, 0.0), p.mu, &Parameters::paper()).is_none(), "the paper has no way back");
    }

    #[test]
    fn the_way_back_is_smooth_ends_on_the_path_and_mirrors() {
        let p = Parameters { t_s: 0.1, ..Parameters::default() };
        let (left, right) = (at(14.0, 3.0, 0.0), at(14.0, -3.0, 0.0));
        let (left, right) = (Recovery::new(&left, p.mu, &p).unwrap(), Recovery::new(&right, p.mu, &p).unwrap());
        let mut rate = 0.0;
        for i in 0..HORIZON_MAX {
            let (e_y, e_psi) = left.at(i, 14.0);
            assert_eq!(right.at(i, 14.0), (-e_y, -e_psi));
            let acceleration = (left.way[i].1 - rate) / p.t_s;
            rate = left.way[i].1;
            assert!(acceleration.abs() <= SIDEWAYS * p.mu * p.g + 1e-9, "stage {i}: {acceleration}");
            // The last metre is a second-order response with damping 0.79, which overshoots by 2 %; coarse steps add to it.
            assert!((-0.05..=3.0).contains(&e_y), "it overshoots: {e_y}");
        }
        // Four seconds: the last 0.1 m fade at LAST_RATE.
        assert!(left.at(HORIZON_MAX - 1, 14.0).0 < 0.1);
    }

    #[test]
    fn a_car_that_heads_away_is_slowed_down_and_one_that_comes_back_gently_is_not() {
        let p = Parameters::default();
        let away = Recovery::new(&at(15.0, 0.0, 1.0), p.mu, &p).unwrap();
        assert!(away.pace < 5.0, "{}", away.pace);
        let gentle = Recovery::new(&at(15.0, 3.0, -0.1), p.mu, &p).unwrap();
        assert!(gentle.pace > 15.0, "{}", gentle.pace);
    }
}

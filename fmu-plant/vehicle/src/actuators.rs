//! Actuators between command and wheel: position limit, pure delay, first-order lag and rate limit.
//!
//! Commands are linear in time between changes, so the motion of an actuator is a chain of straight and exponential
//! pieces. Each piece is solved in closed form and its end is known; the integrator never steps across one. That makes
//! delay and rate limit exact for any communication step.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

/// Times closer than this are the same time: rounding of summed steps, far below any effect on the motion [s].
const SAME_TIME: f64 = 1e-10;

/// Parts of a delay that keep a change of the command each when there are more changes than room: a delay of 1 s then
/// follows its command at most 0.5 ms late.
const RESOLUTION: u16 = 2048;

/// Changes of the command that a delay remembers exactly: 1 s of them at a communication step of 0.25 ms. Thinning leaves
/// at most two in each part, the one that acts, and one at either end.
const CAPACITY: usize = 2 * RESOLUTION as usize + 4;

/// Constants of one actuator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actuator {
    /// Pure delay [s].
    pub delay: f64,
    /// Time constant of the lag, 0 for none [s].
    pub tau: f64,
    /// Largest rate, 0 for none [unit/s].
    pub rate_max: f64,
    /// Smallest position [unit].
    pub min: f64,
    /// Largest position [unit].
    pub max: f64,
}

impl Actuator {
    /// How much of a small change of the command `value` reaches the position at once: 1, or 0 behind a delay, a lag, a
    /// rate limit or a position limit.
    #[must_use]
    pub fn gain(&self, value: f64) -> f64 {
        let direct = self.delay == 0.0 && self.tau == 0.0 && self.rate_max == 0.0;
        f64::from(u8::from(direct && value > self.min && value < self.max))
    }
}

/// A command that is linear in time.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Ramp {
    /// Value at the start [unit].
    pub value: f64,
    /// Rate of change [unit/s].
    pub slope: f64,
}

/// How the position moves until the end of a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Piece {
    /// At a constant rate.
    Straight(Ramp),
    /// Along `ramp` plus a decaying exponential of this amplitude, with the time constant `tau`.
    Decay {
        /// What remains when the exponential has died away.
        ramp: Ramp,
        /// Amplitude of the exponential at the start [unit].
        amplitude: f64,
        /// Time constant [s].
        tau: f64,
    },
}

impl Piece {
    /// Position at `t` seconds after the start of the piece.
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        match *self {
            Self::Straight(Ramp { value, slope }) => value + slope * t,
            Self::Decay { ramp, amplitude, tau } => ramp.value + ramp.slope * t + amplitude * (-t / tau).exp(),
        }
    }

    /// Rate of the position at the start of the piece.
    #[must_use]
    pub fn rate(&self) -> f64 {
        match *self {
            Self::Straight(Ramp { slope, .. }) => slope,
            Self::Decay { ramp, amplitude, tau } => ramp.slope - amplitude / tau,
        }
    }

    /// Whether the position stands still over the piece.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        matches!(self, Self::Straight(Ramp { slope, .. }) if *slope == 0.0)
    }
}

/// Position and memory of one actuator.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Position reached [unit].
    pub position: f64,
    /// Commands not yet replaced at the far end of the delay, with their times, oldest first.
    history: VecDeque<(f64, Ramp)>,
}

impl Clone for State {
    /// Keeps the room for commands to come, so that no later step allocates.
    fn clone(&self) -> Self {
        let mut history = VecDeque::with_capacity(self.history.capacity());
        history.extend(&self.history);
        Self { position: self.position, history }
    }
}

impl State {
    /// At rest in position 0.
    #[must_use]
    pub fn new(actuator: &Actuator) -> Self {
        let mut state = Self { position: 0.0, history: VecDeque::new() };
        state.make_room(actuator);
        state
    }

    /// Makes room for all commands to come, so that no step allocates.
    pub(crate) fn make_room(&mut self, actuator: &Actuator) {
        if actuator.delay > 0.0 {
            self.history.reserve_exact(CAPACITY.saturating_sub(self.history.len()));
        }
    }

    /// Takes the command that holds from `time` on.
    pub fn command(&mut self, actuator: &Actuator, time: f64, command: Ramp) {
        if actuator.delay == 0.0 {
            return;
        }
        // What every part of the delay line has already forgotten: an entry whose successor has come through.
        while self.history.len() > 1 && self.history[1].0 + actuator.delay <= time + SAME_TIME {
            self.history.pop_front();
        }
        if let Some((_, last)) = self.history.back()
            && last.slope == 0.0
            && *last == command
        {
            return;
        }
        if self.history.len() >= CAPACITY {
            self.thin(actuator.delay / f64::from(RESOLUTION));
        }
        self.history.push_back((time, command));
    }

    /// Forgets each command that was replaced within `resolution` after the one kept before it, which holds on instead.
    ///
    /// Dropping by age or by turns was rejected: a stream of new commands would drop the same old ones again and again
    /// until nothing is left that acts before the whole stream has come through. The oldest and the newest stay.
    fn thin(&mut self, resolution: f64) {
        let mut kept = 0;
        for next in 2..self.history.len() {
            if self.history[next].0 - self.history[kept].0 > resolution {
                kept += 1;
                self.history[kept] = self.history[next - 1];
            }
        }
        let newest = self.history.len() - 1;
        self.history.swap(kept + 1, newest);
        self.history.truncate(kept + 2);
    }

    /// The command at the end of the delay at `time`, and how long it stays linear [s].
    fn delayed(&self, actuator: &Actuator, time: f64, now: Ramp) -> (Ramp, f64) {
        if actuator.delay == 0.0 {
            return (now, f64::INFINITY);
        }
        let sent = time - actuator.delay;
        let next = self.history.partition_point(|&(start, _)| start <= sent + SAME_TIME);
        let current = next.checked_sub(1).map_or_else(Ramp::default, |acting| {
            let (start, Ramp { value, slope }) = self.history[acting];
            Ramp { value: value + slope * (sent - start), slope }
        });
        (current, self.history.get(next).map_or(f64::INFINITY, |&(start, _)| start - sent))
    }

    /// The next piece from `time` on, at most `limit` seconds long, and its length [s].
    ///
    /// `now` is the command at `time` before the delay; the caller moves `position` to the end of what it uses.
    #[must_use]
    pub fn piece(&self, actuator: &Actuator, time: f64, now: Ramp, limit: f64) -> (Piece, f64) {
        let (command, until) = self.delayed(actuator, time, now);
        let (command, inside) = clamped(command, actuator.min, actuator.max);
        let limit = limit.min(until).min(inside);
        let (piece, length) = follow(actuator, self.position, command);
        (piece, limit.min(length))
    }
}

/// The command inside its limits, and how long that stays one straight piece [s].
fn clamped(command: Ramp, min: f64, max: f64) -> (Ramp, f64) {
    let Ramp { value, slope } = command;
    // A value at its limit that moves outward is already clamped; moving inward it is free.
    if value > max || (value == max && slope > 0.0) {
        let length = if slope < 0.0 { (max - value) / slope } else { f64::INFINITY };
        (Ramp { value: max, slope: 0.0 }, length.max(SAME_TIME))
    } else if value < min || (value == min && slope < 0.0) {
        let length = if slope > 0.0 { (min - value) / slope } else { f64::INFINITY };
        (Ramp { value: min, slope: 0.0 }, length.max(SAME_TIME))
    } else if slope == 0.0 {
        (command, f64::INFINITY)
    } else {
        let edge = if slope > 0.0 { max } else { min };
        (command, ((edge - value) / slope).max(SAME_TIME))
    }
}

/// Motion from `position` towards `command`, and how long its form holds [s].
fn follow(actuator: &Actuator, position: f64, command: Ramp) -> (Piece, f64) {
    let Actuator { tau, rate_max, .. } = *actuator;
    let error = command.value - position;
    if tau == 0.0 {
        if rate_max == 0.0 {
            return (Piece::Straight(command), f64::INFINITY);
        }
        // Following needs no more than the rate limit: once there, the command is tracked exactly.
        if error.abs() <= SAME_TIME * rate_max && command.slope.abs() <= rate_max {
            return (Piece::Straight(command), f64::INFINITY);
        }
        let rate = rate_max.copysign(if error.abs() > SAME_TIME * rate_max { error } else { command.slope });
        return (straight(position, rate), meeting(error, rate, command.slope));
    }
    // The lag wants the rate w = (u - p) / tau, which approaches the command's slope: w = slope + (w_0 - slope)
    // exp(-t / tau). A rate limit holds it at the limit until the wish is back inside, which never happens while the
    // command runs away faster than the limit.
    let Ramp { value, slope } = command;
    let wish = error / tau;
    let limit = if rate_max > 0.0 { rate_max } else { f64::INFINITY };
    let escapes = slope.abs() > limit;
    let at_limit = wish.abs() >= limit * (1.0 - 1e-9) && escapes && wish * slope > 0.0;
    if at_limit || wish.abs() > limit * (1.0 + 1e-12) {
        let rate = limit.copysign(wish);
        return (
            straight(position, rate),
            if at_limit { f64::INFINITY } else { meeting(error - rate * tau, rate, slope) },
        );
    }
    let ramp = Ramp { value: value - slope * tau, slope };
    let length = if escapes {
        let limit = limit.copysign(slope);
        (tau * ((slope - wish) / (slope - limit)).ln()).max(SAME_TIME)
    } else {
        f64::INFINITY
    };
    (Piece::Decay { ramp, amplitude: position - ramp.value, tau }, length)
}

fn straight(value: f64, slope: f64) -> Piece {
    Piece::Straight(Ramp { value, slope })
}

/// When a gap that one side closes at `rate` and the other opens at `slope` is gone [s].
fn meeting(gap: f64, rate: f64, slope: f64) -> f64 {
    let time = gap / (rate - slope);
    if time > 0.0 { time.max(SAME_TIME) } else { f64::INFINITY }
}

#[cfg(test)]
mod tests;

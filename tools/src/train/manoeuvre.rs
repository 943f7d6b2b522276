//! The manoeuvres that networks are trained and scored on: six classes of steering and braking, drawn from a seed.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Length of a manoeuvre [s].
pub const DURATION: f64 = 5.0;
/// Speeds of the standard set [m/s].
pub const SPEED: (f64, f64) = (5.0, 25.0);
/// Grip that the standard set reaches [1].
pub const GRIP: (f64, f64) = (0.1, 0.9);
/// Largest slip angles of the set beyond [rad]: from 90 % of grip to half as much again as where `dry_asphalt` peaks.
pub const SLIP: (f64, f64) = (0.1, 0.3);

/// Kinds of excitation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// The wheel is turned and held, then turned again.
    Step,
    /// One frequency.
    Sine,
    /// A frequency that rises.
    Sweep,
    /// Out of the lane and back.
    LaneChange,
    /// A random smooth curve.
    Spline,
    /// Braking and accelerating in a turn.
    BrakeInTurn,
}

impl Class {
    /// All classes.
    pub const ALL: [Self; 6] = [Self::Step, Self::Sine, Self::Sweep, Self::LaneChange, Self::Spline, Self::BrakeInTurn];

    /// The name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Sine => "sine",
            Self::Sweep => "sweep",
            Self::LaneChange => "lane change",
            Self::Spline => "spline",
            Self::BrakeInTurn => "braking in a turn",
        }
    }
}

/// What sets the size of the steering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Largest share of grip in use [1].
    Grip(f64),
    /// Largest slip angle of an axle [rad].
    Slip(f64),
}

/// One manoeuvre: everything but the size of the steering, which its target determines.
#[derive(Clone, Debug, PartialEq)]
pub struct Manoeuvre {
    /// Kind of excitation.
    pub class: Class,
    /// Speed at the start [m/s].
    pub v_x_0: f64,
    /// What the steering is sized for.
    pub target: Target,
    /// Friction over the plant's own [1].
    pub mu_scale: f64,
    /// Wind and where it blows to [m/s, rad].
    pub wind: (f64, f64),
    /// Seed of the sensor noise.
    pub noise: i32,
    /// Mean acceleration, and the size and frequency of its swing [m/s2, m/s2, rad/s].
    a_x: (f64, f64, f64),
    /// Numbers in 0..1 that shape the steering.
    shape: [f64; 16],
}

/// What a set of manoeuvres covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cover {
    /// Whether the slip is set, up to far beyond the peak, and not the grip.
    pub beyond: bool,
    /// Smallest and largest factor on the plant's friction [1].
    pub mu_scale: (f64, f64),
    /// Largest speed of the wind [m/s].
    pub wind: f64,
}

impl Manoeuvre {
    /// `count` manoeuvres of a seed: classes in turn, speed, amplitude and friction stratified.
    pub fn set(seed: u64, count: usize, cover: &Cover) -> Vec<Self> {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        // Irrational strides (powers of the plastic number, which spread points of several dimensions evenly) from a random
        // start cover speed, amplitude and friction better than independent draws.
        const STRIDES: [f64; 3] = [0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_4];
        let starts: [f64; 3] = std::array::from_fn(|_| rng.random());
        (0..count)
            .map(|i| {
                let strata = std::array::from_fn(|k| (starts[k] + STRIDES[k] * i as f64).fract());
                Self::draw(Class::ALL[i % Class::ALL.len()], strata, cover, &mut rng)
            })
            .collect()
    }

    fn draw(class: Class, [speed, size, friction]: [f64; 3], cover: &Cover, rng: &mut Pcg64Mcg) -> Self {
        let between = |(low, high): (f64, f64), share: f64| low + (high - low) * share;
        let v_x_0 = between(SPEED, speed);
        // Denser towards the limit, where the stiffness changes most.
        let target =
            if cover.beyond { Target::Slip(between(SLIP, size)) } else { Target::Grip(between(GRIP, size.sqrt())) };
        let brakes = class == Class::BrakeInTurn;
        let largest = if brakes { 4.0 } else { 1.0 };
        let end = between(SPEED, rng.random());
        let mean = ((end - v_x_0) / DURATION).clamp(-largest, largest);
        let swing = rng.random::<f64>() * if brakes { 5.0 } else { 1.0 };
        Self {
            class,
            v_x_0,
            target,
            mu_scale: between(cover.mu_scale, friction),
            wind: (cover.wind * rng.random::<f64>(), std::f64::consts::TAU * rng.random::<f64>()),
            noise: rng.random_range(0..i32::MAX),
            a_x: (mean, swing, between((1.0, 5.0), rng.random())),
            shape: std::array::from_fn(|_| rng.random()),
        }
    }

    /// Acceleration command at time `t` [s] and speed `v_x` [m/s], [m/s2].
    pub fn a_x(&self, t: f64, v_x: f64) -> f64 {
        let (mean, swing, frequency) = self.a_x;
        // A soft pull back to the planned speed makes up for what cornering costs.
        let planned = self.v_x_0 + mean * t;
        mean + swing * (frequency * t).sin() + 0.5 * (planned - v_x)
    }

    /// Steering at time `t` [s] over its size, about -1 to 1.
    pub fn steering(&self, t: f64) -> f64 {
        let s = &self.shape;
        let between = |low: f64, high: f64, share: f64| low + (high - low) * share;
        let side = if s[15] < 0.5 { -1.0 } else { 1.0 };
        side * match self.class {
            Class::Step => {
                let rise = between(0.08, 0.6, s[0]);
                let turn = between(1.8, 3.5, s[1]);
                smooth((t - 0.2) / rise) + (between(-1.0, 0.8, s[2]) - 1.0) * smooth((t - turn) / rise)
            }
            Class::Sine => (std::f64::consts::TAU * between(0.2, 1.2, s[0]) * t).sin(),
            Class::Sweep => {
                let (first, last) = (0.2, between(0.8, 2.2, s[0]));
                (std::f64::consts::TAU * (first * t + 0.5 * (last - first) / DURATION * t * t)).sin()
            }
            Class::LaneChange => {
                let period = between(1.0, 2.2, s[0]);
                let back = between(period + 0.3, DURATION - period, s[1]);
                pulse((t - 0.2) / period) - pulse((t - 0.2 - back) / period)
            }
            Class::Spline => {
                let every = between(0.35, 0.8, s[0]);
                let (i, share) = ((t / every).floor(), (t / every).fract());
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a knot's index, 0 to 14")]
                let knot = |k: f64| 2.0 * s[(i + k) as usize % 15] - 1.0;
                catmull_rom([knot(0.0), knot(1.0), knot(2.0), knot(3.0)], share)
            }
            Class::BrakeInTurn => {
                let rise = between(0.3, 1.0, s[0]);
                smooth((t - 0.1) / rise) * (1.0 - 0.4 * s[1] * (1.0 - (between(0.5, 2.0, s[2]) * t).cos()))
            }
        }
    }
}

/// From 0 at 0 to 1 at 1 without a kink.
fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// One period of a sine between 0 and 1, nothing outside.
fn pulse(t: f64) -> f64 {
    if (0.0..1.0).contains(&t) { (std::f64::consts::TAU * t).sin() } else { 0.0 }
}

/// The cubic through `b` at 0 and `c` at 1 with the slopes of the neighbours.
fn catmull_rom([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
}

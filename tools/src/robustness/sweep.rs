//! Largest errors over what the world does to the loop, one cause at a time: delay and lag together, noise, wind, friction,
//! speed, a patch of ice, and a car that is another than assumed.

use anyhow::Result;
use rayon::prelude::*;

use super::scenario::{Figures, Scenario};
use crate::output::Output;

/// Speed of the lane change where nothing else is said [m/s].
const SPEED: f64 = 14.0;
/// How far the assumed delay is off [s].
const WRONG: f64 = 0.02;
/// Speed at which the lane change uses all grip at friction 0.82 [m/s].
const LIMIT: f64 = 17.2;
/// Seeds of the sensor noise; the worst counts.
const SEEDS: [f64; 3] = [1.0, 2.0, 3.0];

/// One line of a sweep: how the figures change with one quantity.
#[derive(Clone, Debug)]
pub struct Series {
    /// Which sweep it belongs to.
    pub sweep: &'static str,
    /// What distinguishes it from the sweep's other series.
    pub name: &'static str,
    /// Lag of the steering, in the grids over delay and lag [s].
    pub lag: f64,
    /// What changes, with its unit.
    pub over: &'static str,
    /// Its values and what was found there.
    pub points: Vec<(f64, Figures)>,
}

/// A point to be driven: the worst of some scenarios counts.
type Point = (f64, Vec<Scenario>);

/// A series to be driven.
struct Plan {
    sweep: &'static str,
    name: &'static str,
    lag: f64,
    over: &'static str,
    points: Vec<Point>,
}

/// Names of the three grids of delay and lag, in the order of [`delay_and_lag`].
pub const GRIDS: [&str; 3] = ["delay_lag_told", "delay_lag_short", "delay_lag_long"];

/// Drives all sweeps, with `set` on top of each run's parameters; `quick` takes every second value.
///
/// # Errors
/// If a parameter is unknown or out of its range.
pub fn drive(step: f64, set: &[String], quick: bool, output: &Output) -> Result<Vec<Series>> {
    let mut plans = plans(quick);
    if quick {
        plans.iter_mut().for_each(|plan| plan.points = every_second(&plan.points));
    }
    let runs: Vec<(usize, usize)> =
        plans.iter().enumerate().flat_map(|(i, plan)| (0..plan.points.len()).map(move |j| (i, j))).collect();
    let bar = output.bar("sweeping", runs.len() as u64);
    let figures: Vec<Figures> = runs
        .par_iter()
        .map(|&(i, j)| {
            let mut worst = Figures { e_y: 0.0, speed: 0.0 };
            for scenario in &plans[i].points[j].1 {
                let run = scenario.clone().assigned(set).drive(step)?;
                worst = worst.worse(Figures::of(run.as_ref()));
            }
            bar.inc(1);
            Ok(worst)
        })
        .collect::<Result<_>>()?;
    bar.finish_and_clear();
    let mut figures = figures.into_iter();
    Ok(plans
        .into_iter()
        .map(|Plan { sweep, name, lag, over, points }| {
            let points = points.into_iter().zip(figures.by_ref()).map(|((value, _), figures)| (value, figures));
            Series { sweep, name, lag, over, points: points.collect() }
        })
        .collect())
}

/// The first, the last and every second value in between.
fn every_second(points: &[Point]) -> Vec<Point> {
    let last = points.len() - 1;
    points.iter().enumerate().filter(|(i, _)| i % 2 == 0 || *i == last).map(|(_, point)| point.clone()).collect()
}

fn plans(quick: bool) -> Vec<Plan> {
    let lags: Vec<f64> = if quick { values(0.0, 0.1, 4) } else { values(0.0, 0.05, 7) }.collect();
    let mut plans = delay_and_lag(&lags);
    plans.extend([("told", 0.0), ("20 ms too short", -WRONG), ("20 ms too long", WRONG)].map(late));
    plans.extend([
        noise(false),
        noise(true),
        gust("side wind", std::f64::consts::FRAC_PI_2),
        gust("head wind", std::f64::consts::PI),
    ]);
    plans.extend([friction(), patch(true), patch(false), speed(false), speed(true), load(), stiffness()]);
    plans
}

/// `count` values from `from` on.
fn values(from: f64, step: f64, count: u32) -> impl Iterator<Item = f64> {
    // Multiples of whole thousandths, so that tables show 0.15 and not the sum of roundings.
    (0..count).map(move |i| ((from + f64::from(i) * step) * 1e3).round() / 1e3)
}

fn plan(sweep: &'static str, name: &'static str, over: &'static str, points: impl Iterator<Item = Point>) -> Plan {
    Plan { sweep, name, lag: 0.0, over, points: points.collect() }
}

/// A grid for each assumption about the delay: told, too short, too long.
fn delay_and_lag(lags: &[f64]) -> Vec<Plan> {
    let grid = |sweep, error: f64| {
        lags.iter().map(move |&lag| {
            let points = values(0.0, 0.025, 11).map(move |delay| {
                let assumed = (delay + error).max(0.0);
                (delay, vec![Scenario::lane_change(SPEED).slowed(lag, delay, assumed)])
            });
            Plan { lag, ..plan(sweep, "lane change at 14 m/s", "delay [s]", points) }
        })
    };
    GRIDS.into_iter().zip([0.0, -WRONG, WRONG]).flat_map(|(sweep, error)| grid(sweep, error)).collect()
}

/// Late commands on the general track, whose 25 m/s leave less margin than the lane change.
fn late((name, error): (&'static str, f64)) -> Plan {
    let points = values(0.0, 0.05, 6)
        .map(move |delay| (delay, vec![Scenario::on("general").slowed(0.05, delay, (delay + error).max(0.0))]));
    plan("late", name, "delay [s]", points)
}

/// Noisier sensors than the filter assumes, and as noisy as it is told.
fn noise(told: bool) -> Plan {
    let points = values(0.0, 0.5, 9).map(move |scale| {
        let run = |seed: f64| {
            let assumed = if told { scale.max(1.0) } else { 1.0 };
            Scenario::lane_change(SPEED).with(&[
                ("plant.noise_scale", scale),
                ("plant.seed", seed),
                ("controller.sensor_noise", assumed),
            ])
        };
        (scale, SEEDS.map(run).into())
    });
    plan("noise", if told { "told" } else { "1 assumed" }, "noise [1]", points)
}

/// A gust in the first lane change that lasts through the second.
fn gust(name: &'static str, direction: f64) -> Plan {
    let points = values(0.0, 5.0, 11).map(move |wind| {
        let scenario = Scenario::lane_change(SPEED).with(&[
            ("plant.gust_start", 4.0),
            ("plant.gust_rise", 0.1),
            ("plant.gust_hold", 3.0),
            ("plant.gust_speed", wind),
            ("plant.gust_direction", direction),
        ]);
        (wind, vec![scenario])
    });
    plan("wind", name, "wind [m/s]", points)
}

/// The same share of what friction permits, with friction seen.
fn friction() -> Plan {
    let points = values(0.2, 0.1, 10).map(|mu: f64| {
        let speed = 0.8 * LIMIT * (mu / 0.82).sqrt();
        (mu, vec![Scenario::lane_change(speed).with(&[("plant.mu", mu)])])
    });
    plan("friction", "lane change at 0.8 of the limit", "friction [1]", points)
}

/// Friction that falls between the two lane changes.
fn patch(seen: bool) -> Plan {
    let points = values(0.2, 0.1, 9).map(move |mu| {
        let scenario = Scenario::lane_change(SPEED).with(&[
            ("plant.patch_start", 90.0),
            ("plant.patch_length", 1e3),
            ("plant.patch_mu", mu),
        ]);
        (mu, vec![if seen { scenario } else { scenario.unaware_of_friction() }])
    });
    let name = if seen { "patch in the preview" } else { "patch not seen" };
    plan("patch", name, "friction of the patch over the road's [1]", points)
}

fn speed(slow_steering: bool) -> Plan {
    let points = values(8.0, 1.0, 13).map(move |speed| {
        let scenario = Scenario::lane_change(speed);
        let rates = [("plant.delta_rate_max", 0.5), ("controller.delta_rate_max", 0.5)];
        (speed, vec![if slow_steering { scenario.with(&rates) } else { scenario }])
    });
    let name = if slow_steering { "steering of 0.5 rad/s" } else { "steering of 0.8 rad/s" };
    plan("speed", name, "speed [m/s]", points)
}

/// What the sweeps of the car itself change.
const BELIEF: &str = "the car's value over the assumed one [1]";

/// A car that is lighter or heavier than the controller assumes, with its yaw inertia.
fn load() -> Plan {
    let p = vehicle::Parameters::default();
    let points = values(0.6, 0.1, 9).map(move |factor| {
        (factor, vec![Scenario::lane_change(SPEED).with(&[("plant.m", factor * p.m), ("plant.i_z", factor * p.i_z)])])
    });
    plan("belief", "mass and yaw inertia", BELIEF, points)
}

/// Tyres that are softer or stiffer than those of the network, with the same grip.
fn stiffness() -> Plan {
    let p = vehicle::Parameters::default();
    let points = values(0.6, 0.1, 9).map(move |factor| {
        let tyres = [("plant.tyre_b_f", factor * p.tyre_b_f), ("plant.tyre_b_r", factor * p.tyre_b_r)];
        (factor, vec![Scenario::lane_change(SPEED).assigned(&["plant.tyre=custom".to_owned()]).with(&tyres)])
    });
    plan("belief", "cornering stiffness", BELIEF, points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarser_grids_keep_their_ends() {
        for (fine, coarse) in plans(false).iter().filter(|plan| plan.lag == 0.0).zip(plans(true)).take(1) {
            let coarse = every_second(&coarse.points);
            assert_eq!((coarse[0].0, coarse[coarse.len() - 1].0), (0.0, 0.25));
            assert_eq!(coarse.len(), fine.points.len().div_ceil(2));
        }
        let lags = |quick| -> Vec<f64> {
            plans(quick).iter().filter(|plan| plan.sweep == GRIDS[0]).map(|plan| plan.lag).collect()
        };
        assert_eq!(lags(true), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(lags(false), [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3]);
    }

    #[test]
    fn a_sweep_shows_what_its_runs_did() {
        // At a whole sample of latency the quick sweeps are cheap; one point of them driven by hand.
        let quiet = Output { quiet: true };
        let all = drive(0.033, &["controller.horizon=20".to_owned()], true, &quiet).unwrap();
        let speed = all.iter().find(|series| series.name == "steering of 0.8 rad/s").unwrap();
        let (value, found) = speed.points[1];
        let run = Scenario::lane_change(value).with(&[("controller.horizon", 20.0)]).drive(0.033).unwrap();
        assert_eq!(found, Figures::of(run.as_ref()));
        assert!(found.e_y > 0.0 && found.e_y < 1.0, "{} m at {value} m/s", found.e_y);
    }
}

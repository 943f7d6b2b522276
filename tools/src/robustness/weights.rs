//! Are the default weights good ones? The default, the paper's and the default's neighbours over one ensemble of situations.
//!
//! A situation draws its delay, the error of the assumed delay, the lag, noise, friction, speed and wind independently; the
//! same situations serve every set. The score of a run is the sum of its largest lateral, heading and speed errors, each over
//! the one that the paper claims for its best controller, cut at [`LOST`]; the score of a set is the geometric mean over the
//! situations, so that no single situation decides. How much the steering moves is shown beside it: a lower score that is
//! bought with a restless wheel is no better set.

use std::f64::consts::PI;

use anyhow::Result;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::Args;
use super::scenario::Scenario;
use crate::archive::write_whole;
use crate::output::{Output, table};
use crate::recording::{PAPER, Recording, Tracking};
use crate::workspace::shown;

/// Score of a run that left the road: that of a lateral error of 2.3 m, the paper's times a hundred.
const LOST: f64 = 100.0;
/// Situations; `--quick` takes a quarter.
const SITUATIONS: usize = 48;
/// Speed at which the lane change uses all grip at friction 0.82 [m/s].
const LIMIT: f64 = 17.2;
/// Weights whose neighbours are tried.
const WEIGHTS: [&str; 8] = ["q_v_x", "q_v_y", "q_yaw_rate", "q_e_y", "q_e_psi", "r_delta", "r_a_x", "terminal_factor"];

/// A set of weights as assignments.
struct Set {
    name: String,
    assignments: Vec<String>,
}

/// What a set reached.
struct Score {
    name: String,
    /// Geometric mean of the runs' scores [1].
    score: f64,
    /// Runs that left the road.
    lost: usize,
    /// Geometric mean of the largest lateral errors [m].
    e_y: f64,
    /// Mean of the steering command's root mean square rate [rad/s].
    steering: f64,
}

/// Runs the comparison.
///
/// # Errors
/// If a parameter is unknown or the result cannot be written.
pub(super) fn run(args: &Args, output: &Output) -> Result<()> {
    let situations = situations(if args.quick { SITUATIONS / 4 } else { SITUATIONS });
    let sets = sets()?;
    let bar = output.bar("driving", (sets.len() * situations.len()) as u64);
    let runs: Vec<Vec<Run>> = sets
        .par_iter()
        .map(|set| {
            situations
                .par_iter()
                .map(|situation| {
                    let scenario = situation.clone().assigned(&set.assignments).assigned(&args.set);
                    let run = Run::of(scenario.drive(args.step)?.as_ref());
                    bar.inc(1);
                    Ok(run)
                })
                .collect::<Result<_>>()
        })
        .collect::<Result<_>>()?;
    bar.finish_and_clear();
    let scores: Vec<Score> = sets.iter().zip(&runs).map(|(set, runs)| Score::new(&set.name, runs)).collect();
    report(args, &scores, situations.len(), output)?;
    for (situation, _) in situations.iter().zip(&runs[0]).filter(|(_, run)| run.score >= LOST) {
        output.line(&format!("left the road with the default: {}", situation.name));
    }
    let file = args.output.join("situations.csv");
    write_whole(&file, situations_csv(&sets, &situations, &runs).as_bytes())?;
    output.line(&format!("runs: {}", shown(&file)));
    Ok(())
}

/// Each run's score and largest lateral error.
fn situations_csv(sets: &[Set], situations: &[Scenario], runs: &[Vec<Run>]) -> String {
    let mut csv = "set,situation,score,e_y_max\n,,1,m\n".to_owned();
    for (set, runs) in sets.iter().zip(runs) {
        for (situation, Run { score, e_y, .. }) in situations.iter().zip(runs) {
            csv += &format!("{},\"{}\",{score},{e_y}\n", set.name, situation.name);
        }
    }
    csv
}

fn report(args: &Args, scores: &[Score], situations: usize, output: &Output) -> Result<()> {
    let head = ["set", "score", "over default", "left the road", "max |e_y| [cm]", "steering [deg/s]"];
    let default = scores[0].score;
    let row = |score: &Score| {
        vec![
            score.name.clone(),
            format!("{:.3}", score.score),
            format!("{:+.1} %", 100.0 * (score.score / default - 1.0)),
            score.lost.to_string(),
            format!("{:.2}", 100.0 * score.e_y),
            format!("{:.2}", score.steering.to_degrees()),
        ]
    };
    let rows: Vec<Vec<String>> =
        std::iter::once(head.map(str::to_owned).to_vec()).chain(scores.iter().map(row)).collect();
    output.line(&format!("{situations} situations; the score is 3 for the largest errors that the paper claims\n"));
    for line in table(&rows) {
        output.line(&line);
    }
    let csv = args.output.join("weights.csv");
    let lines = scores.iter().map(|s| format!("{},{},{},{},{}\n", s.name, s.score, s.lost, s.e_y, s.steering));
    let text = "set,score,lost,e_y_max,steering_rate\n,1,1,m,rad/s\n".to_owned() + &lines.collect::<String>();
    write_whole(&csv, text.as_bytes())?;
    output.line(&format!("\nscores: {}", shown(&csv)));
    Ok(())
}

/// What counts of one run.
#[derive(Clone, Copy)]
struct Run {
    score: f64,
    e_y: f64,
    steering: f64,
}

impl Run {
    fn of(run: Option<&Recording>) -> Self {
        let lost = Self { score: LOST, e_y: LOST * PAPER.e_y_max, steering: 0.0 };
        run.map_or(lost, |run| {
            let Tracking { e_y_max, e_psi_max, speed_max, .. } = Tracking::of(run);
            let sum = e_y_max / PAPER.e_y_max + e_psi_max / PAPER.e_psi_max + speed_max / PAPER.speed_max;
            // `min` takes the number when the other is NaN.
            Self { score: sum.min(LOST), e_y: e_y_max.min(lost.e_y), steering: steering_rate(run) }
        })
    }
}

impl Score {
    fn new(name: &str, runs: &[Run]) -> Self {
        let count = runs.len() as f64;
        let geometric = |value: fn(&Run) -> f64| (runs.iter().map(|run| value(run).ln()).sum::<f64>() / count).exp();
        Self {
            name: name.to_owned(),
            score: geometric(|run| run.score),
            lost: runs.iter().filter(|run| run.score >= LOST).count(),
            e_y: geometric(|run| run.e_y),
            steering: runs.iter().map(|run| run.steering).sum::<f64>() / count,
        }
    }
}

/// Root mean square rate of the steering command [rad/s].
fn steering_rate(run: &Recording) -> f64 {
    let (times, commands) = (run.column("t"), run.column("delta"));
    let squares: f64 =
        commands.windows(2).zip(times.windows(2)).map(|(d, t)| (d[1] - d[0]).powi(2) / (t[1] - t[0])).sum();
    // Commands jump once a period; the rate is that of a wheel that takes the whole period for it.
    let (step, period) = (times.get(1).copied().unwrap_or(1.0), lpv_mpc::Parameters::default().t_s);
    (squares / times.last().copied().unwrap_or(1.0).max(step) * (step / period)).sqrt()
}

/// The sets: the default first, the paper's, and each weight a third and threefold.
fn sets() -> Result<Vec<Set>> {
    let fields = |p: lpv_mpc::Parameters| serde_json::to_value(p);
    let (default, paper) = (fields(lpv_mpc::Parameters::adaptive())?, fields(lpv_mpc::Parameters::paper())?);
    let assign = |name: &str, value: &serde_json::Value| format!("controller.{name}={value}");
    let paper_weights: Vec<String> = WEIGHTS.iter().map(|name| assign(name, &paper[*name])).collect();
    let mut sets = vec![
        Set { name: "default".to_owned(), assignments: Vec::new() },
        Set { name: "paper's weights".to_owned(), assignments: paper_weights.clone() },
        Set {
            name: "paper's weights, horizon, measurement as it is".to_owned(),
            assignments: paper_weights
                .into_iter()
                .chain([assign("horizon", &paper["horizon"]), "controller.estimation=measured".to_owned()])
                .collect(),
        },
    ];
    for name in WEIGHTS {
        let value = default[name].as_f64().unwrap_or_default();
        for (factor, text) in [(1.0 / 3.0, "/ 3"), (3.0, "* 3")] {
            let assignments = vec![format!("controller.{name}={}", value * factor)];
            sets.push(Set { name: format!("{name} {text}"), assignments });
        }
    }
    Ok(sets)
}

/// The ensemble: lane changes, one in four at the general track.
fn situations(count: usize) -> Vec<Scenario> {
    // Any seed serves; every set sees the same situations.
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    (0..count)
        .map(|i| {
            let mut draw = |from: f64, to: f64| from + (to - from) * rng.random::<f64>();
            let mu = draw(0.5, 1.0);
            let speed = draw(0.5, 0.9) * LIMIT * (mu / 0.82).sqrt();
            let (lag, delay, error) = (draw(0.0, 0.3), draw(0.0, 0.25), draw(-0.02, 0.02));
            let gust = [
                ("plant.gust_start", draw(2.0, 6.0)),
                ("plant.gust_speed", draw(0.0, 30.0)),
                ("plant.gust_direction", draw(-PI, PI)),
            ];
            let noise = [("plant.noise_scale", draw(0.0, 1.5)), ("plant.seed", i as f64)];
            let name = format!(
                "{}, friction {mu:.2}, lag {lag:.2} s, delay {delay:.3} s, assumed {error:+.3} s, noise {:.1}, gust {:.0} m/s",
                if i % 4 == 3 { "general".to_owned() } else { format!("lane change at {speed:.1} m/s") },
                noise[0].1,
                gust[1].1,
            );
            // The general track asks for half of the grip at friction 0.82.
            let road = if i % 4 == 3 {
                Scenario::on("general").with(&[("plant.mu", mu.max(0.6))])
            } else {
                Scenario::lane_change(speed).with(&[("plant.mu", mu)])
            };
            road.with(&gust).with(&noise).slowed(lag, delay, (delay + error).max(0.0)).called(name)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_a_third_and_threefold() {
        let sets = sets().unwrap();
        assert_eq!(sets.len(), 3 + 2 * WEIGHTS.len());
        assert_eq!(sets[0].assignments, Vec::<String>::new());
        let value = |name: &str| -> f64 {
            let set = sets.iter().find(|set| set.name == name).unwrap();
            set.assignments[0].split('=').nth(1).unwrap().parse().unwrap()
        };
        let default = lpv_mpc::Parameters::adaptive().r_delta;
        assert!(
            (value("r_delta / 3") * 3.0 - default).abs() < 1e-9 && (value("r_delta * 3") / 3.0 - default).abs() < 1e-9
        );
        assert!(sets[1].assignments.contains(&"controller.r_delta=0.003".to_owned()), "{:?}", sets[1].assignments);
    }

    #[test]
    fn every_set_sees_the_same_situations() {
        let (some, more) = (situations(8), situations(16));
        for (a, b) in some.iter().zip(&more) {
            assert_eq!(format!("{a:?}"), format!("{b:?}"));
        }
    }

    #[test]
    fn a_run_that_left_the_road_counts_fully_and_no_more() {
        let lost = Run::of(None);
        assert_eq!(lost.score, LOST);
        let score = Score::new("half", &[lost, Run { score: 1.0, e_y: 0.01, steering: 0.2 }]);
        // The geometric mean of 100 and 1.
        assert!((score.score - 10.0).abs() < 1e-12 && score.lost == 1);
        assert!((score.steering - 0.1).abs() < 1e-12);
    }
}

//! What the page says: text, tables and charts in the paper's order.

use anyhow::Result;
use lpv_mpc::{Controller, Parameters};

use super::charts::Figure;
use super::errata::{Shot, Unaware};
use super::learning::{Learning, Point};
use super::runs::{Figures, ROAD, Run, Situation, Who, drive, prepare};
use super::timing::quantile;
use super::verdict::{Verdict, find, verdicts};
use crate::baselines::{Baseline, Gains};
use crate::html::{escape, table};
use crate::plots::{BLUE, Chart, Curve, GREEN, GREY, ORANGE, PURPLE, Page, RED, bars, chart};
use crate::recording::{PAPER, Recording};
use crate::simulate::settings::Settings;
use crate::train::evaluate;

/// Everything that was found out.
pub struct Findings {
    /// All runs of the comparison.
    pub runs: Vec<Run>,
    /// The paper's model with its misprints.
    pub errata: Vec<Shot>,
    /// One sample of latency, told and not told.
    pub late: Vec<(&'static str, Recording)>,
    /// The networks.
    pub learning: Learning,
    /// Computing time of each sample [s].
    pub times: Vec<(Who, Vec<f64>)>,
    /// Weights that the stored runs do not share.
    pub stale: Vec<String>,
}

impl Findings {
    fn times(&self, who: Who) -> &[f64] {
        self.times.iter().find(|(timed, _)| *timed == who).map_or(&[], |(_, times)| times)
    }

    /// What was promised, and whether it holds.
    pub fn verdicts(&self) -> Vec<Verdict> {
        verdicts(&self.runs, [self.times(Who::Ours), self.times(Who::Nonlinear)])
    }
}

/// Names and units of the table of a situation.
const OVERVIEW: [&str; 7] = ["", "e_y rms [cm]", "largest", "v_x rms [m/s]", "largest", "course rms [deg]", "largest"];

/// Everybody's errors in a situation, the paper's first.
pub fn overview(runs: &[Run], situation: Situation) -> Vec<Vec<String>> {
    let row = |name: &str, figures: &Figures| {
        let t = &figures.tracking;
        let mut row = vec![name.to_owned()];
        if figures.stayed() {
            row.extend([
                format!("{:.3}", 100.0 * t.e_y_rms),
                format!("{:.2}", 100.0 * t.e_y_max),
                format!("{:.4}", t.speed_rms),
                format!("{:.3}", t.speed_max),
                format!("{:.3}", figures.course_rms.to_degrees()),
                format!("{:.2}", figures.course_max.to_degrees()),
            ]);
        } else {
            row.push("off the road".to_owned());
            row.resize(OVERVIEW.len(), "-".to_owned());
        }
        row
    };
    let paper = Figures { tracking: PAPER, course_max: PAPER.e_psi_max, course_rms: PAPER.e_psi_rms };
    let mut rows = vec![OVERVIEW.map(str::to_owned).to_vec(), row("paper", &paper)];
    if situation == Situation::General {
        // The paper gives no more of its comparison than these two.
        let cells = ["paper's LMPC + PSO-PID", "32", "-", "0.19", "-", "-", "-"];
        rows.push(cells.map(str::to_owned).to_vec());
    }
    rows.extend(Who::ALL.map(|who| row(who.name(), &find(runs, situation, who).figures)));
    rows
}

/// One sample of latency with the controller's compensation and without it, with the shipped weights and with the paper's.
pub fn late() -> Result<Vec<(&'static str, Recording)>> {
    let ours = || prepare(Situation::LaneChange, &[]);
    let paper = || -> Result<_> {
        let (plant, _, settings) = ours()?;
        Ok((plant, Controller::new(Parameters::paper(), 0.0)?, settings))
    };
    let mut runs = Vec::new();
    let step = Parameters::paper().t_s;
    for (names, build) in [
        (["shipped weights, told", "shipped weights, not told"], &ours as &dyn Fn() -> Result<_>),
        (["paper's weights, told", "paper's weights, not told"], &paper),
    ] {
        let (mut plant, mut controller, _) = build()?;
        runs.push((names[0], drive(Situation::LaneChange, &mut plant, &mut controller, step)?));
        let (mut plant, controller, _) = build()?;
        runs.push((names[1], drive(Situation::LaneChange, &mut plant, &mut Unaware(controller), step)?));
    }
    Ok(runs)
}

/// A run as its table shows it: a sample of each period of the controller.
pub fn samples(run: &Run) -> Recording {
    if run.who == Who::Nonlinear { run.recording.clone() } else { run.recording.thinned(33) }
}

/// A table whose first row is its head and whose other columns are numbers.
fn numbers(rows: &[Vec<String>]) -> String {
    let head: Vec<(&str, bool)> = rows[0].iter().enumerate().map(|(i, name)| (name.as_str(), i > 0)).collect();
    let cells: Vec<Vec<String>> = rows[1..].iter().map(|row| row.iter().map(|cell| escape(cell)).collect()).collect();
    table(&head, &cells)
}

/// The whole page.
pub fn page(findings: &Findings) -> String {
    let mut page = Page::new(
        "The paper, reproduced",
        "Kebbati, Ait-Oufroukh, Ichalal, Vigneron: RNN-based linear parameter varying adaptive model predictive control for \
         autonomous driving. Its tables and figures again, from the code of this project, beside what a user would otherwise pick.",
    );
    page.section("results", "Results");
    page.text(RESULTS);
    promises(&mut page, findings);
    page.section("control", "Control");
    page.text(CONTROL);
    page.tabs(&Situation::ALL.map(Situation::title), |page, i| situation(page, findings, Situation::ALL[i]));
    page.section("time", "Computing time");
    computing(&mut page, findings);
    page.section("learning", "Learning");
    learning(&mut page, &findings.learning);
    page.section("errata", "Errata");
    errata(&mut page, findings);
    page.section("parameters", "Parameters");
    parameters(&mut page);
    page.finish()
}

const RESULTS: &str = "The paper's plant, track, wind, tyre and PID gains are not published, so its figures show the order of \
magnitude and not a contest. What it calls MSE are root mean squares: read as mean squares they would exceed its own maxima. \
Headings are compared by the **course**, the direction of motion: in a curve a body cannot keep the path's heading, its sideslip \
follows from geometry and tyres whoever steers.\n";

fn promises(page: &mut Page, findings: &Findings) {
    page.text("The general track, 2 km of curves at 5 to 25 m/s in a wind of 20 to 50 m/s:\n");
    page.markup(&numbers(&overview(&findings.runs, Situation::General)));
    page.text("What was asked of the controller, and what it does:\n");
    let rows: Vec<Vec<String>> = findings
        .verdicts()
        .into_iter()
        .map(|Verdict { name, asked, got, holds }| {
            let mark = if holds {
                "<span class=\"good\">\u{2713} holds</span>"
            } else {
                "<span class=\"bad\">\u{2717} missed</span>"
            };
            vec![escape(&name), escape(&asked), escape(&got), mark.to_owned()]
        })
        .collect();
    page.markup(&table(&[("", false), ("asked", true), ("found", true), ("", false)], &rows));
    if !findings.stale.is_empty() {
        page.text(&format!(
            "The stored runs of the nonlinear MPC were made with other weights ({}): `tools/reference/nmpc.py` makes them again.\n",
            findings.stale.join("; ")
        ));
    }
}

const CONTROL: &str = "All drive the same plant (magic formula, friction 0.82, ideal actuators) at communication steps of 1 ms, \
sampled every 33 ms, with the same bounds, from the same signals. Who gets what:

| | model | preview | wind | latency |
|---|---|---|---|---|
| LPV-MPC (ours) | LPV, tyres from the network along the plan | curvature, speed | estimated from what the model cannot explain | predicted over |
| nonlinear MPC (offline) | the plant itself, 30 samples ahead | curvature, speed | known, also ahead | none: commands act at once |
| LMPC + PID | linear bicycle at one speed between the road's mean and highest, nominal tyres | curvature, speed | not known | predicted over |
| LMPC at measured speed + PID | the same, linearised at each sample | curvature, speed | not known | predicted over |
| Stanley + PID | none | curvature now | not known | none |
| pure pursuit + PID | none | position and speed ahead | not known | none |

LMPC has our weights, bounds, horizon and solver; Stanley's gains are the defaults of MathWorks' block, pure pursuit's those of \
Autoware's simple pure pursuit. Drag to zoom, double-click to return, click a name to hide it; the camera saves a picture, the \
sheet saves the data.\n";

fn situation(page: &mut Page, findings: &Findings, situation: Situation) {
    page.markup(&numbers(&overview(&findings.runs, situation)));
    page.text(&difference(&findings.runs, situation));
    let links = Who::ALL.map(|who| {
        let file = super::data_file(find(&findings.runs, situation, who));
        format!("[{}]({file})", who.name())
    });
    page.text(&format!("Data, a line for each period: {}.\n", links.join(", ")));
    for chart in Figure::new(situation, &findings.runs).charts() {
        page.chart(&chart);
    }
}

/// What the table of a situation says, in a sentence.
fn difference(runs: &[Run], situation: Situation) -> String {
    let of = |who| find(runs, situation, who).figures;
    let (ours, best) = (of(Who::Ours), of(Who::Nonlinear));
    let ratio = |a: f64, b: f64| format!("{:.1}", a / b);
    let fixed = of(Who::Baseline(Baseline::LinearFixed));
    let behind = if fixed.stayed() {
        format!(
            "The paper's comparison, LMPC at one speed with PID, is {} times behind ours in position and {} times in speed{}.",
            ratio(fixed.tracking.e_y_rms, ours.tracking.e_y_rms),
            ratio(fixed.tracking.speed_rms, ours.tracking.speed_rms),
            if situation == Situation::General { " (paper: 46 and 9.5)" } else { "" }
        )
    } else {
        format!(
            "The paper's comparison, LMPC at one speed with PID, comes further than {ROAD} m from the path: off the road."
        )
    };
    format!(
        "{behind} Of the nonlinear MPC, which knows plant and wind, ours is within a factor of {} in position and {} in speed.\n",
        ratio(ours.tracking.e_y_rms, best.tracking.e_y_rms),
        ratio(ours.tracking.speed_rms, best.tracking.speed_rms)
    )
}

fn computing(page: &mut Page, findings: &Findings) {
    page.text(
        "One sample on the general track, on the machine that made this page; the nonlinear MPC was timed when its runs were \
         made. The paper reports 11 ms (a laptop, Yalmip and Gurobi) for a period of 33 ms.\n",
    );
    let mut rows = vec![["", "median [\u{b5}s]", "99 % [\u{b5}s]", "largest [\u{b5}s]"].map(str::to_owned).to_vec()];
    rows.push(["paper, mean", "11000", "-", "-"].map(str::to_owned).to_vec());
    for (who, times) in &findings.times {
        let mut row = vec![who.name().to_owned()];
        row.extend([0.5, 0.99, 1.0].map(|share| format!("{:.1}", 1e6 * quantile(times, share))));
        rows.push(row);
    }
    page.markup(&numbers(&rows));
    let t_s = Parameters::paper().t_s;
    let shown = [Who::Ours, Who::Nonlinear, Who::Baseline(Baseline::LinearMeasured)];
    let curves = shown.iter().map(|who| {
        let times = findings.times(*who);
        let t: Vec<f64> = (0..times.len()).map(|k| t_s * k as f64).collect();
        Curve::new(who.name(), &t, times.iter().map(|time| 1e6 * time).collect(), who.color())
    });
    page.chart(
        &chart(
            [
                "time-over-time",
                "Computing time over the track",
                "As the paper's figure 11; its own mean is 11 000 \u{b5}s.",
            ],
            ["time [s]", "one sample [\u{b5}s]"],
            curves.collect(),
        )
        .log_y(),
    );
    page.chart(&distribution(findings, &shown));
}

/// Shares of the samples in classes of computing time, ten to a decade.
fn distribution(findings: &Findings, shown: &[Who]) -> Chart {
    let class = |time: f64| (10.0 * (1e6 * time).log10()).floor();
    let all = || shown.iter().flat_map(|who| findings.times(*who));
    let (low, high) = all()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), time| (low.min(class(*time)), high.max(class(*time))));
    let classes: Vec<f64> =
        std::iter::successors(Some(low), |class| Some(class + 1.0)).take_while(|c| *c <= high).collect();
    let x: Vec<f64> = classes.iter().map(|class| 10.0_f64.powf((class + 0.5) / 10.0)).collect();
    let groups = shown.iter().map(|who| {
        let times = findings.times(*who);
        let share =
            |c: &f64| 100.0 * times.iter().filter(|time| class(**time) == *c).count() as f64 / times.len() as f64;
        (who.name().to_owned(), classes.iter().map(share).collect(), who.color())
    });
    bars(
        ["time-distribution", "Distribution of the computing time", "Classes of a tenth of a decade."],
        ["one sample [\u{b5}s]", "share of the samples [%]"],
        &x,
        groups.collect(),
    )
    .log_x()
}

fn learning(page: &mut Page, learning: &Learning) {
    page.text(
        "Manoeuvres of the plant, split by manoeuvre; the scores are those on manoeuvres that no network saw. The paper reports \
         R\u{b2} of 99.8 % and 99.7 % and does not say whether the network was fed the true previous stiffness. That matters: the \
         same weights can score well on the truth and fail on their own answers, as they are deployed, and where the true previous \
         value alone scores this well, teacher-forced scores say little.\n",
    );
    let head = evaluate::HEAD.map(str::to_owned).to_vec();
    let rows = learning.scores.iter().map(|(name, score)| evaluate::row(name, score));
    page.markup(&numbers(&std::iter::once(head).chain(rows).collect::<Vec<_>>()));
    page.text("Front and rear; RMSE and worst in kN/rad; force error, rms and worst, in % of the axle's grip.\n");
    let steps: Vec<f64> = learning.curve.iter().map(|(step, ..)| *step as f64).collect();
    let errors = |pick: fn(&Point) -> f64| learning.curve.iter().map(pick).collect::<Vec<f64>>();
    page.chart(
        &chart(
            [
                "learning-curve",
                "Learning curve",
                "A network of the paper's size, trained while this page was made; mean squared error in units of the variance, on \
                 the free run. As the paper's figure 4, whose recipe ends at 0.002 and 0.005 after 100 epochs.",
            ],
            ["step", "mean squared error"],
            vec![
                Curve::new("training", &steps, errors(|point| point.1), BLUE),
                Curve::new("validation", &steps, errors(|point| point.2), ORANGE),
            ],
        )
        .log_y(),
    );
    for chart in &learning.charts {
        page.chart(chart);
    }
}

fn errata(page: &mut Page, findings: &Findings) {
    page.text(ERRATA);
    let mut rows = vec![
        ["form of the model", "leaves the road", "largest e_y [cm]", "largest speed error [m/s]"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for Shot { name, recording, left } in &findings.errata {
        let figures = Figures::of(recording);
        rows.push(vec![
            (*name).to_owned(),
            left.map_or("no".to_owned(), |time| format!("at {time:.1} s")),
            if left.is_some() {
                format!("over {:.0}", 100.0 * ROAD)
            } else {
                format!("{:.2}", 100.0 * figures.tracking.e_y_max)
            },
            format!("{:.3}", figures.tracking.speed_max),
        ]);
    }
    page.markup(&numbers(&rows));
    let colors = [BLUE, RED, ORANGE, GREEN, PURPLE, GREY];
    let curves = findings.errata.iter().enumerate().map(|(i, shot)| {
        let t = shot.recording.column("t");
        let curve = Curve::new(shot.name, &t, shot.recording.column("e_y_true"), colors[i % colors.len()]);
        if i >= colors.len() { curve.dashed() } else { curve }
    });
    page.chart(
        &chart(
            [
                "printed",
                "The printed matrices in the loop",
                "Lane change at 14 m/s with the paper's weights, horizon and bounds; the model as printed, corrected, and with one misprint at a time.",
            ],
            ["time [s]", "e_y [m]"],
            curves.collect(),
        )
        .zoomed(None, Some([-ROAD, ROAD])),
    );
    let late = findings.late.iter().zip([BLUE, ORANGE, GREEN, RED]);
    let curves = late.map(|((name, run), color)| {
        let curve = Curve::new(*name, &run.column("t"), run.column("e_y_true"), color);
        if name.ends_with("not told") { curve } else { curve.dashed() }
    });
    page.chart(
        &chart(
            [
                "late",
                "One sample of latency",
                "Lane change at communication steps of 33 ms: a command is visible one whole sample late. The controller is told its step and predicts over it, or it is not told.",
            ],
            ["time [s]", "e_y [m]"],
            curves.collect(),
        )
        .zoomed(None, Some([-ROAD, ROAD])),
    );
}

const ERRATA: &str = include_str!("errata.md");

fn parameters(page: &mut Page) {
    let Gains { proportional, integral, derivative } = Gains::TUNED;
    page.text(&format!(
        "The paper's Table 2 holds for vehicle, period and bounds; what it leaves open (tyre, rolling resistance, bounds of the \
         acceleration, steering rate, side force, track, PID gains) is ours and said beside each value in the code. PID: {proportional} \
         1/s, {integral} 1/s\u{b2}, {derivative}, found by particle swarm on the general track (`cargo fmu report --tune-pid`). \
         Weights: ours in the list below; the paper's are q 50, 1e-5, 0.01, 47.43, 1e-3 and r 0.003, 1e-4, horizon 10.\n"
    ));
    let settings = Settings::new("double_lane_change", &[]).and_then(|settings| settings.list());
    let rows = settings.expect("the defaults are valid and can be listed");
    let mut cells = vec![["parameter", "value"].map(str::to_owned).to_vec()];
    cells.extend(rows);
    page.markup(&format!("<details><summary>All parameters of both sides</summary>\n{}</details>\n", numbers(&cells)));
}

//! What the page says: text, tables and charts in the paper's order.

mod control;
mod lessons;
mod misprints;
mod time;

pub use control::{overview, samples};
pub use misprints::late;

use super::errata::Shot;
use super::learning::Learning;
use super::runs::{Figures, Nonlinear, Run, Situation, Who};
use super::verdict::{Verdict, verdicts};
use crate::baselines::Gains;
use crate::html::{escape, table};
use crate::plots::{Chart, Page};
use crate::recording::Recording;
use crate::robustness::Evidence;
use crate::simulate::settings::Settings;

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
    /// The nonlinear MPC with the textbook cost on the general track, not told of the wind.
    pub untold: Figures,
    /// LMPC at the measured speed with other weights on the steering.
    pub weighted: Vec<(f64, Figures)>,
    /// Medians of the optimisers on the paper's function, and how they get there.
    pub optimisers: (Vec<Vec<String>>, Chart),
    /// What delay, lag, noise, wind and lack of grip do; none if it was not asked for.
    pub robustness: Option<Evidence>,
    /// Weights that the stored runs do not share.
    pub stale: Vec<String>,
}

impl Findings {
    fn times(&self, who: Who) -> &[f64] {
        self.times.iter().find(|(timed, _)| *timed == who).map_or(&[], |(_, times)| times)
    }

    /// What was promised, and whether it holds.
    pub fn verdicts(&self) -> Vec<Verdict> {
        verdicts(&self.runs, [self.times(Who::Ours), self.times(Who::Nonlinear(Nonlinear::Foreseen))])
    }
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
    control::section(&mut page, findings);
    time::section(&mut page, findings);
    lessons::section(&mut page, &findings.learning);
    tuning(&mut page, findings);
    if let Some(evidence) = &findings.robustness {
        robustness(&mut page, evidence);
    }
    misprints::section(&mut page, findings);
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

fn tuning(page: &mut Page, findings: &Findings) {
    page.section("tuning", "Tuning");
    page.text(TUNING);
    let (rows, chart) = &findings.optimisers;
    page.markup(&numbers(rows));
    page.chart(chart);
}

const TUNING: &str = "The paper tunes its weights by a hybrid of a genetic algorithm and a particle swarm and compares the three on \
the sphere in five variables (its figure 6 gives one run of each). Here each has thirty seeds and the same number of evaluations; \
`guided` is what `cargo fmu tune` uses unless told otherwise.\n";

fn robustness(page: &mut Page, evidence: &Evidence) {
    page.section("robustness", "Robustness");
    page.text(
        "Beyond the paper: delay, lag, noise, wind, lack of grip. `cargo fmu robustness` drives it on finer grids and lists every \
         case.\n",
    );
    page.markup(&evidence.list());
    for chart in evidence.charts() {
        page.chart(&chart);
    }
}

fn parameters(page: &mut Page) {
    page.section("parameters", "Parameters");
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

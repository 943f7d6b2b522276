//! The closed loops: everybody's errors and figures, one situation after the other.

use super::{Findings, numbers};
use crate::baselines::Baseline;
use crate::plots::Page;
use crate::recording::{PAPER, Recording};
use crate::report::charts::Figure;
use crate::report::data_file;
use crate::report::runs::{Figures, Nonlinear, ROAD, Run, Situation, Who};
use crate::report::verdict::find;

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
                format!("{:.3}", t.course_rms.to_degrees()),
                format!("{:.2}", t.course_max.to_degrees()),
            ]);
        } else {
            row.push("off the road".to_owned());
            row.resize(OVERVIEW.len(), "-".to_owned());
        }
        row
    };
    let paper = Figures { tracking: PAPER };
    let mut rows = vec![OVERVIEW.map(str::to_owned).to_vec(), row("paper", &paper)];
    if situation == Situation::General {
        // The paper gives no more of its comparison than these two.
        let cells = ["paper's LMPC + PSO-PID", "32", "-", "0.19", "-", "-", "-"];
        rows.push(cells.map(str::to_owned).to_vec());
    }
    rows.extend(Who::ALL.map(|who| row(who.name(), &find(runs, situation, who).figures)));
    rows
}

/// A run as its table shows it: a sample of each period of the controller.
pub fn samples(run: &Run) -> Recording {
    if matches!(run.who, Who::Nonlinear(_)) { run.recording.clone() } else { run.recording.thinned(33) }
}

/// The section.
pub fn section(page: &mut Page, findings: &Findings) {
    page.section("control", "Control");
    page.text(CONTROL);
    page.tabs(&Situation::ALL.map(Situation::title), |page, i| situation(page, findings, Situation::ALL[i]));
}

const CONTROL: &str = "All drive the same plant (magic formula, friction 0.82, ideal actuators) at communication steps of 1 ms, \
sampled every 33 ms, with the same bounds, from the same signals. Who gets what:

| | model | preview | increments of steering weighed against | wind | latency |
|---|---|---|---|---|---|
| LPV-MPC (ours) | LPV, tyres from the network along the plan | curvature, speed | those of a car that follows the path exactly | estimated from what the model cannot explain | predicted over |
| nonlinear MPC (offline) | the plant itself, 30 samples ahead | curvature, speed | zero, the textbook cost | told: what blows now (felt), or what is going to blow (foreseen) | none: commands act at once |
| nonlinear MPC (offline), our increments | the same | curvature, speed | those of a car that follows the path exactly, from the plant itself | told: what blows now | none |
| LMPC + PID | linear bicycle at one speed between the road's mean and highest, nominal tyres | curvature, speed | zero | not known | predicted over |
| LMPC at measured speed + PID | the same, linearised at each sample | curvature, speed | zero | not known | predicted over |
| Stanley + PID | none | curvature now | - | not known | none |
| pure pursuit + PID | none | position and speed ahead | - | not known | none |

What our controller weighs its increments against is feed-forward (`lpv-mpc`, module `feedforward`): the steering that the path itself asks for \
costs nothing. The nonlinear MPC has that reference once, computed from its exact knowledge: the ceiling of the position.

LMPC has our weights, bounds, horizon and solver; Stanley's gains are the defaults of MathWorks' block, pure pursuit's those of \
Autoware's simple pure pursuit. Drag to zoom, double-click to return, click a name to hide it; the camera saves a picture, the \
arrow saves the data.\n";

fn situation(page: &mut Page, findings: &Findings, situation: Situation) {
    page.markup(&numbers(&overview(&findings.runs, situation)));
    page.text(&difference(&findings.runs, situation));
    let links = Who::ALL.map(|who| {
        let file = data_file(find(&findings.runs, situation, who));
        format!("[{}]({file})", who.name())
    });
    page.text(&format!("Data, a line for each period: {}.\n", links.join(", ")));
    if situation == Situation::General {
        let e_y = |figures: &Figures| 100.0 * figures.tracking.e_y_rms;
        page.text(&format!(
            "What the nonlinear MPC with the textbook cost owes to being told the wind: without it, its lateral error is {:.2} cm \
             rms, ours, which has to find the wind out, {:.2} cm.\n",
            e_y(&findings.untold),
            e_y(&find(&findings.runs, situation, Who::Ours).figures)
        ));
        weighted(page, findings);
    }
    for chart in Figure::new(situation, &findings.runs).charts() {
        page.chart(&chart);
    }
}

/// How much of the linear MPC's error is its weight and not its model.
fn weighted(page: &mut Page, findings: &Findings) {
    let mut rows = vec![["LMPC at measured speed, r_delta", "e_y rms [cm]", "largest"].map(str::to_owned).to_vec()];
    rows.extend(findings.weighted.iter().map(|(r_delta, figures)| {
        let t = figures.tracking;
        vec![format!("{r_delta}"), format!("{:.3}", 100.0 * t.e_y_rms), format!("{:.2}", 100.0 * t.e_y_max)]
    }));
    page.text(
        "Every MPC here has the weights of ours; the linear ones weigh their increments of steering against zero. With less weight \
         on the steering a linear one that knows its speed comes closer in this loop without delay, lag and noise, at the price of \
         margin against all three:\n",
    );
    page.markup(&numbers(&rows));
}

/// What the table of a situation says, in a sentence.
fn difference(runs: &[Run], situation: Situation) -> String {
    let of = |who| find(runs, situation, who).figures;
    let ours = of(Who::Ours);
    let ratio = |a: f64, b: f64, digits: usize| format!("{:.digits$}", a / b);
    let fixed = of(Who::Baseline(Baseline::LinearFixed));
    let behind = if fixed.stayed() {
        format!(
            "The paper's comparison, LMPC at one speed with PID, is {} times behind ours in position and {} times in speed{}.",
            ratio(fixed.tracking.e_y_rms, ours.tracking.e_y_rms, 1),
            ratio(fixed.tracking.speed_rms, ours.tracking.speed_rms, 1),
            if situation == Situation::General { " (paper: 46 and 9.5)" } else { "" }
        )
    } else {
        format!(
            "The paper's comparison, LMPC at one speed with PID, comes further than {ROAD} m from the path: off the road."
        )
    };
    let over = |nonlinear| {
        let best = of(Who::Nonlinear(nonlinear)).tracking;
        let position = ratio(ours.tracking.e_y_rms, best.e_y_rms, 2);
        format!("{position} and {}", ratio(ours.tracking.speed_rms, best.speed_rms, 2))
    };
    let [felt, foreseen, ideal] = [Nonlinear::Felt, Nonlinear::Foreseen, Nonlinear::Ideal].map(over);
    let [textbook, feeling] = if situation == Situation::LaneChange {
        [format!("{felt} (without wind its first two rows are one run)"), String::new()]
    } else {
        let told =
            format!("{felt} when it feels the wind, as ours does through the car, {foreseen} when it foresees it");
        [told, ", feeling the wind".to_owned()]
    };
    format!(
        "{behind} The errors of ours over those of the nonlinear MPC, which knows the plant, in position and in speed: with the \
         textbook cost {textbook}; with our reference of the increments{feeling}, {ideal}.\n"
    )
}

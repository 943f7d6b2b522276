//! What the command leaves behind: tables of numbers and charts.

use super::cases::Verdict;
use super::scenario::Figures;
use super::sweep::{GRIDS, Series};
use crate::html::{escape, table};
use crate::plots::{BLUE, Chart, Curve, GREY, ORANGE, chart, heat_map};

/// Lateral error at which the grids are cut [cm]: twice what is asked of slow actuators.
const TOP: f64 = 8.0;
/// Lateral error at which curves are cut, so that the small ones can be told apart [cm].
const CUT: f64 = 30.0;
/// Speed error at which its curves are cut [m/s].
const SPEED_CUT: f64 = 10.0;

/// Titles of the charts over delay and lag.
const GRID_LABELS: [[&str; 3]; 3] = [
    [
        "robust_delay_lag",
        "Delay and lag, told",
        "Largest lateral error of the lane change at 14 m/s [cm], cut at 8 cm; actuators as slow as the controller assumes.",
    ],
    ["robust_delay_short", "Delay 20 ms longer than assumed", "The same; the controller assumes 20 ms too little."],
    ["robust_delay_long", "Delay 20 ms shorter than assumed", "The same; the controller assumes 20 ms too much."],
];

/// A sweep's name, its charts of lateral and of speed error, and what is to be known of it.
struct Labels {
    sweep: &'static str,
    ids: [&'static str; 2],
    titles: [&'static str; 2],
    note: &'static str,
}

const CURVE_LABELS: [Labels; 7] = [
    Labels {
        sweep: "late",
        ids: ["robust_late", "robust_late_speed"],
        titles: ["Delay at high speed", "Delay at high speed: speed error"],
        note: "General track, up to 25 m/s, lag 0.05 s; told, and assumed 20 ms wrong.",
    },
    Labels {
        sweep: "noise",
        ids: ["robust_noise", "robust_noise_speed"],
        titles: ["Sensor noise", "Sensor noise: speed error"],
        note: "Lane change at 14 m/s, the worst of three seeds; 1 is a good navigation unit.",
    },
    Labels {
        sweep: "wind",
        ids: ["robust_wind", "robust_wind_speed"],
        titles: ["Wind", "Wind: speed error"],
        note: "Lane change at 14 m/s; the gust rises in 0.1 s and lasts through both halves.",
    },
    Labels {
        sweep: "friction",
        ids: ["robust_friction", "robust_friction_speed"],
        titles: ["Friction", "Friction: speed error"],
        note: "Lane change at 0.8 of the speed that friction permits; the network was trained at 0.82.",
    },
    Labels {
        sweep: "patch",
        ids: ["robust_patch", "robust_patch_speed"],
        titles: ["Ice in mid-manoeuvre", "Ice in mid-manoeuvre: speed error"],
        note: "Friction falls after the first half of the lane change; wanted are 14 m/s.",
    },
    Labels {
        sweep: "speed",
        ids: ["robust_speed", "robust_speed_speed"],
        titles: ["Speed", "Speed: its error"],
        note: "Grip ends at 17.2 m/s; beyond it the controller slows down instead of leaving the road.",
    },
    Labels {
        sweep: "belief",
        ids: ["robust_belief", "robust_belief_speed"],
        titles: ["Another car than assumed", "Another car than assumed: speed error"],
        note: "Lane change at 14 m/s; the controller keeps its parameters and its network.",
    },
];

/// Charts of the sweeps.
pub(crate) fn charts(series: &[Series]) -> Vec<Chart> {
    let drawn = GRIDS.into_iter().flat_map(|name| of(series, name)).flat_map(|line| &line.points);
    let most = drawn.map(|(_, figures)| shown(figures)).fold(0.0, f64::max);
    let grids = GRIDS.into_iter().zip(GRID_LABELS).map(|(name, labels)| grid(labels, &of(series, name), most));
    let curves = CURVE_LABELS.iter().flat_map(|labels| curves(labels, &of(series, labels.sweep)));
    grids.chain(curves).collect()
}

fn of<'a>(series: &'a [Series], sweep: &str) -> Vec<&'a Series> {
    series.iter().filter(|series| series.sweep == sweep).collect()
}

/// Lateral error as the grids show it [cm].
fn shown(figures: &Figures) -> f64 {
    (100.0 * figures.e_y).min(TOP)
}

/// Lateral error over delay and lag; `most` is the largest of all grids [cm].
fn grid(labels: [&str; 3], lines: &[&Series], most: f64) -> Chart {
    let delays: Vec<f64> =
        lines.first().map(|line| line.points.iter().map(|(delay, _)| 1e3 * delay).collect()).unwrap_or_default();
    let lags: Vec<f64> = lines.iter().map(|line| line.lag).collect();
    let row = |line: &&Series| line.points.iter().map(|(_, figures)| shown(figures)).collect();
    let axes = ["delay [ms]", "lag of the steering [s]"];
    heat_map(labels, axes, [&delays, &lags], lines.iter().map(row).collect(), most)
}

/// Lateral and speed error over one quantity.
fn curves(labels: &Labels, lines: &[&Series]) -> Vec<Chart> {
    let Some(over) = lines.first().map(|line| line.over) else { return Vec::new() };
    let draw = |k: usize, axis: &str, figure: fn(&Figures) -> f64| {
        let curves = lines.iter().zip([BLUE, ORANGE, GREY]).map(|(line, color)| {
            let (x, y): (Vec<f64>, Vec<f64>) = line.points.iter().map(|(x, figures)| (*x, figure(figures))).unzip();
            Curve::new(line.name, &x, y, color)
        });
        chart([labels.ids[k], labels.titles[k], labels.note], [over, axis], curves.collect())
    };
    vec![
        draw(0, "max |e_y| [cm], cut at 30 cm", |figures| (100.0 * figures.e_y).min(CUT)),
        draw(1, "max speed error [m/s], cut at 10 m/s", |figures| figures.speed.min(SPEED_CUT)),
    ]
}

/// The list as a table in markup.
pub(crate) fn list(verdicts: &[Verdict]) -> String {
    let rows = super::rows(verdicts);
    let head: Vec<(&str, bool)> =
        rows[0].iter().enumerate().map(|(column, name)| (name.as_str(), (2..4).contains(&column))).collect();
    let cells: Vec<Vec<String>> = rows[1..].iter().map(|row| row.iter().map(|cell| escape(cell)).collect()).collect();
    table(&head, &cells)
}

/// The list as numbers, in SI units: each scenario with its figure.
pub(super) fn list_csv(verdicts: &[Verdict]) -> String {
    let mut csv = "case,scenario,limit,figure\n".to_owned();
    for Verdict { case, figures } in verdicts {
        let limit = case.limit.map_or(String::new(), |limit| limit.to_string());
        for (scenario, figure) in case.scenarios.iter().zip(figures) {
            csv += &format!("{},\"{}\",{limit},{figure}\n", case.name, scenario.name);
        }
    }
    csv
}

/// The sweeps as numbers.
pub(super) fn sweep_csv(series: &[Series]) -> String {
    let mut csv = "sweep,series,over,value,tau_delta,e_y_max,v_x_error_max\n,,,,s,m,m/s\n".to_owned();
    for Series { sweep, name, lag, over, points } in series {
        for (value, Figures { e_y, speed }) in points {
            csv += &format!("{sweep},{name},{over},{value},{lag},{e_y},{speed}\n");
        }
    }
    csv
}

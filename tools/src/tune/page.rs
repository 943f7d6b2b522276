//! The page of a tuning: how it converged, where its parameters lie, what changed.

use super::session::{Checkpoint, Verdict, figure_rows, parameter_rows};
use crate::html::{escape, table};
use crate::optimise::Candidate;
use crate::optimise::search::Progress;
use crate::plots::{BLUE, Chart, Curve, GREY, ORANGE, assemble, chart};
use crate::simulate::settings;

/// The page.
pub fn of(tuning: &Checkpoint, verdict: &Verdict) -> String {
    let setup = &tuning.setup;
    let lead = format!(
        "{} on {}, {} evaluations by the method {}, seed {}. Less is better.",
        match setup.fitness {
            super::fitness::Kind::Paper => "RMSE of position, heading and speed as shares of the paper's",
            super::fitness::Kind::Robust =>
                "Half the mean and half the worst of disturbed runs as shares of the present ones",
        },
        setup.road,
        tuning.search.evaluations(),
        setup.method.name(),
        setup.seed
    );
    let mut above = String::new();
    let mut parameters = parameter_rows(tuning, verdict);
    for row in &mut parameters[1..] {
        row[0] = with_unit(&row[0]);
    }
    for (title, rows) in [("Parameters", parameters), ("Before and after", figure_rows(verdict))] {
        above.push_str(&format!("<h2>{title}</h2>\n{}", html_table(&rows)));
    }
    let mut charts = vec![convergence(tuning)];
    charts.extend(spread(tuning));
    charts.extend(pictures(verdict));
    assemble("Tuning", &lead, &above, &charts)
}

/// A parameter of the controller with its unit, where it has one.
fn with_unit(name: &str) -> String {
    match settings::unit("controller", name).as_deref() {
        None | Some("1") => name.to_owned(),
        Some(unit) => format!("{name} [{unit}]"),
    }
}

/// Rows as a table of the page, the first one its head.
pub fn html_table(rows: &[Vec<String>]) -> String {
    let (head, rows) = rows.split_first().expect("a table of the tuning has a head");
    let columns: Vec<(&str, bool)> = head.iter().enumerate().map(|(k, name)| (name.as_str(), k > 0)).collect();
    let cells: Vec<Vec<String>> = rows.iter().map(|row| row.iter().map(|cell| escape(cell)).collect()).collect();
    table(&columns, &cells)
}

fn convergence(tuning: &Checkpoint) -> Chart {
    let history = tuning.search.history();
    let x: Vec<f64> = history.iter().map(|progress| progress.evaluations as f64).collect();
    let curve = |name: &str, value: fn(&Progress) -> f64, color| {
        Curve::new(name, &x, history.iter().map(value).collect(), color).with_points()
    };
    chart(
        [
            "convergence",
            "Convergence",
            "The best so far, and the middle of each generation; runs that left the road are above 500.",
        ],
        ["evaluations", "fitness"],
        vec![
            curve("middle of the generation", |progress| progress.median, GREY),
            curve("best so far", |progress| progress.best, BLUE),
        ],
    )
    .log_y()
}

/// Where the best tenth lies in the box, parameter by parameter, in the order of evaluation.
fn spread(tuning: &Checkpoint) -> Vec<Chart> {
    let evaluated = &tuning.evaluated;
    let mut values: Vec<f64> = evaluated.iter().map(|one| one.value).collect();
    values.sort_by(f64::total_cmp);
    let Some(limit) = values.get(values.len().div_ceil(10).saturating_sub(1)) else { return Vec::new() };
    let good: Vec<(f64, &Candidate)> =
        evaluated.iter().enumerate().filter(|(_, one)| one.value <= *limit).map(|(k, one)| (k as f64, one)).collect();
    let x: Vec<f64> = good.iter().map(|(k, _)| *k).collect();
    tuning
        .setup
        .space
        .dimensions
        .iter()
        .enumerate()
        .map(|(k, side)| {
            let y = good.iter().map(|(_, one)| side.value(one.point[k])).collect();
            let drawn = chart(
                [
                    &format!("spread_{k}"),
                    &format!("Values of {}", side.name),
                    "The best tenth of all candidates in their order.",
                ],
                ["evaluation", &with_unit(&side.name)],
                vec![Curve::new("candidates", &x, y, ORANGE).points()],
            );
            if side.logarithmic { drawn.log_y() } else { drawn }
        })
        .collect()
}

/// The first manoeuvre of what was seen and of what was not, before and after.
fn pictures(verdict: &Verdict) -> Vec<Chart> {
    let mut charts = Vec::new();
    for (id, fitness) in [("seen", &verdict.training), ("unseen", &verdict.held_out)] {
        let (Some(before), Some(after)) = (fitness.picture(None), fitness.picture(Some(&verdict.tuned))) else {
            continue;
        };
        let title = fitness.titles().swap_remove(0);
        for (column, what, factor) in [
            ("e_y_true", "lateral error [cm]", 100.0),
            ("delta", "steering command [deg]", 180.0 / std::f64::consts::PI),
        ] {
            let curve = |name: &str, run: &crate::recording::Recording, color| {
                let y = run.column(column).into_iter().map(|value| value * factor).collect();
                Curve::new(name, &run.column("t"), y, color)
            };
            charts.push(chart(
                [&format!("{id}_{column}"), &format!("{title}: {what}"), ""],
                ["time [s]", what],
                // One over the other in places, so that both must be seen.
                vec![curve("before", &before, ORANGE), curve("after", &after, BLUE).dashed()],
            ));
        }
    }
    charts
}

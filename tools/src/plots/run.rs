//! The charts of one closed loop, for the pages of `demo` and `simulate`.

use super::{BLUE, Chart, Curve, GREY, ORANGE, assemble, chart};
use crate::html::{escape, table};
use crate::recording::{Recording, Tracking, tracking_rows};

fn scaled(values: Vec<f64>, factor: f64) -> Vec<f64> {
    values.into_iter().map(|value| value * factor).collect()
}

fn charts(run: &Recording) -> Vec<Chart> {
    let t = run.column("t");
    let [x, y] = ["x", "y"].map(|name| run.column(name));
    let [e_y, e_psi] = ["e_y_true", "e_psi_true"].map(|name| run.column(name));
    let (path_x, path_y) = run.path();
    let degrees = 180.0 / std::f64::consts::PI;
    let time = "time [s]";
    vec![
        chart(
            ["trajectory", "Trajectory", "Seen from above; the axes have different scales."],
            ["X [m]", "Y [m]"],
            vec![Curve::new("vehicle", &x, y, BLUE), Curve::new("path", &path_x, path_y, ORANGE).dashed()],
        ),
        chart(
            ["lateral", "Lateral error", "Position relative to the path, positive to the left."],
            [time, "e_y [cm]"],
            vec![Curve::new("lateral error", &t, scaled(e_y, 100.0), BLUE)],
        ),
        chart(
            [
                "heading",
                "Heading error",
                "Heading of the body minus heading of the path: a car that turns drifts a little.",
            ],
            [time, "e_psi [deg]"],
            vec![Curve::new("heading error", &t, scaled(e_psi, degrees), BLUE)],
        ),
        chart(
            ["speed", "Speed", ""],
            [time, "v_x [m/s]"],
            vec![
                Curve::new("vehicle", &t, run.column("v_x_true"), BLUE),
                Curve::new("wanted", &t, run.column("v_x_ref[1]"), ORANGE).dashed(),
            ],
        ),
        chart(
            ["steering", "Steering angle", "What the controller commands and what the front wheels do."],
            [time, "delta [deg]"],
            vec![
                Curve::new("wheels", &t, scaled(run.column("delta_actual"), degrees), BLUE),
                Curve::new("command", &t, scaled(run.column("delta"), degrees), ORANGE).dashed(),
            ],
        ),
        chart(
            ["acceleration", "Acceleration", ""],
            [time, "a_x [m/s\u{b2}]"],
            vec![
                Curve::new("vehicle", &t, run.column("a_x_actual"), BLUE),
                Curve::new("command", &t, run.column("a_x"), ORANGE).dashed(),
            ],
        ),
        chart(
            ["grip", "Grip in use", "Share of what the tyres can give, the worse axle."],
            [time, "grip [%]"],
            vec![Curve::new("grip", &t, scaled(run.column("grip_usage"), 100.0), GREY)],
        ),
    ]
}

/// The page; `runs` are the columns of its table.
pub fn page(title: &str, lead: &str, run: &Recording, runs: &[(&str, Tracking)]) -> String {
    let mut rows = tracking_rows(runs);
    let head = rows.remove(0);
    let columns: Vec<(&str, bool)> =
        head.iter().enumerate().map(|(column, name)| (name.as_str(), column > 1)).collect();
    let cells: Vec<Vec<String>> = rows.iter().map(|row| row.iter().map(|cell| escape(cell)).collect()).collect();
    assemble(title, lead, &table(&columns, &cells), &charts(run))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plots::page::library;
    use crate::recording::{PAPER, Row};

    #[test]
    fn the_page_asks_the_network_for_nothing() {
        let run = Recording { rows: vec![Row::default(); 2] };
        let page = page("Title", "lead", &run, &[("paper", PAPER)]);
        let own = page.replace(&library(), "");
        assert!(own.len() < 100_000, "the library was not taken out: {}", own.len());
        assert!(!own.contains("http") && !own.contains("src="), "{own}");
        assert!(library().contains("Plotly") || library().contains("plotly"));
        assert!(own.contains("lateral error, largest") && own.contains("2.300"));
    }
}

//! The report of a run as one HTML page that needs no network: the plotting library is inside.

use plotly::common::{DashType, Line, Mode, Title};
use plotly::layout::{Axis, Layout, Legend, Margin};
use plotly::{Plot, Scatter};

use crate::html::{document, escape, table};
use crate::recording::{Recording, Tracking, tracking_rows};

/// Colours that stand out on white and on black.
pub(crate) const BLUE: &str = "#2f80d0";
pub(crate) const ORANGE: &str = "#e0821e";
pub(crate) const GREY: &str = "#8a97a3";

/// Draws all plots again when the reader switches between light and dark.
const SCRIPT: &str = "
const dark = matchMedia('(prefers-color-scheme: dark)');
function draw() {
  const css = getComputedStyle(document.documentElement);
  const ink = css.getPropertyValue('--ink').trim(), rule = css.getPropertyValue('--rule').trim();
  for (const [id, plot] of Object.entries(plots)) {
    const axis = old => ({...old, gridcolor: rule, zerolinecolor: rule, automargin: true});
    const layout = {...plot.layout, paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)', font: {color: ink},
      modebar: {bgcolor: 'rgba(0,0,0,0)', color: rule, activecolor: ink},
      xaxis: axis(plot.layout.xaxis), yaxis: axis(plot.layout.yaxis)};
    Plotly.react(id, plot.data, layout, {responsive: true, displaylogo: false});
  }
}
dark.addEventListener('change', draw);
draw();
";

/// One curve.
pub(crate) struct Curve {
    name: &'static str,
    x: Vec<f64>,
    y: Vec<f64>,
    color: &'static str,
    dashed: bool,
}

impl Curve {
    pub(crate) fn new(name: &'static str, x: &[f64], y: Vec<f64>, color: &'static str) -> Self {
        Self { name, x: x.to_vec(), y, color, dashed: false }
    }

    pub(crate) fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }
}

/// A plot with its place on the page.
pub(crate) struct Chart {
    id: &'static str,
    title: &'static str,
    note: &'static str,
    plot: Plot,
}

pub(crate) fn chart([id, title, note]: [&'static str; 3], [x, y]: [&str; 2], curves: Vec<Curve>) -> Chart {
    let mut plot = Plot::new();
    for curve in curves {
        let dash = if curve.dashed { DashType::Dash } else { DashType::Solid };
        let line = Line::new().color(curve.color).dash(dash).width(2.0);
        let trace = Scatter::new(curve.x, curve.y).mode(Mode::Lines).name(curve.name).line(line);
        plot.add_trace(trace);
    }
    plot.set_layout(
        Layout::new()
            .margin(Margin::new().left(60).right(10).top(30).bottom(45))
            .legend(Legend::new().x(0.0).y(1.12).orientation(plotly::common::Orientation::Horizontal))
            .x_axis(Axis::new().title(Title::with_text(x)))
            .y_axis(Axis::new().title(Title::with_text(y))),
    );
    Chart { id, title, note, plot }
}

fn scaled(values: Vec<f64>, factor: f64) -> Vec<f64> {
    values.into_iter().map(|value| value * factor).collect()
}

fn charts(run: &Recording) -> Vec<Chart> {
    let t = run.column("t");
    let [x, y, psi] = ["x", "y", "psi"].map(|name| run.column(name));
    let [e_y, e_psi] = ["e_y_true", "e_psi_true"].map(|name| run.column(name));
    // The path's own points, from the vehicle's position and its errors.
    let path = |offset: fn(f64) -> f64, sign: f64, from: &[f64]| -> Vec<f64> {
        let along = psi.iter().zip(&e_psi).map(|(psi, e_psi)| offset(psi - e_psi));
        from.iter().zip(&e_y).zip(along).map(|((value, e_y), along)| value + sign * e_y * along).collect()
    };
    let (path_x, path_y) = (path(f64::sin, 1.0, &x), path(f64::cos, -1.0, &y));
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

/// A page with some markup above its charts.
pub(crate) fn assemble(title: &str, lead: &str, above: &str, charts: &[Chart]) -> String {
    let mut body = format!("<h1>{}</h1>\n<p class=\"lead\">{}</p>\n{above}", escape(title), escape(lead));
    let mut plots = String::from("const plots = {\n");
    for chart in charts {
        body.push_str(&format!(
            "<h2>{}</h2>\n<p class=\"note\">{}</p>\n<div class=\"plot\" id=\"{}\"></div>\n",
            escape(chart.title),
            escape(chart.note),
            chart.id
        ));
        plots.push_str(&format!("{}: {},\n", chart.id, chart.plot.to_json()));
    }
    body.push_str(&format!("<script>\n{plots}}};\n{SCRIPT}</script>\n"));
    document(title, &library(), &body)
}

/// The plotting library without the formula renderer that comes with it: the page shows no formulas and halves in size.
fn library() -> String {
    let sources = Plot::offline_js_sources();
    let end = sources.find("</script>").map_or(sources.len(), |at| at + "</script>".len());
    sources[..end].to_owned() + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
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

//! What a bench found, as a table, as JSON and as a plot.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use plotly::common::{Mode, Title};
use plotly::layout::{Axis, AxisType, Layout};
use plotly::{Plot, Scatter};
use serde::Serialize;

use crate::output::table;

/// All that one run measured.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    pub files: Vec<FileReport>,
}

/// One file's solvers.
#[derive(Clone, Debug, Serialize)]
pub struct FileReport {
    pub file: String,
    pub n: usize,
    pub solvers: BTreeMap<String, Figures>,
}

/// Times over the problems of a file [s], worst scaled error of the first input, and how often the solver gave up.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Figures {
    pub p50: f64,
    pub p90: f64,
    pub p99: f64,
    pub max: f64,
    pub error: f64,
    pub failures: usize,
}

impl Figures {
    /// From one time per problem.
    pub fn new(mut seconds: Vec<f64>, error: f64, failures: usize) -> Self {
        seconds.sort_by(f64::total_cmp);
        let at =
            |per_cent: usize| seconds.get((seconds.len() * per_cent).div_ceil(100).max(1) - 1).copied().unwrap_or(0.0);
        Self { p50: at(50), p90: at(90), p99: at(99), max: at(100), error, failures }
    }
}

impl FileReport {
    /// Rows for people, microseconds, each solver also as a multiple of the structured one.
    pub fn rows(&self) -> Vec<String> {
        let header =
            ["solver", "p50 [us]", "p90 [us]", "p99 [us]", "max [us]", "times p50", "times p99", "error", "failures"];
        let mut rows = vec![header.map(str::to_owned).to_vec()];
        let own = self.solvers.get("structured");
        let mut solvers: Vec<_> = self.solvers.iter().collect();
        solvers.sort_by(|a, b| a.1.p50.total_cmp(&b.1.p50));
        for (name, figures) in solvers {
            let times =
                |of: fn(&Figures) -> f64| own.map_or(String::new(), |own| format!("{:.1}", of(figures) / of(own)));
            let mut row = vec![name.clone()];
            row.extend(
                [figures.p50, figures.p90, figures.p99, figures.max].map(|seconds| format!("{:.2}", seconds * 1e6)),
            );
            row.extend([times(|f| f.p50), times(|f| f.p99)]);
            row.extend([format!("{:.1e}", figures.error), figures.failures.to_string()]);
            rows.push(row);
        }
        table(&rows)
    }
}

/// Writes the median time over the horizon, both on logarithmic axes, as a page that needs no network.
pub fn write_plot(path: &Path, curves: &BTreeMap<String, Vec<(usize, f64)>>) -> Result<()> {
    let mut plot = Plot::new();
    for (name, points) in curves {
        let (n, p50): (Vec<usize>, Vec<f64>) = points.iter().map(|(n, seconds)| (*n, seconds * 1e6)).unzip();
        plot.add_trace(Scatter::new(n, p50).mode(Mode::LinesMarkers).name(name));
    }
    let axis = |title: &str| Axis::new().title(Title::with_text(title)).type_(AxisType::Log);
    plot.set_layout(
        Layout::new()
            .title(Title::with_text("Median time of a solve over the horizon"))
            .x_axis(axis("samples of the horizon"))
            .y_axis(axis("time [us]")),
    );
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
    }
    std::fs::write(path, plot.to_html()).with_context(|| format!("cannot write {}", path.display()))
}

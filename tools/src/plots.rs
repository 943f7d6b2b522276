//! Curves and charts as a browser draws them, and the pages that carry them: one file each, the plotting library inside.

mod page;
mod run;

pub(crate) use page::{Page, assemble};
pub(crate) use run::page;

use plotly::common::{ColorScale, ColorScalePalette, DashType, Line, Marker, MarkerSymbol, Mode, Orientation, Title};
use plotly::layout::{Axis, AxisType, Layout, Legend, Margin};
use plotly::{HeatMap, Plot, Scatter};

/// Colours that stand out on white and on black.
pub(crate) const BLUE: &str = "#2f80d0";
pub(crate) const ORANGE: &str = "#e0821e";
pub(crate) const GREY: &str = "#8a97a3";
pub(crate) const GREEN: &str = "#2f9e6e";
pub(crate) const RED: &str = "#d1495b";
pub(crate) const PURPLE: &str = "#9272d6";
pub(crate) const TEAL: &str = "#17a2b8";

/// Points of a curve that a page carries: more than a screen has columns.
const POINTS: usize = 1600;

/// One curve.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    name: String,
    x: Vec<f64>,
    y: Vec<f64>,
    color: &'static str,
    dash: DashType,
    mode: Mode,
    symbol: MarkerSymbol,
}

impl Curve {
    /// A solid line. Of long curves every peak is kept, whatever is left out.
    pub(crate) fn new(name: impl Into<String>, x: &[f64], y: Vec<f64>, color: &'static str) -> Self {
        let (x, y) = thinned(x, y);
        let (mode, symbol) = (Mode::Lines, MarkerSymbol::Circle);
        Self { name: name.into(), x, y, color, dash: DashType::Solid, mode, symbol }
    }

    /// A line with its points: one that has a neighbour on neither side is seen as well.
    pub(crate) fn with_points(self) -> Self {
        Self { mode: Mode::LinesMarkers, ..self }
    }

    /// Points without a line: samples that do not follow from each other.
    pub(crate) fn points(self) -> Self {
        Self { mode: Mode::Markers, ..self }
    }

    /// Crosses without a line: what happened where there is no value.
    pub(crate) fn crosses(self) -> Self {
        Self { symbol: MarkerSymbol::X, ..self.points() }
    }

    pub(crate) fn dashed(self) -> Self {
        Self { dash: DashType::Dash, ..self }
    }

    pub(crate) fn dotted(self) -> Self {
        Self { dash: DashType::Dot, ..self }
    }
}

/// At most [`POINTS`] points: of each stretch the lowest and the highest, in their order.
fn thinned(x: &[f64], y: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let length = (2 * y.len()).div_ceil(POINTS);
    if length <= 2 {
        return (rounded(x.to_vec()), rounded(y));
    }
    let (mut xs, mut ys) = (Vec::with_capacity(POINTS + 2), Vec::with_capacity(POINTS + 2));
    for (x, y) in x.chunks(length).zip(y.chunks(length)) {
        let pick = |better: fn(f64, f64) -> bool| {
            (0..y.len()).reduce(|best, i| if better(y[i], y[best]) { i } else { best }).unwrap_or(0)
        };
        let (low, high) = (pick(|a, b| a < b), pick(|a, b| a > b));
        for i in if low == high { vec![low] } else { vec![low.min(high), low.max(high)] } {
            xs.push(x[i]);
            ys.push(y[i]);
        }
    }
    (rounded(xs), rounded(ys))
}

/// Six significant digits: finer than any screen, and a third of the page's size. Where values lie close together, as a speed
/// that is held, up to nine: the browser zooms in on what differs, and would show the steps.
fn rounded(values: Vec<f64>) -> Vec<f64> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let largest = finite().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let span = finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min);
    let more = if span > 0.0 { (largest / span).log10().ceil().clamp(0.0, 3.0) } else { 0.0 };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "5 to 8")]
    let digits = 5 + more as usize;
    values.into_iter().map(|value| format!("{value:.digits$e}").parse().unwrap_or(value)).collect()
}

/// A plot with its place on the page.
#[derive(Clone)]
pub(crate) struct Chart {
    id: String,
    title: String,
    note: String,
    axes: [String; 2],
    log: [bool; 2],
    ranges: [Option<[f64; 2]>; 2],
    plot: Plot,
}

/// A chart of curves; `id` is unique on its page.
pub(crate) fn chart(labels: [&str; 3], axes: [&str; 2], curves: Vec<Curve>) -> Chart {
    let mut plot = Plot::new();
    for curve in curves {
        let line = Line::new().color(curve.color).dash(curve.dash).width(2.0);
        let trace = Scatter::new(curve.x, curve.y).mode(curve.mode.clone()).name(curve.name).line(line);
        plot.add_trace(match curve.mode {
            Mode::Lines => trace,
            _ => trace.marker(Marker::new().color(curve.color).symbol(curve.symbol).size(6)),
        });
    }
    Chart::new(labels, axes, plot)
}

/// A map of values over two quantities; `z` has a row for each value of `y`. Its colours run from 0 to `most`, so that maps can be
/// compared; its axes end at the outermost values, in the middle of their cells.
pub(crate) fn heat_map(labels: [&str; 3], axes: [&str; 2], [x, y]: [&[f64]; 2], z: Vec<Vec<f64>>, most: f64) -> Chart {
    let mut plot = Plot::new();
    let scale = ColorScale::Palette(ColorScalePalette::Viridis);
    plot.add_trace(HeatMap::new(x.to_vec(), y.to_vec(), z).color_scale(scale).zmin(0.0).zmax(most));
    let ends = |values: &[f64]| Some([*values.first()?, *values.last()?]);
    Chart::new(labels, axes, plot).zoomed(ends(x), ends(y))
}

impl Chart {
    fn new([id, title, note]: [&str; 3], axes: [&str; 2], plot: Plot) -> Self {
        Self {
            id: id.to_owned(),
            title: title.to_owned(),
            note: note.to_owned(),
            axes: axes.map(str::to_owned),
            log: [false; 2],
            ranges: [None; 2],
            plot,
        }
    }

    /// With a logarithmic vertical axis.
    pub(crate) fn log_y(mut self) -> Self {
        self.log[1] = true;
        self
    }

    /// With a logarithmic horizontal axis.
    pub(crate) fn log_x(mut self) -> Self {
        self.log[0] = true;
        self
    }

    /// Shows this part at first; a logarithmic axis takes powers of ten.
    pub(crate) fn zoomed(mut self, x: Option<[f64; 2]>, y: Option<[f64; 2]>) -> Self {
        self.ranges = [x, y];
        self
    }

    /// With a place of its own on the page: many charts of one kind need different names.
    pub(crate) fn named(mut self, id: String) -> Self {
        self.id = id;
        self
    }

    /// What the browser draws.
    fn json(&self) -> String {
        let axis = |i: usize| {
            let axis = Axis::new().title(Title::with_text(&self.axes[i]));
            let axis = if self.log[i] { axis.type_(AxisType::Log) } else { axis };
            match self.ranges[i] {
                Some([low, high]) => axis.range(vec![low, high]),
                None => axis,
            }
        };
        let mut plot = self.plot.clone();
        plot.set_layout(
            Layout::new()
                .margin(Margin::new().left(60).right(10).top(30).bottom(45))
                .legend(Legend::new().x(0.0).y(-0.22).orientation(Orientation::Horizontal))
                .x_axis(axis(0))
                .y_axis(axis(1)),
        );
        plot.to_json()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_peak_and_the_order() {
        let x: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut y = vec![0.0; x.len()];
        (y[123], y[77_777]) = (5.0, -7.0);
        let (xs, ys) = thinned(&x, y);
        assert!(xs.len() <= POINTS + 2 && xs.is_sorted());
        let at = |value: f64| ys.iter().position(|y| *y == value).map(|i| xs[i]);
        assert_eq!((at(5.0), at(-7.0)), (Some(123.0), Some(77_777.0)));
    }

    #[test]
    fn digits_go_by_what_differs() {
        assert_eq!(rounded(vec![0.0, 14.123_456_789]), [0.0, 14.1235]);
        assert_eq!(rounded(vec![14.0, 14.000_123_456, f64::NAN])[1], 14.000_123_5);
        assert_eq!(rounded(vec![14.123_456_789; 2]), [14.1235; 2]);
    }

    #[test]
    fn short_curves_keep_all_points() {
        let x = [0.0, 1.0, 2.0];
        assert_eq!(thinned(&x, vec![1.0, f64::NAN, 3.0]).0, x);
    }
}

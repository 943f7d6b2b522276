//! Roads from tables of comma-separated values.
//!
//! The header names the columns: `x,y,v_x` for points of the line, or `s,kappa,v_x`; `grade`, `bank` (both rad) and `mu`
//! (a factor on the friction) may follow; `speed`, `curvature`, capitals and the unit in brackets are understood.
//! Lines that begin with `#` are comments.

mod smoothing;
mod spline;
mod table;

use super::{Profile, Tables};
use crate::Error;
use table::{Column, Table};

/// Grid that tables are resampled to [m].
const STEP: f64 = 0.1;
/// Longest road that a table may describe [m]; the resampled tables then take some 100 MB.
const LENGTH_MAX: f64 = 100_000.0;

/// The tables of a road; points may be missed by `tolerance` [m].
pub(super) fn tables(text: &str, tolerance: f64) -> Result<Tables, Error> {
    let table = Table::read(text)?;
    let geometry = match (table.column(Column::S), table.column(Column::Kappa)) {
        (Some(s), Some(kappa)) => Geometry::along(s, kappa, &table)?,
        _ => Geometry::through(&table, tolerance)?,
    };
    let Geometry { length, closed, ref nodes, .. } = geometry;
    if length > LENGTH_MAX {
        return Err(Error::Table(format!("{length} m are more than the {LENGTH_MAX} m that are taken")));
    }
    let over_nodes = |column: Column| table.column(column).map(|values| resample(nodes, values, length));
    let level = || resample(&[0.0, length], &[0.0, 0.0], length);
    let v_x = over_nodes(Column::Speed).expect("the header has been checked for a speed");
    let slopes = match (over_nodes(Column::Grade), over_nodes(Column::Bank)) {
        (None, None) => None,
        (grade, bank) => Some([grade.unwrap_or_else(level), bank.unwrap_or_else(level)]),
    };
    Ok(Tables {
        closed,
        slopes,
        friction: over_nodes(Column::Friction),
        start: geometry.start,
        ..Tables::plain(length, resample(&geometry.places, &geometry.kappa, length), v_x)
    })
}

/// The line of a road.
struct Geometry {
    length: f64,
    closed: bool,
    /// Arc length of each row [m].
    nodes: Vec<f64>,
    /// Arc lengths with known curvature [m], and the curvature there [1/m].
    places: Vec<f64>,
    kappa: Vec<f64>,
    start: super::Pose,
}

impl Geometry {
    /// Curvature over arc length.
    fn along(s: &[f64], kappa: &[f64], table: &Table) -> Result<Self, Error> {
        if let Some(i) = (1..s.len()).find(|&i| s[i] <= s[i - 1]) {
            let reason = format!("arc length {} does not exceed the {} before it", s[i], s[i - 1]);
            return Err(table.refuse(i, Column::S, reason));
        }
        let nodes: Vec<f64> = s.iter().map(|place| place - s[0]).collect();
        let length = nodes[nodes.len() - 1];
        let (places, kappa) = (nodes.clone(), kappa.to_vec());
        Ok(Self { length, closed: false, nodes, places, kappa, start: super::Pose::default() })
    }

    /// A smooth line through points.
    fn through(table: &Table, tolerance: f64) -> Result<Self, Error> {
        let (x, y) = table.points();
        for i in 1..x.len() {
            if (x[i] - x[i - 1]).hypot(y[i] - y[i - 1]) < 1e-3 {
                let reason = format!("({}, {}) repeats the point before it", x[i], y[i]);
                return Err(table.refuse(i, Column::X, reason));
            }
        }
        spline::line(x, y, tolerance).map_err(Error::Table)
    }
}

/// A function that is known at increasing places, as a profile.
fn resample(places: &[f64], values: &[f64], length: f64) -> Profile {
    let slopes = slopes(places, values);
    let mut cell = 0;
    Profile::new(length, STEP, |s| {
        while cell + 2 < places.len() && s > places[cell + 1] {
            cell += 1;
        }
        hermite(places, values, &slopes, cell, s)
    })
}

/// Slopes of the parabola through each point and its neighbours; straight at a road of two points.
fn slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let secant = |i: usize| (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
    (0..n)
        .map(|i| match i {
            0 => secant(0),
            i if i == n - 1 => secant(n - 2),
            i => {
                let (before, after) = (x[i] - x[i - 1], x[i + 1] - x[i]);
                (secant(i - 1) * after + secant(i) * before) / (before + after)
            }
        })
        .collect()
}

/// Value and slope of the cubic of one cell.
fn hermite(x: &[f64], y: &[f64], slope: &[f64], cell: usize, s: f64) -> (f64, f64) {
    let h = x[cell + 1] - x[cell];
    let t = (s - x[cell]) / h;
    let (d_0, d_1, rise) = (slope[cell] * h, slope[cell + 1] * h, y[cell + 1] - y[cell]);
    let (a, b) = (d_0 + d_1 - 2.0 * rise, 3.0 * rise - 2.0 * d_0 - d_1);
    (((a * t + b) * t + d_0) * t + y[cell], ((3.0 * a * t + 2.0 * b) * t + d_0) / h)
}

#[cfg(test)]
mod tests;

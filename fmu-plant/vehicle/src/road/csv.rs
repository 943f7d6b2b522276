//! Roads from tables of comma-separated values.

use super::{Pose, Profile, Tables};
use crate::Error;

/// Grid that tables are resampled to [m].
const STEP: f64 = 0.05;
/// Longest road that a table may describe [m]; the resampled table then takes some 60 MB.
const LENGTH_MAX: f64 = 100_000.0;

/// The tables of a road given as `s,kappa,v_x` with a header line.
pub(super) fn tables(text: &str) -> Result<Tables, Error> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| {
        let line = line.trim();
        !line.is_empty() && !line.starts_with('#')
    });
    let Some((header_line, header)) = lines.next() else {
        return Err(Error::Table("it is empty".to_owned()));
    };
    let names: Vec<&str> = header.trim_start_matches('\u{feff}').split(',').map(str::trim).collect();
    if names != ["s", "kappa", "v_x"] {
        return Err(Error::Csv {
            line: header_line + 1,
            column: 1,
            reason: format!("the header must be s,kappa,v_x, not \"{}\"", header.trim()),
        });
    }
    let mut rows: Vec<[f64; 3]> = Vec::new();
    for (line, text) in lines {
        let row = row(line + 1, text)?;
        if let Some(last) = rows.last()
            && row[0] <= last[0]
        {
            let reason = format!("arc length {} does not exceed the {} before it", row[0], last[0]);
            return Err(Error::Csv { line: line + 1, column: 1, reason });
        }
        rows.push(row);
    }
    let (Some(first), Some(last)) = (rows.first().copied(), rows.last().copied()) else {
        return Err(Error::Table("it has a header but no rows".to_owned()));
    };
    let length = last[0] - first[0];
    if rows.len() < 2 || length > LENGTH_MAX {
        let reason =
            format!("{} rows over {length} m; at least 2 rows and at most {LENGTH_MAX} m are taken", rows.len());
        return Err(Error::Table(reason));
    }
    let places: Vec<f64> = rows.iter().map(|row| row[0] - first[0]).collect();
    let profile = |column: usize| {
        let values: Vec<f64> = rows.iter().map(|row| row[column]).collect();
        let slopes = slopes(&places, &values);
        let mut cell = 0;
        Profile::new(length, STEP, |s| {
            while cell + 2 < places.len() && s > places[cell + 1] {
                cell += 1;
            }
            hermite(&places, &values, &slopes, cell, s)
        })
    };
    Ok(Tables { length, kappa: profile(1), v_x: profile(2), wind: None, start: Pose::default() })
}

/// The numbers of one line.
fn row(line: usize, text: &str) -> Result<[f64; 3], Error> {
    /// Largest sensible absolute value of each column, and its smallest.
    const LIMITS: [(f64, f64); 3] = [(-1e7, 1e7), (-1.0, 1.0), (0.0, 100.0)];
    let fields: Vec<&str> = text.split(',').map(str::trim).collect();
    if fields.len() != 3 {
        let column = fields.len().min(3) + usize::from(fields.len() > 3);
        return Err(Error::Csv { line, column, reason: format!("3 fields are wanted, {} found", fields.len()) });
    }
    let mut row = [0.0; 3];
    for (i, field) in fields.iter().enumerate() {
        let refuse = |reason| Error::Csv { line, column: i + 1, reason };
        row[i] = field.parse().map_err(|_| refuse(format!("\"{field}\" is not a number")))?;
        let (min, max) = LIMITS[i];
        if !(min..=max).contains(&row[i]) {
            return Err(refuse(format!("{field} lies outside {min} to {max}")));
        }
    }
    Ok(row)
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
mod tests {
    use crate::Road;

    #[test]
    fn table_of_a_parabola_is_reproduced() {
        let text: String = std::iter::once("s,kappa,v_x\n".to_owned())
            .chain((0..20).map(|i| format!("{},{},{}\n", i * 5, f64::from(i * i) * 1e-4, 10.0)))
            .collect();
        let road = Road::from_csv(&text).unwrap();
        // Inner slopes of a parabola are exact, so is the cubic.
        for s in [12.0, 43.7, 80.1] {
            let want = (s / 5.0_f64).powi(2) * 1e-4;
            assert!((road.curvature(s) - want).abs() < 1e-12, "{} for {want}", road.curvature(s));
        }
        assert!((road.length() - 95.0).abs() < 1e-12);
    }

    #[test]
    fn bad_tables_are_refused_with_line_and_column() {
        for (text, message) in [
            ("", "road table: it is empty"),
            ("s,kappa,v_x\n", "road table: it has a header but no rows"),
            ("a,b\n1,2\n", "road table, line 1, column 1: the header must be s,kappa,v_x, not \"a,b\""),
            ("s,kappa,v_x\n0,0,10\n\n5,zero,10\n", "road table, line 4, column 2: \"zero\" is not a number"),
            ("s,kappa,v_x\n0,0,10\n5,0\n", "road table, line 3, column 2: 3 fields are wanted, 2 found"),
            ("s,kappa,v_x\n0,0,10\n5,0,1,7\n", "road table, line 3, column 4: 3 fields are wanted, 4 found"),
            ("s,kappa,v_x\n0,0,10\n5,0,NaN\n", "road table, line 3, column 3: NaN lies outside 0 to 100"),
            (
                "s,kappa,v_x\n5,0,10\n5,0,10\n",
                "road table, line 3, column 1: arc length 5 does not exceed the 5 before it",
            ),
        ] {
            assert_eq!(Road::from_csv(text).unwrap_err().to_string(), message);
        }
    }
}

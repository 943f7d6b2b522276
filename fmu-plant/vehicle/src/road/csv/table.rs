//! Reading the table. Numbers need no quoting, so a row is its line split at the commas, and every complaint knows its place.

use crate::Error;

/// What a column means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// Arc length [m].
    S,
    /// Curvature [1/m].
    Kappa,
    /// Position along the start of the road [m].
    X,
    /// Position to the left of it [m].
    Y,
    /// Wanted speed [m/s].
    Speed,
    /// Slope, uphill positive [rad].
    Grade,
    /// Cross slope, left side up positive [rad].
    Bank,
    /// Factor on the friction [1].
    Friction,
}

/// Each column's name, its unit and the range of its values: what no road exceeds.
const COLUMNS: [(Column, &str, &str, f64, f64); 8] = [
    (Column::S, "s", "m", -1e7, 1e7),
    (Column::Kappa, "kappa", "1/m", -1.0, 1.0),
    (Column::X, "x", "m", -1e7, 1e7),
    (Column::Y, "y", "m", -1e7, 1e7),
    (Column::Speed, "v_x", "m/s", 0.0, 100.0),
    (Column::Grade, "grade", "rad", -0.5, 0.5),
    (Column::Bank, "bank", "rad", -0.5, 0.5),
    (Column::Friction, "mu", "1", 0.0, 2.0),
];

/// What people also call a column.
const ALIASES: [(&str, &str); 2] = [("speed", "v_x"), ("curvature", "kappa")];
/// What separates fields elsewhere.
const OTHER_SEPARATORS: [(char, &str); 2] = [(';', "semicolons"), ('\t', "tabs")];

/// What a header must hold, one of these.
const WANTED: [[Column; 3]; 2] = [[Column::S, Column::Kappa, Column::Speed], [Column::X, Column::Y, Column::Speed]];

/// A table with named columns of equal length.
pub struct Table {
    columns: Vec<(Column, Vec<f64>)>,
    /// Line of each row in the file.
    lines: Vec<usize>,
}

impl Table {
    /// Reads and checks a table.
    pub fn read(text: &str) -> Result<Self, Error> {
        let text = text.trim_start_matches('\u{feff}');
        let mut rows =
            (1..).zip(text.lines().map(str::trim)).filter(|(_, row)| !row.is_empty() && !row.starts_with('#'));
        let (line, header) = rows.next().ok_or_else(|| Error::Table("it is empty".to_owned()))?;
        let mut columns = header_columns(line, header)?;
        let mut lines = Vec::new();
        for (line, row) in rows {
            let found = row.split(',').count();
            if found != columns.len() {
                let missing = columns
                    .get(found)
                    .map_or_else(String::new, |(column, _)| format!(": {} is missing", described(*column).1));
                let wanted = commas_wanted(row).map_or_else(String::new, |reason| format!("; {reason}"));
                let reason = format!("{} fields are wanted, {found} found{missing}{wanted}", columns.len());
                return Err(Error::Csv { line, column: found.min(columns.len()) + 1, reason });
            }
            for (i, (field, (column, values))) in row.split(',').map(str::trim).zip(&mut columns).enumerate() {
                let refuse = |reason| Error::Csv { line, column: i + 1, reason };
                let value: f64 = field.parse().map_err(|_| refuse(format!("\"{field}\" is not a number")))?;
                let (_, name, unit, min, max) = described(*column);
                if !(min..=max).contains(&value) {
                    let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
                    return Err(refuse(format!("{name} = {field} lies outside {min} to {max}{unit}")));
                }
                values.push(value);
            }
            lines.push(line);
        }
        match lines.len() {
            0 => Err(Error::Table("it has a header but no rows".to_owned())),
            1 => Err(Error::Table("one row is no road".to_owned())),
            _ => Ok(Self { columns, lines }),
        }
    }

    /// The values of a column, if the table has it.
    pub fn column(&self, column: Column) -> Option<&[f64]> {
        self.columns.iter().find(|(known, _)| *known == column).map(|(_, values)| values.as_slice())
    }

    /// The points of a table that has them.
    pub fn points(&self) -> (&[f64], &[f64]) {
        let column = |column| self.column(column).expect("a header without arc length has been checked for points");
        (column(Column::X), column(Column::Y))
    }

    /// A refusal of a value.
    pub fn refuse(&self, row: usize, column: Column, reason: String) -> Error {
        let place = self.columns.iter().position(|(known, _)| *known == column).unwrap_or(0);
        Error::Csv { line: self.lines[row], column: place + 1, reason }
    }
}

fn described(column: Column) -> (Column, &'static str, &'static str, f64, f64) {
    *COLUMNS.iter().find(|(known, ..)| *known == column).expect("every column is described")
}

/// A column's name as the table knows it, and the unit that may stand behind it in brackets.
fn name_and_unit(field: &str) -> (String, Option<&str>) {
    let (name, unit) = match field.strip_suffix(']').and_then(|field| field.split_once('[')) {
        Some((name, unit)) => (name.trim_end(), Some(unit.trim())),
        None => (field, None),
    };
    let name = name.to_ascii_lowercase();
    let known = ALIASES.iter().find(|(alias, _)| *alias == name).map(|(_, known)| (*known).to_owned());
    (known.unwrap_or(name), unit)
}

/// What to say of a line whose fields something else separates.
fn commas_wanted(line: &str) -> Option<String> {
    let (_, other) = OTHER_SEPARATORS.iter().find(|(separator, _)| line.contains(*separator))?;
    Some(format!("commas are wanted between the fields, not {other}"))
}

fn header_columns(line: usize, header: &str) -> Result<Vec<(Column, Vec<f64>)>, Error> {
    if let Some(reason) = commas_wanted(header).filter(|_| !header.contains(',')) {
        return Err(Error::Csv { line, column: 1, reason });
    }
    if header.split(',').all(|field| field.trim().parse::<f64>().is_ok()) {
        let reason = "the header is missing: the first line names the columns, s,kappa,v_x or x,y,v_x".to_owned();
        return Err(Error::Csv { line, column: 1, reason });
    }
    let mut columns: Vec<(Column, Vec<f64>)> = Vec::new();
    for (i, name) in header.split(',').map(str::trim).enumerate() {
        let refuse = |reason| Err(Error::Csv { line, column: i + 1, reason });
        let (plain, given) = name_and_unit(name);
        let Some(&(column, known, unit, ..)) = COLUMNS.iter().find(|(_, known, ..)| *known == plain) else {
            let known = COLUMNS.map(|(_, known, ..)| known).join(", ");
            return refuse(format!("unknown column \"{name}\": known are {known}"));
        };
        if given.is_some_and(|given| !given.eq_ignore_ascii_case(unit)) {
            return refuse(format!("\"{name}\" has another unit than {known} is read in: {unit}"));
        }
        if columns.iter().any(|(other, _)| *other == column) {
            return refuse(format!("column \"{name}\" comes twice"));
        }
        columns.push((column, Vec::new()));
    }
    let has = |column: &Column| columns.iter().any(|(known, _)| known == column);
    let complete = WANTED.iter().filter(|wanted| wanted.iter().all(has)).count();
    if complete == 1 {
        return Ok(columns);
    }
    let reason = "the header must hold either s,kappa,v_x or x,y,v_x".to_owned();
    Err(Error::Csv { line, column: 1, reason })
}

//! The stored runs of the nonlinear MPC, as `tools/reference/nmpc.py` wrote them.

use std::collections::HashMap;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};

use crate::archive::Files;
use crate::recording::{Recording, Row, columns};
use crate::workspace;

/// The archive with all runs.
#[derive(Clone, Debug)]
pub struct Reference {
    files: Files,
}

/// A table by its columns.
struct Table(HashMap<String, Vec<f64>>);

impl Table {
    fn parse(text: &str) -> Result<Self> {
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().context("a table without a line")?.split(',').collect();
        let mut columns = vec![Vec::new(); names.len()];
        for line in lines {
            let cells: Vec<&str> = line.split(',').collect();
            ensure!(cells.len() == names.len(), "a line of {} cells under {} names", cells.len(), names.len());
            for (column, cell) in columns.iter_mut().zip(cells) {
                column.push(cell.parse().with_context(|| format!("not a number: {cell}"))?);
            }
        }
        Ok(Self(names.into_iter().map(str::to_owned).zip(columns).collect()))
    }
}

/// Where it lies.
pub fn folder() -> PathBuf {
    workspace::root().join("tools").join("reference")
}

impl Reference {
    /// Reads the archive beside its script.
    pub fn open() -> Result<Self> {
        Ok(Self { files: Files::open(&folder().join("nmpc.zip"))? })
    }

    fn table(&self, name: &str) -> Result<Table> {
        let bytes = self.files.get(name).with_context(|| format!("nmpc.zip has no {name}"))?;
        Table::parse(std::str::from_utf8(bytes)?).with_context(|| format!("in {name}"))
    }

    /// A run as a recording; what the script does not know is not a number.
    pub fn run(&self, id: &str) -> Result<Recording> {
        let Table(table) = self.table(&format!("{id}.csv"))?;
        let samples = table.get("t").map_or(0, Vec::len);
        let mut recording = Recording { rows: vec![[f64::NAN; size_of::<Row>() / size_of::<f64>()]; samples] };
        for (index, (name, _)) in columns().enumerate() {
            let Some(values) = table.get(name) else { continue };
            for (row, value) in recording.rows.iter_mut().zip(values) {
                row[index] = *value;
            }
        }
        Ok(recording)
    }

    /// Computing times of a run [s].
    pub fn times(&self, id: &str) -> Result<Vec<f64>> {
        let Table(mut table) = self.table(&format!("{id}.csv"))?;
        table.remove("solve_time").context("no column solve_time")
    }

    /// Weights that the runs were made with and that are not the parameters' any more.
    pub fn stale(&self, p: &lpv_mpc::Parameters) -> Result<Vec<String>> {
        let Table(weights) = self.table("weights.csv")?;
        let now = [
            ("q_v_x", p.q_v_x),
            ("q_v_y", p.q_v_y),
            ("q_yaw_rate", p.q_yaw_rate),
            ("q_e_y", p.q_e_y),
            ("q_e_psi", p.q_e_psi),
            ("r_delta", p.r_delta),
            ("r_a_x", p.r_a_x),
        ];
        let then = |name: &str| weights.get(name).and_then(|values| values.first().copied()).unwrap_or(f64::NAN);
        Ok(now
            .into_iter()
            .filter(|(name, value)| *value != then(name))
            .map(|(name, value)| format!("{name} {} then, {value} now", then(name)))
            .collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stored_run_reaches_the_end_of_its_road() {
        let reference = Reference::open().unwrap();
        let runs = [
            ("lane_change", 200.0),
            ("lane_change_ideal", 200.0),
            ("lane_change_wind", 200.0),
            ("lane_change_wind_felt", 200.0),
            ("lane_change_wind_felt_ideal", 200.0),
            ("general", 2000.0),
            ("general_felt", 2000.0),
            ("general_felt_ideal", 2000.0),
            ("general_untold", 2000.0),
        ];
        for (id, length) in runs {
            let run = reference.run(id).unwrap();
            let last = *run.column("s").last().unwrap();
            // The last row is the sample before the end: one period at up to 25 m/s.
            assert!(last > length - 1.0 && last <= length, "{id} ends at {last} m");
            assert_eq!(reference.times(id).unwrap().len(), run.rows.len());
            assert!(run.column("status").iter().all(|value| value.is_nan()));
        }
    }
}

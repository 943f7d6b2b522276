//! What a robust controller must show: each case with what is asked of it, the runs that show it, and the figure that counts.

mod actuators;
mod disturbances;
mod grip;
mod standstill;

use anyhow::Result;

use super::scenario::Scenario;
use crate::recording::Recording;

/// The figure of a run that counts, in SI units.
pub type Measure = fn(&Recording) -> f64;

/// One line of the list.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name on the command line.
    pub name: &'static str,
    /// What is asked.
    pub asked: &'static str,
    /// What the figure may be at most, in SI units; none where it is only shown.
    pub limit: Option<f64>,
    /// Unit of the table, and what one SI unit is in it.
    pub unit: (&'static str, f64),
    /// What is driven; the worst counts.
    pub scenarios: Vec<Scenario>,
    /// What counts.
    pub measure: Measure,
}

/// Unit of lateral errors.
const CM: (&str, f64) = ("cm", 100.0);

/// Seeds of the sensor noise: enough that one lucky draw decides nothing, few enough for a minute.
const SEEDS: [f64; 5] = [1.0, 2.0, 3.0, 4.0, 5.0];

/// Every case, in the order of the table.
pub fn all() -> Vec<Case> {
    [actuators::cases(), disturbances::cases(), grip::cases(), standstill::cases()].into_iter().flatten().collect()
}

/// A case with its runs' figures, in SI units.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The case.
    pub case: Case,
    /// Figure of each scenario; infinite where the vehicle was lost.
    pub figures: Vec<f64>,
}

impl Verdict {
    /// The worst scenario: its index and figure.
    pub fn worst(&self) -> (usize, f64) {
        let figures = self.figures.iter().copied().enumerate();
        figures.fold((0, 0.0), |worst, next| if next.1.is_nan() || next.1 > worst.1 { next } else { worst })
    }

    /// Whether what is asked is shown; none where nothing is asked.
    pub fn passed(&self) -> Option<bool> {
        // Written so that NaN does not pass.
        self.case.limit.map(|limit| self.worst().1 <= limit)
    }
}

/// The figure of one scenario at communication steps of `step` [s].
///
/// # Errors
/// If a parameter is unknown or out of its range.
pub fn measure(case: &Case, scenario: &Scenario, step: f64) -> Result<f64> {
    Ok(scenario.drive(step)?.as_ref().map_or(f64::INFINITY, case.measure))
}

/// Largest lateral error [m].
fn lateral(run: &Recording) -> f64 {
    lateral_from(run, 0.0)
}

/// Largest lateral error from a time [s] on [m].
fn lateral_from(run: &Recording, from: f64) -> f64 {
    within(run, "e_y_true", from, f64::INFINITY).map(f64::abs).fold(0.0, worse)
}

/// Values of a column between two times [s].
fn within(run: &Recording, column: &str, from: f64, to: f64) -> impl Iterator<Item = f64> {
    let times = run.column("t");
    times.into_iter().zip(run.column(column)).filter(move |(t, _)| (from..=to).contains(t)).map(|(_, value)| value)
}

/// The larger; `f64::max` would drop a NaN, and a run that went wrong must not look good.
fn worse(max: f64, value: f64) -> f64 {
    if max.is_nan() || value <= max { max } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(figures: &[f64]) -> Verdict {
        let case = all().swap_remove(0);
        Verdict { case: Case { limit: Some(1.0), ..case }, figures: figures.to_vec() }
    }

    #[test]
    fn the_worst_run_decides_and_a_lost_one_never_passes() {
        assert_eq!((verdict(&[0.2, 0.9, 0.1]).worst(), verdict(&[0.2, 0.9, 0.1]).passed()), ((1, 0.9), Some(true)));
        assert_eq!(verdict(&[0.2, 1.1]).passed(), Some(false));
        assert_eq!(verdict(&[f64::INFINITY, 0.1]).passed(), Some(false));
        for figures in [[f64::NAN, 0.1], [0.1, f64::NAN]] {
            assert_eq!(verdict(&figures).passed(), Some(false), "{figures:?}");
        }
    }

    #[test]
    fn cases_have_names_of_their_own_and_runs() {
        let all = all();
        for (i, case) in all.iter().enumerate() {
            assert!(!case.scenarios.is_empty(), "{}", case.name);
            assert!(all[..i].iter().all(|other| other.name != case.name), "{} comes twice", case.name);
        }
    }

    #[test]
    fn a_window_in_time_leaves_the_rest_out() {
        let index = |name| crate::recording::columns().position(|(column, _)| column == name).unwrap();
        let mut run = Recording { rows: vec![Default::default(); 4] };
        for (row, (t, e_y)) in run.rows.iter_mut().zip([(0.0, 9.0), (1.0, 1.0), (2.0, -3.0), (3.0, 2.0)]) {
            (row[index("t")], row[index("e_y_true")]) = (t, e_y);
        }
        assert_eq!([lateral(&run), lateral_from(&run, 0.5), lateral_from(&run, 2.5)], [9.0, 3.0, 2.0]);
        run.rows[3][index("e_y_true")] = f64::NAN;
        assert!(lateral(&run).is_nan(), "a run that went wrong looks good");
    }
}

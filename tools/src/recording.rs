//! What a closed loop leaves behind: one sample for each communication point, from the cores or from the FMUs.

use crate::output::table;

/// Names of the plant's outputs that are recorded, with their units.
pub const PLANT_COLUMNS: [(&str, &str); 20] = [
    ("x", "m"),
    ("y", "m"),
    ("psi", "rad"),
    ("s", "m"),
    ("v_x_true", "m/s"),
    ("v_y_true", "m/s"),
    ("yaw_rate_true", "rad/s"),
    ("e_y_true", "m"),
    ("e_psi_true", "rad"),
    ("v_x_ref[1]", "m/s"),
    ("kappa_ref[1]", "1/m"),
    ("a_lat", "m/s2"),
    ("alpha_f", "rad"),
    ("alpha_r", "rad"),
    ("delta_actual", "rad"),
    ("a_x_actual", "m/s2"),
    ("grip_usage", "1"),
    ("wind_speed_actual", "m/s"),
    ("c_f_true", "N/rad"),
    ("c_r_true", "N/rad"),
];

/// Names of the controller's outputs that are recorded, with their units.
pub const CONTROLLER_COLUMNS: [(&str, &str); 8] = [
    ("delta", "rad"),
    ("a_x", "m/s2"),
    ("c_f", "N/rad"),
    ("c_r", "N/rad"),
    ("status", "1"),
    ("iterations", "1"),
    ("kkt_residual", "1"),
    ("slack_e_y", "m"),
];

/// Values of all columns at one communication point, time first.
pub type Row = [f64; 1 + PLANT_COLUMNS.len() + CONTROLLER_COLUMNS.len()];

/// A run's samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Samples in the order of time.
    pub rows: Vec<Row>,
}

/// All columns with their units, time first.
pub fn columns() -> impl Iterator<Item = (&'static str, &'static str)> {
    std::iter::once(("t", "s")).chain(PLANT_COLUMNS).chain(CONTROLLER_COLUMNS)
}

impl Recording {
    /// All values of one column.
    ///
    /// # Panics
    /// If there is no such column: the names are fixed above, so a wrong one is a mistake in this program.
    pub fn column(&self, name: &str) -> Vec<f64> {
        let index =
            columns().position(|(column, _)| column == name).unwrap_or_else(|| panic!("no column {name} is recorded"));
        self.rows.iter().map(|row| row[index]).collect()
    }

    /// The recording as CSV: a line of names, a line of units, then numbers that read back to the same bits.
    pub fn csv(&self) -> String {
        let join = |cells: Vec<String>| cells.join(",") + "\n";
        let mut text = join(columns().map(|(name, _)| name.to_owned()).collect());
        text += &join(columns().map(|(_, unit)| unit.to_owned()).collect());
        for row in &self.rows {
            text += &join(row.iter().map(f64::to_string).collect());
        }
        text
    }

    /// The path's own points, from the vehicle's position and its errors.
    pub fn path(&self) -> (Vec<f64>, Vec<f64>) {
        let [x, y, psi, e_y, e_psi] = ["x", "y", "psi", "e_y_true", "e_psi_true"].map(|name| self.column(name));
        let point = |i: usize| {
            let (sin, cos) = (psi[i] - e_psi[i]).sin_cos();
            (x[i] + e_y[i] * sin, y[i] - e_y[i] * cos)
        };
        (0..x.len()).map(point).unzip()
    }

    /// Direction of motion minus direction of the path [rad]: the heading error without the sideslip of the body.
    ///
    /// A car whose rear axle has to follow a curve cannot keep its body on the path's heading, whoever steers: its sideslip
    /// follows from geometry and tyres. The course it can keep.
    pub fn course_error(&self) -> Vec<f64> {
        let [v_x, v_y, e_psi] = ["v_x_true", "v_y_true", "e_psi_true"].map(|name| self.column(name));
        (0..v_x.len()).map(|i| e_psi[i] + v_y[i].atan2(v_x[i])).collect()
    }

    /// Every n-th sample and the last one: enough for a picture.
    #[must_use]
    pub fn thinned(&self, every: usize) -> Self {
        let last = self.rows.len().saturating_sub(1);
        let rows = self.rows.iter().enumerate();
        Self {
            rows: rows.filter(|(index, _)| index % every.max(1) == 0 || *index == last).map(|(_, row)| *row).collect(),
        }
    }
}

/// How well a run followed its path and its speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracking {
    /// Largest lateral error [m].
    pub e_y_max: f64,
    /// Largest heading error [rad].
    pub e_psi_max: f64,
    /// Largest speed error [m/s].
    pub speed_max: f64,
    /// Largest error of the course, see [`Recording::course_error`] [rad].
    pub course_max: f64,
    /// Root of the mean squared lateral error [m].
    pub e_y_rms: f64,
    /// Root of the mean squared heading error [rad].
    pub e_psi_rms: f64,
    /// Root of the mean squared speed error [m/s].
    pub speed_rms: f64,
    /// Root of the mean squared error of the course [rad].
    pub course_rms: f64,
}

/// What the paper reports for its best controller; its "MSE" are root mean squares, as its own maxima show.
///
/// Its heading stands beside the course, since no body can keep the path's heading in a curve.
pub const PAPER: Tracking = Tracking {
    e_y_max: 0.023,
    e_psi_max: 4.5 * std::f64::consts::PI / 180.0,
    speed_max: 0.095,
    course_max: 4.5 * std::f64::consts::PI / 180.0,
    e_y_rms: 0.0069,
    e_psi_rms: 0.0191,
    speed_rms: 0.0212,
    course_rms: 0.0191,
};

impl Tracking {
    /// Evaluates a run.
    pub fn of(recording: &Recording) -> Self {
        let speed: Vec<f64> = recording
            .column("v_x_true")
            .iter()
            .zip(recording.column("v_x_ref[1]"))
            .map(|(v_x, v_x_ref)| v_x - v_x_ref)
            .collect();
        let e_y = recording.column("e_y_true");
        let e_psi = recording.column("e_psi_true");
        let course = recording.course_error();
        Self {
            e_y_max: max(&e_y),
            e_psi_max: max(&e_psi),
            speed_max: max(&speed),
            course_max: max(&course),
            e_y_rms: rms(&e_y),
            e_psi_rms: rms(&e_psi),
            speed_rms: rms(&speed),
            course_rms: rms(&course),
        }
    }

    /// The figures as a person reads them: name, unit, and the value with its digits.
    ///
    /// The body's heading has no figure of the paper beside it: what the paper reports is compared with the course, as in
    /// README.md.
    pub fn figures(&self) -> [(&'static str, &'static str, String); 8] {
        let heading = |angle: f64| if *self == PAPER { String::new() } else { format!("{:.3}", angle.to_degrees()) };
        [
            ("lateral error, largest", "cm", format!("{:.3}", self.e_y_max * 100.0)),
            ("lateral error, rms", "cm", format!("{:.3}", self.e_y_rms * 100.0)),
            ("course error, largest", "deg", format!("{:.3}", self.course_max.to_degrees())),
            ("course error, rms", "deg", format!("{:.3}", self.course_rms.to_degrees())),
            ("heading error, largest", "deg", heading(self.e_psi_max)),
            ("heading error, rms", "deg", heading(self.e_psi_rms)),
            ("speed error, largest", "m/s", format!("{:.4}", self.speed_max)),
            ("speed error, rms", "m/s", format!("{:.4}", self.speed_rms)),
        ]
    }
}

/// Largest magnitude. `f64::max` would drop a NaN: a run that went wrong must not look good.
pub fn max(values: &[f64]) -> f64 {
    let worse = |max: f64, value: &f64| match value.abs() {
        value if max.is_nan() || value <= max => max,
        value => value,
    };
    values.iter().fold(0.0, worse)
}

/// Root of the mean square.
pub fn rms(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|value| value * value).sum();
    (sum / values.len().max(1) as f64).sqrt()
}

/// A table of several runs beside each other, one line a figure.
pub fn tracking_rows(runs: &[(&str, Tracking)]) -> Vec<Vec<String>> {
    let head = ["", ""].into_iter().chain(runs.iter().map(|(name, _)| *name));
    let mut rows = vec![head.map(str::to_owned).collect::<Vec<_>>()];
    let figures: Vec<_> = runs.iter().map(|(_, tracking)| tracking.figures()).collect();
    for line in 0..PAPER.figures().len() {
        let (name, unit, _) = PAPER.figures()[line];
        let values = figures.iter().map(|run| run[line].2.clone());
        rows.push([name.to_owned(), unit.to_owned()].into_iter().chain(values).collect());
    }
    rows
}

/// The same table as lines of text.
pub fn tracking_table(runs: &[(&str, Tracking)]) -> Vec<String> {
    table(&tracking_rows(runs))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(e_y: &[f64]) -> Recording {
        let index = columns().position(|(name, _)| name == "e_y_true").unwrap();
        let rows = e_y.iter().enumerate().map(|(t, &e_y)| {
            let mut row = [0.0; columns_count()];
            row[0] = t as f64;
            row[index] = e_y;
            row
        });
        Recording { rows: rows.collect() }
    }

    const fn columns_count() -> usize {
        1 + PLANT_COLUMNS.len() + CONTROLLER_COLUMNS.len()
    }

    #[test]
    fn errors_count_on_both_sides() {
        let tracking = Tracking::of(&run(&[0.03, -0.04]));
        assert!((tracking.e_y_max - 0.04).abs() < 1e-15);
        // sqrt((9 + 16) / 2) = 3.5355...
        assert!((tracking.e_y_rms - 0.035_355_339_059_327_38).abs() < 1e-15);
    }

    #[test]
    fn the_papers_heading_stands_beside_the_course() {
        let rows = tracking_rows(&[("paper", PAPER), ("ours", Tracking { speed_rms: 0.000_34, ..PAPER })]);
        let row = |name: &str| rows.iter().find(|row| row[0] == name).unwrap()[2..].to_vec();
        assert_eq!(row("course error, largest"), ["4.500", "4.500"]);
        assert_eq!(row("heading error, largest"), ["", "4.500"]);
        // A speed is kept to fractions of a millimetre a second: three digits would show nothing of it.
        assert_eq!(row("speed error, rms"), ["0.0212", "0.0003"]);
    }

    #[test]
    fn a_run_with_nan_does_not_look_good() {
        assert!(Tracking::of(&run(&[0.0, f64::NAN, 0.0])).e_y_max.is_nan());
    }

    #[test]
    fn csv_reads_back_to_the_same_bits() {
        let recording = run(&[0.1 + 0.2, 1.0 / 3.0]);
        let csv = recording.csv();
        let index = columns().position(|(name, _)| name == "e_y_true").unwrap();
        let read: Vec<f64> =
            csv.lines().skip(2).map(|line| line.split(',').nth(index).unwrap().parse().unwrap()).collect();
        assert_eq!(read, recording.column("e_y_true"));
    }

    #[test]
    fn thinning_keeps_the_last_sample() {
        let thin = run(&[0.0, 1.0, 2.0, 3.0]).thinned(2);
        assert_eq!(thin.column("t"), [0.0, 2.0, 3.0]);
    }
}

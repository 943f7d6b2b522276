//! What a person sees on the terminal: results on stdout, progress on stderr.

use std::io::{IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Where results go.
#[derive(Clone, Copy, Debug, Default)]
pub struct Output {
    /// Say nothing; tests use it.
    pub quiet: bool,
}

impl Output {
    /// Prints one line of a result. A closed pipe (`| head`) is the reader's wish, not an error.
    pub fn line(&self, text: &str) {
        if !self.quiet {
            let _closed = writeln!(std::io::stdout().lock(), "{text}");
        }
    }

    /// A spinner for work of unknown length; invisible where stderr is no terminal.
    pub fn progress(&self, message: &str) -> ProgressBar {
        if self.quiet {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::new_spinner().with_message(message.to_owned());
        bar.enable_steady_tick(Duration::from_millis(100));
        bar
    }

    /// A line of progress for whoever reads stderr from a file, where bars are invisible.
    pub fn milestone(&self, text: &str) {
        let mut stderr = std::io::stderr().lock();
        if !self.quiet && !stderr.is_terminal() {
            let _closed = writeln!(stderr, "{text}");
        }
    }

    /// A line on stderr beside the results.
    pub fn remark(&self, text: &str) {
        if !self.quiet {
            let _closed = writeln!(std::io::stderr().lock(), "{text}");
        }
    }

    /// A bar over a known number of steps.
    pub fn bar(&self, message: &str, steps: u64) -> ProgressBar {
        if self.quiet {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{msg} [{bar:40}] {percent:>3} %")
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .progress_chars("=> ");
        ProgressBar::new(steps).with_style(style).with_message(message.to_owned())
    }
}

/// A number as people write it, to four digits: powers of ten only where zeros would have to be counted.
pub fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if rounded == 0.0 || (1e-4..1e6).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

/// A change as a whole number of percent; none has no sign.
pub fn percent(change: f64) -> String {
    let rounded = (100.0 * change).round();
    if rounded == 0.0 { "0 %".to_owned() } else { format!("{rounded:+} %") }
}

/// Rows of cells as aligned text: the first column to the left, numbers to the right.
pub fn table(rows: &[Vec<String>]) -> Vec<String> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    rows.iter()
        .map(|row| {
            let cells: Vec<String> = row
                .iter()
                .zip(&widths)
                .enumerate()
                .map(|(column, (cell, &width))| match column {
                    0 => format!("{cell:<width$}"),
                    _ => format!("{cell:>width$}"),
                })
                .collect();
            cells.join("  ").trim_end().to_owned()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        let numbers = [5.0, 1.00634, 300.0, 1e-3, 1.03784e-4, 1.02841e-5, 1e-5, -1.5e7, 0.0].map(number);
        assert_eq!(numbers, ["5", "1.006", "300", "0.001", "0.0001038", "1.028e-5", "1e-5", "-1.5e7", "0"]);
    }

    #[test]
    fn no_change_has_no_sign() {
        assert_eq!([1e-9, -1e-9, -0.004, 0.126, -0.08].map(percent), ["0 %", "0 %", "0 %", "+13 %", "-8 %"]);
    }

    #[test]
    fn columns_of_a_table_line_up() {
        let rows = [vec!["a".into(), "1.5".into()], vec!["long".into(), "22.25".into()]];
        assert_eq!(table(&rows), ["a       1.5", "long  22.25"]);
    }
}

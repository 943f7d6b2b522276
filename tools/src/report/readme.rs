//! The results in README.md: written by this command, and checked by a test.
//!
//! Only what a few seconds can drive again stands there; computing times, which differ from machine to machine, do not.

use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use rayon::prelude::*;

use super::reference::Reference;
use super::runs::{Figures, STEP, Situation, Who, ours, run};
use crate::archive::{read_text, write_whole};
use crate::recording::PAPER;
use crate::workspace;

/// What encloses the results.
const BEGIN: &str = "<!-- results: written by cargo fmu report --readme -->\n";
const END: &str = "<!-- end of results -->\n";
/// Communication steps of the first table [s]: fine, and one whole sample of the controller.
const STEPS: [f64; 2] = [STEP, 0.033];
/// Speeds of the lane change near the limit of grip [m/s].
const LIMIT: [&str; 3] = ["14", "16", "17"];
/// By how much a number may change before the text is wrong: a tenth of it, or one unit of its last digit. Another processor
/// rounds differently; what a reader concludes from the tables stays.
const TOLERANCE: f64 = 0.1;

fn file() -> PathBuf {
    workspace::root().join("README.md")
}

/// The text before the results, the results, and the text after them.
fn parts(text: &str) -> Result<[&str; 3]> {
    let (before, rest) = text.split_once(BEGIN).context("README.md has no mark where the results begin")?;
    let (results, after) = rest.split_once(END).context("README.md has no mark where the results end")?;
    Ok([before, results, after])
}

/// Writes the results into README.md.
pub fn write() -> Result<PathBuf> {
    let text = read_text(&file())?;
    let [before, _, after] = parts(&text)?;
    let text = format!("{before}{BEGIN}{}{END}{after}", results()?);
    write_whole(&file(), text.as_bytes())?;
    Ok(file())
}

/// Drives everything again and compares.
///
/// # Errors
/// If a number is off by more than the tolerance, or any other word differs.
pub fn check() -> Result<()> {
    let text = read_text(&file())?;
    let [_, written, _] = parts(&text)?;
    agree(written, &results()?).context("README.md does not hold any more; cargo fmu report --readme writes it anew")
}

/// Compares two texts: words as they are, numbers within the tolerance.
fn agree(written: &str, found: &str) -> Result<()> {
    let (before, now) = (words(written), words(found));
    ensure!(before.len() == now.len(), "{} words are written, {} were found", before.len(), now.len());
    for (i, (old, new)) in before.iter().zip(&now).enumerate() {
        let near = match (number(old), number(new)) {
            (Some((old, unit)), Some((new, _))) => (old - new).abs() <= unit.max(TOLERANCE * old.abs()) * (1.0 + 1e-9),
            _ => old == new,
        };
        if !near {
            let from = i.saturating_sub(6);
            bail!("\"{old}\" is written, \"{new}\" was found, after \"{}\"", before[from..i].join(" "));
        }
    }
    Ok(())
}

fn words(text: &str) -> Vec<&str> {
    text.split_whitespace().collect()
}

/// A word as a number with the unit of its last digit.
fn number(word: &str) -> Option<(f64, f64)> {
    let word = word.trim_end_matches([',', '.', ';', ':']);
    let value: f64 = word.parse().ok()?;
    let decimals = word.split_once('.').map_or(0, |(_, digits)| digits.len());
    Some((value, 10.0_f64.powi(-i32::try_from(decimals).ok()?)))
}

/// The section's text.
fn results() -> Result<String> {
    let mut text = String::new();
    text.push_str(
        "`cargo fmu report` drives everything again, writes a page with all figures of the paper (`target/report/report.html`), and with\n\
         `--readme` these tables; a test fails when a number is off by more than a tenth or its last digit. Lane change: 14 m/s without\n\
         wind. General track: 2 km of curves at 5 to 25 m/s in a wind of 20 to 50 m/s. Both at communication steps of 1 ms and of 33 ms,\n\
         one whole sample (`cargo fmu simulate --road general --step 0.033`):\n\n",
    );
    text.push_str(&tracking()?);
    text.push_str(
        "\nThe paper calls its rms figures \"MSE\"; read as such they would exceed its own maxima. Its plant, track and wind are not\n\
         published, so the columns show the order of magnitude, not a contest. The course is the direction of motion: the body itself cannot\n\
         keep the path's heading in a curve, whoever steers.\n\n\
         What a user would otherwise pick, and a nonlinear MPC with our weights, solved offline (`tools/reference/nmpc.py`).\n\
         It knows the plant, loses no time, and is told the wind: what blows now (felt, as ours does through the car), or what is going\n\
         to blow (foreseen). Our controller weighs its increments of steering against those of a car that follows the path exactly\n\
         (feed-forward, `lpv-mpc`, module `feedforward`). The nonlinear MPC weighs them against zero, the textbook cost, and in the last\n\
         of its rows against the same reference, computed from its exact knowledge: in position that row is the ceiling. Root mean\n\
         squares:\n\n",
    );
    text.push_str(&comparison()?);
    text.push_str(
        "\nNear the limit of grip the tyre has to be right along the whole plan. Lane change, friction 0.82, steering rate 0.5 rad/s\n\
         (`cargo fmu simulate --set plant.speed=16 --set plant.delta_rate_max=0.5 --set controller.delta_rate_max=0.5`, and\n\
         `--set controller.adaptation=constant`); the curvature asks for all grip at 17.2 m/s:\n\n",
    );
    text.push_str(&limit()?);
    Ok(text)
}

/// A table of Markdown whose columns from `numbers` on are set to the right.
fn markdown(rows: &[Vec<String>], numbers: usize) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rule: Vec<String> = (0..rows[0].len()).map(|i| if i < numbers { "---" } else { "---:" }.to_owned()).collect();
    let mut text = line(&rows[0]) + &format!("|{}|\n", rule.join("|"));
    for row in &rows[1..] {
        text.push_str(&line(row));
    }
    text
}

fn tracking() -> Result<String> {
    let cases: Vec<(Situation, f64)> =
        [Situation::LaneChange, Situation::General].into_iter().flat_map(|s| STEPS.map(|step| (s, step))).collect();
    let found: Vec<Figures> =
        cases.into_par_iter().map(|(situation, step)| ours(situation, &[], step)).collect::<Result<_>>()?;
    let paper = Figures { tracking: PAPER };
    let all: Vec<Figures> = std::iter::once(paper).chain(found).collect();
    let row = |name: &str, unit: &str, digits: usize, pick: &dyn Fn(&Figures) -> f64| {
        let cells = all.iter().map(|figures| format!("{:.digits$}", pick(figures)));
        [name.to_owned(), unit.to_owned()].into_iter().chain(cells).collect::<Vec<String>>()
    };
    let head = ["", "unit", "paper", "lane change, 1 ms", "33 ms", "general, 1 ms", "33 ms"];
    Ok(markdown(
        &[
            head.map(str::to_owned).to_vec(),
            row("lateral error, largest", "cm", 2, &|f| 100.0 * f.tracking.e_y_max),
            row("lateral error, rms", "cm", 2, &|f| 100.0 * f.tracking.e_y_rms),
            row("course error, largest", "deg", 2, &|f| f.tracking.course_max.to_degrees()),
            row("course error, rms", "deg", 3, &|f| f.tracking.course_rms.to_degrees()),
            row("speed error, largest", "m/s", 3, &|f| f.tracking.speed_max),
            row("speed error, rms", "m/s", 4, &|f| f.tracking.speed_rms),
        ],
        2,
    ))
}

fn comparison() -> Result<String> {
    let reference = Reference::open()?;
    let situations = [Situation::LaneChangeWind, Situation::General];
    let drivers: Vec<(Who, Situation)> =
        Who::ALL.into_iter().flat_map(|who| situations.map(|situation| (who, situation))).collect();
    let found: Vec<Figures> = drivers
        .into_par_iter()
        .map(|(who, situation)| Ok(run(situation, who, &reference)?.figures))
        .collect::<Result<_>>()?;
    let head = ["", "lane change in wind, position [cm]", "speed [m/s]", "general, position [cm]", "speed [m/s]"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.push(["paper", "", "", "0.69", "0.0212"].map(str::to_owned).to_vec());
    rows.push(["paper's comparison", "", "", "32", "0.19"].map(str::to_owned).to_vec());
    for (who, figures) in Who::ALL.iter().zip(found.chunks(situations.len())) {
        let mut row = vec![who.name().to_owned()];
        for figures in figures {
            if figures.stayed() {
                row.push(format!("{:.3}", 100.0 * figures.tracking.e_y_rms));
                row.push(format!("{:.5}", figures.tracking.speed_rms));
            } else {
                row.extend(["off the road".to_owned(), String::new()]);
            }
        }
        rows.push(row);
    }
    Ok(markdown(&rows, 1))
}

fn limit() -> Result<String> {
    let cases: Vec<(&str, &str)> =
        LIMIT.into_iter().flat_map(|speed| ["constant", "network_horizon"].map(|mode| (speed, mode))).collect();
    let cell = |(speed, mode): (&str, &str)| -> Result<String> {
        let figures = ours(
            Situation::LaneChange,
            &[
                &format!("plant.speed={speed}"),
                "plant.delta_rate_max=0.5",
                "controller.delta_rate_max=0.5",
                &format!("controller.adaptation={mode}"),
            ],
            STEP,
        )?;
        let e_y = 100.0 * figures.tracking.e_y_max;
        Ok(if figures.stayed() { format!("{e_y:.1}") } else { "off the road".to_owned() })
    };
    let cells: Vec<String> = cases.into_par_iter().map(cell).collect::<Result<_>>()?;
    let head = ["largest lateral error", "unit", "constant stiffness", "network along the horizon"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    rows.extend(LIMIT.iter().zip(cells.chunks(2)).map(|(speed, pair)| {
        let mut row = vec![format!("{speed} m/s"), "cm".to_owned()];
        row.extend_from_slice(pair);
        row
    }));
    Ok(markdown(&rows, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_readme_holds() {
        check().unwrap();
    }

    #[test]
    fn numbers_agree_within_a_tenth_or_their_last_digit() {
        let agrees = |a: &str, b: &str| agree(a, b).is_ok();
        assert!(agrees("| lateral | 0.53 |", "| lateral | 0.58 |"));
        assert!(!agrees("| lateral | 0.53 |", "| lateral | 0.59 |"));
        assert!(agrees("0.004", "0.005") && !agrees("0.004", "0.006"));
        assert!(agrees("21", "23") && !agrees("21", "24"));
    }

    #[test]
    fn words_must_be_the_same() {
        assert!(agree("off the road", "off the road").is_ok());
        let error = agree("at 16 m/s 1.4 cm", "at 16 m/s off cm").unwrap_err().to_string();
        assert_eq!(error, "\"1.4\" is written, \"off\" was found, after \"at 16 m/s\"");
        assert!(agree("one", "one more").is_err());
    }
}

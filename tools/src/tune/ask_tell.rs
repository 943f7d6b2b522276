//! Tuning whose candidates somebody else evaluates: one line of JSON asks, one line tells.
//!
//! On standard output, a line for each generation:
//!
//! ```json
//! {"generation": 0, "ask": [{"id": 0, "parameters": {"q_v_x": 5.0, "r_delta": 300.0}}, {"id": 1, ...}]}
//! ```
//!
//! On standard input, one or more lines until every id of the generation has its value, in any order:
//!
//! ```json
//! {"tell": [{"id": 1, "value": 0.93}, {"id": 0, "value": null}]}
//! ```
//!
//! `null` is a candidate that could not be evaluated. Ids count up over the whole tuning. The last line is
//!
//! ```json
//! {"evaluations": 750, "best": {"parameters": {...}, "value": 0.71}}
//! ```
//!
//! A tuning whose other side goes away is resumed by --resume: generations that were told are not asked again, and the one that
//! was open is asked again with the same ids and parameters, so that values that are known already can be told at once.

use std::collections::BTreeMap;
use std::io::{BufRead, Write};
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

use super::session::{Checkpoint, Setup, write_set};
use super::{Args, dimensions};
use crate::optimise::search::REFUSED;

/// Parameters by name. Sorted by name: a reader that compares lines sees the same order every time.
type Parameters = BTreeMap<String, f64>;

#[derive(Serialize)]
struct Question {
    id: usize,
    parameters: Parameters,
}

#[derive(Serialize)]
struct Ask {
    generation: usize,
    ask: Vec<Question>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Tell {
    tell: Vec<Answer>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Answer {
    id: usize,
    value: Option<f64>,
}

#[derive(Serialize)]
struct Best {
    parameters: Parameters,
    value: f64,
}

#[derive(Serialize)]
struct End {
    evaluations: usize,
    best: Option<Best>,
}

/// Asks until the evaluations are spent, then writes the set.
pub fn run(setup: Setup, args: &Args, file: &Path, input: impl BufRead, mut output: impl Write) -> Result<()> {
    let checkpoint = file.with_extension("checkpoint.json");
    let names: Vec<String> = setup.space.dimensions.iter().map(|side| side.name.clone()).collect();
    let present = dimensions::present(&setup.space, &setup.set)?;
    let mut tuning = Checkpoint::start(setup, &present, args.resume, &checkpoint)?;
    let named = |values: Vec<f64>| -> Parameters { names.iter().cloned().zip(values).collect() };
    let mut lines = input.lines();
    while !tuning.search.finished() {
        let first = tuning.search.evaluations();
        let points = tuning.search.ask();
        let affordable = points.len().min(tuning.search.budget() - first);
        let questions = points[..affordable].iter().enumerate();
        let ask = questions
            .map(|(k, point)| Question { id: first + k, parameters: named(tuning.setup.space.values(point)) })
            .collect();
        write_line(&mut output, &Ask { generation: tuning.search.history().len(), ask })?;
        let mut values: Vec<Option<f64>> = vec![None; affordable];
        while values.iter().any(Option::is_none) {
            let line = lines.next().context("the evaluations ended before the tuning; --resume goes on")??;
            let tell: Tell = serde_json::from_str(&line).with_context(|| format!("in the line {line}"))?;
            for Answer { id, value } in tell.tell {
                let place = id.checked_sub(first).and_then(|k| values.get_mut(k));
                let place = place.with_context(|| format!("id {id} was not asked for"))?;
                ensure!(place.is_none(), "id {id} was told twice");
                *place = Some(value.unwrap_or(REFUSED));
            }
        }
        let values: Vec<f64> = values.into_iter().flatten().collect();
        tuning.tell(points, &values, &checkpoint)?;
    }
    let best = tuning.search.best().map(|best| (tuning.setup.space.values(&best.point), best.value));
    if let Some((values, _)) = &best {
        write_set(&names, values, file)?;
    }
    let best = best.map(|(values, value)| Best { parameters: named(values), value });
    write_line(&mut output, &End { evaluations: tuning.search.evaluations(), best })
}

/// One line, at once: the other side waits for it.
fn write_line(output: &mut impl Write, value: &impl Serialize) -> Result<()> {
    serde_json::to_writer(&mut *output, value)?;
    writeln!(output)?;
    output.flush()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use serde_json::Value;

    use super::*;
    use crate::tune::setup;

    /// Lets `lines` answer a tuning of ten evaluations; gives what it said and how it ended.
    fn talk(folder: &Path, lines: &str, resume: bool) -> (Vec<Value>, Result<()>) {
        let file = folder.join("tuned.ssv");
        let mut words =
            "tune --method ga --population 4 --evaluations 10 --search r_delta=1:100".split(' ').collect::<Vec<_>>();
        words.extend(resume.then_some("--resume"));
        let args = Args::parse_from(words);
        let mut said = Vec::new();
        let end = run(setup(&args).unwrap(), &args, &file, lines.as_bytes(), &mut said);
        let said = String::from_utf8(said).unwrap();
        (said.lines().map(|line| serde_json::from_str(line).unwrap()).collect(), end)
    }

    /// Answers to ids, the value being the id.
    fn tell(ids: std::ops::Range<usize>) -> String {
        ids.rev().map(|id| format!("{{\"tell\": [{{\"id\": {id}, \"value\": {id}}}]}}\n")).collect()
    }

    #[test]
    fn an_interrupted_talk_goes_on_with_the_open_generation() {
        let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        // Generations of 4, 4 and 2: the budget ends the last one.
        let (whole, end) = talk(folders[0].path(), &(tell(0..4) + &tell(4..8) + &tell(8..10)), false);
        end.unwrap();
        assert_eq!(whole.len(), 4);
        assert_eq!(whole[3]["evaluations"], 10);
        assert_eq!(whole[3]["best"]["value"], 0.0);
        assert!(whole[0]["ask"][0]["parameters"]["r_delta"].as_f64().unwrap() >= 1.0);

        let (first, end) = talk(folders[1].path(), &(tell(0..4) + &tell(6..8)), false);
        assert_eq!(end.unwrap_err().to_string(), "the evaluations ended before the tuning; --resume goes on");
        let (rest, end) = talk(folders[1].path(), &(tell(4..8) + &tell(8..10)), true);
        end.unwrap();
        assert_eq!((&first[..2], &rest[..]), (&whole[..2], &whole[1..]));
        let set = |k: usize| std::fs::read(folders[k].path().join("tuned.ssv")).unwrap();
        assert_eq!(set(0), set(1));
    }

    #[test]
    fn wrong_answers_are_named() {
        let message = |lines: &str| {
            let folder = tempfile::tempdir().unwrap();
            format!("{:#}", talk(folder.path(), lines, false).1.unwrap_err())
        };
        assert_eq!(message(&tell(7..8)), "id 7 was not asked for");
        assert_eq!(message(&(tell(2..3) + &tell(2..3))), "id 2 was told twice");
        assert!(message("nonsense\n").starts_with("in the line nonsense"));
        let folder = tempfile::tempdir().unwrap();
        let (_, end) = talk(folder.path(), "", true);
        assert!(format!("{:#}", end.unwrap_err()).starts_with("there is no interrupted tuning to resume"));
    }

    #[test]
    fn a_candidate_without_a_value_is_never_the_best() {
        let folder = tempfile::tempdir().unwrap();
        let none: String = (0..4).map(|id| format!("{{\"tell\": [{{\"id\": {id}, \"value\": null}}]}}\n")).collect();
        let (said, end) = talk(folder.path(), &(none + &tell(4..8) + &tell(8..10)), false);
        end.unwrap();
        assert_eq!(said[3]["best"]["value"], 4.0);
    }
}

//! Tuning whose candidates somebody else evaluates: one line of JSON asks, one line tells.
//!
//! On standard output, a line for each generation:
//!
//!     {"generation": 0, "ask": [{"id": 0, "parameters": {"q_v_x": 5.0, "r_delta": 300.0}}, {"id": 1, ...}]}
//!
//! On standard input, one or more lines until every id of the generation has its value, in any order:
//!
//!     {"tell": [{"id": 1, "value": 0.93}, {"id": 0, "value": null}]}
//!
//! `null` is a candidate that could not be evaluated. Ids count up over the whole tuning. The last line is
//!
//!     {"evaluations": 750, "best": {"parameters": {...}, "value": 0.71}}
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

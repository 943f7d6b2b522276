//! Solvers from PyPI in a process of their own, asked for one block of problems at a time.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result};
use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::solvers::Run;
use crate::workspace;

/// The running script.
pub struct Peers {
    child: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
    /// Names of the solvers that could be imported.
    pub names: Vec<String>,
}

/// A block of consecutive problems.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Request<'a> {
    pub solver: &'a str,
    pub file: &'a Path,
    pub horizon: usize,
    pub first: usize,
    pub count: usize,
    /// Forget warm starts.
    pub restart: bool,
}

#[derive(Deserialize)]
struct Answer {
    seconds: Vec<f64>,
    u: Vec<[f64; 2]>,
    solved: Vec<bool>,
}

impl Peers {
    /// Starts the script with a Python that has numpy and at least one of the solvers.
    pub fn start(python: &Path) -> Result<Self> {
        let script = workspace::root().join("tools").join("bench").join("peers.py");
        let mut child = Command::new(python)
            .arg(script)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .with_context(|| format!("cannot run {}", python.display()))?;
        let requests = child.stdin.take().context("the script has no standard input")?;
        let mut answers = BufReader::new(child.stdout.take().context("the script has no standard output")?);
        let mut line = String::new();
        answers.read_line(&mut line)?;
        let names = serde_json::from_str(&line).context("the script did not start; it needs numpy")?;
        Ok(Self { child, requests, answers, names })
    }

    /// Solves a block.
    pub fn solve(&mut self, request: &Request) -> Result<Vec<Run>> {
        serde_json::to_writer(&mut self.requests, request)?;
        writeln!(self.requests)?;
        let mut line = String::new();
        self.answers.read_line(&mut line)?;
        let answer: Answer =
            serde_json::from_str(&line).with_context(|| format!("{} gave no answer", request.solver))?;
        let runs = answer.seconds.into_iter().zip(answer.u).zip(answer.solved);
        Ok(runs.map(|((seconds, u), solved)| Run { seconds, u: SVector::from(u), solved }).collect())
    }
}

impl Drop for Peers {
    fn drop(&mut self) {
        let _already_gone = self.child.kill();
        let _reaped = self.child.wait();
    }
}

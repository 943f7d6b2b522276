//! The Python that the peers from PyPI run in.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::output::Output;
use crate::workspace;

const REQUIREMENTS: &str = include_str!("../../bench/requirements.txt");

/// The Python of the virtual environment in `target/peers`, which is set up when it is not there yet.
///
/// A package that cannot be had is named and left out.
///
/// # Errors
/// When there is no Python, or none that makes virtual environments.
pub fn python(output: &Output) -> Result<PathBuf> {
    let folder = workspace::root().join("target").join("peers");
    let (python, installed) = (folder.join("bin").join("python"), folder.join("requirements.txt"));
    if fs::read_to_string(&installed).is_ok_and(|text| text == REQUIREMENTS) && python.exists() {
        return Ok(python);
    }
    output.remark(&format!("setting the peers up in {}", workspace::shown(&folder)));
    fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    run(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
    let mut is_complete = true;
    for package in packages() {
        let progress = output.progress(package);
        // From its sources one takes half an hour, and compilers of its own.
        let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary", ":all:", package];
        let done = run(Command::new(&python).args(pip));
        progress.finish_and_clear();
        if let Err(reason) = done {
            output.remark(&format!("{package} is left out: {reason:#}"));
            is_complete = false;
        }
    }
    // What is missing now may be had next time.
    if is_complete {
        fs::write(&installed, REQUIREMENTS).with_context(|| format!("cannot write {}", installed.display()))?;
    }
    Ok(python)
}

/// What is to be installed, one package after the other.
fn packages() -> impl Iterator<Item = &'static str> {
    REQUIREMENTS.lines().filter(|line| !line.starts_with('#'))
}

/// Runs a program; what it complained of last is the error.
fn run(command: &mut Command) -> Result<()> {
    let name = Path::new(command.get_program()).display().to_string();
    let done = command.output().with_context(|| format!("cannot run {name}"))?;
    let said = [done.stderr, done.stdout].concat();
    let said = String::from_utf8_lossy(&said);
    let reason = said.lines().map(str::trim).find(|line| !line.is_empty()).unwrap_or("it did not say why");
    ensure!(done.status.success(), "{name}: {reason}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_installed_is_what_the_script_imports() {
        let script = include_str!("../../bench/peers.py");
        for package in packages() {
            let name = package.split(['=', '>']).next().unwrap_or(package);
            assert!(["import", "from"].iter().any(|word| script.contains(&format!("{word} {name}"))), "{name}");
        }
    }

    #[test]
    fn a_program_that_fails_is_named_with_its_reason() {
        let failed = run(Command::new("python3").args(["-c", "raise SystemExit('no such thing')"])).unwrap_err();
        assert_eq!(failed.to_string(), "python3: no such thing");
        assert!(run(&mut Command::new("no such program")).unwrap_err().to_string().contains("no such program"));
    }
}

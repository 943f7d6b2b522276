//! `cargo fmu merge`: one archive out of archives that were built on different machines.

use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use clap::Parser;

use crate::archive::Files;
use crate::interface::Interface;
use crate::output::Output;
use crate::workspace::shown;

/// Unites archives of one model that were built on different machines.
///
/// All must have the same interface. Everything but the libraries is taken from the first.
#[derive(Clone, Debug, Parser)]
#[command(after_help = "\
Example:
  cargo fmu merge linux/VehiclePlant.fmu mac/VehiclePlant.fmu --output VehiclePlant.fmu")]
pub struct Args {
    /// Archives of the same model
    #[arg(required = true, num_args = 2.., value_name = "FMU")]
    pub archives: Vec<PathBuf>,
    /// Where the united archive goes
    #[arg(long, short, value_name = "FMU")]
    pub output: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args, output: &Output) -> Result<()> {
    let mut archives = args.archives.iter();
    let first = archives.next().context("no archive was given")?;
    let mut united = Files::open(first)?;
    for archive in archives {
        let other = Files::open(archive)?;
        united = unite(united, &other).with_context(|| format!("{} and {}", shown(first), shown(archive)))?;
    }
    united.save(&args.output)?;
    output.line(&format!("{} runs on {}", shown(&args.output), platforms(&united).join(", ")));
    Ok(())
}

/// Names of the folders with libraries.
pub fn platforms(files: &Files) -> Vec<&str> {
    let mut names: Vec<&str> = files
        .iter()
        .filter_map(|(path, _)| path.strip_prefix("binaries/")?.split_once('/').map(|(folder, _)| folder))
        .collect();
    names.dedup();
    names
}

fn interface(files: &Files) -> Result<Interface> {
    let description = files.get("modelDescription.xml").context("an archive has no modelDescription.xml")?;
    Interface::parse(std::str::from_utf8(description)?)
}

/// The first archive with the libraries of the other.
fn unite(mut files: Files, other: &Files) -> Result<Files> {
    let (ours, theirs) = (interface(&files)?, interface(other)?);
    ensure!(ours.model_name == theirs.model_name, "the models differ: {} and {}", ours.model_name, theirs.model_name);
    if ours.guid != theirs.guid || files.get("modelDescription.xml") != other.get("modelDescription.xml") {
        bail!("the interfaces differ: {} and {}; build both from the same sources", ours.guid, theirs.guid);
    }
    for (path, bytes) in other.iter().filter(|(path, _)| path.starts_with("binaries/")) {
        match files.get(path) {
            None => files.add(path, bytes)?,
            Some(same) => ensure!(same == bytes, "both have {path}, and they differ"),
        }
    }
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn archive(guid: &str, libraries: &[(&str, &str)]) -> Files {
        let description = format!(
            r#"<fmiModelDescription fmiVersion="2.0" modelName="M" guid="{guid}"><CoSimulation modelIdentifier="m"/></fmiModelDescription>"#
        );
        let mut files = Files::default();
        files.add("modelDescription.xml", description).unwrap();
        for (folder, text) in libraries {
            files.add(&format!("binaries/{folder}/m"), *text).unwrap();
        }
        files
    }

    #[test]
    fn libraries_of_both_machines_are_in_the_result() {
        let united = unite(archive("{1}", &[("linux64", "a")]), &archive("{1}", &[("win64", "b")])).unwrap();
        assert_eq!(platforms(&united), ["linux64", "win64"]);
        assert_eq!(united.get("binaries/win64/m"), Some(&b"b"[..]));
    }

    #[test]
    fn different_interfaces_are_refused() {
        let error = unite(archive("{1}", &[]), &archive("{2}", &[])).unwrap_err().to_string();
        assert_eq!(error, "the interfaces differ: {1} and {2}; build both from the same sources");
    }

    #[test]
    fn two_builds_for_one_platform_are_refused_unless_they_are_one() {
        let ours = || archive("{1}", &[("linux64", "a")]);
        let error = unite(ours(), &archive("{1}", &[("linux64", "b")])).unwrap_err().to_string();
        assert_eq!(error, "both have binaries/linux64/m, and they differ");
        assert!(unite(ours(), &ours()).unwrap() == ours());
    }
}

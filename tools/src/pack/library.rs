//! Cargo builds the libraries; each is then loaded once, to see that it is the one that the XML describes.

use std::path::{Path, PathBuf};
use std::process::Stdio;

use anyhow::{Context, Result, bail, ensure};
use serde::Deserialize;

use super::platform::{GLIBC, Platform, newest_glibc};
use crate::archive::read;
use crate::importer::Fmu;
use crate::interface::Interface;
use crate::workspace::{self, Model};

/// One line of cargo's `--message-format=json`; only finished artifacts have all of these fields.
#[derive(Deserialize)]
struct Artifact {
    target: Target,
    filenames: Vec<PathBuf>,
}

#[derive(Deserialize)]
struct Target {
    name: String,
    kind: Vec<String>,
}

/// Builds the libraries in release mode and returns their paths in the same order.
pub fn build(models: &[Model], platform: Platform) -> Result<Vec<PathBuf>> {
    if let Some(what) = platform.missing() {
        bail!("no toolchain for {}: {what}", platform.folder());
    }
    let mut command = platform.cargo();
    command.args(["--release", "--quiet", "--message-format=json-render-diagnostics"]);
    for model in models {
        command.args(["--package", model.package]);
    }
    let run = command
        .current_dir(workspace::root())
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .output()
        .context("starting cargo")?;
    let errors = String::from_utf8_lossy(&run.stderr);
    ensure!(run.status.success(), "cargo build failed:\n{errors}");
    let messages = String::from_utf8_lossy(&run.stdout);
    models
        .iter()
        .map(|model| {
            find(&messages, model.identifier, platform.extension())
                .with_context(|| format!("cargo built no library {} from {}", model.identifier, model.package))
        })
        .collect()
}

/// Cargo itself says where the library lies, so that any target folder works.
fn find(messages: &str, identifier: &str, extension: &str) -> Option<PathBuf> {
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<Artifact>(line).ok())
        .filter(|artifact| {
            artifact.target.name == identifier && artifact.target.kind.iter().any(|kind| kind == "cdylib")
        })
        .flat_map(|artifact| artifact.filenames)
        // Windows adds an import library and debug symbols, which no FMU needs.
        .find(|file| file.extension().is_some_and(|found| found == extension))
}

/// Refuses a library that would not load on the systems that it is meant for.
pub fn ensure_portable(library: &Path) -> Result<()> {
    let newest = newest_glibc(&read(library)?);
    ensure!(
        newest.is_none_or(|newest| newest <= GLIBC),
        "{} asks for glibc {newest:?}, newer than {GLIBC:?}",
        library.display()
    );
    Ok(())
}

/// Loads the library and asks it to instantiate with the fingerprint of the XML.
pub fn verified(model: Model, library: &Path, interface: Interface) -> Result<Fmu> {
    ensure!(
        interface.identifier == model.identifier,
        "modelDescription/{} describes {}, expected {}",
        model.description,
        interface.identifier,
        model.identifier
    );
    let resources = workspace::root().join(model.folder).join("resources");
    let fmu = Fmu::load(library, &resources, interface)?;
    if let Err(error) = fmu.instantiate("verification") {
        bail!(
            "the library does not accept modelDescription/{}: {error:#}; if the variables changed, \
             UPDATE=1 cargo test --package {} writes it anew",
            model.description,
            model.package
        );
    }
    Ok(fmu)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_is_found_among_the_messages_of_cargo() {
        let file = "/t/libvehicle_plant.so";
        let messages = format!(
            "{{\"reason\":\"build-script-executed\"}}\n\
             {{\"target\":{{\"name\":\"vehicle_plant\",\"kind\":[\"lib\"]}},\"filenames\":[\"/t/x.rlib\"]}}\n\
             {{\"target\":{{\"name\":\"vehicle_plant\",\"kind\":[\"cdylib\"]}},\"filenames\":[\"/t/x.lib\",\"{file}\"]}}\n"
        );
        assert_eq!(find(&messages, "vehicle_plant", "so"), Some(PathBuf::from(file)));
        assert_eq!(find(&messages, "lpv_mpc_controller", "so"), None);
    }
}

//! `cargo fmu pack`: builds both libraries and writes the two FMUs and the system to `target/fmu/`.

mod contents;
mod documentation;
mod library;
mod system;

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Parser;

use crate::archive::{Files, read_text};
use crate::importer::platform;
use crate::interface::Interface;
use crate::output::Output;
use crate::workspace::{self, CONTROLLER, Model, PLANT};

/// Builds LpvMpcController.fmu, VehiclePlant.fmu and ClosedLoop.ssp.
///
/// The archives land in target/fmu/. The same sources give the same bytes.
#[derive(Clone, Debug, Default, Parser)]
pub struct Args {}

/// The finished archives.
#[derive(Clone, Debug)]
pub struct Packed {
    /// Path of the controller's FMU.
    pub controller: PathBuf,
    /// Path of the plant's FMU.
    pub plant: PathBuf,
    /// Path of the wired system.
    pub system: PathBuf,
}

/// Runs the command.
pub fn run(_args: &Args, output: &Output) -> Result<()> {
    let packed = pack(output)?;
    for path in [&packed.controller, &packed.plant, &packed.system] {
        let size = path.metadata()?.len();
        output.line(&format!("{:<34} {:>7.1} kB", workspace::shown(path), size as f64 / 1e3));
    }
    Ok(())
}

/// Builds, checks and writes all three archives.
pub fn pack(output: &Output) -> Result<Packed> {
    let progress = output.progress("building the two libraries (a minute or two the first time)");
    let libraries = library::build(&[CONTROLLER, PLANT])?;
    progress.set_message("packing");
    let mut archives = Vec::new();
    for (model, library) in [CONTROLLER, PLANT].into_iter().zip(&libraries) {
        let interface = interface_of(model)?;
        library::verify(model, library, interface.clone())?;
        let files = contents::of(model, &interface, &[(platform(), library.clone())])?;
        archives.push((model, interface, files));
    }
    let mut resources = Files::default();
    for (model, _, files) in &archives {
        resources.add(&format!("resources/{}.fmu", model.name), files.to_bytes()?)?;
    }
    let [(_, controller, controller_files), (_, plant, plant_files)] = archives.as_slice() else {
        unreachable!("two models were packed above");
    };
    let system = system::of(controller, plant, resources)?;
    let packed = Packed {
        controller: controller_files.save(&CONTROLLER.archive())?,
        plant: plant_files.save(&PLANT.archive())?,
        system: system.save(&workspace::system_archive())?,
    };
    progress.finish_and_clear();
    Ok(packed)
}

/// The committed interface of a model.
pub fn interface_of(model: Model) -> Result<Interface> {
    let file = model.description_file();
    Interface::parse(&read_text(&file)?).with_context(|| format!("in {}", file.display()))
}

//! `cargo fmu pack`: builds both libraries and writes the two FMUs and the system to `target/fmu/`.

mod contents;
mod documentation;
mod library;
mod licenses;
mod reference;
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
    let packages = licenses::metadata()?;
    let interfaces = [interface_of(CONTROLLER)?, interface_of(PLANT)?];
    let [controller, plant] = &interfaces;
    let mut controller_files = contents::of(CONTROLLER, controller, &[(platform(), libraries[0].clone())], &packages)?;
    let mut plant_files = contents::of(PLANT, plant, &[(platform(), libraries[1].clone())], &packages)?;
    reference::add(
        &library::verified(PLANT, &libraries[1], plant.clone())?,
        &library::verified(CONTROLLER, &libraries[0], controller.clone())?,
        &mut plant_files,
        &mut controller_files,
    )?;
    let mut resources = Files::default();
    for (model, files) in [(CONTROLLER, &controller_files), (PLANT, &plant_files)] {
        resources.add(&format!("resources/{}.fmu", model.name), files.to_bytes()?)?;
    }
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

//! `cargo fmu pack`: builds both libraries and writes the two FMUs and the system to `target/fmu/`.

mod contents;
mod documentation;
mod library;
mod licenses;
pub mod merge;
pub mod platform;
mod reference;
mod system;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Parser;

use platform::Platform;

use crate::archive::{Files, read_text};
use crate::interface::Interface;
use crate::output::Output;
use crate::workspace::{self, CONTROLLER, Model, PLANT};

/// Builds LpvMpcController.fmu, VehiclePlant.fmu and ClosedLoop.ssp.
///
/// The archives land in target/fmu/. The same sources give the same bytes.
#[derive(Clone, Debug, Default, Parser)]
#[command(after_help = "\
Examples:
  cargo fmu pack               for this machine
  cargo fmu pack --portable    to hand on: any 64-bit Linux of the last decade, and Windows if its toolchain is there
  tools/cross-toolchain        prepares what --portable needs

Archives that were built on different machines are united by cargo fmu merge.")]
pub struct Args {
    /// Build for linux64 with glibc 2.17 or newer and for win64, into the same archives
    #[arg(long)]
    pub portable: bool,
    /// Leave win64 out of the portable archives, even if its toolchain is there
    #[arg(long, requires = "portable")]
    pub without_windows: bool,
    /// Folder of the finished archives; target/fmu unless given
    #[arg(long, value_name = "FOLDER")]
    pub into: Option<PathBuf>,
}

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
pub fn run(args: &Args, output: &Output) -> Result<()> {
    let mut platforms = vec![Platform::Host];
    if args.portable {
        platforms = vec![Platform::PortableLinux];
        match Platform::Windows.missing() {
            _ if args.without_windows => {}
            None => platforms.push(Platform::Windows),
            Some(what) => output.line(&format!("WITHOUT WINDOWS: there is no toolchain for win64 here, {what}")),
        }
    }
    let folder = args.into.clone().unwrap_or_else(workspace::archive_folder);
    let packed = pack_for(&platforms, &folder, output)?;
    for path in [&packed.controller, &packed.plant, &packed.system] {
        let size = path.metadata()?.len();
        output.line(&format!("{:<34} {:>7.1} kB", workspace::shown(path), size as f64 / 1e3));
    }
    Ok(())
}

/// Builds, checks and writes all three archives for this machine.
pub fn pack(output: &Output) -> Result<Packed> {
    pack_for(&[Platform::Host], &workspace::archive_folder(), output)
}

/// Builds and checks all three archives for some platforms and writes them to a folder.
pub fn pack_for(platforms: &[Platform], folder: &Path, output: &Output) -> Result<Packed> {
    let (mut controllers, mut plants) = (Vec::new(), Vec::new());
    for platform in platforms {
        let progress = output.progress(&format!("building for {} (a minute or two the first time)", platform.folder()));
        let libraries = library::build(&[CONTROLLER, PLANT], *platform)?;
        if *platform == Platform::PortableLinux {
            libraries.iter().try_for_each(|library| library::ensure_portable(library))?;
        }
        controllers.push((*platform, libraries[0].clone()));
        plants.push((*platform, libraries[1].clone()));
        progress.finish_and_clear();
    }
    let packages = licenses::metadata()?;
    let [controller, plant] = &[interface_of(CONTROLLER)?, interface_of(PLANT)?];
    let mut controller_files = contents::of(CONTROLLER, controller, &controllers, &packages)?;
    let mut plant_files = contents::of(PLANT, plant, &plants, &packages)?;
    reference::add(
        &library::verified(PLANT, loadable(&plants)?, plant.clone())?,
        &library::verified(CONTROLLER, loadable(&controllers)?, controller.clone())?,
        &mut plant_files,
        &mut controller_files,
    )?;
    let mut resources = Files::default();
    for (model, files) in [(CONTROLLER, &controller_files), (PLANT, &plant_files)] {
        resources.add(&format!("resources/{}.fmu", model.name), files.to_bytes()?)?;
    }
    let system = system::of(controller, plant, resources)?;
    let packed = Packed {
        controller: controller_files.save(&folder.join(CONTROLLER.archive()))?,
        plant: plant_files.save(&folder.join(PLANT.archive()))?,
        system: system.save(&folder.join(workspace::SYSTEM).with_extension("ssp"))?,
    };
    Ok(packed)
}

/// The library that can be tried out here.
fn loadable(libraries: &[(Platform, PathBuf)]) -> Result<&Path> {
    let here = libraries.iter().find(|(platform, _)| platform.runs_here());
    here.map(|(_, path)| path.as_path()).context("no library among those built runs on this machine")
}

/// The committed interface of a model.
pub fn interface_of(model: Model) -> Result<Interface> {
    let file = model.description_file();
    Interface::parse(&read_text(&file)?).with_context(|| format!("in {}", file.display()))
}

//! Where things lie in the project: the root, the two models and the folder of the finished archives.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, ensure};

/// Root of the project that this program was built from.
pub fn root() -> PathBuf {
    let tools = Path::new(env!("CARGO_MANIFEST_DIR"));
    tools.parent().unwrap_or(tools).to_path_buf()
}

/// Folder of the finished archives. It does not follow CARGO_TARGET_DIR: users are told this one place.
pub fn archive_folder() -> PathBuf {
    root().join("target").join("fmu")
}

/// A path as a person would type it: relative to the current folder where that is possible.
pub fn shown(path: &Path) -> String {
    std::env::current_dir()
        .ok()
        .and_then(|here| path.strip_prefix(here).ok().map(Path::to_path_buf))
        .unwrap_or_else(|| path.to_path_buf())
        .display()
        .to_string()
}

/// One of the two FMUs, as the packer sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Model {
    /// Name of the archive and of the model.
    pub name: &'static str,
    /// Name of the shared library without prefix and suffix; FMI calls it the model identifier.
    pub identifier: &'static str,
    /// Cargo package that builds the library.
    pub package: &'static str,
    /// Folder with `resources/` and `documentation/`.
    pub folder: &'static str,
    /// File in `modelDescription/` that becomes `modelDescription.xml`.
    pub description: &'static str,
    /// Name of the component in the closed loop.
    pub component: &'static str,
}

/// The controller.
pub const CONTROLLER: Model = Model {
    name: "LpvMpcController",
    identifier: "lpv_mpc_controller",
    package: "fmu-controller",
    folder: "fmu-controller",
    description: "controller.xml",
    component: "controller",
};

/// The vehicle.
pub const PLANT: Model = Model {
    name: "VehiclePlant",
    identifier: "vehicle_plant",
    package: "fmu-plant",
    folder: "fmu-plant",
    description: "plant.xml",
    component: "plant",
};

/// Name of the wired system.
pub const SYSTEM: &str = "ClosedLoop";

impl Model {
    /// File name of the finished archive.
    pub fn archive(&self) -> String {
        format!("{}.fmu", self.name)
    }

    /// Path of the committed model description.
    pub fn description_file(&self) -> PathBuf {
        root().join("modelDescription").join(self.description)
    }
}

/// Runs this very command again with a feature turned on: what takes minutes to compile is compiled by those who ask for it.
///
/// # Errors
/// If it does not end well.
pub fn run_again_with(feature: &str) -> Result<()> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .current_dir(root())
        .args(["run", "--release", "--package", "fmu-tools", "--bin", "fmu", "--features", feature, "--quiet", "--"])
        .args(std::env::args_os().skip(1))
        .status()?;
    ensure!(status.success(), "the command with {feature} ended with {status}");
    Ok(())
}

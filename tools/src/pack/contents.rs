//! What goes into one FMU.

use std::path::PathBuf;

use anyhow::Result;

use super::documentation;
use super::licenses::Metadata;
use super::platform::Platform;
use crate::archive::{Files, read};
use crate::interface::Interface;
use crate::workspace::{self, Model};

/// What stands in resources/ when a model needs nothing there: importers hand over the folder's address, so it must exist.
const NO_RESOURCES: &str =
    "The model reads nothing from here unless a parameter names a file: a bare file name is looked for here first.\n";

/// Collects a model's files; `libraries` are built for a platform each.
pub fn of(
    model: Model,
    interface: &Interface,
    libraries: &[(Platform, PathBuf)],
    packages: &Metadata,
) -> Result<Files> {
    let mut files = Files::default();
    files.add("modelDescription.xml", read(&model.description_file())?)?;
    let terminals = model.description_file().with_extension("terminals.xml");
    if terminals.is_file() {
        files.add("terminalsAndIcons/terminalsAndIcons.xml", read(&terminals)?)?;
    }
    for (platform, library) in libraries {
        let path = format!("binaries/{}/{}.{}", platform.folder(), model.identifier, platform.extension());
        files.add(&path, read(library)?)?;
    }
    let folder = workspace::root().join(model.folder);
    files.add_folder("resources", &folder.join("resources"))?;
    if !files.iter().any(|(path, _)| path.starts_with("resources/")) {
        files.add("resources/README.txt", NO_RESOURCES)?;
    }
    let icon = workspace::root().join("tools/icons").join(model.component).with_extension("png");
    files.add("model.png", read(&icon)?)?;
    documentation::add(&mut files, interface, &folder.join("documentation"))?;
    for license in ["LICENSE-MIT", "LICENSE-APACHE"] {
        let text = read(&workspace::root().join(license))?;
        files.add(&format!("documentation/licenses/{license}.txt"), text)?;
    }
    files.add("documentation/licenses/third-party.txt", packages.page(model)?)?;
    Ok(files)
}

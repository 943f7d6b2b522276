//! What goes into one FMU.

use std::path::PathBuf;

use anyhow::{Context, Result};

use super::documentation;
use crate::archive::{Files, read};
use crate::interface::Interface;
use crate::workspace::{self, Model};

/// Collects a model's files; `libraries` are pairs of platform folder and file.
pub fn of(model: Model, interface: &Interface, libraries: &[(&str, PathBuf)]) -> Result<Files> {
    let mut files = Files::default();
    files.add("modelDescription.xml", read(&model.description_file())?)?;
    for (platform, library) in libraries {
        let extension = library
            .extension()
            .and_then(|extension| extension.to_str())
            .with_context(|| format!("{} has no extension", library.display()))?;
        let path = format!("binaries/{platform}/{}.{extension}", model.identifier);
        files.add(&path, read(library)?)?;
    }
    let folder = workspace::root().join(model.folder);
    files.add_folder("resources", &folder.join("resources"))?;
    documentation::add(&mut files, interface, &folder.join("documentation"))?;
    for license in ["LICENSE-MIT", "LICENSE-APACHE"] {
        let text = read(&workspace::root().join(license))?;
        files.add(&format!("documentation/licenses/{license}.txt"), text)?;
    }
    Ok(files)
}

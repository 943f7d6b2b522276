//! A small importer of FMI 2.0 co-simulation units: unzip, load, call. It sees the archives just as a stranger's tool
//! does, so that what it shows holds for strangers. All unsafe code of the tools is in this folder.
//!
//! `[FMI]` is the Functional Mock-up Interface 2.0.4.

mod c;
mod instance;

use std::ffi::CString;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use libloading::Library;
use tempfile::TempDir;

use crate::archive::Files;
use crate::interface::Interface;
use c::{CO_SIMULATION, Callbacks, Functions, Messages, calloc, free, log};
pub use instance::Instance;

/// A loaded FMU. Its unzipped folder lives as long as it does.
pub struct Fmu {
    interface: Interface,
    functions: Functions,
    resources: PathBuf,
    _library: Library,
    _folder: Option<TempDir>,
}

/// Folder of the binaries for the system that this program runs on, [FMI, 2.3].
pub fn platform() -> &'static str {
    if cfg!(windows) {
        "win64"
    } else if cfg!(target_os = "macos") {
        "darwin64"
    } else {
        "linux64"
    }
}

impl Fmu {
    /// Unzips an archive to a temporary folder and loads the library for this system.
    pub fn open(archive: &Path) -> Result<Self> {
        let folder = tempfile::tempdir()?;
        let files = Files::open(archive)?;
        files.extract(folder.path())?;
        let description = files
            .get("modelDescription.xml")
            .with_context(|| format!("{} has no modelDescription.xml", archive.display()))?;
        let interface = Interface::parse(std::str::from_utf8(description)?)?;
        let library = folder.path().join(format!(
            "binaries/{}/{}{}",
            platform(),
            interface.identifier,
            std::env::consts::DLL_SUFFIX
        ));
        let resources = folder.path().join("resources");
        let fmu = Self::load(&library, &resources, interface)?;
        Ok(Self { _folder: Some(folder), ..fmu })
    }

    /// Loads a library that lies somewhere on the disk.
    pub fn load(library: &Path, resources: &Path, interface: Interface) -> Result<Self> {
        // SAFETY: [FMI, 2.3] loading an FMU's library runs none of its code but the runtime's own start.
        let library = unsafe { Library::new(library) }.with_context(|| format!("loading {}", library.display()))?;
        Ok(Self {
            functions: Functions::load(&library)?,
            interface,
            resources: resources.to_path_buf(),
            _library: library,
            _folder: None,
        })
    }

    /// What the FMU offers.
    pub fn interface(&self) -> &Interface {
        &self.interface
    }

    /// Makes an instance.
    pub fn instantiate(&self, name: &str) -> Result<Instance<'_>> {
        let messages = Box::new(Messages::default());
        let callbacks = Box::new(Callbacks {
            logger: log,
            allocate: calloc,
            free,
            step_finished: None,
            environment: &raw const *messages,
        });
        let uri = CString::new(file_uri(&self.resources))?;
        let guid = CString::new(self.interface.guid.as_str())?;
        let name = CString::new(name)?;
        // SAFETY: [FMI, 2.1.5] the texts are zero-terminated; the callbacks are boxed and outlive the component.
        let component = unsafe {
            (self.functions.instantiate)(
                name.as_ptr(),
                CO_SIMULATION,
                guid.as_ptr(),
                uri.as_ptr(),
                &raw const *callbacks,
                0,
                0,
            )
        };
        let instance = Instance { fmu: self, component, messages, _callbacks: callbacks };
        if component.is_null() {
            bail!("{} cannot be instantiated: {}", self.interface.model_name, instance.log());
        }
        Ok(instance)
    }
}

/// A path as the URI that [FMI, 2.1.5] asks for; bytes that a URI cannot hold are percent-encoded.
fn file_uri(path: &Path) -> String {
    let path = path.to_string_lossy().replace('\\', "/");
    let mut uri = String::from(if path.starts_with('/') { "file://" } else { "file:///" });
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"/:._-~".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            uri.push_str(&format!("%{byte:02X}"));
        }
    }
    uri
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_with_blanks_becomes_a_valid_uri() {
        assert_eq!(file_uri(Path::new("/tmp/a b/\u{e4}")), "file:///tmp/a%20b/%C3%A4");
        assert_eq!(file_uri(Path::new("C:\\x")), "file:///C:/x");
    }
}

//! A small importer of FMI 2.0 co-simulation units: unzip, load, call. It sees the archives just as a stranger's tool
//! does, so that what it shows holds for strangers. All unsafe code of the tools is in this file.
//!
//! `[FMI]` is the Functional Mock-up Interface 2.0.4.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, Result, bail, ensure};
use libloading::Library;
use tempfile::TempDir;

use crate::archive::Files;
use crate::interface::{Interface, Kind, Variable};

type Component = *mut c_void;
type Status = c_int;

/// fmi2Warning of [FMI, 2.1.3]: everything above it is an error.
const WARNING: Status = 1;
/// fmi2CoSimulation of fmi2Type, [FMI, 2.1.5].
const CO_SIMULATION: c_int = 1;

/// Messages that an instance logged, each as "category: text".
type Messages = Mutex<Vec<String>>;

/// fmi2CallbackFunctions of [FMI, 2.1.5].
#[repr(C)]
struct Callbacks {
    // The standard declares the logger variadic. A function that reads only the fixed arguments may be called so on
    // every platform that we build for, since the caller removes the arguments.
    logger: unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char),
    allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    free: unsafe extern "C" fn(*mut c_void),
    step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    environment: *const Messages,
}

unsafe extern "C" {
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(pointer: *mut c_void);
}

unsafe extern "C" fn log(
    environment: *mut c_void,
    _instance: *const c_char,
    _status: Status,
    category: *const c_char,
    message: *const c_char,
) {
    let text = |pointer: *const c_char| {
        if pointer.is_null() {
            return String::new();
        }
        // SAFETY: [FMI, 2.1.5] category and message are zero-terminated and live during the call.
        unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
    };
    // The message is a format string without arguments, in which a per cent sign is doubled.
    let line = format!("{}: {}", text(category), text(message).replace("%%", "%"));
    // SAFETY: [FMI, 2.1.5] the environment is handed back as it was given: the instance's own messages, which outlive it.
    let messages = unsafe { environment.cast::<Messages>().as_ref() };
    if let Some(mut messages) = messages.and_then(|messages| messages.lock().ok()) {
        messages.push(line);
    }
}

/// Declares the table of functions and its loader, one line a function.
macro_rules! functions {
    ($($field:ident = $symbol:literal: fn($($argument:ty),*) -> $result:ty;)*) => {
        #[derive(Clone, Copy)]
        struct Functions { $($field: unsafe extern "C" fn($($argument),*) -> $result,)* }

        impl Functions {
            fn load(library: &Library) -> Result<Self> {
                Ok(Self { $(
                    // SAFETY: [FMI, 2.1 and 4.2] a function of this name has this signature.
                    $field: *unsafe { library.get($symbol) }.with_context(|| {
                        format!("{} is not exported", String::from_utf8_lossy($symbol))
                    })?,
                )* })
            }
        }
    };
}

functions! {
    instantiate = b"fmi2Instantiate": fn(*const c_char, c_int, *const c_char, *const c_char, *const Callbacks, c_int, c_int) -> Component;
    free_instance = b"fmi2FreeInstance": fn(Component) -> ();
    setup_experiment = b"fmi2SetupExperiment": fn(Component, c_int, f64, f64, c_int, f64) -> Status;
    enter_initialization = b"fmi2EnterInitializationMode": fn(Component) -> Status;
    exit_initialization = b"fmi2ExitInitializationMode": fn(Component) -> Status;
    terminate = b"fmi2Terminate": fn(Component) -> Status;
    get_real = b"fmi2GetReal": fn(Component, *const u32, usize, *mut f64) -> Status;
    get_integer = b"fmi2GetInteger": fn(Component, *const u32, usize, *mut c_int) -> Status;
    get_boolean = b"fmi2GetBoolean": fn(Component, *const u32, usize, *mut c_int) -> Status;
    set_real = b"fmi2SetReal": fn(Component, *const u32, usize, *const f64) -> Status;
    set_integer = b"fmi2SetInteger": fn(Component, *const u32, usize, *const c_int) -> Status;
    set_boolean = b"fmi2SetBoolean": fn(Component, *const u32, usize, *const c_int) -> Status;
    set_string = b"fmi2SetString": fn(Component, *const u32, usize, *const *const c_char) -> Status;
    do_step = b"fmi2DoStep": fn(Component, f64, f64, c_int) -> Status;
}

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

/// One running instance; freed when it is dropped.
pub struct Instance<'a> {
    fmu: &'a Fmu,
    component: Component,
    messages: Box<Messages>,
    _callbacks: Box<Callbacks>,
}

impl Drop for Instance<'_> {
    fn drop(&mut self) {
        if !self.component.is_null() {
            // SAFETY: [FMI, 2.1.5] the component came from fmi2Instantiate and nobody uses it after this.
            unsafe { (self.fmu.functions.free_instance)(self.component) };
        }
    }
}

impl Instance<'_> {
    /// What the FMU offers.
    pub fn interface(&self) -> &Interface {
        &self.fmu.interface
    }

    /// Everything logged so far, in one line.
    pub fn log(&self) -> String {
        self.messages.lock().map(|messages| messages.join("; ")).unwrap_or_default()
    }

    fn check(&self, call: &str, status: Status) -> Result<()> {
        ensure!(status <= WARNING, "{} of {} failed: {}", call, self.fmu.interface.model_name, self.log());
        Ok(())
    }

    /// Initialises for a run that starts at 0 and has no set end.
    pub fn initialize(&mut self) -> Result<()> {
        let functions = &self.fmu.functions;
        // SAFETY: [FMI, 4.2.4] the component is alive and in the state Instantiated.
        let status = unsafe { (functions.setup_experiment)(self.component, 0, 0.0, 0.0, 0, 0.0) };
        self.check("setupExperiment", status)?;
        // SAFETY: [FMI, 4.2.4] as above; the experiment is set up.
        let status = unsafe { (functions.enter_initialization)(self.component) };
        self.check("enterInitializationMode", status)?;
        // SAFETY: [FMI, 4.2.4] the component is in the initialization mode.
        let status = unsafe { (functions.exit_initialization)(self.component) };
        self.check("exitInitializationMode", status)
    }

    /// Advances from `time` by `step` [s].
    pub fn do_step(&mut self, time: f64, step: f64) -> Result<()> {
        // SAFETY: [FMI, 4.2.2] the component is alive; a call in a wrong state is answered by an error status.
        let status = unsafe { (self.fmu.functions.do_step)(self.component, time, step, 1) };
        self.check("doStep", status)
    }

    /// Ends the run.
    pub fn terminate(&mut self) -> Result<()> {
        // SAFETY: [FMI, 2.1.6] the component is alive; a call in a wrong state is answered by an error status.
        let status = unsafe { (self.fmu.functions.terminate)(self.component) };
        self.check("terminate", status)
    }

    /// Reads real variables.
    pub fn get_real(&self, references: &[u32], values: &mut [f64]) -> Result<()> {
        assert_eq!(references.len(), values.len(), "a value for each reference");
        let count = references.len();
        // SAFETY: [FMI, 2.1.7] both arrays have `count` elements.
        let status =
            unsafe { (self.fmu.functions.get_real)(self.component, references.as_ptr(), count, values.as_mut_ptr()) };
        self.check("getReal", status)
    }

    /// Writes real variables.
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<()> {
        assert_eq!(references.len(), values.len(), "a value for each reference");
        let count = references.len();
        // SAFETY: [FMI, 2.1.7] both arrays have `count` elements.
        let status =
            unsafe { (self.fmu.functions.set_real)(self.component, references.as_ptr(), count, values.as_ptr()) };
        self.check("setReal", status)
    }

    /// Reads a number of any type by its variable.
    pub fn number(&self, variable: &Variable) -> Result<f64> {
        if variable.kind == Kind::Real {
            let mut value = [0.0];
            self.get_real(&[variable.reference], &mut value)?;
            return Ok(value[0]);
        }
        let get = match variable.kind {
            Kind::Integer | Kind::Enumeration => self.fmu.functions.get_integer,
            Kind::Boolean => self.fmu.functions.get_boolean,
            Kind::Real | Kind::String => bail!("{} is not a number", variable.name),
        };
        let mut value = 0;
        // SAFETY: [FMI, 2.1.7] one reference, one value; integers and Booleans have the same C type.
        let status = unsafe { get(self.component, &raw const variable.reference, 1, &raw mut value) };
        self.check(&format!("getting {}", variable.name), status)?;
        Ok(f64::from(value))
    }

    /// Sets a variable from its text, as typed by a person.
    pub fn set(&mut self, name: &str, text: &str) -> Result<()> {
        let functions = self.fmu.functions;
        let variable = self.fmu.interface.variable(name)?;
        let reference = &raw const variable.reference;
        let number = || format!("{name} takes a {}, got {text}", variable.kind.name());
        let status = match variable.kind {
            Kind::Real => {
                let value: f64 = text.parse().with_context(number)?;
                // SAFETY: [FMI, 2.1.7] one reference, one value.
                unsafe { (functions.set_real)(self.component, reference, 1, &raw const value) }
            }
            Kind::Integer | Kind::Enumeration => {
                let value: c_int = text.parse().with_context(number)?;
                // SAFETY: [FMI, 2.1.7] one reference, one value.
                unsafe { (functions.set_integer)(self.component, reference, 1, &raw const value) }
            }
            Kind::Boolean => {
                let value = c_int::from(text.parse::<bool>().with_context(number)?);
                // SAFETY: [FMI, 2.1.7] one reference, one value.
                unsafe { (functions.set_boolean)(self.component, reference, 1, &raw const value) }
            }
            Kind::String => {
                let value = CString::new(text)?;
                let pointer = value.as_ptr();
                // SAFETY: [FMI, 2.1.7] one reference, one zero-terminated text, which the FMU copies.
                unsafe { (functions.set_string)(self.component, reference, 1, &raw const pointer) }
            }
        };
        self.check(&format!("setting {name}"), status)
    }
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

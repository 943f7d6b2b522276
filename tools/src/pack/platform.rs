//! The platforms that a library is built for, and how cargo is called for each.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use crate::importer::platform as host_folder;
use crate::workspace;

/// A build of the libraries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Platform {
    /// The system that this program runs on, as its toolchain makes it.
    Host,
    /// Any 64-bit Linux of the last decade: no symbol newer than GLIBC_2.17, through cargo-zigbuild.
    PortableLinux,
    /// 64-bit Windows, through MinGW.
    Windows,
}

/// Version of glibc that the portable library asks for at most: that of CentOS 7, the oldest in wide use.
pub const GLIBC: (u32, u32) = (2, 17);

impl Platform {
    /// Folder in `binaries/`.
    pub fn folder(self) -> &'static str {
        match self {
            Self::Host => host_folder(),
            Self::PortableLinux => "linux64",
            Self::Windows => "win64",
        }
    }

    /// Extension of the library.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Host => std::env::consts::DLL_EXTENSION,
            Self::PortableLinux => "so",
            Self::Windows => "dll",
        }
    }

    /// Whether its library can be loaded here.
    pub fn runs_here(self) -> bool {
        self.folder() == host_folder()
    }

    /// What is missing to build for it, as something to do; nothing if it can be built.
    pub fn missing(self) -> Option<&'static str> {
        let ready = match self {
            Self::Host => true,
            Self::PortableLinux => tool("cargo-zigbuild").is_some(),
            Self::Windows => {
                runs(&mut Command::new("x86_64-w64-mingw32-gcc"), "--version")
                    && (has_windows_std() || PathBuf::from(DEBIAN_CARGO).is_file())
            }
        };
        (!ready).then_some("run tools/cross-toolchain first")
    }

    /// Cargo with its subcommand and target.
    pub fn cargo(self) -> Command {
        // Under `cargo run`, the variable names the very cargo that started this program.
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        match self {
            Self::Host => {
                cargo.arg("build");
                return cargo;
            }
            Self::PortableLinux => {
                // Cargo and its plugin find each other, and the plugin its compiler, through the PATH.
                cargo.env("PATH", path_with_tools());
                let target = format!("{LINUX}.{}.{}", GLIBC.0, GLIBC.1);
                cargo.args(["zigbuild", "--target", &target]);
            }
            Self::Windows if has_windows_std() => {
                cargo.args(["build", "--target", WINDOWS]);
            }
            Self::Windows => {
                // Debian ships the compiler and the library's sources, not the library for Windows.
                cargo = Command::new(DEBIAN_CARGO);
                cargo.env("RUSTC", "/usr/bin/rustc").env("RUSTC_BOOTSTRAP", "1").env_remove("RUSTUP_TOOLCHAIN");
                cargo.args(["build", "-Zbuild-std=std,panic_unwind", "--target", WINDOWS]);
            }
        }
        // What is handed to strangers does not tell where it was built.
        cargo.env("RUSTFLAGS", remapped_paths());
        cargo
    }
}

const LINUX: &str = "x86_64-unknown-linux-gnu";
const WINDOWS: &str = "x86_64-pc-windows-gnu";
/// Cargo of Debian's package cargo-web.
const DEBIAN_CARGO: &str = "/usr/bin/cargo";

fn runs(command: &mut Command, argument: &str) -> bool {
    let silent = command.arg(argument).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    silent.status().is_ok_and(|status| status.success())
}

/// Whether the present toolchain has the standard library for Windows.
fn has_windows_std() -> bool {
    let folder = Command::new("rustc").args(["--print", "sysroot"]).output().ok();
    let folder = folder.map(|run| PathBuf::from(String::from_utf8_lossy(&run.stdout).trim()));
    folder.is_some_and(|folder| folder.join("lib/rustlib").join(WINDOWS).join("lib").is_dir())
}

/// Folder that `tools/cross-toolchain` installs into.
fn tools() -> PathBuf {
    workspace::root().join("target/cross/bin")
}

fn path_with_tools() -> OsString {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::iter::once(tools()).chain(std::env::split_paths(&path));
    // A folder whose name holds the separator cannot be on a PATH at all; then the plugin is looked for on the old one.
    std::env::join_paths(folders).unwrap_or(path)
}

fn tool(name: &str) -> Option<PathBuf> {
    std::env::split_paths(&path_with_tools()).map(|folder| folder.join(name)).find(|file| file.is_file())
}

fn remapped_paths() -> String {
    let home = std::env::var("CARGO_HOME").or_else(|_| std::env::var("HOME").map(|home| format!("{home}/.cargo")));
    let given = std::env::var("RUSTFLAGS").unwrap_or_default();
    let home = home.map(|home| format!(" --remap-path-prefix={home}=cargo")).unwrap_or_default();
    format!("{given} --remap-path-prefix={}=.{home}", workspace::root().display()).trim().to_owned()
}

/// The newest version of glibc that a library asks for, from the version names in its string table.
pub fn newest_glibc(library: &[u8]) -> Option<(u32, u32)> {
    const NAME: &[u8] = b"GLIBC_";
    let versions = library.windows(NAME.len()).enumerate().filter(|(_, window)| *window == NAME);
    versions
        .filter_map(|(at, _)| {
            let rest = &library[at + NAME.len()..];
            let end = rest.iter().position(|byte| *byte == 0)?;
            let mut numbers = std::str::from_utf8(&rest[..end]).ok()?.split('.').map(str::parse);
            Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
        })
        .max()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_glibc_is_the_largest_by_number() {
        let strings = b"\0GLIBC_2.9\0GLIBC_2.2.5\0GLIBC_2.14\0GLIBC_PRIVATE\0";
        assert_eq!(newest_glibc(strings), Some((2, 14)));
        assert_eq!(newest_glibc(b"nothing here"), None);
    }

    #[test]
    fn builds_for_others_do_not_tell_where_they_were_made() {
        assert!(remapped_paths().contains(&format!("--remap-path-prefix={}=.", workspace::root().display())));
    }
}

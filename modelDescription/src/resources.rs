//! The resources folder from the URI that the importer passes (FMI 2.0.4, section 2.1.5; RFC 8089), and files that
//! parameters name.

use std::ffi::CStr;
use std::fs;
use std::path::{Path, PathBuf};

use percent_encoding::percent_decode;

/// The folder, or why the built-in defaults are used instead.
pub(crate) fn folder(location: Option<&CStr>) -> Result<PathBuf, String> {
    let Some(location) = location else {
        return Err("no resource location is given, so the built-in defaults are used".to_owned());
    };
    let shown = location.to_string_lossy();
    let path = path(location.to_bytes()).ok_or_else(|| {
        format!("resource location {shown:?} is no local file URI, so the built-in defaults are used")
    })?;
    if path.is_dir() {
        Ok(path)
    } else {
        Err(format!("resource folder {shown:?} does not exist, so the built-in defaults are used"))
    }
}

/// A file that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("file \"{path}\" cannot be read: {reason}")]
pub struct FileError {
    /// Where it was looked for.
    pub path: PathBuf,
    /// What the system says.
    pub reason: String,
}

/// The text of a file that a String parameter names, and where it was found.
///
/// `name` is a path or a file URI. A relative one is looked for in the resources and then in the working directory.
///
/// # Errors
/// If there is no such file, if it is no UTF-8 text, or if it is longer than `size_max` [bytes].
pub fn read_file(name: &str, resources: Option<&Path>, size_max: u64) -> Result<(PathBuf, String), FileError> {
    let named = path(name.as_bytes()).unwrap_or_else(|| PathBuf::from(name));
    let found = resources.map(|folder| folder.join(&named)).filter(|path| path.is_file()).unwrap_or(named);
    let text = fs::metadata(&found).map_err(|error| error.to_string()).and_then(|data| match data.len() {
        size if size > size_max => Err(format!("{size} bytes are more than the {size_max} that are taken")),
        _ => fs::read_to_string(&found).map_err(|error| error.to_string()),
    });
    match text {
        Ok(text) => Ok((found, text)),
        Err(reason) => Err(FileError { path: found, reason }),
    }
}

/// The path that a URI names; some importers pass a bare path, which is taken as it is.
fn path(location: &[u8]) -> Option<PathBuf> {
    let text = std::str::from_utf8(location).ok()?;
    let Some((scheme, rest)) = text.split_once(':').filter(|(scheme, _)| scheme.len() > 1) else {
        return (!text.is_empty()).then(|| PathBuf::from(text));
    };
    if !scheme.eq_ignore_ascii_case("file") {
        return None;
    }
    let encoded = match rest.strip_prefix("//") {
        // Some importers write file://tmp/x or file://C:/x; a real host other than this one cannot be reached.
        Some(authority) => match authority.strip_prefix("localhost").filter(|path| path.starts_with('/')) {
            Some(path) => path,
            None if authority.starts_with('/') || is_drive(authority) => authority,
            None => return None,
        },
        None => rest,
    };
    let decoded = percent_decode(encoded.as_bytes()).decode_utf8().ok()?;
    if decoded.is_empty() || decoded.contains('\0') {
        return None;
    }
    let local = match decoded.strip_prefix('/') {
        Some(drive) if is_drive(drive) => drive,
        _ => &decoded,
    };
    Some(PathBuf::from(local))
}

/// Whether a path begins with a Windows drive.
fn is_drive(path: &str) -> bool {
    matches!(path.as_bytes(), [letter, b':', ..] if letter.is_ascii_alphabetic())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_to_write_a_local_file_is_understood() {
        for (location, wanted) in [
            ("file:///tmp/a", Some("/tmp/a")),
            ("file:/tmp/a", Some("/tmp/a")),
            ("file://localhost/tmp/a", Some("/tmp/a")),
            ("FILE:///tmp/a", Some("/tmp/a")),
            ("file:///tmp/a%20b/%C3%A4", Some("/tmp/a b/ä")),
            ("file:///tmp/a b/ä", Some("/tmp/a b/ä")),
            ("file:///tmp/100%25", Some("/tmp/100%")),
            ("file:///C:/Temp/a", Some("C:/Temp/a")),
            ("file://C:/Temp/a", Some("C:/Temp/a")),
            ("/tmp/a", Some("/tmp/a")),
            ("C:/Temp/a", Some("C:/Temp/a")),
            ("", None),
            ("file://", None),
            ("file:///tmp/%00", None),
            ("file:///tmp/%FF", None),
            ("file://elsewhere/tmp/a", None),
            ("http://localhost/tmp/a", None),
        ] {
            assert_eq!(path(location.as_bytes()), wanted.map(PathBuf::from), "{location:?}");
        }
    }

    #[test]
    fn a_missing_folder_is_explained() {
        let reason = folder(Some(c"file:///does/not/exist")).unwrap_err();
        assert!(reason.contains("/does/not/exist"), "{reason}");
        assert!(folder(None).is_err());
    }
}

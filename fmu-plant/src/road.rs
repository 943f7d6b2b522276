//! The parameter `road`: a manoeuvre's name or a file.

use std::fs;
use std::path::{Path, PathBuf};

use percent_encoding::percent_decode_str;
use vehicle::{Parameters, Road, road};

use crate::error::Error;

/// Longest road file [bytes]: 100 km in steps of 0.1 m are 30 MB.
const SIZE_MAX: u64 = 64 << 20;

/// The road that `text` names.
///
/// Known names come first. Whatever ends in `.csv` or begins with `file:` is a file; a relative one is looked for in the
/// resources and then in the working directory.
pub fn load(text: &str, parameters: &Parameters, resources: Option<&Path>) -> Result<Road, Error> {
    let text = text.trim();
    let is_file = text.len() >= 4
        && (text.to_ascii_lowercase().ends_with(".csv") || text.to_ascii_lowercase().starts_with("file:"));
    if road::NAMES.contains(&text) || !is_file {
        return Ok(Road::named(text, parameters)?);
    }
    let path = local(text);
    let found = resources.map(|folder| folder.join(&path)).filter(|path| path.is_file()).unwrap_or(path);
    let content = read(&found).map_err(|reason| Error::File { path: found.clone(), reason })?;
    Road::from_csv_within(&content, parameters.road_tolerance).map_err(|reason| Error::Content { path: found, reason })
}

/// The path that a file URI or a plain path names.
fn local(text: &str) -> PathBuf {
    let is_uri = text.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("file:"));
    if !is_uri {
        return PathBuf::from(text);
    }
    let rest = &text[5..];
    let rest = rest.strip_prefix("//").unwrap_or(rest);
    let rest = rest.strip_prefix("localhost").unwrap_or(rest);
    let decoded = percent_decode_str(rest).decode_utf8_lossy().into_owned();
    // A Windows drive stands behind a slash that is not part of the path.
    let drive = decoded.as_bytes();
    let behind = usize::from(drive.len() > 2 && drive[0] == b'/' && drive[2] == b':');
    PathBuf::from(&decoded[behind..])
}

fn read(path: &Path) -> Result<String, String> {
    let size = fs::metadata(path).map_err(|error| error.to_string())?.len();
    if size > SIZE_MAX {
        return Err(format!("{size} bytes are more than the {SIZE_MAX} that are taken"));
    }
    fs::read_to_string(path).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_to_write_a_file_is_understood() {
        for (text, want) in [
            ("a b.csv", "a b.csv"),
            ("file:///tmp/a%20b.csv", "/tmp/a b.csv"),
            ("file:/tmp/a.csv", "/tmp/a.csv"),
            ("file://localhost/tmp/a.csv", "/tmp/a.csv"),
            ("FILE:///C:/tracks/a.csv", "C:/tracks/a.csv"),
        ] {
            assert_eq!(local(text), PathBuf::from(want), "{text}");
        }
    }

    #[test]
    fn resources_come_before_the_working_directory() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("my track.csv"), "s,kappa,v_x\n0,0,10\n50,0,10\n").unwrap();
        let parameters = Parameters::default();
        let road = load("my track.csv", &parameters, Some(folder.path())).unwrap();
        assert!((road.length() - 50.0).abs() < 1e-12);
        let message = load("my track.csv", &parameters, None).unwrap_err().to_string();
        assert!(message.starts_with("road file \"my track.csv\" cannot be read"), "{message}");
        let message = load("nowhere", &parameters, None).unwrap_err().to_string();
        assert!(message.starts_with("unknown road \"nowhere\": known are double_lane_change"), "{message}");
    }
}

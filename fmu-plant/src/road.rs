//! The parameter `road`: a manoeuvre's name or a file.

use std::path::Path;

use model_description::read_file;
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
    let (path, content) = read_file(text, resources, SIZE_MAX).map_err(Error::File)?;
    Road::from_csv_within(&content, parameters.road_tolerance).map_err(|reason| Error::Content { path, reason })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

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

    #[test]
    fn example_of_the_resources_is_a_closed_track() {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/resources"));
        let road = load("example_track.csv", &Parameters::default(), Some(folder)).unwrap();
        assert!(road.is_closed() && (500.0..600.0).contains(&road.length()), "{} m", road.length());
        for i in 0..550 {
            // 12 m/s stay below half of the grip.
            let lateral = 144.0 * road.curvature(f64::from(i));
            assert!(lateral.abs() < 4.02, "{lateral} m/s2 at {i} m");
        }
    }
}

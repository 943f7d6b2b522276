//! The network that adapts the tyres: the built-in one, or a file.

use std::path::Path;

use lpv_mpc::jordan::Network;
use model_description::read_file;

use crate::error::Error;

/// The network of resources/, which serves when the importer gives no resources at all.
const BUILT_IN: &str = include_str!("../resources/jordan.json");

/// Longest network file [bytes]: a net of the largest width has some thousand numbers of twenty characters.
const SIZE_MAX: u64 = 4 << 20;

/// The network in `file`, or the built-in one when that is empty.
pub fn load(file: &str, resources: Option<&Path>) -> Result<Network, Error> {
    if file.trim().is_empty() {
        return Ok(Network::from_json(BUILT_IN)?);
    }
    let (path, text) = read_file(file.trim(), resources, SIZE_MAX).map_err(Error::File)?;
    Network::from_json(&text).map_err(|reason| Error::Network { path, reason })
}

#[cfg(test)]
mod tests {
    use lpv_mpc::Parameters;
    use lpv_mpc::adaptation::other_car;

    use super::*;

    #[test]
    fn built_in_network_is_of_the_default_car() {
        let network = load("", None).unwrap();
        assert_eq!(other_car(&network, &Parameters::default()), None);
        let other = Parameters { l_f: 1.5, ..Parameters::default() };
        assert_eq!(other_car(&network, &other).unwrap(), "l_f was 1.2, it is 1.5 here");
    }

    #[test]
    fn a_file_that_is_no_network_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("not a net.json"), "{\"format\": \"poem\"}").unwrap();
        let message = load("not a net.json", Some(folder.path())).unwrap_err().to_string();
        assert!(message.contains("not a net.json") && message.contains("poem"), "{message}");
        let message = load("nowhere.json", Some(folder.path())).unwrap_err().to_string();
        assert!(message.starts_with("network file \"nowhere.json\" cannot be read"), "{message}");
    }
}

//! The GUID of an interface: a hash of its XML, so that archives with equal GUIDs have the same variables.

use sha2::{Digest, Sha256};

use crate::error::Error;
use crate::model::Model;
use crate::xml;

/// Length of a GUID as text, braces included.
pub(crate) const LEN: usize = 38;

/// GUID of the model's interface, computed at the first call.
pub(crate) fn guid<M: Model>() -> &'static str {
    let bytes = M::table().guid.get_or_init(|| {
        // A table without XML never gets past the test that compares it with the committed file.
        compute::<M>().expect("the table was checked by assert_xml_current")
    });
    std::str::from_utf8(bytes).expect("hexadecimal digits are UTF-8")
}

fn compute<M: Model>() -> Result<[u8; LEN], Error> {
    // The version is left out: a release that changes no variable keeps its GUID.
    let digest = Sha256::digest(xml::write::<M>("", "")?);
    let mut text = *b"{00000000-0000-0000-0000-000000000000}";
    let places = (0..LEN).filter(|&k| b"{}-".iter().all(|mark| *mark != text[k])).collect::<Vec<_>>();
    for (nibble, place) in places.into_iter().enumerate() {
        let byte = digest[nibble / 2];
        let digit = if nibble % 2 == 0 { byte >> 4 } else { byte & 15 };
        text[place] = b"0123456789abcdef"[usize::from(digit)];
    }
    Ok(text)
}

//! The C interface, driven as an importer does: through the exported symbols, with an importer's own declarations.
#![allow(missing_docs, clippy::unwrap_used, reason = "a test; clippy recognises only functions marked as such")]

mod importer;
mod lifecycle;
mod robustness;
mod sample;
mod states;
mod values;
mod xml;

use sample::Sample;

use model_description::Model;

/// The GUID as an importer learns it: from the XML.
fn guid() -> String {
    let xml = model_description::model_description::<Sample>().unwrap();
    let (_, rest) = xml.split_once("guid=\"").unwrap();
    rest.split_once('"').unwrap().0.to_owned()
}

/// Value reference of a variable.
fn vr(name: &str) -> u32 {
    Sample::table().find(name).unwrap_or_else(|| panic!("no variable {name}"))
}

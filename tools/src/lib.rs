//! The tools around the two FMUs: pack them, drive them, show what they do. Run as `cargo fmu COMMAND`.

pub mod archive;
pub mod html;
pub mod importer;
pub mod interface;
pub mod output;
pub mod pack;
pub mod workspace;
pub mod xml;

//! The generated XML is committed; this keeps it current.

use std::path::Path;

use crate::model::Model;
use crate::terminals::terminals;
use crate::xml;

/// Panics if the committed XML is not the one that the table gives. With `UPDATE` set in the environment it is rewritten instead.
///
/// Meant for a unit test of each FMU crate: `assert_xml_current::<Plant>("../modelDescription/plant.xml")`. If variables belong to
/// terminals, `plant.terminals.xml` beside it is kept as well.
///
/// # Panics
/// If the table contradicts itself, or a file is stale or cannot be written.
pub fn assert_xml_current<M: Model>(path: impl AsRef<Path>) {
    let path = path.as_ref();
    let description = xml::model_description::<M>().unwrap_or_else(|error| panic!("{error}"));
    assert_current(path, &description);
    if let Some(terminals) = terminals::<M>() {
        assert_current(&path.with_extension("terminals.xml"), &terminals);
    }
}

fn assert_current(path: &Path, current: &str) {
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(path, current).unwrap_or_else(|error| panic!("cannot write {}: {error}", path.display()));
    }
    let committed =
        std::fs::read_to_string(path).unwrap_or_else(|error| panic!("cannot read {}: {error}", path.display()));
    let mut lines = (1..).zip(committed.lines().zip(current.lines()));
    if let Some((line, (is, should))) = lines.find(|(_, (is, should))| is != should) {
        panic!(
            "{}:{line} is stale:\n{is}\nshould be\n{should}\nrun `UPDATE=1 cargo test` and review the difference",
            path.display()
        );
    }
    assert!(committed == current, "{} is stale: its length differs; run `UPDATE=1 cargo test`", path.display());
}

//! Which variables are connected as one: terminalsAndIcons.xml. FMI 3.0 (section 2.4.9) defines it; tools read it beside an FMI 2.0
//! description too, and others ignore it.

use std::collections::BTreeMap;

use quick_xml::Writer;

use crate::model::Model;
use crate::table::Role;

/// The XML of a model's terminals, or None if no variable belongs to one.
///
/// Members have the names of their variables, so that terminals of the same name fit each other (matching rule "bus").
#[must_use]
pub fn terminals<M: Model>() -> Option<String> {
    let mut members: BTreeMap<(&str, bool), Vec<String>> = BTreeMap::new();
    for (_, row, element) in M::table().variables() {
        if let Some(terminal) = row.terminal {
            members.entry((terminal, row.role == Role::Input)).or_default().push(row.element_name(element));
        }
    }
    if members.is_empty() {
        return None;
    }
    let mut out = Writer::new_with_indent(b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_vec(), b' ', 2);
    out.create_element("fmiTerminalsAndIcons")
        .with_attribute(("fmiVersion", "3.0"))
        .write_inner_content(|out| {
            out.create_element("Terminals").write_inner_content(|out| {
                for ((name, _), variables) in &members {
                    out.create_element("Terminal")
                        .with_attribute(("name", *name))
                        .with_attribute(("matchingRule", "bus"))
                        .write_inner_content(|out| {
                            for variable in variables {
                                out.create_element("TerminalMemberVariable")
                                    .with_attribute(("variableName", variable.as_str()))
                                    .with_attribute(("memberName", variable.as_str()))
                                    .with_attribute(("variableKind", "signal"))
                                    .write_empty()?;
                            }
                            Ok(())
                        })?;
                }
                Ok(())
            })?;
            Ok(())
        })
        .expect("writing into a vector cannot fail");
    let mut xml = String::from_utf8(out.into_inner()).expect("quick-xml writes the UTF-8 that it was given");
    xml.push('\n');
    Some(xml)
}

//! The generated XML, read back with an XML reader that knows nothing of the writer.

use std::collections::{BTreeMap, BTreeSet};

use quick_xml::Reader;
use quick_xml::escape::unescape;
use quick_xml::events::{BytesStart, Event};

use crate::guid;
use crate::sample::Sample;

/// One start tag and its attributes, in the order of the document.
type Element = (String, BTreeMap<String, String>);

fn elements() -> Vec<Element> {
    read(&model_description::model_description::<Sample>().unwrap())
}

fn read(xml: &str) -> Vec<Element> {
    let mut reader = Reader::from_str(xml);
    let mut elements = Vec::new();
    loop {
        match reader.read_event().unwrap() {
            Event::Start(tag) | Event::Empty(tag) => elements.push(element(&tag)),
            Event::Eof => return elements,
            _ => {}
        }
    }
}

fn element(tag: &BytesStart<'_>) -> Element {
    let attributes = tag.attributes().map(|attribute| {
        let attribute = attribute.unwrap();
        (attribute.key.as_ref().to_owned(), unescape(&attribute.value).unwrap().into_owned())
    });
    (tag.name().as_ref().to_owned(), attributes.collect())
}

/// The type element of a variable.
fn typed(name: &str) -> Element {
    let elements = elements();
    let at = elements.iter().position(|(tag, of)| tag == "ScalarVariable" && of["name"] == name).unwrap();
    elements[at + 1].clone()
}

#[test]
fn top_level_elements_have_the_order_of_the_schema() {
    let wanted = [
        "CoSimulation",
        "UnitDefinitions",
        "TypeDefinitions",
        "LogCategories",
        "DefaultExperiment",
        "ModelVariables",
        "ModelStructure",
    ];
    let found: Vec<_> =
        elements().into_iter().map(|(tag, _)| tag).filter(|tag| wanted.contains(&tag.as_str())).collect();
    assert_eq!(found, wanted);
}

#[test]
fn capabilities_are_those_of_the_model() {
    let (_, flags) = elements().into_iter().find(|(tag, _)| tag == "CoSimulation").unwrap();
    for flag in
        ["canInterpolateInputs", "canGetAndSetFMUstate", "canSerializeFMUstate", "providesDirectionalDerivative"]
    {
        assert_eq!(flags[flag], "true", "{flag}");
    }
    assert_eq!(flags["maxOutputDerivativeOrder"], "1");
}

#[test]
fn a_variable_has_type_unit_limits_and_start() {
    let (tag, real) = typed("u");
    assert_eq!(tag, "Real");
    assert_eq!((real["unit"].as_str(), real["displayUnit"].as_str()), ("m/s", "km/h"));
    assert_eq!((real["min"].as_str(), real["max"].as_str(), real["start"].as_str()), ("-10.0", "10.0", "0.0"));
    let (tag, enumeration) = typed("trouble");
    assert_eq!(
        (tag.as_str(), enumeration["declaredType"].as_str(), enumeration["start"].as_str()),
        ("Enumeration", "Trouble", "0")
    );
    let (tag, integer) = typed("limit");
    assert_eq!((tag.as_str(), integer["min"].as_str(), integer["max"].as_str()), ("Integer", "1", "1000"));
    assert_eq!(typed("label").1["start"], "ü & <b>");
    assert!(!typed("y").1.contains_key("start"), "a calculated variable has no start value");
}

#[test]
fn initial_is_absent_from_inputs_and_right_elsewhere() {
    for (tag, attributes) in elements().iter().filter(|(tag, _)| tag == "ScalarVariable") {
        let wanted = match attributes["causality"].as_str() {
            "input" => None,
            "parameter" => Some("exact"),
            _ => Some("calculated"),
        };
        assert_eq!(attributes.get("initial").map(String::as_str), wanted, "{tag} {attributes:?}");
    }
}

#[test]
fn every_used_unit_and_type_is_defined_once() {
    let elements = elements();
    let defined: Vec<_> = elements
        .iter()
        .filter(|(tag, _)| tag == "Unit" || tag == "SimpleType")
        .map(|(_, of)| of["name"].as_str())
        .collect();
    assert_eq!(defined.len(), defined.iter().collect::<BTreeSet<_>>().len());
    for (_, attributes) in &elements {
        for used in ["unit", "declaredType"].iter().filter_map(|key| attributes.get(*key)) {
            assert!(defined.contains(&used.as_str()), "{used}");
        }
    }
}

#[test]
fn dependencies_are_true_and_sorted() {
    let elements = elements();
    let index = |name: &str| {
        let names = elements.iter().filter(|(tag, _)| tag == "ScalarVariable").map(|(_, of)| of["name"].as_str());
        (1 + names.into_iter().position(|of| of == name).unwrap()).to_string()
    };
    let structure: Vec<_> = elements.iter().filter(|(tag, _)| tag == "Unknown").map(|(_, of)| of).collect();
    let (outputs, initial) = structure.split_at(structure.len() / 2);
    let of = |part: &[&BTreeMap<String, String>], name: &str| {
        let found = part.iter().find(|unknown| unknown["index"] == index(name)).unwrap();
        found.get("dependencies").cloned()
    };
    assert_eq!(of(outputs, "y").as_deref(), Some(""), "an integral does not depend on the input of the same instant");
    assert_eq!(of(outputs, "double_u"), Some(index("u")));
    assert_eq!(of(outputs, "moving"), None, "no list: on everything");
    let parameters = ["gain", "trouble", "limit", "enabled", "label"].map(index).join(" ");
    assert_eq!(of(initial, "y"), Some(parameters.clone()));
    assert_eq!(of(initial, "double_u"), Some(format!("{} {parameters}", index("u"))));
    let indices: Vec<u32> = initial.iter().map(|unknown| unknown["index"].parse().unwrap()).collect();
    assert!(indices.is_sorted(), "{indices:?}");
}

#[test]
fn a_guid_has_the_form_of_one() {
    let guid = guid();
    let groups: Vec<_> = guid.trim_start_matches('{').trim_end_matches('}').split('-').map(str::len).collect();
    assert_eq!(groups, [8, 4, 4, 4, 12], "{guid}");
    assert!(guid.chars().all(|c| c.is_ascii_hexdigit() || "{}-".contains(c)));
}

#[test]
fn terminals_hold_their_variables_by_name() {
    let mut terminals: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut current = String::new();
    for (tag, attributes) in read(&model_description::terminals::<Sample>().unwrap()) {
        match tag.as_str() {
            "Terminal" => current.clone_from(&attributes["name"]),
            "TerminalMemberVariable" => {
                terminals.entry(current.clone()).or_default().push(attributes["variableName"].clone());
            }
            _ => {}
        }
    }
    assert_eq!(terminals["settings"], ["weights[1]", "weights[2]", "weights[3]"]);
    assert_eq!(
        (&terminals["drive"][..], &terminals["echo"][..]),
        (&["u".to_owned()][..], &["double_u".to_owned()][..])
    );
}

//! documentation/index.html: the written pages of the model, then every variable, generated from the XML.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::archive::{Files, read, read_text};
use crate::html::{document, escape, markdown, table};
use crate::interface::{Interface, Variable};

/// Sections of the variable list in the order in which a reader wants them.
const SECTIONS: [(&str, &str); 3] = [("input", "Inputs"), ("output", "Outputs"), ("parameter", "Parameters")];

/// Adds index.html and whatever else lies in the folder. Markdown files become chapters, in the order of their names.
pub fn add(files: &mut Files, interface: &Interface, folder: &Path) -> Result<()> {
    let mut chapters = Vec::new();
    for path in sorted(folder)? {
        if path.extension().is_some_and(|extension| extension == "md") {
            chapters.push(markdown(&read_text(&path)?));
        } else if path.is_dir() {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            files.add_folder(&format!("documentation/{name}"), &path)?;
        } else {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            files.add(&format!("documentation/{name}"), read(&path)?)?;
        }
    }
    files.add("documentation/index.html", page(interface, &chapters))
}

fn sorted(folder: &Path) -> Result<Vec<PathBuf>> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let mut paths = fs::read_dir(folder)
        .with_context(|| format!("reading {}", folder.display()))?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}

fn page(interface: &Interface, chapters: &[String]) -> String {
    let mut body = format!(
        "<h1>{}</h1>\n<p class=\"lead\">{}. Version {}, FMI 2.0 co-simulation.</p>\n",
        escape(&interface.model_name),
        escape(&interface.description),
        escape(&interface.version)
    );
    for chapter in chapters {
        body.push_str(chapter);
    }
    body.push_str("<h2>Variables</h2>\n");
    for (causality, title) in SECTIONS {
        body.push_str(&section(interface, causality, title));
    }
    for (name, items) in &interface.enumerations {
        body.push_str(&format!("<h3>Values of {}</h3>\n", escape(name)));
        let rows: Vec<Vec<String>> = items
            .iter()
            .map(|item| vec![item.value.to_string(), escape(&item.name), escape(&item.description)])
            .collect();
        body.push_str(&table(&[("value", true), ("name", false), ("meaning", false)], &rows));
    }
    document(&interface.model_name, "", &body)
}

fn section(interface: &Interface, causality: &str, title: &str) -> String {
    let rows: Vec<Vec<String>> = folded(interface.with_causality(causality))
        .into_iter()
        .map(|(name, variable)| {
            let text = |value: &Option<String>| escape(value.as_deref().unwrap_or_default());
            let range = match (&variable.min, &variable.max) {
                (None, None) => String::new(),
                (min, max) => format!(
                    "{} to {}",
                    escape(min.as_deref().unwrap_or("-\u{221e}")),
                    escape(max.as_deref().unwrap_or("\u{221e}"))
                ),
            };
            vec![
                format!("<code>{}</code>", escape(&name)),
                format!("<div class=\"what\">{}</div>", escape(&variable.description)),
                text(&variable.unit),
                text(&variable.start),
                range,
                escape(&variable.variability),
            ]
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let head = [
        ("name", false),
        ("what it is", false),
        ("unit", false),
        ("start", true),
        ("range", false),
        ("may change", false),
    ];
    // An output has no start value: a column that nobody fills only takes the room of the others.
    let used: Vec<usize> = (0..head.len()).filter(|&column| rows.iter().any(|row| !row[column].is_empty())).collect();
    let head: Vec<(&str, bool)> = used.iter().map(|&column| head[column]).collect();
    let rows: Vec<Vec<String>> =
        rows.iter().map(|row| used.iter().map(|&column| row[column].clone()).collect()).collect();
    format!("<h3>{title}</h3>\n{}", table(&head, &rows))
}

/// Arrays as one row: `kappa_ref[1..41]`.
fn folded<'a>(variables: impl Iterator<Item = &'a Variable>) -> Vec<(String, &'a Variable)> {
    let mut rows: Vec<(String, usize, &Variable)> = Vec::new();
    for variable in variables {
        let stem = variable.name.split('[').next().unwrap_or_default();
        match rows.last_mut() {
            Some((last, count, _)) if last == stem && variable.name.contains('[') => *count += 1,
            _ => rows.push((stem.to_owned(), usize::from(variable.name.contains('[')), variable)),
        }
    }
    rows.into_iter()
        .map(|(stem, count, variable)| match count {
            0 => (stem, variable),
            _ => (format!("{stem}[1..{count}]"), variable),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOCUMENT: &str = r#"<fmiModelDescription fmiVersion="2.0" modelName="M" guid="{1}">
  <CoSimulation modelIdentifier="m"/>
  <ModelVariables>
    <ScalarVariable name="a" valueReference="0" causality="input" description="x &lt; 1"><Real unit="m"/></ScalarVariable>
    <ScalarVariable name="b[1]" valueReference="1" causality="input"><Real min="0"/></ScalarVariable>
    <ScalarVariable name="b[2]" valueReference="2" causality="input"><Real min="0"/></ScalarVariable>
    <ScalarVariable name="c" valueReference="3" causality="parameter"><Real start="5"/></ScalarVariable>
  </ModelVariables>
</fmiModelDescription>"#;

    #[test]
    fn the_page_lists_every_variable_and_folds_arrays() {
        let interface = Interface::parse(DOCUMENT).unwrap();
        let page = page(&interface, &[markdown("# Timing\n\n| a | b |\n|---|---|\n| 1 | 2 |\n")]);
        for part in ["<h1>Timing</h1>", "<code>a</code>", "x &lt; 1", "<code>b[1..2]</code>", "<h3>Parameters</h3>"] {
            assert!(page.contains(part), "{part} is missing in\n{page}");
        }
        assert!(!page.contains("<h3>Outputs</h3>"));
        // Only the second table has start values.
        assert_eq!(page.matches(">start</th>").count(), 1);
    }
}

//! The licences of everything that is linked into a library: texts that must travel with the binary.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

use crate::workspace::{self, Model};

/// What `cargo metadata` says, as far as it is needed.
#[derive(Deserialize)]
pub struct Metadata {
    packages: Vec<Package>,
    resolve: Resolve,
}

#[derive(Deserialize)]
struct Package {
    id: String,
    name: String,
    version: String,
    license: Option<String>,
    repository: Option<String>,
    manifest_path: PathBuf,
    source: Option<String>,
    targets: Vec<Target>,
}

#[derive(Deserialize)]
struct Target {
    kind: Vec<String>,
}

#[derive(Deserialize)]
struct Resolve {
    nodes: Vec<Node>,
}

#[derive(Deserialize)]
struct Node {
    id: String,
    deps: Vec<Dependency>,
}

#[derive(Deserialize)]
struct Dependency {
    pkg: String,
    dep_kinds: Vec<DependencyKind>,
}

#[derive(Deserialize)]
struct DependencyKind {
    kind: Option<String>,
}

/// Beginnings of the names of files that hold a licence.
const FILES: [&str; 5] = ["license", "licence", "copying", "notice", "unlicense"];

/// Asks cargo for the graph of packages on the system that it runs on.
pub fn metadata() -> Result<Metadata> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let run = Command::new(cargo)
        .args(["metadata", "--format-version", "1"])
        .current_dir(workspace::root())
        .stdin(Stdio::null())
        .output()
        .context("starting cargo metadata")?;
    ensure!(run.status.success(), "cargo metadata failed:\n{}", String::from_utf8_lossy(&run.stderr));
    Ok(serde_json::from_slice(&run.stdout)?)
}

impl Metadata {
    /// Packages that are linked into the model's library: normal dependencies, without what only runs in the compiler.
    fn linked(&self, model: Model) -> Result<Vec<&Package>> {
        let package = |id: &str| self.packages.iter().find(|package| package.id == id);
        let root = self.packages.iter().find(|package| package.name == model.package);
        let mut open = vec![root.with_context(|| format!("cargo knows no package {}", model.package))?];
        let mut seen = BTreeSet::new();
        let mut linked = Vec::new();
        while let Some(next) = open.pop() {
            let in_compiler = next.targets.iter().any(|target| target.kind.iter().any(|kind| kind == "proc-macro"));
            if in_compiler || !seen.insert(&next.id) {
                continue;
            }
            linked.push(next);
            let node = self.resolve.nodes.iter().find(|node| node.id == next.id);
            let dependencies = node.map_or(&[][..], |node| &node.deps);
            let normal = dependencies.iter().filter(|dep| dep.dep_kinds.iter().any(|kind| kind.kind.is_none()));
            open.extend(normal.filter_map(|dep| package(&dep.pkg)));
        }
        // Packages of this project carry the licences that lie beside this file.
        linked.retain(|package| package.source.is_some());
        linked.sort_by(|a, b| (&a.name, &a.version).cmp(&(&b.name, &b.version)));
        Ok(linked)
    }

    /// The page of licences: who is linked in, then every text once, with the names that it holds for.
    pub fn page(&self, model: Model) -> Result<String> {
        let mut page = format!(
            "{} is linked with the Rust standard library (MIT OR Apache-2.0, texts beside this file) and with:\n\n",
            model.name
        );
        let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for package in self.linked(model)? {
            let name = format!("{} {}", package.name, package.version);
            let license = package.license.as_deref().unwrap_or("see its text");
            page += &format!("  {name}: {license}  {}\n", package.repository.as_deref().unwrap_or_default());
            for text in texts_of(&package.manifest_path)? {
                texts.entry(text).or_default().push(name.clone());
            }
        }
        for (text, names) in texts {
            page += &format!("\n{}\n{}\n\n{}\n", "-".repeat(78), names.join(", "), text.trim());
        }
        Ok(page)
    }
}

/// The licence texts in a package's folder, in the order of their names.
fn texts_of(manifest: &Path) -> Result<Vec<String>> {
    let folder = manifest.parent().unwrap_or_else(|| Path::new("."));
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .with_context(|| format!("reading {}", folder.display()))?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<_>>()?;
    files.retain(|file| {
        let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        file.is_file() && FILES.iter().any(|start| name.starts_with(start))
    });
    files.sort();
    files
        .iter()
        .map(|file| {
            let bytes = fs::read(file).with_context(|| format!("reading {}", file.display()))?;
            // Line ends differ between packages; the same text must count as the same.
            Ok(String::from_utf8_lossy(&bytes).replace("\r\n", "\n"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::{CONTROLLER, PLANT};

    #[test]
    fn what_is_linked_is_listed_and_what_only_compiles_is_not() {
        let metadata = metadata().unwrap();
        let page = metadata.page(CONTROLLER).unwrap();
        for name in ["clarabel", "nalgebra", "serde"] {
            assert!(page.contains(&format!("\n  {name} ")), "{name} is missing");
        }
        // Runs in the compiler, is used by the tools alone, and belongs to the other model.
        for name in ["serde_derive", "plotly", "vehicle"] {
            assert!(!page.contains(&format!("\n  {name} ")), "{name} is not linked");
        }
        assert!(page.contains("Apache License") && page.contains("Permission is hereby granted"));
        assert!(!metadata.page(PLANT).unwrap().contains("\n  clarabel "));
    }
}

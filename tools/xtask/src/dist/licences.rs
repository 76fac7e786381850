//! The licences of everything that is built in, in full: those who pass binaries on must pass them on too.

use crate::metadata::cargo;
use anyhow::{Context, ensure};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

/// The text: each package with its licence, then every licence text once.
pub fn text(packages: &[&str]) -> anyhow::Result<String> {
    let mut command = cargo();
    command.args(["metadata", "--format-version", "1", "--locked", "--filter-platform", &target()]);
    let output = command.output().context("cannot run cargo")?;
    ensure!(output.status.success(), "cargo metadata failed:\n{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout)?;
    let used = used(&metadata, packages);
    let mut out = "Soleus contains the following packages.\n\n".to_string();
    let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for package in metadata["packages"].as_array().into_iter().flatten() {
        let (id, name) = (package["id"].as_str().unwrap_or_default(), package["name"].as_str().unwrap_or_default());
        if !used.contains(id) || package["source"].is_null() {
            continue;
        }
        let name = format!("{name} {}", package["version"].as_str().unwrap_or_default());
        let license = package["license"].as_str().unwrap_or("see below");
        let from = package["repository"].as_str().unwrap_or_default();
        writeln!(out, "{name}: {license} {from}")?;
        let manifest = Path::new(package["manifest_path"].as_str().unwrap_or_default());
        for text in licence_files(manifest.parent().context("a manifest lies in a folder")?) {
            texts.entry(text).or_default().push(name.clone());
        }
    }
    for (text, names) in &texts {
        write!(out, "\n{}\n{}\n\n{text}\n", "=".repeat(100), names.join(", "))?;
    }
    Ok(out)
}

/// Identifiers of the packages that the binaries are built from.
fn used(metadata: &Value, packages: &[&str]) -> BTreeSet<String> {
    let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
    let ours = list(&metadata["packages"]);
    let ours = ours.iter().filter(|package| packages.contains(&package["name"].as_str().unwrap_or_default()));
    let mut open: Vec<String> = ours.filter_map(|package| package["id"].as_str().map(str::to_string)).collect();
    let nodes: BTreeMap<String, Value> = list(&metadata["resolve"]["nodes"])
        .into_iter()
        .filter_map(|node| Some((node["id"].as_str()?.to_string(), node)))
        .collect();
    let mut found = BTreeSet::new();
    while let Some(id) = open.pop() {
        if !found.insert(id.clone()) {
            continue;
        }
        for dependency in nodes.get(&id).map(|node| list(&node["deps"])).unwrap_or_default() {
            // Kind null is an ordinary dependency; what tests and build scripts use is not built in.
            if list(&dependency["dep_kinds"]).iter().any(|kind| kind["kind"].is_null()) {
                open.extend(dependency["pkg"].as_str().map(str::to_string));
            }
        }
    }
    found
}

/// The texts of the licences in a package's folder.
fn licence_files(folder: &Path) -> Vec<String> {
    const BEGINNINGS: [&str; 5] = ["license", "licence", "copying", "notice", "copyright"];
    let Ok(entries) = folder.read_dir() else { return Vec::new() };
    let mut paths: Vec<_> = entries
        .flatten()
        .filter(|entry| {
            let name = entry.file_name().to_string_lossy().to_lowercase();
            BEGINNINGS.iter().any(|beginning| name.starts_with(beginning))
        })
        .map(|entry| entry.path())
        .collect();
    paths.sort();
    paths.iter().filter_map(|path| std::fs::read_to_string(path).ok()).map(|text| text.trim().to_string()).collect()
}

fn target() -> String {
    format!("{}-unknown-linux-gnu", std::env::consts::ARCH)
}

#[cfg(test)]
mod tests {
    #[test]
    fn what_is_built_in_is_named_with_its_licence() {
        let text = super::text(&["soleus-controller"]).expect("cargo knows this workspace");
        assert!(text.contains("\niceoryx2 0.") && text.contains("\nnalgebra 0."), "{text:.2000}");
        assert!(text.contains("Permission is hereby granted") && text.contains("Apache License"));
        assert!(!text.contains("\ncriterion "), "of tests nothing is built in");
    }
}

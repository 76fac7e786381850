//! What `cargo metadata` knows of the packages.

use anyhow::{Context, ensure};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::process::Command;

/// A package and what it uses.
#[derive(Debug, Clone, Default)]
pub struct Package {
    /// Name.
    pub name: String,
    /// Licence expression, if it states one.
    pub license: Option<String>,
    /// Whether it belongs to this workspace.
    pub ours: bool,
    /// Names of the packages it uses directly, tests and build scripts apart.
    pub uses: BTreeSet<String>,
}

/// All packages of the build, and where it puts its results.
#[derive(Debug, Default)]
pub struct Metadata {
    /// Packages by name; of several versions of one, the uses are joined.
    pub packages: BTreeMap<String, Package>,
    /// Cargo's target directory.
    pub target: PathBuf,
    /// Root of the workspace.
    pub root: PathBuf,
}

/// The cargo that runs us.
pub fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

impl Metadata {
    /// Asks cargo.
    pub fn read() -> anyhow::Result<Self> {
        let output =
            cargo().args(["metadata", "--format-version", "1", "--locked"]).output().context("cannot run cargo")?;
        ensure!(output.status.success(), "cargo metadata failed:\n{}", String::from_utf8_lossy(&output.stderr));
        Self::parse(&serde_json::from_slice(&output.stdout)?)
    }

    fn parse(value: &Value) -> anyhow::Result<Self> {
        let text = |value: &Value| value.as_str().map(str::to_string).context("not as `cargo metadata` documents it");
        let list = |value: &Value| value.as_array().cloned().context("not as `cargo metadata` documents it");
        let members: BTreeSet<String> =
            list(&value["workspace_members"])?.iter().map(text).collect::<Result<_, _>>()?;
        let mut names = BTreeMap::new();
        let mut packages: BTreeMap<String, Package> = BTreeMap::new();
        for package in list(&value["packages"])? {
            let (id, name) = (text(&package["id"])?, text(&package["name"])?);
            let entry = packages.entry(name.clone()).or_default();
            entry.name = name.clone();
            entry.license = package["license"].as_str().map(str::to_string);
            entry.ours |= members.contains(&id);
            names.insert(id, name);
        }
        for node in list(&value["resolve"]["nodes"])? {
            let name = &names[&text(&node["id"])?];
            for dependency in list(&node["deps"])? {
                // Kind null is an ordinary dependency; the others are `dev` and `build`.
                if list(&dependency["dep_kinds"])?.iter().any(|kind| kind["kind"].is_null()) {
                    let used = names[&text(&dependency["pkg"])?].clone();
                    packages.entry(name.clone()).or_default().uses.insert(used);
                }
            }
        }
        Ok(Self {
            packages,
            target: text(&value["target_directory"])?.into(),
            root: text(&value["workspace_root"])?.into(),
        })
    }

    /// Everything a package uses, directly or not.
    pub fn all_uses(&self, name: &str) -> BTreeSet<String> {
        let mut found = BTreeSet::new();
        let mut open = vec![name.to_string()];
        while let Some(name) = open.pop() {
            for used in self.packages.get(&name).map(|package| &package.uses).into_iter().flatten() {
                if found.insert(used.clone()) {
                    open.push(used.clone());
                }
            }
        }
        found
    }
}

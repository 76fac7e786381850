//! Circles of modules: `a` uses `b`, which uses `a`, perhaps through others. Neither can then be read, moved or
//! replaced without the other.
//!
//! Looked at are the modules right below each `lib.rs`; a folder is one module. A path counts from the module that
//! writes it to the module that owns what it names: `crate::Workspace` is in `workspace` when `lib.rs` says `pub use
//! workspace::Workspace`. Tests may use everything.

use anyhow::Context;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Modules and those they use.
type Graph = BTreeMap<String, BTreeSet<String>>;

/// Every circle of the workspace.
pub fn violations(root: &Path) -> anyhow::Result<Vec<String>> {
    let mut violations = Vec::new();
    for group in ["crates", "tools"] {
        let folder = root.join(group);
        for entry in std::fs::read_dir(&folder).with_context(|| format!("reading {}", folder.display()))? {
            let package = entry?.path();
            let source = package.join("src");
            if !source.join("lib.rs").is_file() {
                continue;
            }
            let name = package.file_name().unwrap_or_default().to_string_lossy().into_owned();
            for circle in circles(&graph(&source)?) {
                violations.push(format!("{group}/{name}: circle of modules {}", circle.join(" <-> ")));
            }
        }
    }
    violations.sort();
    Ok(violations)
}

/// Who uses whom right below `lib.rs`.
fn graph(source: &Path) -> anyhow::Result<Graph> {
    let read = |path: &Path| std::fs::read_to_string(path).with_context(|| format!("reading {}", path.display()));
    let root = code(&read(&source.join("lib.rs"))?);
    let modules = declared(&root);
    // What `lib.rs` hands on, and from where.
    let mut owners: BTreeMap<String, String> = modules.iter().map(|module| (module.clone(), module.clone())).collect();
    for path in used(&root) {
        let mut parts = path.iter().skip_while(|part| *part == "crate" || *part == "self");
        if let (Some(module), Some(name)) = (parts.next(), path.last())
            && modules.contains(module)
        {
            owners.entry(name.clone()).or_insert_with(|| module.clone());
        }
    }
    let mut graph = Graph::new();
    for module in &modules {
        let uses = graph.entry(module.clone()).or_default();
        for (depth, file) in files(source, module)? {
            let text = code(&read(&file)?);
            for path in used(&text).into_iter().chain(written(&text)) {
                // `super` climbs: from a file of depth 0 once to the crate.
                let climbs = path.iter().take_while(|part| *part == "super").count();
                let name = match path.first().map(String::as_str) {
                    Some("crate") => path.get(1),
                    Some("super") if climbs > depth => path.get(climbs),
                    _ => None,
                };
                if let Some(owner) = name.and_then(|name| owners.get(name))
                    && owner != module
                {
                    uses.insert(owner.clone());
                }
            }
        }
    }
    Ok(graph)
}

/// The files of a module, each with how far it lies below the module's root.
fn files(source: &Path, module: &str) -> anyhow::Result<Vec<(usize, std::path::PathBuf)>> {
    let mut found = Vec::new();
    let single = source.join(format!("{module}.rs"));
    if single.is_file() {
        found.push((0, single));
    }
    let mut folders = vec![(0, source.join(module))];
    while let Some((depth, folder)) = folders.pop().filter(|(_, folder)| folder.is_dir()) {
        for entry in std::fs::read_dir(&folder)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                folders.push((depth + 1, path));
            } else if name == "mod.rs" {
                found.push((depth, path));
            } else if name.ends_with(".rs") && !matches!(name.as_str(), "tests.rs") {
                found.push((depth + 1, path));
            }
        }
    }
    Ok(found)
}

/// Text without comments, strings and unit tests.
fn code(text: &str) -> String {
    let mut code = String::with_capacity(text.len());
    for line in text.lines() {
        // Unit tests come last in a file.
        if line.trim_start().starts_with("mod tests") {
            break;
        }
        let mut inside = false;
        let mut previous = ' ';
        let mut kept = String::new();
        for (at, c) in line.char_indices() {
            if !inside && line[at..].starts_with("//") {
                break;
            }
            if c == '"' && previous != '\\' && previous != '\'' {
                inside = !inside;
            }
            if !inside {
                kept.push(c);
            }
            previous = c;
        }
        code.push_str(&kept);
        code.push('\n');
    }
    code
}

/// Names of `mod name;`.
fn declared(code: &str) -> BTreeSet<String> {
    code.lines()
        .filter_map(|line| {
            line.trim().strip_suffix(';')?.split_once("mod ").filter(|(before, _)| !before.contains('='))
        })
        .map(|(_, name)| name.trim().to_string())
        .collect()
}

/// Every path of every `use`, groups multiplied out; for `a as b` both names' path is `a`.
fn used(code: &str) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    for statement in code.split(';') {
        let Some(at) = statement.rfind("use ").filter(|at| !statement[..*at].ends_with(is_name)) else { continue };
        expand(&statement[at + 4..], &mut Vec::new(), &mut paths);
    }
    paths
}

fn expand(tree: &str, before: &mut Vec<String>, paths: &mut Vec<Vec<String>>) {
    let depth = before.len();
    let tree = tree.trim();
    if let Some(group) = tree.strip_prefix('{').and_then(|tree| tree.strip_suffix('}')) {
        let (mut level, mut start) = (0, 0);
        for (at, c) in group.char_indices() {
            match c {
                '{' => level += 1,
                '}' => level -= 1,
                ',' if level == 0 => {
                    expand(&group[start..at], before, paths);
                    start = at + 1;
                }
                _ => {}
            }
        }
        expand(&group[start..], before, paths);
    } else if let Some((first, rest)) = tree.split_once("::") {
        before.push(first.trim().to_string());
        expand(rest, before, paths);
    } else if !tree.is_empty() {
        before.push(tree.split_whitespace().next().unwrap_or_default().to_string());
        paths.push(before.clone());
    }
    before.truncate(depth);
}

/// Paths written out where they are used: `crate::a::b`, `super::c`.
fn written(code: &str) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    for start in ["crate::", "super::"] {
        for (at, _) in code.match_indices(start).filter(|(at, _)| !code[..*at].ends_with(is_name)) {
            let path: String = code[at..].chars().take_while(|c| is_name(*c) || *c == ':').collect();
            paths.push(path.split("::").map(str::to_string).collect());
        }
    }
    paths
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Sets of modules each of which reaches all others, larger than one; sorted by name.
fn circles(graph: &Graph) -> Vec<Vec<String>> {
    let reach = |from: &str| {
        let mut seen = BTreeSet::new();
        let mut next: Vec<&str> = vec![from];
        while let Some(module) = next.pop() {
            for used in graph.get(module).into_iter().flatten() {
                if seen.insert(used.as_str()) {
                    next.push(used);
                }
            }
        }
        seen
    };
    let reaches: BTreeMap<&str, BTreeSet<&str>> = graph.keys().map(|module| (module.as_str(), reach(module))).collect();
    let mut circles = BTreeSet::new();
    for (module, reached) in &reaches {
        if reached.contains(module) {
            let circle = reached.iter().filter(|other| reaches.get(*other).is_some_and(|back| back.contains(module)));
            circles.insert(circle.map(|other| (*other).to_string()).collect::<Vec<_>>());
        }
    }
    circles.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn temporary(name: &str, files: &[(&str, &str)]) -> std::path::PathBuf {
        let folder = std::env::temp_dir().join(format!("soleus-circles-{name}-{}", std::process::id()));
        for (path, text) in files {
            let path = folder.join(path);
            std::fs::create_dir_all(path.parent().expect("below the folder")).expect("a folder");
            std::fs::write(path, text).expect("a file");
        }
        folder
    }

    #[test]
    fn the_workspace_has_no_circle() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        assert_eq!(violations(&root).expect("readable"), [] as [String; 0]);
    }

    #[test]
    fn a_circle_through_names_that_lib_hands_on_is_found() {
        let files = [
            ("lib.rs", "mod a;\npub mod b;\nmod c;\npub use a::{Tree, inner::Leaf};\npub use c::*;"),
            ("a.rs", "use crate::b;\n// use crate::c;\nmod inner;"),
            ("a/inner.rs", "pub struct Leaf; fn f() { super::g(); }"),
            ("b/mod.rs", "mod deep;"),
            (
                "b/deep.rs",
                "use super::Own; use std::{fmt, io};\nfn f(_: crate::Leaf) {}\n#[cfg(test)]\nmod tests { use crate::c::C; }",
            ),
            ("c.rs", "use super::{Tree, b::{self, Deep}};"),
        ];
        let folder = temporary("found", &files);
        let graph = graph(&folder).expect("readable");
        std::fs::remove_dir_all(&folder).expect("made above");
        let uses = |module: &str| graph[module].iter().map(String::as_str).collect::<Vec<_>>();
        assert_eq!((uses("a"), uses("b"), uses("c")), (vec!["b"], vec!["a"], vec!["a", "b"]));
        assert_eq!(circles(&graph), [["a", "b"]]);
    }
}

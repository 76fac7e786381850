//! `cargo xtask walks`: walks every list of `docs/walks/` and writes its table into `docs/walks.md`.
//!
//! A table stands between the lines `<!-- walks: NAME -->` and `<!-- end of walks -->`, NAME being the list's file without its ending. The
//! table is printed by the example `walks` of crate `closed_loop`; what is written by hand around it stays.

use crate::metadata::{Metadata, cargo};
use anyhow::{Context, ensure};
use std::path::Path;

const PAGE: &str = "docs/walks.md";
const LISTS: &str = "docs/walks";
const END: &str = "<!-- end of walks -->";

fn begin(name: &str) -> String {
    format!("<!-- walks: {name} -->")
}

/// Walks the lists of these names, or all, and writes their tables.
pub fn walks(names: &[String]) -> anyhow::Result<()> {
    let root = Metadata::read()?.root;
    let lists = lists(&root)?;
    for name in names {
        ensure!(lists.contains(name), "there is no {LISTS}/{name}.txt, only {}", lists.join(", "));
    }
    for name in lists.iter().filter(|list| names.is_empty() || names.contains(list)) {
        eprintln!("== {name}");
        let mut example = cargo();
        // Optimised or not, the numbers are the same to the bit; the development build is there already.
        example.args(["run", "--quiet", "-p", "closed_loop", "--example", "walks", "--"]);
        example.arg(format!("{LISTS}/{name}.txt")).current_dir(&root).stderr(std::process::Stdio::inherit());
        let output = example.output().context("cannot run cargo")?;
        ensure!(output.status.success(), "{name}: {example:?} failed");
        // Read anew each time: a table takes minutes, in which somebody may write beside it.
        let page = root.join(PAGE);
        let text = std::fs::read_to_string(&page).with_context(|| PAGE.to_string())?;
        let text = with_table(&text, name, &String::from_utf8(output.stdout)?)?;
        std::fs::write(&page, text).with_context(|| PAGE.to_string())?;
    }
    Ok(())
}

/// Names of the lists, sorted.
fn lists(root: &Path) -> anyhow::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(root.join(LISTS)).with_context(|| LISTS.to_string())? {
        let path = entry?.path();
        if let (Some(name), true) = (path.file_stem(), path.extension().is_some_and(|ending| ending == "txt")) {
            names.push(name.to_string_lossy().into_owned());
        }
    }
    names.sort();
    Ok(names)
}

/// The page before a list's table, the table, and the page from its end on.
fn around<'a>(page: &'a str, name: &str) -> anyhow::Result<[&'a str; 3]> {
    let begin = begin(name);
    let (before, rest) = page.split_once(&begin).with_context(|| format!("{PAGE} has no line {begin}"))?;
    let (table, after) = rest.split_once(END).with_context(|| format!("{PAGE}: no {END} follows {begin}"))?;
    Ok([before, table, after])
}

fn with_table(page: &str, name: &str, table: &str) -> anyhow::Result<String> {
    let [before, _, after] = around(page, name)?;
    Ok(format!("{before}{}\n\n{}\n\n{END}{after}", begin(name), table.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_replaced_and_all_else_stays() {
        let page = "a\n<!-- walks: x -->\nold\n<!-- end of walks -->\nb\n<!-- walks: y -->\n<!-- end of walks -->\n";
        let written = with_table(page, "x", "| new |\n").expect("it is there");
        assert_eq!(written, page.replace("old", "\n| new |\n"));
        assert!(with_table(page, "z", "").expect_err("no such").to_string().contains("<!-- walks: z -->"));
    }

    /// A walk that was added to a list, renamed or taken away is in its table.
    #[test]
    fn every_list_has_its_table_with_its_walks() {
        let root = Metadata::read().expect("cargo describes the workspace").root;
        let page = std::fs::read_to_string(root.join(PAGE)).expect("it can be read");
        let lists = lists(&root).expect("they can be read");
        assert!(lists.len() > 1, "{lists:?}");
        for name in &lists {
            let list = std::fs::read_to_string(root.join(LISTS).join(format!("{name}.txt"))).expect("it can be read");
            let wanted: Vec<&str> = (list.lines().map(|line| line.split('#').next().unwrap_or_default()))
                .filter_map(|line| line.split_once(':').map(|(walk, _)| walk.trim()))
                .collect();
            let [_, table, _] = around(&page, name).expect("it has a place");
            let there: Vec<&str> =
                table.lines().filter_map(|line| line.strip_prefix("| ")?.split(" |").next()).skip(1).collect();
            assert_eq!(there, wanted, "`cargo xtask walks {name}` writes the table of {LISTS}/{name}.txt");
        }
        let places = page.matches("<!-- walks: ").count();
        assert_eq!(places, lists.len(), "a table without a list, or two of one");
    }
}

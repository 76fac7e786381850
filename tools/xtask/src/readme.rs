//! What README and documents promise is there.

#[cfg(test)]
mod tests {
    use crate::metadata::Metadata;
    use std::path::{Path, PathBuf};

    /// Folders of the workspace whose mention is a path.
    const FOLDERS: [&str; 6] = ["config/", "crates/", "docs/", "robots/", "tests/", "tools/"];

    /// The README and every document, with their names.
    fn pages(root: &Path) -> Vec<(String, String)> {
        let read = |path: PathBuf| {
            let text = std::fs::read_to_string(&path).expect("a page can be read");
            (path.file_name().expect("it has a name").to_string_lossy().into_owned(), text)
        };
        let documents = std::fs::read_dir(root.join("docs")).expect("there are documents");
        let documents = documents.map(|entry| entry.expect("readable").path());
        let documents = documents.filter(|path| path.extension().is_some_and(|end| end == "md"));
        std::iter::once(root.join("README.md")).chain(documents).map(read).collect()
    }

    #[test]
    fn every_path_in_readme_and_documents_exists() {
        let root = Metadata::read().expect("cargo describes the workspace").root;
        let is_path = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
        let (mut found, mut missing) = (0, Vec::new());
        for (page, text) in pages(&root) {
            let words = text.split(|c: char| !is_path(c)).map(|word| word.trim_end_matches('.'));
            let paths = words.filter(|word| FOLDERS.iter().any(|folder| word.starts_with(folder)));
            // NAME stands for any scenario or robot, jvrc1 for one that a reader makes.
            for path in paths.filter(|path| !path.contains("NAME") && !path.starts_with("robots/jvrc1")) {
                found += 1;
                if !root.join(path).exists() {
                    missing.push(format!("{page}: {path}"));
                }
            }
        }
        assert!(found > 80, "only {found} paths were found: the search is broken");
        assert!(missing.is_empty(), "the documents name what is not there: {missing:?}");
    }

    /// Pages of results: whoever reads a number can have it again.
    #[test]
    fn every_table_of_results_stands_with_its_command() {
        let root = Metadata::read().expect("cargo describes the workspace").root;
        let mut tables = 0;
        for name in ["performance.md", "walks.md", "plant.md"] {
            let text = std::fs::read_to_string(root.join("docs").join(name)).expect("it can be read");
            // A section may name the command of those below it.
            let mut above = String::new();
            for section in text.split("\n## ").flat_map(|section| {
                section.split("\n### ").enumerate().map(|(i, part)| (i == 0, part)).collect::<Vec<_>>()
            }) {
                let (is_head, part) = section;
                if is_head {
                    above = part.to_string();
                }
                let commands = ["cargo ", "python3 "];
                let has_command = |text: &str| commands.iter().any(|command| text.contains(command));
                if part.contains("|---") {
                    tables += 1;
                    let title = part.lines().next().unwrap_or_default();
                    assert!(
                        has_command(part) || has_command(&above),
                        "docs/{name}: `{title}` has a table and no command"
                    );
                }
            }
        }
        assert!(tables > 8, "only {tables} tables were found: the search is broken");
    }

    #[test]
    fn the_readmes_test_command_is_what_continuous_integration_calls() {
        let root = Metadata::read().expect("cargo describes the workspace").root;
        let read = |file: &str| std::fs::read_to_string(root.join(file)).expect("it can be read");
        let (readme, script) = (read("README.md"), read(".ci/run"));
        for command in ["cargo test --workspace", "cargo walk"] {
            assert!(readme.contains(command) && script.contains(command), "{command}");
        }
    }
}

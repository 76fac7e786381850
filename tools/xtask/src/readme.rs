//! What the README promises is there.

#[cfg(test)]
mod tests {
    use crate::metadata::Metadata;

    /// Folders of the workspace whose mention is a path.
    const FOLDERS: [&str; 6] = ["config/", "crates/", "docs/", "robots/", "tests/", "tools/"];

    #[test]
    fn every_path_in_the_readme_exists() {
        let root = Metadata::read().expect("cargo describes the workspace").root;
        let text = std::fs::read_to_string(root.join("README.md")).expect("the README can be read");
        let is_path = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
        let words = text.split(|c: char| !is_path(c)).map(|word| word.trim_end_matches('.'));
        let paths: Vec<&str> = words.filter(|word| FOLDERS.iter().any(|folder| word.starts_with(folder))).collect();
        assert!(paths.len() > 10, "only {} paths were found: the search is broken", paths.len());
        // NAME stands for any scenario.
        let missing: Vec<&&str> =
            paths.iter().filter(|path| !path.contains("NAME") && !root.join(path).exists()).collect();
        assert!(missing.is_empty(), "the README names what is not there: {missing:?}");
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

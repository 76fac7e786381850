//! The Python package: installed as a user would, its tests run on a walk and on living domains.

use crate::alone;
use harness::{Launch, binaries, root};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Says loudly why nothing was tried.
fn skipped(why: &str) {
    eprintln!("SKIPPED: {why}: python/ was not tried");
}

/// A virtual environment with the package and what its tests need; kept beside the binaries until the package changes what it
/// needs. `None` with a loud word where there is no Python or no package index.
fn environment() -> Option<PathBuf> {
    let new_enough = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))";
    let python = Command::new("python3").args(["-c", new_enough]).stderr(Stdio::null()).status();
    if !python.is_ok_and(|status| status.success()) {
        skipped("no python3 of version 3.11 or newer with the module venv (apt-get install python3-venv)");
        return None;
    }
    let folder = binaries().join("python-venv");
    let python = folder.join("bin/python3");
    let needs = std::fs::read_to_string(root().join("python/pyproject.toml")).expect("it is there");
    let note = folder.join("made-for.toml");
    if std::fs::read_to_string(&note).is_ok_and(|made_for| made_for == needs) {
        return Some(python);
    }
    let run = |command: &mut Command| command.stdout(Stdio::null()).status().is_ok_and(|status| status.success());
    if !run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder)) {
        skipped("python3 -m venv failed (apt-get install python3-venv)");
        return None;
    }
    // Editable: what is tested is the working tree.
    let package = format!("{}[pandas,test]", root().join("python").display());
    if !run(Command::new(&python).args(["-m", "pip", "install", "--quiet", "--editable"]).arg(package)) {
        skipped("pip could not install the package and what it needs (no package index?)");
        return None;
    }
    std::fs::write(note, needs).expect("it was just made");
    Some(python)
}

fn pytest(python: &Path, run: &Path) -> bool {
    let mut command = Command::new(python);
    command.args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "-rs"]).arg(root().join("python/tests"));
    command.current_dir(root().join("python")).env("SOLEUS_BINARIES", binaries()).env("SOLEUS_RUN", run);
    command.env("PYTHONDONTWRITEBYTECODE", "1");
    command.status().expect("it can be started").success()
}

#[test]
fn the_python_package_reads_walks_and_belongs_to_domains() {
    let _alone = alone();
    let Some(python) = environment() else { return };
    let run = Launch::short_walk().finish();
    assert_eq!(run.code(), 0, "{}\n{}", run.stdout, run.stderr);
    assert!(pytest(&python, &run.folder()), "the tests of python/ failed, see above");
}

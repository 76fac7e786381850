//! Puts the commit into the version that every process prints and every log holds.

use std::process::Command;

fn main() {
    let git = |arguments: &[&str]| -> Option<String> {
        let output = Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
        Some(String::from_utf8(output.stdout).ok()?.trim().to_string())
    };
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=SOLEUS_COMMIT");
    // Who builds from a source archive says which commit it is of.
    if let Ok(commit) = std::env::var("SOLEUS_COMMIT") {
        println!("cargo::rustc-env=SOLEUS_COMMIT={commit}");
        return;
    }
    // Without git or outside of a repository the commit is not known, and the version says so.
    let commit = git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or_else(|| "unknown commit".to_string());
    println!("cargo::rustc-env=SOLEUS_COMMIT={commit}");
    // Grows with every commit and checkout.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|path| std::path::Path::new(path).exists())
    {
        println!("cargo::rerun-if-changed={log}");
    }
}

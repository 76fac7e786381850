//! Puts the commit into the version that every process prints and every log holds, and the check of the processor before all else.

use std::process::Command;

fn main() {
    check_processor();
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

/// Compiles the check for any processor of the architecture; it is linked whole, since nothing calls it.
fn check_processor() {
    println!("cargo::rerun-if-changed=src/processor.c");
    let required = std::env::var("CARGO_CFG_TARGET_FEATURE").unwrap_or_default();
    if !required.split(',').any(|feature| feature == "avx2") {
        return;
    }
    cc::Build::new().file("src/processor.c").cargo_metadata(false).compile("soleus_processor");
    let folder = std::env::var("OUT_DIR").expect("cargo sets it");
    println!("cargo::rustc-link-search=native={folder}");
    println!("cargo::rustc-link-lib=static:+whole-archive=soleus_processor");
}

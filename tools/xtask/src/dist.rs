//! `cargo xtask dist`: what somebody needs who has no Rust: binaries, configuration, robots, licences, as an archive and a package.
//!
//! | made | from |
//! |---|---|
//! | `soleus-VERSION-ARCH.tar.gz` | the tree below, to be unpacked anywhere |
//! | `soleus_VERSION_ARCH.deb` | the same under `/usr`, where `dpkg-deb` is there: every Debian and Ubuntu has it, nothing is installed for it |
//!
//! `bin/`, `share/soleus/{config,robots,python,messages.h}`, `share/doc/soleus/`, `lib/systemd/system/`. Binaries find nothing by
//! themselves: a scenario says where robot and configuration are, relative to itself.

mod licences;
mod trial;

use crate::metadata::{Metadata, cargo};
use anyhow::{Context, bail, ensure};
use clap::Args;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What is packed, by package.
const PACKAGES: [&str; 11] = [
    "soleus-launch",
    "soleus-planner",
    "soleus-estimator",
    "soleus-controller",
    "soleus-simulator",
    "soleus-recorder",
    "soleus-replayer",
    "soleus-inspect",
    "soleus-view",
    "soleus-latency",
    "soleus-driver",
];

/// Where units of systemd are, if there are any.
const UNITS: &str = "config/systemd";

#[derive(Debug, Args)]
pub struct Arguments {
    /// The profile that is built and packed.
    #[arg(long, default_value = "release")]
    profile: String,
    /// Install the package in a clean Debian (made by debootstrap, needs root) and walk there.
    #[arg(long = "try")]
    trial: bool,
    /// A clean Debian to try it in, in place of one made for it; it is changed.
    #[arg(long, value_name = "FOLDER", requires = "trial")]
    root: Option<PathBuf>,
}

/// Builds, packs, and tries.
pub fn dist(arguments: &Arguments) -> anyhow::Result<()> {
    let metadata = Metadata::read()?;
    let mut build = cargo();
    build.args(["build", "--bins", "--profile", &arguments.profile]);
    build.args(PACKAGES.iter().flat_map(|package| ["--package", package]));
    run(&mut build)?;
    let built = metadata.target.join(if arguments.profile == "dev" { "debug" } else { &arguments.profile });
    let version = env!("CARGO_PKG_VERSION");
    let out = metadata.target.join("dist");
    let name = format!("soleus-{version}-{}-linux", std::env::consts::ARCH);
    let tree = out.join(&name);
    if out.exists() {
        fs::remove_dir_all(&out).with_context(|| format!("cannot remove {}", out.display()))?;
    }
    stage(&metadata.root, &built, &tree)?;
    let archive = out.join(format!("{name}.tar.gz"));
    let time = commit_time(&metadata.root);
    // The same tree makes the same bytes.
    let mut tar = Command::new("tar");
    tar.args(["--sort=name", "--owner=0", "--group=0", "--numeric-owner", "--format=gnu"]);
    tar.arg(format!("--mtime=@{time}")).args(["--use-compress-program=gzip -n9", "-cf"]);
    run(tar.arg(&archive).arg("-C").arg(&out).arg(&name))?;
    report(&archive)?;
    let package = if is_there("dpkg-deb") {
        let package = debian(&out, &tree, version, time)?;
        report(&package)?;
        Some(package)
    } else {
        eprintln!("== no package: dpkg-deb is not there (it is on every Debian and Ubuntu)");
        None
    };
    if arguments.trial {
        let package = package.context("--try installs the package: dpkg-deb is needed")?;
        trial::walk(&package, &out, arguments.root.as_deref())?;
    }
    Ok(())
}

/// Puts everything in its place.
fn stage(root: &Path, built: &Path, tree: &Path) -> anyhow::Result<()> {
    let bin = tree.join("bin");
    fs::create_dir_all(&bin).with_context(|| format!("cannot make {}", bin.display()))?;
    ensure!(
        is_there("strip"),
        "no `strip`: binaries with their symbols are six times as large (apt-get install binutils)"
    );
    for package in PACKAGES {
        // Debugging symbols stay in the build.
        run(Command::new("strip").arg("--strip-unneeded").arg("-o").arg(bin.join(package)).arg(built.join(package)))?;
    }
    let share = tree.join("share/soleus");
    let doc = tree.join("share/doc/soleus");
    copy(&root.join("config"), &share.join("config"))?;
    copy(&root.join("robots"), &share.join("robots"))?;
    copy(&root.join("python"), &share.join("python"))?;
    for file in ["README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"] {
        copy(&root.join(file), &doc.join(file))?;
    }
    copy(&root.join("docs"), &doc.join("docs"))?;
    if let Ok(units) = root.join(UNITS).read_dir() {
        // Limits and the like, beside them, stay with the configuration.
        for unit in
            units.flatten().map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "service"))
        {
            copy(&unit, &tree.join("lib/systemd/system").join(unit.file_name().unwrap_or_default()))?;
        }
    }
    let header = Command::new(bin.join("soleus-inspect")).args(["layout", "--c"]).output();
    let header = header.context("soleus-inspect layout --c")?;
    ensure!(header.status.success(), "soleus-inspect layout --c: {}", String::from_utf8_lossy(&header.stderr));
    write(&share.join("messages.h"), &header.stdout)?;
    write(&doc.join("third-party-licences.txt"), licences::text(&PACKAGES)?.as_bytes())
}

/// The Debian package.
fn debian(out: &Path, tree: &Path, version: &str, time: u64) -> anyhow::Result<PathBuf> {
    let folder = out.join("debian");
    copy(tree, &folder.join("usr"))?;
    let architecture = match std::env::consts::ARCH {
        "x86_64" => "amd64",
        "aarch64" => "arm64",
        other => other,
    };
    let kilobytes = size(&folder)? / 1024;
    let depends = glibc(&tree.join("bin"))?;
    let control = format!(
        "Package: soleus\nVersion: {version}\nArchitecture: {architecture}\nMaintainer: Soleus <soleus@localhost>\n\
         Installed-Size: {kilobytes}\nDepends: {depends}\nSection: science\nPriority: optional\n\
         Description: a humanoid robot walks on soft soles\n \
         Plans the walk, computes how far each foot sinks and tilts on its sole, and tracks\n \
         the corrected ankle poses with the whole body, as 200 Hz processes.\n \
         Try it: soleus-launch /usr/share/soleus/config/scenarios/flat.toml\n"
    );
    write(&folder.join("DEBIAN/control"), control.as_bytes())?;
    // What an administrator changes is kept by the next version.
    let path = out.join(format!("soleus_{version}_{architecture}.deb"));
    let mut command = Command::new("dpkg-deb");
    command.env("SOURCE_DATE_EPOCH", time.to_string()).args(["--root-owner-group", "--build"]);
    run(command.arg(&folder).arg(&path))?;
    Ok(path)
}

/// The C library that the binaries ask for: the newest version of a symbol in any of them.
fn glibc(bin: &Path) -> anyhow::Result<String> {
    let mut newest = (0, 0);
    for package in PACKAGES {
        let symbols =
            Command::new("objdump").arg("-T").arg(bin.join(package)).output().context("objdump (binutils)")?;
        newest = newest.max(newest_glibc(&String::from_utf8_lossy(&symbols.stdout)));
    }
    ensure!(newest > (0, 0), "the binaries ask for no symbol of the C library: objdump says nothing");
    Ok(format!("libc6 (>= {}.{}), libgcc-s1", newest.0, newest.1))
}

fn newest_glibc(symbols: &str) -> (u32, u32) {
    let versions = symbols.split("GLIBC_").skip(1).filter_map(|rest| {
        let version = rest.split(|c: char| !c.is_ascii_digit() && c != '.').next()?;
        let (major, minor) = version.split_once('.')?;
        Some((major.parse().ok()?, minor.split('.').next()?.parse().ok()?))
    });
    versions.max().unwrap_or((0, 0))
}

/// Copies a file or a folder; what a run or Python left in it is not part of it.
fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    const LEFT: [&str; 5] = ["__pycache__", ".pytest_cache", "build", "venv", ".venv"];
    let name = from.file_name().unwrap_or_default().to_string_lossy();
    if LEFT.contains(&name.as_ref()) || name.ends_with(".egg-info") {
        return Ok(());
    }
    let failed = || format!("cannot copy {} to {}", from.display(), to.display());
    if from.is_dir() {
        fs::create_dir_all(to).with_context(failed)?;
        for entry in fs::read_dir(from).with_context(failed)? {
            let entry = entry.with_context(failed)?;
            copy(&entry.path(), &to.join(entry.file_name()))?;
        }
        return Ok(());
    }
    if let Some(folder) = to.parent() {
        fs::create_dir_all(folder).with_context(failed)?;
    }
    fs::copy(from, to).with_context(failed)?;
    Ok(())
}

fn write(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    let failed = || format!("cannot write {}", path.display());
    fs::create_dir_all(path.parent().with_context(failed)?).with_context(failed)?;
    fs::write(path, content).with_context(failed)
}

fn size(path: &Path) -> anyhow::Result<u64> {
    let metadata = fs::symlink_metadata(path)?;
    if !metadata.is_dir() {
        return Ok(metadata.len());
    }
    fs::read_dir(path)?.map(|entry| size(&entry?.path())).sum()
}

fn report(path: &Path) -> anyhow::Result<()> {
    println!("{:8.1} MB  {}", size(path)? as f64 * 1e-6, path.display());
    Ok(())
}

/// When the tree was committed (s since 1970), so that the same commit makes the same archive.
fn commit_time(root: &Path) -> u64 {
    let said = Command::new("git").arg("-C").arg(root).args(["log", "-1", "--format=%ct"]).output();
    let said = said.ok().and_then(|said| String::from_utf8(said.stdout).ok());
    said.and_then(|said| said.trim().parse().ok()).unwrap_or(0)
}

fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

fn run(command: &mut Command) -> anyhow::Result<()> {
    let status = command.status().with_context(|| format!("cannot run {command:?}"))?;
    if !status.success() {
        bail!("{command:?} failed: {status}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_symbol_of_the_c_library_counts() {
        let symbols = "0000 DF *UND* (GLIBC_2.2.5) write\n0000 DF *UND* (GLIBC_2.34) stat\n (GLIBC_2.9) x (GCC_3.0) y";
        assert_eq!(newest_glibc(symbols), (2, 34));
        assert_eq!(newest_glibc("GLIBC_PRIVATE nothing"), (0, 0));
    }

    #[test]
    fn every_program_of_the_workspace_is_packed() {
        let metadata = Metadata::read().expect("cargo knows this workspace");
        let programs = metadata.packages.values().filter(|package| package.ours && package.name.starts_with("soleus-"));
        let left: Vec<&String> =
            programs.map(|package| &package.name).filter(|name| !PACKAGES.contains(&name.as_str())).collect();
        assert_eq!(left, [] as [&String; 0]);
    }

    #[test]
    fn what_python_leaves_is_not_copied() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let from = folder.path().join("from");
        for file in ["a/b.py", "a/__pycache__/b.pyc", "soleus.egg-info/x"] {
            write(&from.join(file), b"1").expect("writable");
        }
        let to = folder.path().join("to");
        copy(&from, &to).expect("readable");
        assert!(
            to.join("a/b.py").is_file() && !to.join("a/__pycache__").exists() && !to.join("soleus.egg-info").exists()
        );
        assert_eq!(size(&to).expect("readable"), 1);
    }
}

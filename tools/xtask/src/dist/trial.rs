//! The package in a clean Debian: installed, and walked.

use super::{is_there, run};
use anyhow::ensure;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What is done inside: in namespaces of its own, so that nothing stays mounted whatever happens.
const SCRIPT: &str = r#"
set -eu
root=$1
mount --make-rprivate /
mount -t proc proc "$root/proc"
mkdir -p "$root/dev/shm"
mount -t tmpfs tmpfs "$root/dev/shm"
for device in null zero random urandom; do
    [ -e "$root/dev/$device" ] || { touch "$root/dev/$device"; mount --bind "/dev/$device" "$root/dev/$device"; }
done
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root "$@"; }
inside dpkg --install /tmp/soleus.deb
inside soleus-launch /usr/share/soleus/config/scenarios/flat.toml \
    --set planner.gait.walk.swings=2 --out /tmp/walk --overwrite
inside soleus-inspect recording /tmp/walk/walk.mcap | head -n 20
inside test -s /tmp/walk/report.html
inside dpkg --purge soleus
inside sh -c '! command -v soleus-launch'
"#;

/// Installs the package in `root`, or in a Debian made for it, and walks there.
pub fn walk(package: &Path, out: &Path, root: Option<&Path>) -> anyhow::Result<()> {
    let root = match root {
        Some(root) => root.to_path_buf(),
        None => bootstrap(out)?,
    };
    std::fs::create_dir_all(root.join("tmp"))?;
    std::fs::copy(package, root.join("tmp/soleus.deb"))?;
    run(Command::new("unshare").args(["--mount", "--pid", "--fork", "sh", "-c", SCRIPT, "sh"]).arg(&root))?;
    println!("installed, walked and removed in {}", root.display());
    Ok(())
}

/// The smallest Debian there is.
fn bootstrap(out: &Path) -> anyhow::Result<PathBuf> {
    ensure!(is_there("debootstrap"), "no `debootstrap` (apt-get install debootstrap): name a clean Debian with --root");
    let root = out.join("clean-debian");
    run(Command::new("debootstrap").args(["--variant=minbase", "stable"]).arg(&root))?;
    Ok(root)
}

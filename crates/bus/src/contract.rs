//! What a process that is not one of Soleus's own must know to belong to a domain.

use crate::domain::{DomainName, MEMBERS, READY};
use crate::runtime::{RUNTIME_VARIABLE, runtime_folder, user_id};
use messages::code::Process;
use std::fmt;
use std::path::PathBuf;

/// Where a domain is, and how a process in any language takes a place in it. Displayed as TOML with comments.
pub struct Contract {
    domain: DomainName,
    living: Vec<(Option<Process>, String)>,
}

impl Contract {
    /// That of a domain as it is now.
    pub fn of(domain: &DomainName) -> Self {
        Self { domain: domain.clone(), living: domain.living() }
    }

    /// The file that the owner of the domain keeps locked while the domain is complete.
    pub fn ready_file(&self) -> PathBuf {
        self.domain.root().join(READY)
    }

    /// The file whose lock makes a process the one of its kind.
    pub fn member_file(&self, process: Process) -> PathBuf {
        self.domain.root().join(MEMBERS).join(process.word())
    }
}

impl fmt::Display for Contract {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = |path: PathBuf| format!("{:?}", path.display().to_string());
        let (user, domain) = (user_id(), &self.domain);
        writeln!(f, "# Where domain `{domain}` of user {user} is, and how a process in any language belongs to it.\n")?;
        writeln!(f, "domain = \"{domain}\"")?;
        writeln!(
            f,
            "# {RUNTIME_VARIABLE}, else /tmp/soleus-UID. A real folder (no link), of this user, mode 0700: check all three."
        )?;
        writeln!(f, "runtime_folder = {}\n", path(runtime_folder()))?;
        writeln!(f, "# iceoryx2 {}: all else as built in; services are opened, never created.", ICEORYX2)?;
        writeln!(f, "[iceoryx2]")?;
        writeln!(f, "root-path = {}", path(domain.root()))?;
        writeln!(f, "prefix = \"{}\"\n", domain.prefix())?;
        writeln!(
            f,
            "# The owner holds an exclusive flock(2) on this file while the domain is complete: join only then, and leave when it"
        )?;
        writeln!(f, "# lets go. In the file: its process id, the time since when (ns), and the end of the line.")?;
        writeln!(f, "[owner]")?;
        writeln!(f, "file = {}\n", path(self.ready_file()))?;
        writeln!(
            f,
            "# One living process of each kind. Before it publishes anything, one that wants to be a KIND\n# 1. opens KIND's file (O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, mode 0600) and asks for flock(fd, LOCK_EX | LOCK_NB);"
        )?;
        writeln!(
            f,
            "#    refused: the process whose id is in the file lives, and this one must end;\n# 2. compares st_ino of the open file and of the path: where they differ, begins again;"
        )?;
        writeln!(
            f,
            "# 3. cuts the file to nothing, writes its process id and the end of the line, and keeps the file open until it ends."
        )?;
        writeln!(
            f,
            "# One that ends in order cuts the file to nothing and removes it first. One that dies leaves it, and all hear of its death."
        )?;
        writeln!(f, "[processes]")?;
        for process in Process::ALL {
            writeln!(f, "{process} = {}", path(self.member_file(*process)))?;
        }
        writeln!(f, "\n# Process ids of those who live now.\n[living]")?;
        for (process, id) in &self.living {
            writeln!(f, "{} = \"{id}\"", process.map_or("owner", Process::word))?;
        }
        Ok(())
    }
}

/// The version whose files these are: each has its own.
const ICEORYX2: &str = "0.10.0";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_the_one_that_is_built_in() {
        let lock = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.lock")).expect("there");
        assert!(lock.contains(&format!("name = \"iceoryx2\"\nversion = \"{ICEORYX2}\"")));
    }
}

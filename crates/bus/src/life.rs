//! A file that says whether the process that made it lives: it holds the file's lock until it ends, however that happens.
//!
//! Locks go with the process, at the latest when the system removes it, and asking for one disturbs nobody: the file of one that
//! lives cannot be locked, that of a dead one is nobody's. A process that ends in order removes its file.

use std::fs::{File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// The file of this process, as long as it lives.
pub(crate) struct Life {
    path: PathBuf,
    file: File,
    /// Whether the file is to stay when this ends, as that of one that was killed does.
    ends_badly: AtomicBool,
}

/// What a file says of the process that made it.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Seen {
    /// There is no such file.
    Nothing,
    /// It has ended, and not in order.
    Dead,
    /// It lives, and wrote this.
    Alive(String),
}

impl Life {
    /// Makes the file. Whoever sees it sees all of it, and sees it locked: it is written and locked under another name.
    pub(crate) fn begin(path: PathBuf, text: &str) -> io::Result<Self> {
        let draft = path.with_extension("draft");
        let mut file = File::create(&draft)?;
        file.lock()?;
        file.write_all(text.as_bytes())?;
        std::fs::rename(&draft, &path)?;
        Ok(Self { path, file, ends_badly: AtomicBool::new(false) })
    }

    /// From now on the end of this process is one that others must hear of.
    pub(crate) fn ends_badly(&self) {
        self.ends_badly.store(true, Ordering::Relaxed);
    }
}

impl Drop for Life {
    fn drop(&mut self) {
        if !self.ends_badly.load(Ordering::Relaxed) && !std::thread::panicking() {
            // Gone already if somebody wiped the domain.
            let _ = std::fs::remove_file(&self.path);
        }
        // Closing alone would not do: a child that is being started by another thread holds the same lock until it runs.
        let _ = self.file.unlock();
    }
}

/// Looks at a file made by [`Life::begin`].
pub(crate) fn look(path: &Path) -> Seen {
    File::open(path).map_or(Seen::Nothing, |file| judge(path, file))
}

fn judge(path: &Path, file: File) -> Seen {
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => std::io::read_to_string(file).map_or(Seen::Nothing, Seen::Alive),
        // Closing the file gives the lock back, and nobody will ever ask for more than a look. Who ended in order after the file was
        // opened removed its name first.
        Ok(()) if path.exists() => Seen::Dead,
        Ok(()) | Err(TryLockError::Error(_)) => Seen::Nothing,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_living_are_seen_with_what_they_wrote_and_leave_nothing_unless_they_end_badly() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("one");
        assert_eq!(look(&path), Seen::Nothing);
        let life = Life::begin(path.clone(), "text").expect("writable");
        assert_eq!(look(&path), Seen::Alive("text".to_string()));
        assert_eq!(look(&path), Seen::Alive("text".to_string()), "looking takes nothing away");
        drop(life);
        assert_eq!(look(&path), Seen::Nothing);
        assert_eq!(folder.path().read_dir().expect("readable").count(), 0);

        let life = Life::begin(path.clone(), "text").expect("writable");
        life.ends_badly();
        drop(life);
        assert_eq!(look(&path), Seen::Dead);

        let life = Life::begin(path.clone(), "text").expect("writable");
        let opened = File::open(&path).expect("it is there");
        drop(life);
        assert_eq!(judge(&path, opened), Seen::Nothing, "it ended in order while somebody looked");

        let other = folder.path().join("other");
        let panicked = std::thread::scope(|scope| {
            let panics = || {
                let _life = Life::begin(other.clone(), "text").expect("writable");
                std::panic::resume_unwind(Box::new("a bug"));
            };
            scope.spawn(panics).join().is_err()
        });
        assert!(panicked);
        assert_eq!(look(&other), Seen::Dead, "a panic is no end in order");
    }
}

//! A file that says whether the process that made it lives: it holds the file's lock until it ends, however that happens.
//!
//! Locks go with the process, at the latest when the system removes it, and asking for one disturbs nobody: the file of one that
//! lives cannot be locked, that of a dead one is nobody's. There is one file for each that there may be only one of; whoever holds its
//! lock is the one. A process that ends in order removes its file.

use crate::folder::Folder;
use rustix::fs::OFlags;
use std::ffi::{OsStr, OsString};
use std::fs::{File, TryLockError};
use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often one that waits for a lock asks again.
const ASK_AGAIN: Duration = Duration::from_millis(2);

/// The file of this process, as long as it lives.
pub(crate) struct Life {
    folder: Folder,
    name: OsString,
    file: File,
    /// Whether the file is to stay when this ends, as that of one that was killed does.
    ends_badly: AtomicBool,
}

/// What came of the wish to live.
pub(crate) enum Begun {
    /// There is nobody else.
    Ours(Life),
    /// One who lives wrote this.
    Taken(String),
}

/// What a file says of the process that made it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Seen {
    /// There is no such file, or nobody has said yet that it is there.
    Nothing,
    /// Who wrote this has ended, and not in order.
    Dead(String),
    /// Who wrote this lives.
    Alive(String),
}

impl Life {
    /// Takes the file's lock and writes a line into it, waiting for a while for one who holds it: that one may be ending.
    pub(crate) fn begin(folder: Folder, name: &str, line: &str, patience: Duration) -> io::Result<Begun> {
        let (name, until) = (OsString::from(name), Instant::now() + patience);
        loop {
            let mut file = folder.file(&name, OFlags::RDWR | OFlags::CREATE)?;
            match file.try_lock() {
                // Whoever left removed the file: a lock on one without a name is worth nothing.
                Ok(()) if !folder.names(&name, &file)? => continue,
                Ok(()) => {
                    file.set_len(0)?;
                    file.write_all(format!("{line}\n").as_bytes())?;
                    return Ok(Begun::Ours(Self { folder, name, file, ends_badly: AtomicBool::new(false) }));
                }
                Err(TryLockError::Error(error)) => return Err(error),
                Err(TryLockError::WouldBlock) if Instant::now() >= until => {
                    return Ok(Begun::Taken(io::read_to_string(file)?.trim().to_string()));
                }
                Err(TryLockError::WouldBlock) => std::thread::sleep(ASK_AGAIN),
            }
        }
    }

    /// From now on the end of this process is one that others must hear of.
    pub(crate) fn ends_badly(&self) {
        self.ends_badly.store(true, Ordering::Relaxed);
    }
}

impl Drop for Life {
    fn drop(&mut self) {
        if !self.ends_badly.load(Ordering::Relaxed) && !std::thread::panicking() {
            // Who has opened it already sees that nobody is in it.
            let _ = self.file.set_len(0);
            // Gone already if somebody wiped the domain; then the name is another's.
            if self.folder.names(&self.name, &self.file).is_ok_and(|ours| ours) {
                let _ = self.folder.remove_file(&self.name);
            }
        }
        // Closing alone would not do: a child that is being started by another thread holds the same lock until it runs.
        let _ = self.file.unlock();
    }
}

/// Looks at a file made by [`Life::begin`].
pub(crate) fn look(folder: &Folder, name: &str) -> Seen {
    let name = OsStr::new(name);
    folder.file(name, OFlags::RDONLY).map_or(Seen::Nothing, |file| judge(folder, name, file))
}

fn judge(folder: &Folder, name: &OsStr, file: File) -> Seen {
    let lock = file.try_lock_shared();
    let is_named = folder.names(name, &file).is_ok_and(|is_named| is_named);
    // A line without its end is still being written.
    let line = io::read_to_string(&file).unwrap_or_default().strip_suffix('\n').map(str::to_string);
    match (lock, line) {
        (Err(TryLockError::WouldBlock), Some(line)) => Seen::Alive(line),
        // Closing the file gives the lock back, and nobody will ever ask for more than a look.
        (Ok(()), Some(line)) if is_named => Seen::Dead(line),
        _ => Seen::Nothing,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn begin(path: &Path, name: &str, line: &str) -> Life {
        let folder = Folder::open(path).expect("it is there");
        let Begun::Ours(life) = Life::begin(folder, name, line, Duration::ZERO).expect("writable") else {
            panic!("somebody lives")
        };
        life
    }

    #[test]
    fn the_living_are_seen_and_leave_nothing_unless_they_end_badly() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let (path, folder) = (place.path(), Folder::open(place.path()).expect("it is there"));
        assert_eq!(look(&folder, "one"), Seen::Nothing);
        let life = begin(path, "one", "text");
        assert_eq!(look(&folder, "one"), Seen::Alive("text".to_string()));
        assert_eq!(look(&folder, "one"), Seen::Alive("text".to_string()), "looking takes nothing away");
        drop(life);
        assert_eq!(look(&folder, "one"), Seen::Nothing);
        assert_eq!(path.read_dir().expect("readable").count(), 0);

        let life = begin(path, "one", "first");
        life.ends_badly();
        drop(life);
        assert_eq!(look(&folder, "one"), Seen::Dead("first".to_string()));

        let life = begin(path, "one", "second");
        assert_eq!(look(&folder, "one"), Seen::Alive("second".to_string()), "it took the place of the dead");
        let name = OsStr::new("one");
        let opened = folder.file(name, OFlags::RDONLY).expect("it is there");
        drop(life);
        assert_eq!(judge(&folder, name, opened), Seen::Nothing, "it ended in order while somebody looked");

        let panicked = std::thread::scope(|scope| {
            let panics = || {
                let _life = begin(path, "other", "text");
                std::panic::resume_unwind(Box::new("a bug"));
            };
            scope.spawn(panics).join().is_err()
        });
        assert!(panicked);
        assert_eq!(look(&folder, "other"), Seen::Dead("text".to_string()), "a panic is no end in order");
    }

    #[test]
    fn there_is_one_at_a_time_and_it_is_named() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let again = |patience| {
            let folder = Folder::open(place.path()).expect("it is there");
            Life::begin(folder, "one", "second", patience).expect("readable")
        };
        let life = begin(place.path(), "one", "first");
        let Begun::Taken(line) = again(Duration::ZERO) else { panic!("there are two") };
        assert_eq!(line, "first");
        // One who is ending is waited for.
        let waiting = std::thread::scope(|scope| {
            let waiting = scope.spawn(|| again(Duration::from_secs(60)));
            drop(life);
            waiting.join().expect("no panic")
        });
        assert!(matches!(waiting, Begun::Ours(_)));
    }

    #[test]
    fn who_was_wiped_leaves_the_file_of_its_successor() {
        let place = tempfile::tempdir().expect("a temporary folder");
        let wiped = begin(place.path(), "one", "first");
        std::fs::remove_file(place.path().join("one")).expect("ours");
        let _successor = begin(place.path(), "one", "second");
        drop(wiped);
        let folder = Folder::open(place.path()).expect("it is there");
        assert_eq!(look(&folder, "one"), Seen::Alive("second".to_string()));
    }
}

//! Folders by handle: what is in one is reached through the folder that was looked at, never by a path that may lead elsewhere now.

use rustix::fs::{AtFlags, CWD, Dir, FileType, Mode, OFlags, Stat, fstat, mkdirat, openat, renameat, statat, unlinkat};
use rustix::io::Errno;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// How often a folder is emptied in which somebody else is still making files.
const EMPTYINGS_MAX: u32 = 100;
/// Access for the owner alone.
pub(crate) const PRIVATE_FOLDER: Mode = Mode::RWXU;
const PRIVATE_FILE: Mode = Mode::RUSR.union(Mode::WUSR);

/// An open folder. Its path is for messages, and for iceoryx2, which knows paths only.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    handle: OwnedFd,
}

impl Folder {
    /// Opens a folder that may not be a link.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        Self::open_with(path, OFlags::NOFOLLOW)
    }

    /// Opens a folder of the system, wherever links lead.
    pub(crate) fn open_of_system(path: &Path) -> io::Result<Self> {
        Self::open_with(path, OFlags::empty())
    }

    fn open_with(path: &Path, flags: OFlags) -> io::Result<Self> {
        let flags = flags | OFlags::DIRECTORY | OFlags::RDONLY | OFlags::CLOEXEC;
        Ok(Self { handle: openat(CWD, path, flags, Mode::empty())?, path: path.to_path_buf() })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Opens a folder in this one.
    pub(crate) fn folder(&self, name: &OsStr) -> io::Result<Self> {
        let flags = OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::RDONLY | OFlags::CLOEXEC;
        Ok(Self { handle: openat(&self.handle, name, flags, Mode::empty())?, path: self.path.join(name) })
    }

    /// Makes a folder in this one, for its owner alone, if it is not there yet.
    pub(crate) fn make_folder(&self, name: &OsStr) -> io::Result<Self> {
        match mkdirat(&self.handle, name, PRIVATE_FOLDER) {
            Ok(()) | Err(Errno::EXIST) => self.folder(name),
            Err(error) => Err(error.into()),
        }
    }

    /// Opens a file in this folder that may not be a link; with `CREATE` it is made for its owner alone.
    pub(crate) fn file(&self, name: &OsStr, flags: OFlags) -> io::Result<File> {
        // A named pipe would keep us waiting.
        let flags = flags | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
        Ok(File::from(openat(&self.handle, name, flags, PRIVATE_FILE)?))
    }

    /// What is under a name, itself if it is a link.
    pub(crate) fn look(&self, name: &OsStr) -> io::Result<Stat> {
        Ok(statat(&self.handle, name, AtFlags::SYMLINK_NOFOLLOW)?)
    }

    /// What the folder itself is.
    pub(crate) fn look_at_itself(&self) -> io::Result<Stat> {
        Ok(fstat(&self.handle)?)
    }

    /// Whether a name is that of an open file.
    pub(crate) fn names(&self, name: &OsStr, file: &File) -> io::Result<bool> {
        let (named, open) = (self.look(name), fstat(file)?);
        Ok(named.is_ok_and(|named| (named.st_dev, named.st_ino) == (open.st_dev, open.st_ino)))
    }

    /// The names of all that is in the folder.
    pub(crate) fn entries(&self) -> io::Result<Vec<OsString>> {
        let mut names = Vec::new();
        for entry in Dir::read_from(&self.handle)? {
            let name = OsStr::from_bytes(entry?.file_name().to_bytes()).to_os_string();
            if name != "." && name != ".." {
                names.push(name);
            }
        }
        Ok(names)
    }

    /// Gives a file another name, in place of what had it.
    pub(crate) fn rename(&self, from: &OsStr, to: &OsStr) -> io::Result<()> {
        Ok(renameat(&self.handle, from, &self.handle, to)?)
    }

    /// Removes a file, or a link and not what it leads to; it is fine if there is none.
    pub(crate) fn remove_file(&self, name: &OsStr) -> io::Result<()> {
        match unlinkat(&self.handle, name, AtFlags::empty()) {
            Ok(()) | Err(Errno::NOENT) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Removes a file, a link and not what it leads to, or a folder with all that is in it; it is fine if there is nothing.
    pub(crate) fn remove(&self, name: &OsStr) -> io::Result<()> {
        for _ in 1..EMPTYINGS_MAX {
            match self.remove_once(name) {
                // Somebody made something meanwhile.
                Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => {}
                other => return other,
            }
        }
        self.remove_once(name)
    }

    fn remove_once(&self, name: &OsStr) -> io::Result<()> {
        match unlinkat(&self.handle, name, AtFlags::empty()) {
            Ok(()) | Err(Errno::NOENT) => return Ok(()),
            Err(Errno::ISDIR) => {}
            Err(error) => return Err(error.into()),
        }
        let folder = self.folder(name)?;
        for entry in folder.entries()? {
            folder.remove(&entry)?;
        }
        match unlinkat(&self.handle, name, AtFlags::REMOVEDIR) {
            Ok(()) | Err(Errno::NOENT) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }
}

/// What kind of thing is where a folder was expected, for people.
pub(crate) fn kind(stat: &Stat) -> &'static str {
    match FileType::from_raw_mode(stat.st_mode) {
        FileType::Symlink => "a symbolic link",
        FileType::RegularFile => "a file",
        FileType::Directory => "a folder",
        _ => "neither file nor folder",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn links_are_removed_and_never_followed() {
        let (ours, theirs) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
        std::fs::create_dir(theirs.path().join("home")).expect("writable");
        std::fs::write(theirs.path().join("home/precious"), "text").expect("writable");
        let folder = Folder::open(ours.path()).expect("it is there");
        std::fs::create_dir_all(ours.path().join("tree/below")).expect("writable");
        for link in ["link", "tree/link", "tree/below/link"] {
            symlink(theirs.path().join("home"), ours.path().join(link)).expect("writable");
        }
        symlink(theirs.path().join("home/precious"), ours.path().join("tree/file")).expect("writable");
        for name in ["link", "tree", "nothing"] {
            folder.remove(OsStr::new(name)).expect("it is ours");
        }
        assert_eq!(folder.entries().expect("readable"), [] as [OsString; 0]);
        assert_eq!(std::fs::read_to_string(theirs.path().join("home/precious")).expect("untouched"), "text");
        symlink(theirs.path().join("home"), ours.path().join("link")).expect("writable");
        assert!(folder.folder(OsStr::new("link")).is_err() && folder.make_folder(OsStr::new("link")).is_err());
        assert!(folder.file(OsStr::new("link"), OFlags::RDONLY).is_err());
        assert!(Folder::open(&ours.path().join("link")).is_err());
    }

    #[test]
    fn a_folder_that_was_moved_is_still_the_one_that_was_opened() {
        let place = tempfile::tempdir().expect("a folder");
        let (before, after) = (place.path().join("before"), place.path().join("after"));
        std::fs::create_dir(&before).expect("writable");
        let folder = Folder::open(&before).expect("it is there");
        std::fs::rename(&before, &after).expect("writable");
        std::fs::create_dir(&before).expect("writable");
        std::fs::write(before.join("file"), "").expect("writable");
        std::fs::write(after.join("file"), "").expect("writable");
        folder.remove(OsStr::new("file")).expect("it is there");
        assert!(before.join("file").exists() && !after.join("file").exists());
    }
}

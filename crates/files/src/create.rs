//! Making files.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// Makes a file that only its owner can read and write, and that was not there before.
///
/// # Errors
/// What the system says; [`io::ErrorKind::AlreadyExists`] if there is anything of this name.
pub fn create_new(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).create_new(true).mode(0o600).open(path)
}

/// Gives a finished file its name. Unless it shall `overwrite`, nothing of this name may be there.
///
/// # Errors
/// What the system says; [`io::ErrorKind::AlreadyExists`] if there is something of this name.
pub fn replace(draft: &Path, path: &Path, overwrite: bool) -> io::Result<()> {
    if !overwrite {
        // An empty file holds the place against others, then it is replaced. (Renaming alone replaces whatever is
        // there.)
        drop(create_new(path)?);
    }
    std::fs::rename(draft, path)
}

/// The first of `name.ending`, `name-2.ending`, `name-3.ending`, .. that is not in the folder.
#[must_use]
pub fn free_name(folder: &Path, name: &str, ending: &str) -> PathBuf {
    let numbered = (2..).map(|number| format!("{name}-{number}.{ending}"));
    let mut names = std::iter::once(format!("{name}.{ending}")).chain(numbered).map(|name| folder.join(name));
    names.find(|path| path.symlink_metadata().is_err()).expect("a folder has not all of them")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn nothing_that_exists_is_replaced_unless_asked_for() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (draft, path) = (folder.path().join("draft"), folder.path().join("file"));
        let write = |text: &str| std::fs::write(&draft, text).expect("writable");
        let text = || std::fs::read_to_string(&path).expect("there");
        write("one");
        replace(&draft, &path, false).expect("nothing is there");
        write("two");
        assert_eq!(replace(&draft, &path, false).expect_err("there").kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(text(), "one");
        replace(&draft, &path, true).expect("asked for");
        assert_eq!(text(), "two");
        // A link that leads nowhere is something, too.
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("nowhere", &link).expect("a link");
        assert!(create_new(&link).is_err());
        assert_eq!(free_name(folder.path(), "link", "x"), folder.path().join("link.x"));
    }

    #[test]
    fn new_files_are_their_owners_alone_and_have_free_names() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for name in ["walk.mcap", "walk-2.mcap", "walk-3.mcap"] {
            let path = free_name(folder.path(), "walk", "mcap");
            assert_eq!(path, folder.path().join(name));
            let file = create_new(&path).expect("free");
            assert_eq!(file.metadata().expect("open").permissions().mode() & 0o777, 0o600);
        }
    }
}

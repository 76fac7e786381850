//! The files of a domain in shared memory. `/dev/shm` is everybody's: who has a name there first keeps it.

use crate::error::{MemoryError, User};
use crate::folder::Folder;
use crate::runtime::user_id;
use rustix::fs::{FallocateFlags, FileType, OFlags, fallocate};
use rustix::io::Errno;
use std::ffi::{OsStr, OsString};
use std::io::{self, Read, Write};
use std::path::Path;

/// Where POSIX shared memory is on Linux.
pub(crate) const FOLDER: &str = "/dev/shm";

/// The largest file that is copied to make it private; that of iceoryx2 has 16 bytes.
const COPY_MAX_BYTES: u64 = 1 << 20;

fn folder() -> io::Result<Folder> {
    Folder::open_of_system(Path::new(FOLDER))
}

fn names_in(folder: &Folder, prefix: &str) -> io::Result<Vec<OsString>> {
    let mut names = folder.entries()?;
    names.retain(|name| name.as_encoded_bytes().starts_with(prefix.as_bytes()));
    Ok(names)
}

/// The names that begin so.
pub(crate) fn names(prefix: &str) -> Vec<OsString> {
    folder().and_then(|folder| names_in(&folder, prefix)).unwrap_or_default()
}

/// The names of files of ours that begin so.
pub(crate) fn names_of_ours(prefix: &str) -> Vec<OsString> {
    let Ok(folder) = folder() else { return Vec::new() };
    let ours = |name: &OsString| folder.look(name).is_ok_and(|stat| stat.st_uid == user_id());
    names_in(&folder, prefix).unwrap_or_default().into_iter().filter(ours).collect()
}

/// Refuses to go on where a file of somebody else has a name of ours, or one of ours is broken: iceoryx2 would wait for it for ever.
pub(crate) fn check(prefix: &str) -> Result<(), MemoryError> {
    let failed = |source| MemoryError::File { path: FOLDER.into(), source };
    let folder = folder().map_err(failed)?;
    for name in names_in(&folder, prefix).map_err(failed)? {
        // It may just have been removed.
        let Ok(stat) = folder.look(&name) else { continue };
        let path = folder.path().join(&name);
        if stat.st_uid != user_id() || FileType::from_raw_mode(stat.st_mode) != FileType::RegularFile {
            return Err(MemoryError::Foreign { path, owner: User(stat.st_uid), ours: User(user_id()) });
        }
        // Made once, by the owner of the domain, before anybody could join.
        if stat.st_size == 0 && is_management(&name) {
            return Err(MemoryError::Truncated { path });
        }
    }
    Ok(())
}

fn is_management(name: &OsStr) -> bool {
    name.as_encoded_bytes().windows(b".global_mgmt".len()).any(|part| part == b".global_mgmt")
}

/// Removes what begins so.
pub(crate) fn remove(prefix: &str) -> Result<(), MemoryError> {
    check_owners(prefix)?;
    let failed = |source| MemoryError::File { path: FOLDER.into(), source };
    let folder = folder().map_err(failed)?;
    for name in names_in(&folder, prefix).map_err(failed)? {
        folder.remove_file(&name).map_err(|source| MemoryError::File { path: folder.path().join(&name), source })?;
    }
    Ok(())
}

/// Refuses to go on where a file of somebody else has a name of ours.
fn check_owners(prefix: &str) -> Result<(), MemoryError> {
    match check(prefix) {
        Err(MemoryError::Truncated { .. }) => Ok(()),
        other => other,
    }
}

/// Replaces each file that others may open by a copy that only we may, before anybody uses it.
///
/// iceoryx2 gives one file per domain (its `global_mgmt`) mode 0666, whatever the umask; who cut it to nothing would keep everybody
/// waiting who joins. Changing the mode would leave it to those who have it open already; nobody has the copy open.
pub(crate) fn make_private(prefix: &str) -> Result<(), MemoryError> {
    let failed = |source| MemoryError::File { path: FOLDER.into(), source };
    let folder = folder().map_err(failed)?;
    for name in names_in(&folder, prefix).map_err(failed)? {
        let path = folder.path().join(&name);
        let replaced = folder
            .look(&name)
            .and_then(|stat| if stat.st_mode & 0o077 == 0 { Ok(()) } else { replace_by_copy(&folder, prefix, &name) });
        replaced.map_err(|source| MemoryError::File { path, source })?;
    }
    Ok(())
}

fn replace_by_copy(folder: &Folder, prefix: &str, name: &OsStr) -> io::Result<()> {
    let mut content = Vec::new();
    folder.file(name, OFlags::RDONLY)?.take(COPY_MAX_BYTES).read_to_end(&mut content)?;
    let draft = OsString::from(format!("{prefix}private"));
    let mut copy = folder.file(&draft, OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL)?;
    copy.write_all(&content)?;
    folder.rename(&draft, name)
}

/// Bytes of a block in which the system counts what a file takes.
const BLOCK_BYTES: u64 = 512;

/// Takes the memory behind each file of ours that begins so.
///
/// A file in shared memory has a size before it has memory; its first touch takes that, and where somebody else has filled `/dev/shm`
/// meanwhile the toucher is ended by SIGBUS. After this call no touch can fail. Files whose maker is not done with them are left to it.
/// `needed_bytes`, what a domain may touch, is for the error.
pub(crate) fn commit(prefix: &str, needed_bytes: u64) -> Result<(), MemoryError> {
    let failed = |source| MemoryError::File { path: FOLDER.into(), source };
    let folder = folder().map_err(failed)?;
    for name in names_in(&folder, prefix).map_err(failed)? {
        let Ok(stat) = folder.look(&name) else { continue };
        let size = u64::try_from(stat.st_size).unwrap_or(0);
        let taken = u64::try_from(stat.st_blocks).unwrap_or(0) * BLOCK_BYTES;
        if size <= taken || FileType::from_raw_mode(stat.st_mode) != FileType::RegularFile {
            continue;
        }
        let Ok(file) = folder.file(&name, OFlags::RDWR) else { continue };
        match fallocate(&file, FallocateFlags::KEEP_SIZE, 0, size) {
            Ok(()) => {}
            Err(Errno::NOSPC | Errno::NOMEM) => {
                return Err(MemoryError::Full { free_bytes: free_bytes().unwrap_or(0), needed_bytes });
            }
            Err(error) => return Err(MemoryError::File { path: folder.path().join(&name), source: error.into() }),
        }
    }
    Ok(())
}

/// Bytes that may still be taken of shared memory; `None` if the system does not say.
pub(crate) fn free_bytes() -> Option<u64> {
    let space = rustix::fs::statvfs(FOLDER).ok()?;
    Some(space.f_bavail.saturating_mul(space.f_frsize))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{Permissions, set_permissions};
    use std::os::unix::fs::{PermissionsExt, chown, symlink};
    use std::path::PathBuf;

    /// Files in shared memory, removed at the end.
    struct Files(String);

    impl Files {
        fn new(test: &str) -> Self {
            Self(format!("soleus-memory-{test}-{}_", std::process::id()))
        }

        fn path(&self, name: &str) -> PathBuf {
            Path::new(FOLDER).join(format!("{}{name}", self.0))
        }
    }

    impl Drop for Files {
        fn drop(&mut self) {
            names(&self.0).iter().for_each(|name| drop(std::fs::remove_file(Path::new(FOLDER).join(name))));
        }
    }

    #[test]
    fn what_others_may_open_is_replaced_by_a_private_copy() {
        let files = Files::new("private");
        let (open, private) = (files.path("open"), files.path("closed"));
        std::fs::write(&open, "content").expect("writable");
        set_permissions(&open, Permissions::from_mode(0o666)).expect("it is ours");
        std::fs::write(&private, "other").expect("writable");
        set_permissions(&private, Permissions::from_mode(0o600)).expect("it is ours");
        let held = std::fs::OpenOptions::new().write(true).open(&open).expect("anybody may");
        make_private(&files.0).expect("they are ours");
        held.set_len(0).expect("it has it open");
        assert_eq!(
            std::fs::read_to_string(&open).expect("ours"),
            "content",
            "who had it open cannot change it any more"
        );
        assert_eq!(open.metadata().expect("there").permissions().mode() & 0o777, 0o600);
        assert_eq!(std::fs::read_to_string(&private).expect("ours"), "other");
        assert_eq!(names(&files.0).len(), 2);
    }

    #[test]
    fn what_is_committed_has_its_memory() {
        let files = Files::new("commit");
        let sparse = files.path("sparse");
        std::fs::File::create(&sparse).and_then(|file| file.set_len(1 << 20)).expect("writable");
        let blocks = || std::os::unix::fs::MetadataExt::blocks(&sparse.metadata().expect("there"));
        assert_eq!(blocks(), 0, "a size is no memory");
        commit(&files.0, 0).expect("there is room");
        assert_eq!(blocks() * BLOCK_BYTES, 1 << 20);
        assert_eq!(sparse.metadata().expect("there").len(), 1 << 20);
    }

    #[test]
    fn broken_and_foreign_files_are_named_with_owner_and_remedy() {
        let files = Files::new("foreign");
        check(&files.0).expect("there is nothing");
        std::fs::write(files.path("x.global_mgmt"), "").expect("writable");
        let refused = check(&files.0).expect_err("nothing is in it").to_string();
        assert!(refused.contains("x.global_mgmt") && refused.contains("cut"), "{refused}");
        remove(&files.0).expect("ours, if broken");
        symlink("/etc/hostname", files.path("link")).expect("writable");
        let refused = check(&files.0).expect_err("no memory of ours is a link");
        assert!(matches!(refused, MemoryError::Foreign { .. }), "{refused}");
        std::fs::remove_file(files.path("link")).expect("ours");
        if user_id() != 0 {
            eprintln!("SKIPPED: only root can make a file of another user");
            return;
        }
        std::fs::write(files.path("theirs"), "").expect("writable");
        chown(files.path("theirs"), Some(1), None).expect("we are root");
        for refused in [check(&files.0), remove(&files.0)] {
            let refused = refused.expect_err("somebody else's").to_string();
            for said in ["theirs", "user 1", "rm "] {
                assert!(refused.contains(said), "no `{said}` in {refused}");
            }
        }
        assert_eq!(names_of_ours(&files.0), [] as [OsString; 0]);
        assert!(files.path("theirs").exists());
    }
}

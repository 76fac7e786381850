//! The runtime folder: where the domains of one user are.
//!
//! It is that in the environment's `SOLEUS_RUNTIME_DIR`, else `/tmp/soleus-UID`: the same in a login shell, under `su`, in cron and in
//! a service. `/tmp` is everybody's, so somebody else may have made it, or a link of its name: what is there is used only if it is a
//! real folder, ours, and for nobody else (mode 0700).

use crate::error::{RuntimeError, User};
use crate::folder::{Folder, PRIVATE_FOLDER, kind};
use rustix::fs::{CWD, mkdirat};
use std::io::{self, ErrorKind};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// The variable of the environment that names another folder.
pub const RUNTIME_VARIABLE: &str = "SOLEUS_RUNTIME_DIR";

/// Who owns what no user of this user namespace owns.
const NOBODY: u32 = 65534;

/// The user whose domains these are.
pub(crate) fn user_id() -> u32 {
    rustix::process::geteuid().as_raw()
}

/// Path of the runtime folder, not by the links through which it may be named: they may lead elsewhere tomorrow.
pub fn runtime_folder() -> PathBuf {
    let path = named().unwrap_or_else(|| PathBuf::from(format!("/tmp/soleus-{}", user_id())));
    match (path.parent().map(Path::canonicalize), path.file_name()) {
        (Some(Ok(parent)), Some(name)) if path.is_absolute() => parent.join(name),
        // What is wrong with it is told by whoever opens it.
        _ => path,
    }
}

/// How the names of all shared memory of the domains in this runtime folder begin. Shared memory has no folders: domains of one name
/// in two runtime folders of one user are kept apart here.
pub(crate) fn memory_prefix() -> String {
    let user = user_id();
    match named() {
        None => format!("soleus_{user}_"),
        Some(_) => format!("soleus_{user}-{:08x}_", fnv_1a(runtime_folder().as_os_str().as_encoded_bytes())),
    }
}

/// The 32-bit FNV-1a hash (Fowler, Noll, Vo), the same in every build.
fn fnv_1a(bytes: &[u8]) -> u32 {
    bytes.iter().fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193))
}

fn named() -> Option<PathBuf> {
    std::env::var_os(RUNTIME_VARIABLE).filter(|folder| !folder.is_empty()).map(PathBuf::from)
}

/// Opens the runtime folder and checks it; `None` if there is none.
pub(crate) fn open() -> Result<Option<Folder>, RuntimeError> {
    open_at(&runtime_folder())
}

/// Opens the runtime folder and checks it, and makes it if there is none.
pub(crate) fn open_or_make() -> Result<Folder, RuntimeError> {
    let path = runtime_folder();
    loop {
        if let Some(folder) = open_at(&path)? {
            return Ok(folder);
        }
        match mkdirat(CWD, &path, PRIVATE_FOLDER).map_err(io::Error::from) {
            Ok(()) => {}
            // The last to leave takes it along, at this very moment perhaps.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(source) => return Err(RuntimeError::File { path, source }),
        }
    }
}

/// Removes the runtime folder if it is empty and one that we make ourselves: what the variable names is somebody's gift.
pub(crate) fn remove_if_empty() {
    if named().is_none() {
        let _ = std::fs::remove_dir(runtime_folder());
    }
}

fn open_at(path: &Path) -> Result<Option<Folder>, RuntimeError> {
    let failed = |source| RuntimeError::File { path: path.to_path_buf(), source };
    let (Some(parent), Some(name), true) = (path.parent(), path.file_name(), path.is_absolute()) else {
        return Err(RuntimeError::Name { path: path.to_path_buf() });
    };
    let parent = parent.canonicalize().map_err(failed)?;
    check_above(path, &parent)?;
    let path = parent.join(name);
    let folder = match Folder::open(&path) {
        Ok(folder) => folder,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(source) => {
            let look = Folder::open_of_system(&parent).and_then(|parent| parent.look(name));
            return Err(match look {
                Ok(stat) if kind(&stat) != "a folder" => RuntimeError::NoFolder { path, found: kind(&stat) },
                _ => RuntimeError::File { path, source },
            });
        }
    };
    let stat = folder.look_at_itself().map_err(failed)?;
    if stat.st_uid != user_id() {
        return Err(RuntimeError::Foreign { path, owner: User(stat.st_uid), ours: User(user_id()) });
    }
    if stat.st_mode & 0o777 != 0o700 {
        return Err(RuntimeError::Mode { path, mode: stat.st_mode & 0o777 });
    }
    Ok(Some(folder))
}

/// Refuses a folder that others may replace: because they can write where it is, or where that is.
fn check_above(path: &Path, parent: &Path) -> Result<(), RuntimeError> {
    for above in parent.ancestors() {
        let metadata = above.metadata().map_err(|source| RuntimeError::File { path: above.to_path_buf(), source })?;
        let (mode, owner) = (metadata.mode(), metadata.uid());
        // Where the sticky bit is set, as in /tmp, everybody may make files and only their owner may replace them.
        let others_write = mode & 0o022 != 0 && mode & 0o1000 == 0;
        if others_write || ![0, user_id(), NOBODY].contains(&owner) {
            let (path, above) = (path.to_path_buf(), above.to_path_buf());
            return Err(RuntimeError::Above { path, above, owner: User(owner), mode: mode & 0o7777 });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{Permissions, create_dir, set_permissions, write};
    use std::os::unix::fs::{PermissionsExt, chown, symlink};

    fn with_mode(path: &Path, mode: u32) {
        set_permissions(path, Permissions::from_mode(mode)).expect("it is ours");
    }

    #[test]
    fn only_a_real_folder_for_its_owner_alone_is_used() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("runtime");
        assert!(open_at(&path).expect("nothing wrong").is_none());
        create_dir(&path).expect("writable");
        for mode in [0o755, 0o770, 0o777, 0o701, 0o500] {
            with_mode(&path, mode);
            let refused = open_at(&path).expect_err("not private");
            assert!(matches!(refused, RuntimeError::Mode { mode: found, .. } if found == mode), "{refused}");
            let said = refused.to_string();
            assert!(said.contains(&format!("{mode:04o}")) && said.contains("chmod 700"), "{said}");
        }
        with_mode(&path, 0o700);
        assert_eq!(open_at(&path).expect("ours").expect("there").path(), path.canonicalize().expect("there"));
        let link = place.path().join("link");
        symlink(&path, &link).expect("writable");
        let refused = open_at(&link).expect_err("a link").to_string();
        assert!(refused.contains("is a symbolic link"), "{refused}");
        let file = place.path().join("file");
        write(&file, "").expect("writable");
        let refused = open_at(&file).expect_err("a file").to_string();
        assert!(refused.contains("is a file"), "{refused}");
        assert!(matches!(open_at(Path::new("runtime")), Err(RuntimeError::Name { .. })));
        assert!(matches!(open_at(Path::new("/")), Err(RuntimeError::Name { .. })));
        assert!(matches!(open_at(&place.path().join("nowhere/runtime")), Err(RuntimeError::File { .. })));
    }

    #[test]
    fn the_hash_is_the_published_one() {
        // From the authors' test vectors.
        for (text, hash) in [("", 0x811c_9dc5), ("a", 0xe40c_292c), ("foobar", 0xbf9c_f968)] {
            assert_eq!(fnv_1a(text.as_bytes()), hash);
        }
    }

    #[test]
    fn a_folder_that_others_may_replace_is_refused() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("shared/runtime");
        std::fs::create_dir_all(&path).expect("writable");
        with_mode(&path, 0o700);
        for (mode, used) in [(0o755, true), (0o1777, true), (0o777, false), (0o775, false)] {
            with_mode(&place.path().join("shared"), mode);
            assert_eq!(open_at(&path).is_ok(), used, "{mode:o}");
        }
    }

    /// Needs to be root, as continuous integration is: nobody else may give a folder away.
    #[test]
    fn a_folder_of_another_user_is_refused_by_name() {
        if user_id() != 0 {
            eprintln!("SKIPPED: only root can make a folder of another user");
            return;
        }
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("runtime");
        create_dir(&path).expect("writable");
        with_mode(&path, 0o700);
        chown(&path, Some(1), None).expect("we are root");
        let refused = open_at(&path).expect_err("it is somebody else's");
        let RuntimeError::Foreign { owner: User(1), ours: User(0), .. } = refused else { panic!("{refused}") };
        let below = path.join("ours");
        create_dir(&below).expect("writable");
        with_mode(&below, 0o700);
        let refused = open_at(&below).expect_err("somebody else may replace it");
        assert!(matches!(refused, RuntimeError::Above { owner: User(1), .. }), "{refused}");
    }
}

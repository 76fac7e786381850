//! The owner of a domain.

use crate::domain::DomainName;
use crate::error::OwnerError;
use crate::life::{Life, Seen, look};
use crate::service::{self, Services};
use iceoryx2::prelude::*;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

/// How long one who claims a domain waits for its owner to end: one that is just being stopped needs a moment.
const OWNER_ENDS: Duration = Duration::from_secs(1);
/// How long one waits for somebody else who holds the lock and is no owner: removing what the dead left, or claiming the domain,
/// takes milliseconds, and longer only on a machine that does not run them.
const OTHERS_FINISH: Duration = Duration::from_secs(30);
/// How often one that waits looks again.
const LOOK_AGAIN: Duration = Duration::from_millis(5);
/// How often a folder is emptied in which somebody else is still making files.
const EMPTYINGS_MAX: u32 = 100;

/// Possession of a domain: all services exist as long as it does. Dropping it removes everything.
pub struct Owner {
    name: DomainName,
    // The order of the fields is the order in which they go: nobody joins any more, then services, node, and (in `drop` of the last)
    // files and lock.
    _life: Life,
    _services: Services,
    node: Node<ipc::Service>,
    _possession: Possession,
}

/// The lock and the files. What the dead left is wiped when it is taken, what we made when it is given back.
struct Possession {
    name: DomainName,
    lock: File,
}

impl Owner {
    /// Takes a domain into possession: locks it, wipes what the dead left behind, creates every service.
    ///
    /// # Errors
    /// [`OwnerError::InUse`] if it has an owner; others if files or shared memory cannot be made.
    pub fn claim(name: &DomainName) -> Result<Self, OwnerError> {
        set_log_level(LogLevel::Error);
        remove_all_abandoned();
        let config = name.config().ok_or_else(|| OwnerError::PathTooLong { path: name.root() })?;
        let possession = Possession::take(name)?;
        possession.wipe()?;
        let members = name.members_path();
        std::fs::create_dir_all(&members).map_err(|source| OwnerError::File { path: members, source })?;
        let node = NodeBuilder::new()
            .name(&NodeName::new("owner").expect("a short name"))
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|source| OwnerError::Node { domain: name.to_string(), source })?;
        let services = service::create_all(&node)?;
        let since = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos();
        let ready = name.ready_path();
        let life = Life::begin(ready.clone(), &format!("{} {since}\n", std::process::id()))
            .map_err(|source| OwnerError::File { path: ready, source })?;
        Ok(Self { name: name.clone(), _life: life, _services: services, node, _possession: possession })
    }

    /// The domain's name.
    pub fn name(&self) -> &DomainName {
        &self.name
    }

    /// Frees what processes held that died without leaving; to be called now and then.
    pub fn reap_dead(&self) {
        self.node.try_cleanup_dead_nodes();
    }
}

impl Possession {
    /// Locks the domain's file, unless somebody else holds it.
    fn take(name: &DomainName) -> Result<Self, OwnerError> {
        let start = Instant::now();
        loop {
            if let Some(mut possession) = Self::try_take(name)? {
                let failed = |source| OwnerError::File { path: name.lock_path(), source };
                let lock = &mut possession.lock;
                lock.set_len(0).and_then(|()| writeln!(lock, "{}", std::process::id())).map_err(failed)?;
                return Ok(possession);
            }
            let patience = if name.has_owner() { OWNER_ENDS } else { OTHERS_FINISH };
            if start.elapsed() >= patience {
                let owner = std::fs::read_to_string(name.lock_path()).unwrap_or_default();
                let owner = if owner.trim().is_empty() { "?" } else { owner.trim() }.to_string();
                return Err(OwnerError::InUse { domain: name.to_string(), owner });
            }
            std::thread::sleep(LOOK_AGAIN);
        }
    }

    /// Locks the domain's file if nobody holds it, or removes its folder, at this moment.
    fn try_take(name: &DomainName) -> Result<Option<Self>, OwnerError> {
        use std::os::unix::fs::{DirBuilderExt, MetadataExt};
        let folder = DomainName::user_folder();
        match std::fs::DirBuilder::new().mode(0o700).create(&folder) {
            Err(source) if source.kind() != ErrorKind::AlreadyExists => {
                return Err(OwnerError::File { path: folder, source });
            }
            _ => {}
        }
        let path = name.lock_path();
        let failed = |source| OwnerError::File { path: path.clone(), source };
        let lock = match File::options().read(true).write(true).create(true).truncate(false).open(&path) {
            // The last domain of the user took the folder with it.
            Err(source) if source.kind() == ErrorKind::NotFound => return Ok(None),
            opened => opened.map_err(failed)?,
        };
        match lock.try_lock() {
            Ok(()) => {
                // Whoever leaves removes the file: a lock on a file that lost its name possesses nothing, and may not wipe
                // what a new owner has under that name.
                let ours = lock.metadata().map_err(failed)?.ino();
                let is_named = std::fs::metadata(&path).is_ok_and(|metadata| metadata.ino() == ours);
                Ok(is_named.then(|| Self { name: name.clone(), lock }))
            }
            Err(std::fs::TryLockError::WouldBlock) => Ok(None),
            Err(std::fs::TryLockError::Error(source)) => Err(failed(source)),
        }
    }

    /// Removes everything of the domain but the lock.
    fn wipe(&self) -> Result<(), OwnerError> {
        for path in self.name.leftovers() {
            remove(path)?;
        }
        remove(self.name.root())
    }
}

/// Removes whatever is left of this user's domains that have no owner any more: killed with all their processes, or still being
/// left by some. What somebody else is removing at this moment is left to them.
fn remove_all_abandoned() {
    for name in DomainName::all_of_user() {
        // Taking possession fails while the owner lives; wiping happens when it is given back.
        drop(Possession::try_take(&name));
    }
}

/// Removes whatever is left of a domain if it has no owner any more, also what was made while somebody else removed it. To be called by
/// each process that ends: the owner may have been killed, and the last to leave puts out the light.
pub fn remove_abandoned(name: &DomainName) {
    let start = Instant::now();
    loop {
        match Possession::try_take(name) {
            Ok(Some(abandoned)) => return drop(abandoned),
            // What cannot be removed now, the next owner removes, or says why it cannot.
            Err(_) => return,
            Ok(None) if name.has_owner() || start.elapsed() >= OTHERS_FINISH => return,
            Ok(None) => std::thread::sleep(LOOK_AGAIN),
        }
    }
}

/// Removes a file or folder; it is fine if there is none.
fn remove(path: PathBuf) -> Result<(), OwnerError> {
    let is_folder = path.is_dir();
    for emptied in 1.. {
        let removed = if is_folder { std::fs::remove_dir_all(&path) } else { std::fs::remove_file(&path) };
        match removed {
            // A process of the dead owner made something meanwhile.
            Err(source) if source.kind() == ErrorKind::DirectoryNotEmpty && emptied < EMPTYINGS_MAX => {}
            Err(source) if source.kind() != ErrorKind::NotFound => return Err(OwnerError::File { path, source }),
            _ => break,
        }
    }
    Ok(())
}

impl DomainName {
    /// Whether a living owner has made the domain complete.
    fn has_owner(&self) -> bool {
        matches!(look(&self.ready_path()), Seen::Alive(_))
    }
}

impl Drop for Possession {
    fn drop(&mut self) {
        // Whatever cannot be removed now, the next owner removes.
        let _ = self.wipe();
        // Removed while locked, so that nobody can lock it in between; see `take` for who opened it before.
        let _ = std::fs::remove_file(self.name.lock_path());
        let _ = self.lock.unlock();
        // The folder of all domains goes with the last one.
        let _ = std::fs::remove_dir(DomainName::user_folder());
    }
}

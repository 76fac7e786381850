//! The owner of a domain.

use crate::domain::{DomainName, MEMBERS, READY};
use crate::error::OwnerError;
use crate::folder::Folder;
use crate::life::{Begun, Life, Seen, look};
use crate::runtime;
use crate::service::{self, Services};
use crate::{memory, space};
use iceoryx2::prelude::*;
use rustix::fs::OFlags;
use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::io::{ErrorKind, Write};
use std::time::{Duration, Instant, SystemTime};

/// How long one who claims a domain waits for its owner to end: one that is just being stopped needs a moment.
const OWNER_ENDS: Duration = Duration::from_secs(1);
/// How long one waits for somebody else who holds the lock and is no owner: removing what the dead left, or claiming the domain,
/// takes milliseconds, and longer only on a machine that does not run them.
const OTHERS_FINISH: Duration = Duration::from_secs(30);
/// How often one that waits looks again.
const LOOK_AGAIN: Duration = Duration::from_millis(5);
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
    /// The runtime folder.
    runtime: Folder,
    lock: File,
}

impl Owner {
    /// Takes a domain into possession: locks it, wipes what the dead left behind, creates every service.
    ///
    /// # Errors
    /// [`OwnerError::InUse`] if it has an owner; others if files or shared memory cannot be made.
    pub fn claim(name: &DomainName) -> Result<Self, OwnerError> {
        set_log_level(LogLevel::Error);
        let config = name.config()?;
        let runtime = runtime::open_or_make()?;
        remove_all_abandoned(&runtime);
        let possession = Possession::take(name)?;
        possession.wipe()?;
        space::check()?;
        let failed = |source| OwnerError::File { path: possession.runtime.path().join(name.folder_name()), source };
        let folder = possession.runtime.make_folder(&name.folder_name()).map_err(failed)?;
        folder.make_folder(OsStr::new(MEMBERS)).map_err(failed)?;
        let node = || {
            NodeBuilder::new()
                .name(&NodeName::new("owner").expect("a short name"))
                .config(&config)
                .signal_handling_mode(SignalHandlingMode::Disabled)
                .create::<ipc::Service>()
                .map_err(|source| OwnerError::Node { domain: name.to_string(), source })
        };
        // The first node makes what all of them share; it goes again before anybody uses what is then made private.
        drop(node()?);
        memory::make_private(&name.prefix())?;
        let node = node()?;
        let services = service::create_all(&node)?;
        memory::commit(&name.prefix(), space::needed_bytes())?;
        let since = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos();
        let line = format!("{} {since}", std::process::id());
        let Begun::Ours(life) = Life::begin(folder, READY, &line, OTHERS_FINISH).map_err(failed)? else {
            return Err(possession.in_use());
        };
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
            let runtime = runtime::open_or_make()?;
            let has_owner = has_owner(&runtime, name);
            match Self::try_take(runtime, name)? {
                Ok(mut possession) => {
                    let path = possession.runtime.path().join(name.lock_name());
                    let lock = &mut possession.lock;
                    let written = lock.set_len(0).and_then(|()| writeln!(lock, "{}", std::process::id()));
                    written.map_err(|source| OwnerError::File { path, source })?;
                    return Ok(possession);
                }
                Err(runtime) if start.elapsed() >= if has_owner { OWNER_ENDS } else { OTHERS_FINISH } => {
                    return Err(in_use(&runtime, name));
                }
                Err(_) => std::thread::sleep(LOOK_AGAIN),
            }
        }
    }

    /// Locks the domain's file if nobody holds it, or removes its folder, at this moment; else gives the folder back.
    fn try_take(runtime: Folder, name: &DomainName) -> Result<Result<Self, Folder>, OwnerError> {
        let lock_name = name.lock_name();
        let failed = |source| OwnerError::File { path: runtime.path().join(&lock_name), source };
        let lock = match runtime.file(&lock_name, OFlags::RDWR | OFlags::CREATE) {
            // The last domain of the user took the folder with it.
            Err(source) if source.kind() == ErrorKind::NotFound => return Ok(Err(runtime)),
            opened => opened.map_err(failed)?,
        };
        match lock.try_lock() {
            // Whoever leaves removes the file: a lock on a file that lost its name possesses nothing, and may not wipe what a new
            // owner has under that name.
            Ok(()) if runtime.names(&lock_name, &lock).map_err(failed)? => {
                Ok(Ok(Self { name: name.clone(), runtime, lock }))
            }
            Ok(()) | Err(TryLockError::WouldBlock) => Ok(Err(runtime)),
            Err(TryLockError::Error(source)) => Err(failed(source)),
        }
    }

    /// Removes everything of the domain but the lock.
    fn wipe(&self) -> Result<(), OwnerError> {
        let folder = self.name.folder_name();
        memory::remove(&self.name.prefix())?;
        let failed = |source| OwnerError::File { path: self.runtime.path().join(&folder), source };
        self.runtime.remove(&folder).map_err(failed)
    }

    fn in_use(&self) -> OwnerError {
        in_use(&self.runtime, &self.name)
    }
}

/// The error that names the owner as it wrote itself down.
fn in_use(runtime: &Folder, name: &DomainName) -> OwnerError {
    let file = runtime.file(&name.lock_name(), OFlags::RDONLY);
    let owner = file.and_then(std::io::read_to_string).unwrap_or_default();
    let owner = if owner.trim().is_empty() { "?" } else { owner.trim() }.to_string();
    OwnerError::InUse { domain: name.to_string(), owner }
}

/// Whether a living owner has made the domain complete.
fn has_owner(runtime: &Folder, name: &DomainName) -> bool {
    runtime.folder(&name.folder_name()).is_ok_and(|folder| matches!(look(&folder, READY), Seen::Alive(_)))
}

/// Removes whatever is left of this user's domains that have no owner any more: killed with all their processes, or still being
/// left by some. What somebody else is removing at this moment is left to them.
fn remove_all_abandoned(runtime: &Folder) {
    for name in DomainName::all_of_user(runtime) {
        // Taking possession fails while the owner lives; wiping happens when it is given back.
        if let Ok(runtime) = runtime::open_or_make() {
            drop(Possession::try_take(runtime, &name));
        }
    }
}

/// Removes whatever is left of a domain if it has no owner any more, also what was made while somebody else removed it. To be called by
/// each process that ends: the owner may have been killed, and the last to leave puts out the light.
pub fn remove_abandoned(name: &DomainName) {
    let start = Instant::now();
    loop {
        // A folder that may not be used is nobody's to wipe.
        let Ok(Some(runtime)) = runtime::open() else { return };
        let has_owner = has_owner(&runtime, name);
        match Possession::try_take(runtime, name) {
            Ok(Ok(abandoned)) => return drop(abandoned),
            // What cannot be removed now, the next owner removes, or says why it cannot.
            Err(_) => return,
            Ok(Err(_)) if has_owner || start.elapsed() >= OTHERS_FINISH => return,
            Ok(Err(_)) => std::thread::sleep(LOOK_AGAIN),
        }
    }
}

impl Drop for Possession {
    fn drop(&mut self) {
        // Whatever cannot be removed now, the next owner removes.
        let _ = self.wipe();
        // Removed while locked, so that nobody can lock it in between; see `try_take` for who opened it before.
        let _ = self.runtime.remove_file(&self.name.lock_name());
        let _ = self.lock.unlock();
        // The folder of all domains goes with the last one.
        runtime::remove_if_empty();
    }
}

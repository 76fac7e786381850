//! The owner of a domain.

use crate::domain::DomainName;
use crate::error::OwnerError;
use crate::service::{self, Services};
use iceoryx2::prelude::*;
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

/// Possession of a domain: all services exist as long as it does. Dropping it removes everything.
pub struct Owner {
    name: DomainName,
    // The order of the fields is the order in which they go: services, node, then (in `drop` of the last) files and lock.
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
        remove_abandoned();
        let config = name.config().ok_or_else(|| OwnerError::PathTooLong { path: name.root() })?;
        let possession = Possession::take(name)?;
        possession.wipe()?;
        let root = name.root();
        std::fs::create_dir_all(&root).map_err(|source| OwnerError::File { path: root, source })?;
        let node = NodeBuilder::new()
            .name(&NodeName::new("owner").expect("a short name"))
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|source| OwnerError::Node { domain: name.to_string(), source })?;
        let services = service::create_all(&node)?;
        // Written under another name and moved: whoever sees the file sees all of it.
        let ready = name.ready_path();
        let draft = ready.with_extension("draft");
        let since = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos();
        std::fs::write(&draft, format!("{} {since}\n", std::process::id()))
            .and_then(|()| std::fs::rename(&draft, &ready))
            .map_err(|source| OwnerError::File { path: ready, source })?;
        Ok(Self { name: name.clone(), _services: services, node, _possession: possession })
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
        use std::os::unix::fs::DirBuilderExt;
        // A process that asks whether there is an owner, or that wipes what a dead one left, holds the lock for a moment: try
        // again for a while.
        let until = Instant::now() + Duration::from_secs(1);
        loop {
            let folder = DomainName::user_folder();
            std::fs::DirBuilder::new()
                .recursive(true)
                .mode(0o700)
                .create(&folder)
                .map_err(|source| OwnerError::File { path: folder, source })?;
            if let Some(mut possession) = Self::try_take(name)? {
                let failed = |source| OwnerError::File { path: name.lock_path(), source };
                let lock = &mut possession.lock;
                lock.set_len(0).and_then(|()| writeln!(lock, "{}", std::process::id())).map_err(failed)?;
                return Ok(possession);
            }
            if Instant::now() >= until {
                let owner = std::fs::read_to_string(name.lock_path()).unwrap_or_default();
                let owner = if owner.trim().is_empty() { "?" } else { owner.trim() }.to_string();
                return Err(OwnerError::InUse { domain: name.to_string(), owner });
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Locks the domain's file if nobody holds it, or removes its folder, at this moment.
    fn try_take(name: &DomainName) -> Result<Option<Self>, OwnerError> {
        use std::os::unix::fs::MetadataExt;
        let path = name.lock_path();
        let failed = |source| OwnerError::File { path: path.clone(), source };
        let lock = match File::options().read(true).write(true).create(true).truncate(false).open(&path) {
            // The last domain of the user took the folder with it.
            Err(source) if source.kind() == std::io::ErrorKind::NotFound => return Ok(None),
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
/// left by some. Called by each new owner, and by each process that ends and finds its owner gone. What somebody else is
/// removing at this moment is left to them: it may still be there for a moment on return.
pub fn remove_abandoned() {
    for name in DomainName::all_of_user() {
        // Taking possession fails while the owner lives; wiping happens when it is given back.
        drop(Possession::try_take(&name));
    }
}

/// Removes a file or folder; it is fine if there is none.
fn remove(path: PathBuf) -> Result<(), OwnerError> {
    let result = if path.is_dir() { std::fs::remove_dir_all(&path) } else { std::fs::remove_file(&path) };
    match result {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(OwnerError::File { path, source }),
        _ => Ok(()),
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

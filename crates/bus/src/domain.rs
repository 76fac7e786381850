//! A domain: everything of one system on one host, apart from all others.

use crate::error::{DomainNameError, JoinError, PortError};
use crate::life::{Life, Seen, look};
use crate::pattern::{PatternPublisher, PatternSubscriber};
use crate::publisher::Publisher;
use crate::subscriber::{Robot, Subscriber};
use iceoryx2::prelude::*;
use messages::code::Process;
use messages::{Message, Topic};
use std::path::{Path as FilePath, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// Name of a domain: lower-case letters, digits and `-`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DomainName(String);

impl std::str::FromStr for DomainName {
    type Err = DomainNameError;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if (1..=32).contains(&name.len()) && name.chars().all(allowed) {
            Ok(Self(name.to_string()))
        } else {
            Err(DomainNameError { found: name.to_string() })
        }
    }
}

impl std::fmt::Display for DomainName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl DomainName {
    /// Folder of all domains of this user.
    pub(crate) fn user_folder() -> PathBuf {
        PathBuf::from(format!("/tmp/soleus-{}", user_id()))
    }

    /// Folder of this domain's iceoryx2 files.
    pub(crate) fn root(&self) -> PathBuf {
        Self::user_folder().join(&self.0)
    }

    /// The file whose lock is the possession of the domain.
    pub(crate) fn lock_path(&self) -> PathBuf {
        Self::user_folder().join(format!("{}.lock", self.0))
    }

    /// The file that says the domain is complete, and whose possession it is.
    pub(crate) fn ready_path(&self) -> PathBuf {
        self.root().join("ready")
    }

    /// The folder in which each process of the domain has a file that says whether it lives.
    pub(crate) fn members_path(&self) -> PathBuf {
        self.root().join("members")
    }

    /// How the name of each piece of the domain's shared memory begins. No name may contain `_`, so no prefix is the beginning
    /// of another.
    pub fn prefix(&self) -> String {
        format!("soleus_{}_{}_", user_id(), self.0)
    }

    /// The files of those who were a process here and did not end in order.
    fn dead_members(&self, process: Process) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(self.members_path()).into_iter().flatten().flatten();
        let is_such = |name: &str| name.split('-').next() == Some(process.word()) && !name.ends_with(".draft");
        let files = entries.filter(|entry| is_such(&entry.file_name().to_string_lossy())).map(|entry| entry.path());
        files.filter(|path| look(path) == Seen::Dead).collect()
    }

    /// Every domain of this user of which there is anything on this host.
    pub(crate) fn all_of_user() -> Vec<Self> {
        let names_in = |folder: &FilePath| -> Vec<String> {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect()
        };
        let user = format!("soleus_{}_", user_id());
        let in_memory = names_in(FilePath::new("/dev/shm"));
        let in_memory =
            in_memory.iter().filter_map(|name| name.strip_prefix(&user)?.split('_').next().map(str::to_string));
        let in_folder = names_in(&Self::user_folder());
        let in_folder = in_folder.iter().map(|name| name.strip_suffix(".lock").unwrap_or(name).to_string());
        let names: std::collections::BTreeSet<String> = in_memory.chain(in_folder).collect();
        names.iter().filter_map(|name| name.parse().ok()).collect()
    }

    /// Everything of this domain that is on this host now: files in its folder and in shared memory.
    pub fn leftovers(&self) -> Vec<PathBuf> {
        let prefix = self.prefix();
        let in_folder = |folder: &FilePath| -> Vec<PathBuf> {
            std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
        };
        let mut found = in_folder(&self.root());
        found.extend(
            in_folder(FilePath::new("/dev/shm"))
                .into_iter()
                .filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&prefix))),
        );
        found
    }

    /// iceoryx2's configuration for this domain; `None` if the path is too long.
    pub(crate) fn config(&self) -> Option<Config> {
        // Nothing here may come from a file that happens to lie about: every value is iceoryx2's built-in default or ours.
        let mut config = Config::default();
        config.global.prefix = FileName::new(self.prefix().as_bytes()).ok()?;
        config.global.set_root_path(&Path::new(self.root().to_str()?.as_bytes()).ok()?);
        Some(config)
    }
}

/// The user's number, of which every user has a domain namespace of its own.
fn user_id() -> u32 {
    use std::os::unix::fs::MetadataExt;
    // A process is always allowed to see itself; a system without /proc has no iceoryx2 either.
    std::fs::metadata("/proc/self").map_or(0, |metadata| metadata.uid())
}

/// A process's membership in a domain.
pub struct Domain {
    name: DomainName,
    /// What the owner wrote when the domain was complete: another text is another owner.
    owner: String,
    pub(crate) node: Node<ipc::Service>,
    /// Files of those who were dead before we came: their end is nothing to us.
    dead_before: Vec<PathBuf>,
    // After the node: who is seen to have left has left everything.
    life: Life,
}

impl Domain {
    /// Joins a domain as a process, waiting for its owner for a while.
    ///
    /// # Errors
    /// [`JoinError::NoOwner`] after `patience`; others if shared memory does not work.
    pub fn join(name: &DomainName, process: Process, patience: Duration) -> Result<Self, JoinError> {
        set_log_level(LogLevel::Error);
        let config = name.config().ok_or_else(|| JoinError::PathTooLong { path: name.root() })?;
        let until = Instant::now() + patience;
        loop {
            if let Seen::Alive(owner) = look(&name.ready_path()) {
                let joined = Self::join_owned_by(owner.clone(), name, process, &config);
                // Whoever owned it may have ended meanwhile, and with it gone whatever we made or looked for.
                match joined {
                    Ok(domain) if domain.owner_is_alive() => return Ok(domain),
                    Err(error) if look(&name.ready_path()) == Seen::Alive(owner) => return Err(error),
                    _ => {}
                }
            }
            if Instant::now() >= until {
                return Err(JoinError::NoOwner { domain: name.to_string(), waited: patience });
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn join_owned_by(owner: String, name: &DomainName, process: Process, config: &Config) -> Result<Self, JoinError> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        // This one takes the place of those that died.
        for path in name.dead_members(process) {
            let _ = std::fs::remove_file(path);
        }
        let dead_before = Process::ALL.iter().flat_map(|other| name.dead_members(*other)).collect();
        // Numbers of processes return, and are not one's own in containers that share a folder; the time does not.
        let since = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos();
        let member = format!("{}-{}-{number}-{since}", process.word(), std::process::id());
        let path = name.members_path().join(member);
        let life = Life::begin(path.clone(), "").map_err(|source| JoinError::File { path, source })?;
        let node_name = NodeName::new(process.word()).expect("a process's word is a short name");
        let node = NodeBuilder::new()
            .name(&node_name)
            .config(config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|source| JoinError::Node { domain: name.to_string(), source })?;
        Ok(Self { name: name.clone(), owner, node, dead_before, life })
    }

    /// Its name.
    pub fn name(&self) -> &DomainName {
        &self.name
    }

    /// Whether the owner that was there when we joined still is. A few system calls: not for every tick.
    pub fn owner_is_alive(&self) -> bool {
        matches!(look(&self.name.ready_path()), Seen::Alive(owner) if owner == self.owner)
    }

    /// The processes of this domain that were killed, broke down or ended badly since we came, until another one takes their place.
    /// Reads files: not for every tick.
    pub fn dead_processes(&self) -> Vec<Process> {
        let is_dead =
            |process: &Process| self.name.dead_members(*process).iter().any(|path| !self.dead_before.contains(path));
        Process::ALL.iter().copied().filter(is_dead).collect()
    }

    /// From now on the end of this process is one that the others must hear of as if it had been killed.
    pub fn ends_badly(&self) {
        self.life.ends_badly();
    }

    /// A publisher of a topic.
    ///
    /// # Errors
    /// When the service cannot be opened, or others publish there already.
    pub fn publisher<T: Message>(&self, topic: Topic<T>) -> Result<Publisher<T>, PortError> {
        Publisher::new(&self.node, topic)
    }

    /// A subscriber to a topic that keeps up to `depth` messages until they are received.
    ///
    /// # Errors
    /// When the service cannot be opened or has too many subscribers.
    pub fn subscriber<T: Message>(
        &self,
        topic: Topic<T>,
        robot: Robot,
        depth: usize,
    ) -> Result<Subscriber<T>, PortError> {
        Subscriber::new(&self.node, topic, robot, depth)
    }

    /// The publisher of a walking pattern of at most `max_phases` phases.
    ///
    /// # Errors
    /// As [`Domain::publisher`].
    pub fn pattern_publisher(&self, max_phases: usize) -> Result<PatternPublisher, PortError> {
        PatternPublisher::new(&self.node, max_phases)
    }

    /// A subscriber to the walking pattern with memory for `max_phases` phases.
    ///
    /// # Errors
    /// As [`Domain::subscriber`].
    pub fn pattern_subscriber(&self, robot: Robot, max_phases: usize) -> Result<PatternSubscriber, PortError> {
        PatternSubscriber::new(&self.node, robot, max_phases)
    }
}

//! A domain: everything of one system on one host, apart from all others.

use crate::error::{DomainNameError, JoinError, PathTooLong, PortError, RuntimeError};
use crate::folder::Folder;
use crate::life::{Begun, Life, Seen, look};
use crate::memory;
use crate::pattern::{PatternPublisher, PatternSubscriber};
use crate::publisher::Publisher;
use crate::runtime::{self, memory_prefix, runtime_folder};
use crate::space;
use crate::subscriber::{Robot, Subscriber};
use iceoryx2::prelude::*;
use messages::code::Process;
use messages::{Message, Topic};
use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::path::{Path as FilePath, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// The file that says, in the folder of a domain, that the domain is complete and whose possession it is.
pub(crate) const READY: &str = "ready";
/// The folder in which each process of the domain has a file that says whether it lives.
pub(crate) const MEMBERS: &str = "members";

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
    /// How the name of each piece of the domain's shared memory begins. No name may contain `_`, so no prefix is the beginning
    /// of another.
    pub fn prefix(&self) -> String {
        format!("{}{}_", memory_prefix(), self.0)
    }

    /// Every domain of this user of which there is anything on this host.
    pub(crate) fn all_of_user(runtime: &Folder) -> Vec<Self> {
        let user = memory_prefix();
        let in_memory = memory::names_of_ours(&user);
        let in_memory = in_memory.iter().filter_map(|name| name.to_str()?.strip_prefix(&user)?.split('_').next());
        let in_folder = runtime.entries().unwrap_or_default();
        let in_folder = in_folder.iter().filter_map(|name| name.to_str());
        let in_folder = in_folder.map(|name| name.strip_suffix(".lock").unwrap_or(name));
        let names: BTreeSet<&str> = in_memory.chain(in_folder).collect();
        names.iter().filter_map(|name| name.parse().ok()).collect()
    }

    /// The domains of this user that have a living owner.
    ///
    /// # Errors
    /// If the runtime folder is not ours alone.
    pub fn all_living() -> Result<Vec<Self>, RuntimeError> {
        let Some(runtime) = runtime::open()? else { return Ok(Vec::new()) };
        Ok(Self::all_of_user(&runtime).into_iter().filter(|name| name.owner().is_some()).collect())
    }

    /// Everything of this domain that is on this host now: files in its folder and in shared memory.
    pub fn leftovers(&self) -> Vec<PathBuf> {
        let folder = runtime::open().ok().flatten().and_then(|runtime| runtime.folder(&self.folder_name()).ok());
        let entries = folder.as_ref().and_then(|folder| folder.entries().ok()).unwrap_or_default();
        let mut found: Vec<PathBuf> =
            folder.iter().flat_map(|folder| entries.iter().map(|entry| folder.path().join(entry))).collect();
        let in_memory = memory::names(&self.prefix());
        found.extend(in_memory.into_iter().map(|name| FilePath::new(memory::FOLDER).join(name)));
        found
    }

    /// Path of the domain's folder, where iceoryx2 has its files.
    pub(crate) fn root(&self) -> PathBuf {
        runtime_folder().join(&self.0)
    }

    /// iceoryx2's configuration for this domain.
    pub(crate) fn config(&self) -> Result<Config, PathTooLong> {
        // Nothing here may come from a file that happens to lie about: every value is iceoryx2's built-in default or ours.
        let mut config = Config::default();
        let (root, prefix) = (self.root(), self.prefix());
        let root_bytes = root.as_os_str().as_encoded_bytes();
        let suffix = config.global.service.event_connection_suffix.len();
        let length = root_bytes.len() + 1 + prefix.len() + ID_DIGITS_MAX + suffix;
        let too_long = || PathTooLong { domain: self.0.clone(), folder: root.clone(), length, limit: SOCKET_PATH_MAX };
        if length > SOCKET_PATH_MAX {
            return Err(too_long());
        }
        config.global.prefix = FileName::new(prefix.as_bytes()).map_err(|_| too_long())?;
        config.global.set_root_path(&Path::new(root_bytes).map_err(|_| too_long())?);
        Ok(config)
    }
}

impl DomainName {
    /// Name of the domain's folder in the runtime folder.
    pub(crate) fn folder_name(&self) -> OsString {
        OsString::from(self.to_string())
    }

    /// Name of the file, in the runtime folder, whose lock is the possession of the domain.
    pub(crate) fn lock_name(&self) -> OsString {
        OsString::from(format!("{self}.lock"))
    }
}

impl DomainName {
    /// The line that the living owner wrote, if there is one.
    pub(crate) fn owner(&self) -> Option<String> {
        let folder = runtime::open().ok()??.folder(&self.folder_name()).ok()?;
        match look(&folder, READY) {
            Seen::Alive(line) => Some(line),
            _ => None,
        }
    }

    /// The living processes of this domain with their process ids, as they wrote them down; the owner has none of the names.
    pub fn living(&self) -> Vec<(Option<Process>, String)> {
        let owner = self.owner().map(|line| (None, id_in(&line)));
        let folder = runtime::open().ok().flatten().and_then(|runtime| runtime.folder(&self.folder_name()).ok());
        let members = folder.and_then(|folder| folder.folder(OsStr::new(MEMBERS)).ok());
        let lives = |process: &Process| match look(members.as_ref()?, process.word()) {
            Seen::Alive(line) => Some((Some(*process), id_in(&line))),
            _ => None,
        };
        owner.into_iter().chain(Process::ALL.iter().filter_map(lives)).collect()
    }
}

/// The process id at the beginning of a line; `?` if there is none.
fn id_in(line: &str) -> String {
    let id = line.split_whitespace().next().filter(|id| id.parse::<u32>().is_ok());
    id.unwrap_or("?").to_string()
}

/// The longest path a socket may have (bytes): 108 in `sockaddr_un`, one of them the end. iceoryx2 copies longer ones beyond it.
const SOCKET_PATH_MAX: usize = 107;
/// Decimal digits of the number in a socket's name. Its highest 32 of 128 bits count what the process has made, never 65536 things.
const ID_DIGITS_MAX: usize = 34;
/// How long one waits for another of its kind: one that is just being stopped needs a moment.
const OTHER_ENDS: Duration = Duration::from_secs(1);

/// A process's membership in a domain.
pub struct Domain {
    name: DomainName,
    /// What the owner wrote when the domain was complete: another text is another owner.
    owner: String,
    pub(crate) node: Node<ipc::Service>,
    /// The folder as it was when we came: an heir makes another one.
    folder: Folder,
    members: Folder,
    /// What those wrote who were dead before we came: their end is nothing to us.
    dead_before: Vec<(Process, String)>,
    // After the node: who is seen to have left has left everything. Who only observes has none.
    life: Option<Life>,
}

impl Domain {
    /// Joins a domain as a process, the only one of its kind, waiting for its owner for a while.
    ///
    /// # Errors
    /// [`JoinError::NoOwner`] after `patience`; [`JoinError::Occupied`] while another one of its kind lives; others if files or shared
    /// memory do not work.
    pub fn join(name: &DomainName, process: Process, patience: Duration) -> Result<Self, JoinError> {
        Self::enter(name, Some(process), patience)
    }

    /// Joins a domain to look on: takes nobody's place and publishes nothing that a process of the domain publishes.
    ///
    /// # Errors
    /// As [`Domain::join`].
    pub fn observe(name: &DomainName, patience: Duration) -> Result<Self, JoinError> {
        Self::enter(name, None, patience)
    }

    fn enter(name: &DomainName, process: Option<Process>, patience: Duration) -> Result<Self, JoinError> {
        set_log_level(LogLevel::Error);
        let config = name.config()?;
        let until = Instant::now() + patience;
        loop {
            let runtime = runtime::open()?;
            let folder = runtime.and_then(|runtime| runtime.folder(&name.folder_name()).ok());
            if let Some(folder) = folder
                && let Seen::Alive(owner) = look(&folder, READY)
            {
                let entered = Self::enter_owned_by(owner.clone(), name, folder, process, &config);
                // Whoever owned it may have ended meanwhile, and with it gone whatever we made or looked for.
                match entered {
                    Ok(domain) if domain.owner_is_alive() => return Ok(domain),
                    Err(error) if name.owner() == Some(owner) => return Err(error),
                    _ => {}
                }
            }
            if Instant::now() >= until {
                return Err(JoinError::NoOwner { domain: name.to_string(), waited: patience });
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn enter_owned_by(
        owner: String,
        name: &DomainName,
        folder: Folder,
        process: Option<Process>,
        config: &Config,
    ) -> Result<Self, JoinError> {
        memory::check(&name.prefix())?;
        let path = folder.path().join(MEMBERS);
        let failed = |source| JoinError::File { path: path.clone(), source };
        let members = || folder.folder(OsStr::new(MEMBERS)).map_err(failed);
        // Numbers of processes return, and are not one's own in containers that share a folder; the time does not.
        let since = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos();
        let line = format!("{} {since}", std::process::id());
        let life = match process {
            None => None,
            Some(process) => match Life::begin(members()?, process.word(), &line, OTHER_ENDS).map_err(failed)? {
                // This one takes the place of one that died.
                Begun::Ours(life) => Some(life),
                Begun::Taken(line) => {
                    return Err(JoinError::Occupied { domain: name.to_string(), process, id: id_in(&line) });
                }
            },
        };
        let members = members()?;
        let dead = |other: &Process| match look(&members, other.word()) {
            Seen::Dead(line) => Some((*other, line)),
            _ => None,
        };
        let dead_before = Process::ALL.iter().filter_map(dead).collect();
        let node_name = process.map_or("observer", Process::word);
        let node = NodeBuilder::new()
            .name(&NodeName::new(node_name).expect("a process's word is a short name"))
            .config(config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|source| JoinError::Node { domain: name.to_string(), source })?;
        Ok(Self { name: name.clone(), owner, node, folder, members, dead_before, life })
    }

    /// Its name.
    pub fn name(&self) -> &DomainName {
        &self.name
    }

    /// Whether the owner that was there when we joined still is. A few system calls: not for every tick.
    pub fn owner_is_alive(&self) -> bool {
        matches!(look(&self.folder, READY), Seen::Alive(owner) if owner == self.owner)
    }

    /// The processes of this domain that were killed, broke down or ended badly since we came, until another one takes their place.
    /// Reads files: not for every tick.
    pub fn dead_processes(&self) -> Vec<Process> {
        let is_dead = |process: &Process| match look(&self.members, process.word()) {
            Seen::Dead(line) => !self.dead_before.contains(&(*process, line)),
            _ => false,
        };
        Process::ALL.iter().copied().filter(is_dead).collect()
    }

    /// From now on the end of this process is one that the others must hear of as if it had been killed.
    pub fn ends_badly(&self) {
        self.life.iter().for_each(Life::ends_badly);
    }

    /// A port with the memory that it and its connections need: nobody who fills shared memory later can end us by SIGBUS.
    fn committed<P>(&self, port: Result<P, PortError>) -> Result<P, PortError> {
        let port = port?;
        memory::commit(&self.name.prefix(), space::needed_bytes())?;
        Ok(port)
    }

    /// A publisher of a topic.
    ///
    /// # Errors
    /// When the service cannot be opened, others publish there already, or shared memory is full.
    pub fn publisher<T: Message>(&self, topic: Topic<T>) -> Result<Publisher<T>, PortError> {
        self.committed(Publisher::new(&self.node, topic))
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
        self.committed(Subscriber::new(&self.node, topic, robot, depth))
    }

    /// The publisher of a walking pattern of at most `max_phases` phases.
    ///
    /// # Errors
    /// As [`Domain::publisher`].
    pub fn pattern_publisher(&self, max_phases: usize) -> Result<PatternPublisher, PortError> {
        self.committed(PatternPublisher::new(&self.node, max_phases))
    }

    /// A subscriber to the walking pattern with memory for `max_phases` phases.
    ///
    /// # Errors
    /// As [`Domain::subscriber`].
    pub fn pattern_subscriber(&self, robot: Robot, max_phases: usize) -> Result<PatternSubscriber, PortError> {
        self.committed(PatternSubscriber::new(&self.node, robot, max_phases))
    }
}

//! What may go wrong, one enumeration per operation.

use iceoryx2::node::NodeCreationFailure;
use iceoryx2::port::listener::ListenerCreateError;
use iceoryx2::port::notifier::NotifierCreateError;
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::port::subscriber::SubscriberCreateError;
use iceoryx2::port::update_connections::ConnectionFailure;
use iceoryx2::service::builder::event::{EventCreateError, EventOpenError};
use iceoryx2::service::builder::publish_subscribe::{PublishSubscribeCreateError, PublishSubscribeOpenError};
use std::path::PathBuf;
use std::time::Duration;
use thiserror::Error;

/// A name that no domain can have.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("`{found}` cannot name a domain: use 1 to 32 lower-case letters, digits and `-`")]
pub struct DomainNameError {
    /// What was given.
    pub found: String,
}

/// A user, for people: its number, and its name if the system knows one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct User(pub u32);

impl std::fmt::Display for User {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let users = std::fs::read_to_string("/etc/passwd").unwrap_or_default();
        let name = users.lines().find_map(|line| {
            let mut fields = line.split(':');
            let (name, id) = (fields.next()?, fields.nth(1)?);
            (id.parse() == Ok(self.0)).then_some(name)
        });
        match name {
            Some(name) => write!(f, "user {} ({name})", self.0),
            None => write!(f, "user {}", self.0),
        }
    }
}

/// The runtime folder may not be used.
#[derive(Debug, Error)]
pub enum RuntimeError {
    /// The variable names no folder that can be made.
    #[error("SOLEUS_RUNTIME_DIR = \"{path}\": must be the absolute path of a folder for this user alone")]
    Name {
        /// What it names.
        path: PathBuf,
    },
    /// Something else is there, and it may have been put there on purpose.
    #[error("{path} is {found}, not a folder: remove it (`rm {path}`), or name another folder in SOLEUS_RUNTIME_DIR")]
    NoFolder {
        /// The runtime folder.
        path: PathBuf,
        /// What it is.
        found: &'static str,
    },
    /// It is somebody else's.
    #[error(
        "{path} belongs to {owner}, and we are {ours}: have it removed by its owner or root (`rm -r {path}`), or name a folder of \
your own in SOLEUS_RUNTIME_DIR"
    )]
    Foreign {
        /// The runtime folder.
        path: PathBuf,
        /// Whose it is.
        owner: User,
        /// Who we are.
        ours: User,
    },
    /// Others may look into it or change what is in it.
    #[error(
        "{path} has mode {mode:04o}, so that others may reach into it: look at what is in it, then `chmod 700 {path}` (in a systemd \
unit: RuntimeDirectoryMode=0700)"
    )]
    Mode {
        /// The runtime folder.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// Others may put another one in its place.
    #[error(
        "{path} can be replaced by others: {above} belongs to {owner} and has mode {mode:04o}; name a folder in SOLEUS_RUNTIME_DIR above \
which only root and this user may write"
    )]
    Above {
        /// The runtime folder.
        path: PathBuf,
        /// The folder above it in which others may write.
        above: PathBuf,
        /// Whose that is.
        owner: User,
        /// Its permissions.
        mode: u32,
    },
    /// It cannot be opened or made.
    #[error("cannot use {path} for the files of all domains (SOLEUS_RUNTIME_DIR, else /tmp/soleus-UID)")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// The path of a domain's sockets would be longer than the system allows.
#[derive(Debug, Error, PartialEq, Eq)]
#[error(
    "domain `{domain}`: the paths of its sockets in {folder} would have up to {length} bytes, and the system allows {limit}: choose a \
shorter --domain or a shorter SOLEUS_RUNTIME_DIR"
)]
pub struct PathTooLong {
    /// The domain.
    pub domain: String,
    /// Its folder.
    pub folder: PathBuf,
    /// How long they may become.
    pub length: usize,
    /// How long they may be.
    pub limit: usize,
}

/// Shared memory of a domain may not be used.
#[derive(Debug, Error)]
pub enum MemoryError {
    /// A file of somebody else has a name of ours.
    #[error(
        "{path} blocks a name of this domain and belongs to {owner}, and we are {ours}: have it removed by its owner or root \
(`rm {path}`), or choose another --domain"
    )]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Whose it is.
        owner: User,
        /// Who we are.
        ours: User,
    },
    /// Somebody cut a file to nothing that every process needs.
    #[error(
        "{path} was cut to nothing while the domain is in use: stop all that uses this domain; the next start makes it anew"
    )]
    Truncated {
        /// The file.
        path: PathBuf,
    },
    /// There is not enough of it.
    #[error(
        "shared memory is nearly full: /dev/shm has {} MB left and a domain takes up to {} MB; remove what fills it, or let root \
enlarge it (`mount -o remount,size=1G /dev/shm`; in a container: --shm-size=1g)",
        free_bytes / 1_000_000, needed_bytes.div_ceil(1_000_000)
    )]
    Full {
        /// What is left.
        free_bytes: u64,
        /// What is needed.
        needed_bytes: u64,
    },
    /// A file cannot be made or removed.
    #[error("cannot use {path}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// A service could not be created or opened.
#[derive(Debug, Error)]
pub enum ServiceError {
    /// Creating failed; with a domain of one's own this means that shared memory is full or not permitted.
    #[error("cannot create shared memory for topic `{topic}` (is /dev/shm full, or memory limited by `ulimit -v`?)")]
    Create {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: PublishSubscribeCreateError,
    },
    /// Creating the wake-up event failed.
    #[error("cannot create the wake-up event of topic `{topic}` (is /dev/shm full, or memory limited by `ulimit -v`?)")]
    CreateEvent {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: EventCreateError,
    },
    /// Opening failed: the owner is gone or was built with other messages.
    #[error(
        "cannot open topic `{topic}`: the owner of the domain is gone, or was built from another version of the messages"
    )]
    Open {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: PublishSubscribeOpenError,
    },
    /// Opening the wake-up event failed.
    #[error("cannot open the wake-up event of topic `{topic}`: the owner of the domain is gone, or of another version")]
    OpenEvent {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: EventOpenError,
    },
}

/// A domain could not be taken into possession.
#[derive(Debug, Error)]
pub enum OwnerError {
    /// Somebody owns it.
    #[error("domain `{domain}` is in use by process {owner}: choose another with --domain, or stop that process")]
    InUse {
        /// The domain.
        domain: String,
        /// Process id of the owner as it wrote it down; `?` if it has not yet.
        owner: String,
    },
    /// A file or folder of the domain could not be made or removed.
    #[error("cannot prepare {path}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Its paths would be too long.
    #[error(transparent)]
    PathTooLong(#[from] PathTooLong),
    /// The runtime folder may not be used.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// Shared memory may not be used.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// iceoryx2 could not start.
    #[error("cannot start iceoryx2 in domain `{domain}` (is /dev/shm full, or memory limited by `ulimit -v`?)")]
    Node {
        /// The domain.
        domain: String,
        /// What iceoryx2 says.
        source: NodeCreationFailure,
    },
    /// A service could not be created.
    #[error(transparent)]
    Service(#[from] ServiceError),
}

/// A domain could not be joined.
#[derive(Debug, Error)]
pub enum JoinError {
    /// Nobody owns it.
    #[error(
        "no owner of domain `{domain}` appeared within {} s: start `soleus-launch serve --domain {domain}`, or a scenario",
        waited.as_secs_f64()
    )]
    NoOwner {
        /// The domain.
        domain: String,
        /// How long we waited.
        waited: Duration,
    },
    /// There is one already.
    #[error(
        "a living {process} (process {id}) is in domain `{domain}` already, and two would both be obeyed: stop that one (`kill {id}`), or \
choose another --domain"
    )]
    Occupied {
        /// The domain.
        domain: String,
        /// What we wanted to be.
        process: messages::code::Process,
        /// The process id that the other wrote down; `?` if it has not.
        id: String,
    },
    /// The file that says that we live could not be made.
    #[error("cannot make {path}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Its paths would be too long.
    #[error(transparent)]
    PathTooLong(#[from] PathTooLong),
    /// The runtime folder may not be used.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// Shared memory may not be used.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// iceoryx2 could not start.
    #[error("cannot start iceoryx2 in domain `{domain}` (is /dev/shm full, or memory limited by `ulimit -v`?)")]
    Node {
        /// The domain.
        domain: String,
        /// What iceoryx2 says.
        source: NodeCreationFailure,
    },
}

/// A publisher or subscriber could not be made.
#[derive(Debug, Error)]
pub enum PortError {
    /// Its service could not be opened.
    #[error(transparent)]
    Service(#[from] ServiceError),
    /// There is no shared memory for it.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The publisher could not be made.
    #[error(
        "cannot publish on `{topic}` (does another process publish there already, is /dev/shm full, or memory limited by `ulimit -v`?)"
    )]
    Publisher {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: PublisherCreateError,
    },
    /// The subscriber could not be made.
    #[error("cannot subscribe to `{topic}` (too many subscribers?)")]
    Subscriber {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: SubscriberCreateError,
    },
    /// The notifier could not be made.
    #[error("cannot wake others on `{topic}`")]
    Notifier {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: NotifierCreateError,
    },
    /// The listener could not be made.
    #[error("cannot be woken on `{topic}` (too many listeners?)")]
    Listener {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: ListenerCreateError,
    },
}

/// A message could not be published.
#[derive(Debug, Error)]
pub enum PublishError {
    /// No memory for it.
    #[error("no shared memory for a message on `{topic}`")]
    Loan {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: iceoryx2::port::LoanError,
    },
    /// It could not be delivered.
    #[error("cannot send on `{topic}`")]
    Send {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: iceoryx2::port::SendError,
    },
    /// Late joiners could not be served.
    #[error("cannot connect late joiners of `{topic}`")]
    Connect {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: ConnectionFailure,
    },
    /// The pattern has more phases than consumers have memory for.
    #[error("the pattern has {found} phases, more than the {limit} its consumers can hold")]
    PatternTooLong {
        /// Number of phases.
        found: usize,
        /// Largest number allowed.
        limit: usize,
    },
}

/// A message could not be received.
#[derive(Debug, Error)]
pub enum ReceiveError {
    /// The subscriber is broken.
    #[error("cannot receive from `{topic}`")]
    Receive {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: iceoryx2::port::ReceiveError,
    },
    /// Waiting is not possible.
    #[error("cannot wait for `{topic}`")]
    Wait {
        /// The topic.
        topic: &'static str,
    },
    /// For as long as one was ready to wait, all that came was about another robot.
    #[error(
        "what comes on `{topic}` is about another robot (fingerprint {found:016x}, ours is {expected:016x}): give all processes the same robot folder"
    )]
    OtherRobot {
        /// The topic.
        topic: &'static str,
        /// Fingerprint of our robot.
        expected: u64,
        /// Fingerprint in the latest message.
        found: u64,
    },
    /// The pattern is longer than we have memory for.
    #[error(
        "a pattern of {found} phases arrived, more than the {limit} there is memory for: raise max_phases or plan shorter"
    )]
    PatternTooLong {
        /// Number of phases.
        found: usize,
        /// Largest number.
        limit: usize,
    },
}

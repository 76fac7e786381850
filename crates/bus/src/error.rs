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

/// A service could not be created or opened.
#[derive(Debug, Error)]
pub enum ServiceError {
    /// Creating failed; with a domain of one's own this means that shared memory is full or not permitted.
    #[error("cannot create shared memory for topic `{topic}` (is /dev/shm full?)")]
    Create {
        /// The topic.
        topic: &'static str,
        /// What iceoryx2 says.
        source: PublishSubscribeCreateError,
    },
    /// Creating the wake-up event failed.
    #[error("cannot create the wake-up event of topic `{topic}` (is /dev/shm full?)")]
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
    /// The path is too long for iceoryx2.
    #[error("{path} is too long a path for shared memory: choose a shorter domain name")]
    PathTooLong {
        /// Which.
        path: PathBuf,
    },
    /// iceoryx2 could not start.
    #[error("cannot start iceoryx2 in domain `{domain}`")]
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
    /// The file that says that we live could not be made.
    #[error("cannot make {path}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The path is too long for iceoryx2.
    #[error("{path} is too long a path for shared memory: choose a shorter domain name")]
    PathTooLong {
        /// Which.
        path: PathBuf,
    },
    /// iceoryx2 could not start.
    #[error("cannot start iceoryx2 in domain `{domain}`")]
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
    /// The publisher could not be made.
    #[error("cannot publish on `{topic}` (does another process publish there already?)")]
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

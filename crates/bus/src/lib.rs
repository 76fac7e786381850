//! The messages over iceoryx2 shared memory.
//!
//! A **domain** is one system on one host: its name gives a root folder and a prefix of its own to everything iceoryx2 makes, so
//! that two domains do not see each other, whatever files lie in the working directory (the configuration is always explicit).
//!
//! One process, the [`Owner`], creates every service of [`messages::topic`] and stays alive; all others [`Domain::join`] and only
//! open. The reason was measured: a process killed while it *creates* a service leaves it broken for ever, one killed while it
//! uses it does not. The owner holds a lock on the domain, wipes what the dead left behind after taking it, and leaves nothing.
//!
//! Who lives is told by locks too: the owner and each kind of process hold that of a file in the domain's folder until they end, so that
//! there is one living process of a kind at most: two controllers would both be obeyed. One that ends in order removes its file; one that
//! was killed, panicked or said that it [ends badly](Domain::ends_badly) leaves it, for the others to find ([`Domain::dead_processes`])
//! until another process takes its place. iceoryx2 knows of dead nodes as well, but only until somebody has freed what they held, which
//! each process that comes or goes does. Whoever publishes without the lock is heard by nobody while the first publisher lives.
//!
//! Nothing here is shared with other users of the host. The runtime folder ([`runtime_folder`]) must be a real folder, ours, with mode
//! 0700; it is used by handle, and no link in it is followed. Shared memory has mode 0600; a file of somebody else that has a name of
//! ours is an error that says whose it is. How a process in another language finds all of this, a [`Contract`] says.
//!
//! Topics have safe overflow: a publisher never waits for anybody, a slow subscriber loses its oldest messages and counts them by
//! the sequence numbers. [`Subscriber::wait`] sleeps until it is woken by an event of the same name; it never
//! spins, for the core it would spin on is the one that the other process needs.
//! A kept message (walking pattern, health) reaches those who come later as long as its publisher lives and now and then calls
//! [`Publisher::serve_late_joiners`].
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use bus::{Domain, DomainName, Owner, Robot};
//! use messages::{Header, RobotState, code::Process, topic};
//! use std::time::Duration;
//!
//! let name: DomainName = format!("example-{}", std::process::id()).parse()?;
//! let owner = Owner::claim(&name)?;
//! let domain = Domain::join(&name, Process::Simulator, Duration::from_secs(1))?;
//! let onlooker = Domain::observe(&name, Duration::from_secs(1))?;
//! let mut states = onlooker.subscriber(topic::ROBOT_STATE, Robot::Any, 4)?;
//! let mut publisher = domain.publisher(topic::ROBOT_STATE)?;
//! publisher.publish(&RobotState { header: Header::new(12, 7), ..RobotState::default() })?;
//! let heard = states.wait(Duration::from_secs(1))?.expect("it was just said");
//! assert_eq!((heard.header.tick, heard.header.sequence), (12, 0));
//! # drop((owner, states, publisher, domain, onlooker));
//! # Ok(())
//! # }
//! ```
//!
//! Not covered: other hosts; several publishers of one topic at a time.

mod contract;
mod domain;
mod error;
mod folder;
mod life;
mod memory;
mod owner;
mod pattern;
mod publisher;
mod runtime;
mod service;
mod sleep;
mod space;
mod subscriber;

pub use contract::Contract;
pub use domain::{Domain, DomainName};
pub use error::{
    DomainNameError, JoinError, MemoryError, OwnerError, PathTooLong, PortError, PublishError, ReceiveError,
    RuntimeError, ServiceError, User,
};
pub use owner::{Owner, remove_abandoned};
pub use pattern::{Pattern, PatternPublisher, PatternSubscriber};
pub use publisher::Publisher;
pub use runtime::{RUNTIME_VARIABLE, runtime_folder};
pub use subscriber::{Counts, Robot, Subscriber};

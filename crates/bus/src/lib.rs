//! The messages over iceoryx2 shared memory.
//!
//! A **domain** is one system on one host: its name gives a root folder and a prefix of its own to everything iceoryx2 makes, so
//! that two domains do not see each other, whatever files lie in the working directory (the configuration is always explicit).
//!
//! One process, the [`Owner`], creates every service of [`messages::topic`] and stays alive; all others [`Domain::join`] and only
//! open. The reason was measured: a process killed while it *creates* a service leaves it broken for ever, one killed while it
//! uses it does not. The owner holds a lock on the domain, wipes what the dead left behind after taking it, and leaves nothing.
//!
//! Who lives is told by locks too: owner and processes each hold that of a file of their own in the domain's folder until they end. One
//! that ends in order removes its file; one that was killed, panicked or said that it [ends badly](Domain::ends_badly) leaves it, for
//! the others to find ([`Domain::dead_processes`]) until another process takes its place. iceoryx2 knows of dead nodes as well, but only
//! until somebody has freed what they held, which each process that comes or goes does.
//!
//! Topics have safe overflow: a publisher never waits for anybody, a slow subscriber loses its oldest messages and counts them by
//! the sequence numbers. [`Subscriber::wait`] spins for a moment, then sleeps until it is woken by an event of the same name.
//! A kept message (walking pattern, health) reaches those who come later as long as its publisher lives and now and then calls
//! [`Publisher::serve_late_joiners`].
//!
//! Not covered: other hosts; several publishers of one topic at a time (the sequence numbers would show it as gaps).

mod domain;
mod error;
mod life;
mod owner;
mod pattern;
mod publisher;
mod service;
mod subscriber;

pub use domain::{Domain, DomainName};
pub use error::{DomainNameError, JoinError, OwnerError, PortError, PublishError, ReceiveError, ServiceError};
pub use owner::{Owner, remove_abandoned};
pub use pattern::{Pattern, PatternPublisher, PatternSubscriber};
pub use publisher::Publisher;
pub use subscriber::{Counts, Robot, Subscriber};

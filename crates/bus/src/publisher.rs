//! Publishing one topic.

use crate::error::{PortError, PublishError};
use crate::service;
use crate::sleep::clock_monotonic_ns;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::*;
use messages::{Message, Topic};

/// The publisher of a topic. Publishing never waits for anybody.
pub struct Publisher<T: Message> {
    // The ports go before the service they belong to.
    publisher: iceoryx2::port::publisher::Publisher<ipc::Service, T, ()>,
    notifier: Option<Notifier<ipc::Service>>,
    topic: Topic<T>,
    sequence: u64,
    sent_ns: u64,
}

impl<T: Message> Publisher<T> {
    pub(crate) fn new(node: &Node<ipc::Service>, topic: Topic<T>) -> Result<Self, PortError> {
        let name = topic.name();
        let service = service::open(node, topic)?;
        let create = || service.publisher_builder().max_loaned_samples(1).create();
        // The place of a publisher that died without leaving is free once the dead are reaped.
        let publisher = create().or_else(|_| {
            node.try_cleanup_dead_nodes();
            create()
        });
        let publisher = publisher.map_err(|source| PortError::Publisher { topic: name, source })?;
        let notifier = notifier(node, topic)?;
        Ok(Self { publisher, notifier, topic, sequence: 0, sent_ns: 0 })
    }

    /// Publishes a message; its sequence number is set here. Returns it.
    ///
    /// One small heap allocation (48 bytes, inside iceoryx2) per call.
    ///
    /// # Errors
    /// When shared memory is used up: somebody holds on to messages.
    pub fn publish(&mut self, message: &T) -> Result<u64, PublishError> {
        let topic = self.topic.name();
        let sample = self.publisher.loan_uninit().map_err(|source| PublishError::Loan { topic, source })?;
        let mut sample = sample.write_payload(*message);
        sample.payload_mut().header_mut().sequence = self.sequence;
        sample.send().map_err(|source| PublishError::Send { topic, source })?;
        self.sequence += 1;
        self.sent_ns = clock_monotonic_ns();
        wake(&self.notifier);
        Ok(self.sequence - 1)
    }

    /// When the last message was there for everybody (ns, `CLOCK_MONOTONIC`), before anybody was woken for it: who is woken may have the
    /// higher priority, and run before [`Publisher::publish`] comes back. Zero before the first.
    pub fn sent_ns(&self) -> u64 {
        self.sent_ns
    }

    /// Gives kept messages to those who subscribed since the last call; publishing does so too.
    ///
    /// # Errors
    /// When connecting fails.
    pub fn serve_late_joiners(&self) -> Result<(), PublishError> {
        let topic = self.topic.name();
        self.publisher.update_connections().map_err(|source| PublishError::Connect { topic, source })?;
        Ok(())
    }
}

pub(crate) fn notifier<T>(
    node: &Node<ipc::Service>,
    topic: Topic<T>,
) -> Result<Option<Notifier<ipc::Service>>, PortError> {
    let topic_name = topic.name();
    let Some(event) = service::open_event(node, &topic.row)? else { return Ok(None) };
    let create = || event.notifier_builder().create();
    let notifier = create().or_else(|_| {
        node.try_cleanup_dead_nodes();
        create()
    });
    notifier.map(Some).map_err(|source| PortError::Notifier { topic: topic_name, source })
}

/// Wakes those who wait. One that cannot be woken looks by itself after a while (`subscriber::SLICE`): not an error.
pub(crate) fn wake(notifier: &Option<Notifier<ipc::Service>>) {
    if let Some(notifier) = notifier {
        let _ = notifier.notify();
    }
}

//! The services of a domain: their limits, their making, their opening.

use crate::error::ServiceError;
use iceoryx2::prelude::*;
use iceoryx2::service::Service;
use iceoryx2::service::dynamic_config::publish_subscribe::DynamicConfig;
use iceoryx2::service::port_factory::{event, publish_subscribe};
use messages::topic::{Element, Row, Visitor};
use messages::{Message, PatternHeader, PatternPhase, Topic};
use std::any::Any;

/// Publishers per topic: one, and one that is being started again while the other is not yet seen as dead.
pub(crate) const MAX_PUBLISHERS: usize = 2;
/// Subscribers per topic: four processes, recorder, launcher, and two observers.
pub(crate) const MAX_SUBSCRIBERS: usize = 8;
/// Processes per domain, with some that died and are not yet reaped.
const MAX_NODES: usize = 24;
/// Messages a subscriber may let wait: 0.64 s, so that a recorder survives a slow disk.
pub(crate) const MAX_DEPTH: usize = 128;

pub(crate) type Messages<T> = publish_subscribe::PortFactory<ipc::Service, T, ()>;
pub(crate) type Phases = publish_subscribe::PortFactory<ipc::Service, [PatternPhase], PatternHeader>;
pub(crate) type Events = event::PortFactory<ipc::Service>;

/// Opens the service of a topic.
pub(crate) fn open<T: Message>(node: &Node<ipc::Service>, topic: Topic<T>) -> Result<Messages<T>, ServiceError> {
    let row = topic.row;
    node.service_builder(&service_name(&row))
        .publish_subscribe::<T>()
        .open()
        .map_err(|source| ServiceError::Open { topic: row.name, source })
}

/// Opens the service of the walking pattern.
pub(crate) fn open_pattern(node: &Node<ipc::Service>, row: &Row) -> Result<Phases, ServiceError> {
    node.service_builder(&service_name(row))
        .publish_subscribe::<[PatternPhase]>()
        .user_header::<PatternHeader>()
        .open()
        .map_err(|source| ServiceError::Open { topic: row.name, source })
}

/// Opens the wake-up event of a topic; `None` if it has none.
pub(crate) fn open_event(node: &Node<ipc::Service>, row: &Row) -> Result<Option<Events>, ServiceError> {
    if !row.wakes {
        return Ok(None);
    }
    let event = node.service_builder(&service_name(row)).event().open();
    event.map(Some).map_err(|source| ServiceError::OpenEvent { topic: row.name, source })
}

/// All services of a domain, kept open by its owner.
pub(crate) struct Services(#[expect(dead_code, reason = "kept so that the services live")] Vec<Box<dyn Any>>);

/// Creates the service of every topic.
pub(crate) fn create_all(node: &Node<ipc::Service>) -> Result<Services, ServiceError> {
    let mut creator = Creator { node, kept: Vec::new() };
    messages::topic::visit(&mut creator)?;
    Ok(Services(creator.kept))
}

struct Creator<'a> {
    node: &'a Node<ipc::Service>,
    kept: Vec<Box<dyn Any>>,
}

impl Visitor for Creator<'_> {
    type Error = ServiceError;

    fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), ServiceError> {
        let row = topic.row;
        let service = self
            .node
            .service_builder(&service_name(&row))
            .publish_subscribe::<T>()
            .max_publishers(MAX_PUBLISHERS)
            .max_subscribers(MAX_SUBSCRIBERS)
            .max_nodes(MAX_NODES)
            .history_size(row.kept as usize)
            .subscriber_max_buffer_size(MAX_DEPTH)
            .subscriber_max_borrowed_samples(2)
            .enable_safe_overflow(true)
            .create()
            .map_err(|source| ServiceError::Create { topic: row.name, source })?;
        self.kept.push(Box::new(service));
        self.event(&row)
    }

    fn slice<H: Message, E: Element>(&mut self, topic: Topic<H>) -> Result<(), ServiceError> {
        let row = topic.row;
        let service = self
            .node
            .service_builder(&service_name(&row))
            .publish_subscribe::<[E]>()
            .user_header::<H>()
            .max_publishers(MAX_PUBLISHERS)
            .max_subscribers(MAX_SUBSCRIBERS)
            .max_nodes(MAX_NODES)
            .history_size(row.kept as usize)
            .subscriber_max_buffer_size(1)
            .subscriber_max_borrowed_samples(2)
            .enable_safe_overflow(true)
            .create()
            .map_err(|source| ServiceError::Create { topic: row.name, source })?;
        self.kept.push(Box::new(service));
        self.event(&row)
    }
}

impl Creator<'_> {
    fn event(&mut self, row: &Row) -> Result<(), ServiceError> {
        if row.wakes {
            let event = self
                .node
                .service_builder(&service_name(row))
                .event()
                .max_notifiers(MAX_PUBLISHERS)
                .max_listeners(MAX_SUBSCRIBERS)
                .max_nodes(MAX_NODES)
                .disable_deadline()
                .create()
                .map_err(|source| ServiceError::CreateEvent { topic: row.name, source })?;
            self.kept.push(Box::new(event));
        }
        Ok(())
    }
}

fn service_name(row: &Row) -> ServiceName {
    ServiceName::new(row.name).expect("the table of topics holds short names only")
}

/// Whether a publisher is still there, and its process alive: what one asks who hears another one. Reads files.
pub(crate) fn publisher_lives(
    config: &Config,
    publishers: &DynamicConfig<<ipc::Service as Service>::Bag>,
    publisher: u128,
) -> bool {
    let mut node_id = None;
    publishers.list_publishers(|details| {
        if details.publisher_id.value() != publisher {
            return CallbackProgression::Continue;
        }
        node_id = Some(details.node_id);
        CallbackProgression::Stop
    });
    let Some(node_id) = node_id else { return false };
    let mut lives = false;
    let listed = Node::<ipc::Service>::list(config, |state| {
        lives |= *state.node_id() == node_id && !matches!(state, NodeState::Dead(_));
        CallbackProgression::Continue
    });
    // Where it cannot be known, the first one keeps the word.
    lives || listed.is_err()
}

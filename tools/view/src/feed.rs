//! From the domain to the hub.

use crate::hub::{Hub, Sample};
use bus::{Domain, Robot, Subscriber};
use messages::topic::{self, Element, Topic, Visitor};
use messages::{Message, RobotCommand, RobotState, SoleContact, Truth};
use recording::{
    CONTACT, Encoder, JOINT_STATES, ROBOT_DESCRIPTION, SCENE, TRANSFORMS, Viewer, ViewerSettings, ViewerTopic,
};
use std::any::Any;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

/// Topics that are made for viewers; those of the domain come after them, in the order of the table.
const MADE: [ViewerTopic; 5] = [ROBOT_DESCRIPTION, TRANSFORMS, JOINT_STATES, SCENE, CONTACT];
const DESCRIPTION_AT: usize = 0;
const TRANSFORMS_AT: usize = 1;
const JOINTS_AT: usize = 2;
const SCENE_AT: usize = 3;
const CONTACT_AT: usize = 4;

/// All topics that viewers can have.
pub fn topics() -> Vec<ViewerTopic> {
    struct Each(Vec<ViewerTopic>);
    impl Visitor for Each {
        type Error = Infallible;
        fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), Infallible> {
            self.0.push(Encoder::<T>::topic(topic.name()));
            Ok(())
        }
        fn slice<H: Message, E: Element>(&mut self, _: Topic<H>) -> Result<(), Infallible> {
            Ok(())
        }
    }
    let mut each = Each(MADE.to_vec());
    let Ok(()) = topic::visit(&mut each);
    each.0
}

/// Subscribers to all topics of a domain. Each keeps one message: the latest.
pub struct Ears(Vec<Box<dyn Ear>>);

impl Ears {
    /// Subscribes.
    ///
    /// # Errors
    /// If a topic has as many subscribers as it can.
    pub fn new(domain: &Domain) -> anyhow::Result<Self> {
        struct Each<'a>(&'a Domain, Vec<Box<dyn Ear>>);
        impl Visitor for Each<'_> {
            type Error = anyhow::Error;
            fn message<T: Message>(&mut self, topic: Topic<T>) -> anyhow::Result<()> {
                let place = MADE.len() + self.1.len();
                let subscriber = self.0.subscriber(topic, Robot::Any, 1)?;
                self.1.push(Box::new(OfMessages { subscriber, encoder: Encoder::new()?, place }));
                Ok(())
            }
            fn slice<H: Message, E: Element>(&mut self, _: Topic<H>) -> anyhow::Result<()> {
                Ok(())
            }
        }
        let mut each = Each(domain, Vec::new());
        topic::visit(&mut each)?;
        Ok(Self(each.1))
    }
}

trait Ear {
    /// Takes the latest message, if one came; shows it to `see`, and passes it on if somebody wants it.
    fn hear(&mut self, hub: &Hub, time_ns: u64, see: &mut dyn FnMut(&dyn Any)) -> anyhow::Result<()>;
}

struct OfMessages<T: Message> {
    subscriber: Subscriber<T>,
    encoder: Encoder<T>,
    place: usize,
}

impl<T: Message> Ear for OfMessages<T> {
    fn hear(&mut self, hub: &Hub, time_ns: u64, see: &mut dyn FnMut(&dyn Any)) -> anyhow::Result<()> {
        let Some(message) = self.subscriber.latest()? else { return Ok(()) };
        see(&message);
        if hub.is_wanted(self.place) {
            let mut content = Vec::new();
            self.encoder.put(&message, &mut content);
            hub.put(self.place, Sample { time_ns, content: Arc::new(content) });
        }
        Ok(())
    }
}

/// Makes what viewers show.
pub struct Feed {
    hub: Arc<Hub>,
    viewer: Viewer,
    seen: Seen,
}

/// What was heard in a turn.
#[derive(Default)]
struct Seen {
    truth: Option<Truth>,
    contact: Option<SoleContact>,
    state: Option<RobotState>,
    command: Option<RobotCommand>,
    /// Whether the domain has a truth at all: a real robot has none.
    has_truth: bool,
}

impl Feed {
    /// For a robot.
    ///
    /// # Errors
    /// None today.
    pub fn new(settings: ViewerSettings, hub: Arc<Hub>) -> anyhow::Result<Self> {
        let viewer = Viewer::new(settings);
        let mut content = Vec::new();
        viewer.put_description(&mut content);
        hub.put(DESCRIPTION_AT, Sample { time_ns: now_ns(), content: Arc::new(content) });
        Ok(Self { hub, viewer, seen: Seen::default() })
    }

    /// Takes what came, and passes on what is wanted.
    ///
    /// # Errors
    /// If a subscriber is broken.
    pub fn pass_on(&mut self, ears: &mut Ears) -> anyhow::Result<()> {
        let time_ns = now_ns();
        for ear in &mut ears.0 {
            ear.hear(&self.hub, time_ns, &mut |message| self.seen.take(message))?;
        }
        if let Some(contact) = self.seen.contact.take().filter(|_| self.hub.is_wanted(CONTACT_AT)) {
            let mut content = Vec::new();
            self.viewer.put_contact(&contact, time_ns, &mut content);
            self.hub.put(CONTACT_AT, Sample { time_ns, content: Arc::new(content) });
        }
        let measured = !self.seen.has_truth;
        let Some(truth) = self.seen.robot() else { return Ok(()) };
        // Without truth there are no forces and soles to be drawn.
        let places = [(TRANSFORMS_AT, true), (JOINTS_AT, true), (SCENE_AT, !measured)];
        let mut contents = places.map(|(place, can)| (can && self.hub.is_wanted(place)).then(Vec::new));
        self.viewer.put_truth(&truth, time_ns, contents.each_mut().map(Option::as_mut));
        for ((place, _), content) in places.into_iter().zip(contents) {
            let content = content.map(|content| Sample { time_ns, content: Arc::new(content) });
            content.into_iter().for_each(|sample| self.hub.put(place, sample));
        }
        Ok(())
    }
}

impl Seen {
    fn take(&mut self, message: &dyn Any) {
        if let Some(truth) = message.downcast_ref() {
            (self.truth, self.has_truth) = (Some(*truth), true);
        } else if let Some(contact) = message.downcast_ref() {
            self.contact = Some(*contact);
        } else if let Some(state) = message.downcast_ref() {
            self.state = Some(*state);
        } else if let Some(command) = message.downcast_ref() {
            self.command = Some(*command);
        }
    }

    /// Where the robot is: the truth, or, of a real robot, its joints on the base that the controller plans.
    fn robot(&mut self) -> Option<Truth> {
        if self.has_truth {
            return self.truth.take();
        }
        let (state, command) = (self.state.take()?, self.command.as_ref()?);
        Some(Truth {
            header: state.header,
            joint_count: state.joint_count,
            joint_position_rad: state.joint_position_rad,
            joint_velocity_rad_per_s: state.joint_velocity_rad_per_s,
            base_position_m: command.plan.base_position_m,
            base_rotation: command.plan.base_rotation,
            sole_position_m: command.plan.feet.map(|foot| foot.ankle_position_m),
            sole_rotation: command.plan.feet.map(|foot| foot.ankle_rotation),
            ..Truth::default()
        })
    }
}

/// Universal time (ns).
fn now_ns() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(now.as_nanos()).unwrap_or(u64::MAX)
}

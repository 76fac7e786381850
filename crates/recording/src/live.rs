//! What viewers show, message by message: for those that look at a living robot.

use crate::encode::encode;
use crate::error::SchemaError;
use crate::plan::{FOXGLOVE, Plan, SOLEUS};
use crate::ros;
use crate::viewer::{Viewer, ViewerSettings};
use messages::{Message, SoleContact, Truth};
use std::marker::PhantomData;

/// What a viewer must know of a topic to read its messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewerTopic {
    /// Its name.
    pub name: &'static str,
    /// Name of the schema.
    pub schema_name: &'static str,
    /// What the schema is written in: `protobuf` (a descriptor set), `ros2msg`.
    pub schema_encoding: &'static str,
    /// The schema.
    pub schema: &'static [u8],
    /// What the messages are written in: `protobuf`, `cdr`.
    pub encoding: &'static str,
}

const fn foxglove(name: &'static str, schema_name: &'static str) -> ViewerTopic {
    ViewerTopic { name, schema_name, schema_encoding: PROTOBUF, schema: FOXGLOVE, encoding: PROTOBUF }
}

const fn ros(name: &'static str, (schema_name, schema): (&'static str, &'static str)) -> ViewerTopic {
    let (schema_encoding, encoding) = (ros::SCHEMA_ENCODING, ros::ENCODING);
    ViewerTopic { name, schema_name, schema_encoding, schema: schema.as_bytes(), encoding }
}

pub(crate) const PROTOBUF: &str = "protobuf";

/// The URDF, once.
pub const ROBOT_DESCRIPTION: ViewerTopic = ros("/robot_description", ros::STRING);
/// Every link in its parent; base and soles in `world`.
pub const TRANSFORMS: ViewerTopic = foxglove("/tf", "foxglove.FrameTransforms");
/// Positions, rates and torques by joint name.
pub const JOINT_STATES: ViewerTopic = ros("/joint_states", ros::JOINT_STATE);
/// Soles, forces, centre of mass, zero-moment point.
pub const SCENE: ViewerTopic = foxglove("/scene", "foxglove.SceneUpdate");
/// Contact forces that the estimator sees.
pub const CONTACT: ViewerTopic = foxglove("/scene/contact", "foxglove.SceneUpdate");
/// What happens.
pub const LOG: ViewerTopic = foxglove("/log", "foxglove.Log");

impl Viewer {
    /// The message of [`ROBOT_DESCRIPTION`].
    pub fn put_description(&self, out: &mut Vec<u8>) {
        ros::put_string(self.urdf(), out);
    }

    /// The messages of [`TRANSFORMS`], [`JOINT_STATES`] and [`SCENE`] at a time, each appended where it is wanted.
    pub fn put_truth(&mut self, truth: &Truth, time_ns: u64, [transforms, joints, scene]: [Option<&mut Vec<u8>>; 3]) {
        self.look_at(truth);
        transforms.into_iter().for_each(|out| self.transforms(truth, time_ns, out));
        joints.into_iter().for_each(|out| self.joints(time_ns, out));
        scene.into_iter().for_each(|out| self.scene(truth, time_ns, out));
    }

    /// The message of [`CONTACT`].
    pub fn put_contact(&self, contact: &SoleContact, time_ns: u64, out: &mut Vec<u8>) {
        self.contact(contact, time_ns, out);
    }

    /// What it was made with.
    pub fn settings(&self) -> &ViewerSettings {
        &self.settings
    }
}

/// Messages of one kind as recordings hold them.
pub struct Encoder<T> {
    plan: Plan,
    bytes: Vec<u8>,
    message: PhantomData<fn() -> T>,
}

impl<T: Message> Encoder<T> {
    /// For messages of this kind.
    ///
    /// # Errors
    /// If the schema is not that of the messages: a bug, which a test finds.
    pub fn new() -> Result<Self, SchemaError> {
        Ok(Self { plan: Plan::new(T::SHAPE)?, bytes: Vec::new(), message: PhantomData })
    }

    /// What a viewer must know of its topic.
    #[must_use]
    pub fn topic(name: &'static str) -> ViewerTopic {
        let (schema_encoding, encoding) = (PROTOBUF, PROTOBUF);
        ViewerTopic { name, schema_name: T::WIRE_NAME, schema_encoding, schema: SOLEUS, encoding }
    }

    /// Appends a message.
    pub fn put(&mut self, message: &T, out: &mut Vec<u8>) {
        self.bytes.clear();
        message.write_bytes(&mut self.bytes);
        encode(&self.plan, &self.bytes, out);
    }
}

//! Why a text is no robot.

use spatial::InertiaError;

/// Why a text is not a robot, or a name is not one of its names.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The text is not XML. Remedy: check the place with an XML linter.
    #[error("the URDF is not well-formed XML near line {line}")]
    Xml {
        /// Line, from 1.
        line: usize,
        /// What the XML reader says.
        source: quick_xml::Error,
    },
    /// The document is XML, but its root element is not `robot`.
    #[error("{}, a URDF has <robot>", if .found.is_empty() { "the file has no element".to_owned() } else { format!("the root element is <{found}>") })]
    NotARobot {
        /// Name of the root element, empty if there is none.
        found: String,
    },
    /// A second element stands beside `<robot>`. Remedy: one robot per file.
    #[error("a second root element, <{second}>, near line {line}: a URDF has one <robot> and no element beside it")]
    SeveralElements {
        /// Name of the second one.
        second: String,
        /// Line, from 1.
        line: usize,
    },
    /// Macros are not expanded here. Remedy: run `xacro` first and give its output.
    #[error("<{element}> is a macro; expand the file with xacro first")]
    Macro {
        /// The first macro element found.
        element: String,
    },
    /// A link or joint lacks a required element or attribute, or holds something that is not a number.
    #[error("{item} is not readable as URDF")]
    Unreadable {
        /// Which one.
        item: Item,
        /// What `urdf-rs` says.
        source: urdf_rs::UrdfError,
    },
    /// What should be a number, or three of them, is not. Remedy: numbers have a decimal point and no unit, and spaces between them.
    #[error("{item}: <{element} {attribute}=\"{found}\">: {expected} expected")]
    Number {
        /// Which one.
        item: Item,
        /// The element in it.
        element: String,
        /// The element's attribute.
        attribute: String,
        /// Its value.
        found: String,
        /// What it should be.
        expected: &'static str,
    },
    /// The robot has no link.
    #[error("the robot has no link")]
    NoLink,
    /// Two links or two joints have one name.
    #[error("there are two of {0}; names must be unique")]
    Duplicate(Item),
    /// A joint refers to a link that does not exist.
    #[error("joint `{joint}` refers to link `{link}`, which does not exist{}", suggestion(.nearest))]
    UnknownLink {
        /// The joint.
        joint: String,
        /// The link it names as parent or child.
        link: String,
        /// The most similar existing link.
        nearest: Option<String>,
    },
    /// A link is the child of two joints: not a tree. Remedy: cut the loop; closed chains are not modelled.
    #[error("link `{link}` is the child of joint `{first}` and of joint `{second}`; only trees are modelled")]
    TwoParents {
        /// The link.
        link: String,
        /// One joint.
        first: String,
        /// Another joint.
        second: String,
    },
    /// Following parents from this link leads back to it.
    #[error("joint `{joint}` closes a cycle through link `{link}`")]
    Cycle {
        /// A link on the cycle.
        link: String,
        /// The joint above it.
        joint: String,
    },
    /// More than one link has no parent. Remedy: join them or remove the unused ones.
    #[error("{} links have no parent joint ({}); there must be exactly one root", .roots.len(), .roots.join(", "))]
    SeveralRoots {
        /// The links without a parent.
        roots: Vec<String>,
    },
    /// Only fixed, revolute, continuous and prismatic joints are modelled.
    #[error("joint `{joint}` is of type {kind}; fixed, revolute, continuous and prismatic joints are modelled")]
    UnsupportedJoint {
        /// The joint.
        joint: String,
        /// Its type in the file.
        kind: &'static str,
    },
    /// The axis of a movable joint has no direction.
    #[error("joint `{joint}` has an axis of length {length}")]
    Axis {
        /// The joint.
        joint: String,
        /// Length of the axis in the file.
        length: f64,
    },
    /// A revolute or prismatic joint has no `<limit>`. Remedy: add one, or make the joint `continuous`, or lock it.
    #[error("joint `{joint}` is revolute or prismatic but has no <limit>; add one, declare it continuous, or lock it")]
    MissingLimits {
        /// The joint.
        joint: String,
    },
    /// The limits exclude every motion, or a largest speed or effort is negative.
    #[error("joint `{joint}`: {quantity} limits {lower} .. {upper} exclude everything")]
    ImpossibleLimits {
        /// The joint.
        joint: String,
        /// `position`, `velocity` or `effort`.
        quantity: &'static str,
        /// Lower limit (rad, m and their rates; N m, N).
        lower: f64,
        /// Upper limit.
        upper: f64,
    },
    /// A number is NaN or infinite.
    #[error("{item}: {field} is not a finite number")]
    NotFinite {
        /// Where.
        item: Item,
        /// Which number.
        field: &'static str,
    },
    /// A number no robot has; most often millimetres or grams were meant.
    #[error("{item}: {field} is {value}, more than {limit}; metres, kilograms and radians are expected")]
    Absurd {
        /// Where.
        item: Item,
        /// Which number.
        field: &'static str,
        /// Its value (SI).
        value: f64,
        /// The largest value accepted (SI).
        limit: f64,
    },
    /// More movable joints than dense matrices can serve.
    #[error("{found} movable joints, at most {limit} are accepted; lock the ones that do not move")]
    TooManyJoints {
        /// Movable joints in the file.
        found: usize,
        /// The largest number accepted.
        limit: usize,
    },
    /// No body can have this mass distribution. Remedy: correct the link's `<inertial>`, or tolerate it.
    #[error("link `{link}` cannot exist: {cause}")]
    Inertia {
        /// The link.
        link: String,
        /// What is wrong with it.
        cause: InertiaError,
    },
    /// A floating robot needs mass somewhere.
    #[error("no link of the robot has mass, so nothing determines how its floating base moves")]
    NoMass,
    /// A joint mimics one that does not exist. Remedy: correct the name, or remove the `<mimic>`.
    #[error("joint `{joint}` mimics joint `{leader}`, which does not exist{}", suggestion(.nearest))]
    UnknownLeader {
        /// The joint.
        joint: String,
        /// The joint it names.
        leader: String,
        /// The most similar existing joint.
        nearest: Option<String>,
    },
    /// A follower leaves its limits wherever its leader may be. Remedy: correct the limits, or multiplier and offset.
    #[error(
        "joint `{joint}` follows joint `{leader}` and needs it within {} .. {}, but that one is limited to {} .. {}",
        .needed[0], .needed[1], .allowed[0], .allowed[1]
    )]
    MimicLimits {
        /// The follower.
        joint: String,
        /// The joint that it follows.
        leader: String,
        /// Positions of the leader at which the follower is within its limits (rad, m).
        needed: [f64; 2],
        /// The leader's own limits, or what other followers left of them (rad, m).
        allowed: [f64; 2],
    },
    /// A follower cannot stand still while its leader moves. Remedy: lock the leader.
    #[error(
        "joint `{joint}` is locked but follows joint `{leader}`, which is not; lock `{leader}`, its followers stay with it"
    )]
    LockedFollower {
        /// The follower.
        joint: String,
        /// The joint that it follows.
        leader: String,
    },
    /// A follower was asked for where only a joint with a coordinate makes sense. Remedy: name its leader.
    #[error("joint `{joint}` follows joint `{leader}` and has no coordinate of its own; name `{leader}` instead")]
    Follows {
        /// The follower.
        joint: String,
        /// The joint that it follows.
        leader: String,
    },
    /// A joint that was asked for or locked does not exist.
    #[error("there is no joint `{name}`{}", suggestion(.nearest))]
    UnknownJoint {
        /// The name asked for.
        name: String,
        /// The most similar existing joint.
        nearest: Option<String>,
    },
    /// A frame that was asked for does not exist.
    #[error("there is no frame `{name}`{}", suggestion(.nearest))]
    UnknownFrame {
        /// The name asked for.
        name: String,
        /// The most similar existing frame.
        nearest: Option<String>,
    },
    /// Joints that follow each other in a circle.
    #[error("joint `{joint}` mimics itself through other joints")]
    MimicCycle {
        /// One of them.
        joint: String,
    },
}

/// A named part of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Item {
    /// A link.
    Link(String),
    /// A joint.
    Joint(String),
    /// The document itself.
    Document,
}

impl std::fmt::Display for Item {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Link(name) => write!(f, "link `{name}`"),
            Self::Joint(name) => write!(f, "joint `{name}`"),
            Self::Document => write!(f, "the document"),
        }
    }
}

fn suggestion(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

/// The most similar of the known names, if any is similar at all.
pub(crate) fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    const SIMILAR: f64 = 0.7;
    known
        .map(|candidate| (strsim::jaro_winkler(name, candidate), candidate))
        .filter(|(similarity, _)| *similarity > SIMILAR)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate.to_owned())
}

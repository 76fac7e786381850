//! What the estimator answers.

use friction::ContactState;
use nalgebra::Vector2;
use spatial::{Mat6, Transform, Twist, Vec3, Wrench};

/// What ended a search that found no pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The points' states run in circles: friction far above one, or Poisson's ratio near a half.
    Circling,
    /// Newton's iterations ran out, or led nowhere.
    Steps,
    /// The tick has cost what it may ([`EstimatorSettings::multiplications_max`](super::EstimatorSettings::multiplications_max)).
    Work,
    /// A pose was found, but the contact laws, checked from the compliance, do not hold there.
    Laws,
    /// The tangent is singular: the pose has no rate.
    Singular,
}

/// Outcome of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Status {
    /// No stance: the foot is in the air.
    InAir,
    /// Solved.
    Converged,
    /// Solved, but tilted so far that linear elasticity is doubtful.
    DoubtfulTilt {
        /// Angle between sole and ground (rad).
        tilt_rad: f64,
    },
    /// Solved, little tilted, but pressed so far that linear elasticity is doubtful.
    DoubtfulCompression {
        /// [`StanceReport::compression`].
        part: f64,
    },
    /// Without friction position and heading are free: no unique pose.
    Indeterminate,
    /// The vertical force is not positive.
    NoLoad {
        /// Vertical force wanted (N).
        normal_n: f64,
    },
    /// The horizontal force exceeds the friction available.
    OutsideFrictionCone {
        /// Horizontal force wanted (N).
        tangential_n: f64,
        /// Largest one allowed (N).
        limit_n: f64,
    },
    /// The ZMP lies outside the contact points, undeformed at the last pose as well as where they were at the last tick (a tilted
    /// sole's edge that sticks is further out than its undeformed projection).
    ZmpOutsideSole {
        /// Distance beyond the outermost point (m).
        by_m: f64,
    },
    /// The vertical force is below what rounding of this sole's forces leaves room for: no digit of an answer would be right.
    TooLight {
        /// Vertical force wanted (N).
        normal_n: f64,
        /// Least force that is solved for (N).
        least_n: f64,
    },
    /// There is no pose on the way: the curve of equilibria from the last load carried to this one turns back, and is solved on both sides of
    /// where it does. At full load that is the fold of the first tick, whose references turn with the sole (35): see the crate. (Another
    /// curve may carry the load, tilted by tens of degrees; no load leads there.) The history stays that of the last load carried; every
    /// later tick tries again from there, so a stance recovers as soon as its load allows.
    Fold {
        /// ZMP of the last load that was carried (m).
        reached_zmp_m: Vector2<f64>,
        /// Part of the way to the wanted load.
        fraction: f64,
    },
    /// No pose was found, which does not say that there is none. History as with [`Status::Fold`].
    NotFound {
        /// What ended the search.
        cause: Cause,
    },
    /// NaN or infinite input; nothing was touched.
    InvalidInput,
}

impl Status {
    /// Is the report's pose the answer to this tick's reference?
    #[must_use]
    pub fn is_solved(&self) -> bool {
        matches!(self, Self::Converged | Self::DoubtfulTilt { .. } | Self::DoubtfulCompression { .. })
    }
}

/// Answer of a tick. When the status is not solved, pose, forces and derivatives are those of the last solved tick.
#[derive(Debug, Clone, PartialEq)]
pub struct StanceReport {
    /// Outcome.
    pub status: Status,
    /// Pose `X_WS` of the sole frame.
    pub sole_pose: Transform,
    /// Velocity of the sole's origin and angular velocity, world axes.
    pub twist: Twist,
    /// Acceleration of the sole's origin and angular acceleration, world axes.
    pub acceleration: Twist,
    /// Pose of the ankle frame (axes of the foot).
    pub ankle_pose: Transform,
    /// At the ankle, world axes.
    pub ankle_twist: Twist,
    /// At the ankle, world axes.
    pub ankle_acceleration: Twist,
    /// Wrench of the ground on the sole about the sole's origin, world axes.
    pub wrench: Wrench,
    /// ZMP reached (m).
    pub zmp: Vector2<f64>,
    /// How far the ZMP asked for lies inside the contact points (m), negative outside: the room there was before solving, whatever came
    /// of it. The fold of the first tick may come before the edge. None before
    /// a load was asked for that could be looked at.
    pub zmp_margin_m: Option<f64>,
    /// Horizontal force asked for over what friction allows, `|F_t| / (mu F_n)` with the largest coefficient of all points. None as
    /// the margin.
    pub friction_use: Option<f64>,
    /// Vertical moment about the ZMP (N m).
    pub moment_z_nm: f64,
    /// How far the points in contact lie below their undeformed places, on average, as a part of the sole's thickness; 0 for a sole of
    /// unknown thickness.
    pub compression: f64,
    /// Rate of the wrench (about the sole's moving origin, world axes) with the pose (position, rotation vector in the world),
    /// at frozen node states. Negative definite in essence: deeper means more force.
    pub tangent: Mat6,
    /// Inverse of the tangent: pose change per wrench change.
    pub compliance: Mat6,
    /// World positions of the contact points (m).
    pub node_positions: Vec<Vec3>,
    /// World forces on the contact points (N).
    pub node_forces: Vec<Vec3>,
    /// States of the contact points.
    pub node_states: Vec<ContactState>,
    /// Scaled residual of force and moments, see [`EstimatorSettings::tolerance`](super::EstimatorSettings::tolerance).
    pub residual: f64,
    /// Largest violation of the contact laws, from the compliance (N), see `friction`'s scaled residual.
    pub law_violation_n: f64,
    /// Newton iterations, all attempts together.
    pub iterations: usize,
    /// Multiplications of this tick, the measure of its work; 0 where nothing was computed.
    pub multiplications: u64,
    /// Newton from the last tick had not found the answer. It, or that there is none, was found by ways that may take many
    /// periods, and that allocate.
    pub slow: bool,
    /// Points that are open.
    pub open: usize,
    /// Points that stick.
    pub sticking: usize,
    /// Points that slip.
    pub slipping: usize,
    /// Points that landed and lifted during the iterations.
    pub landings: usize,
    /// See `landings`.
    pub lift_offs: usize,
    /// Ticks since the reported pose was solved.
    pub age_ticks: u32,
}

impl StanceReport {
    pub(super) fn new(points: usize) -> Self {
        Self {
            status: Status::InAir,
            sole_pose: Transform::identity(),
            twist: Twist::zero(),
            acceleration: Twist::zero(),
            ankle_pose: Transform::identity(),
            ankle_twist: Twist::zero(),
            ankle_acceleration: Twist::zero(),
            wrench: Wrench::zero(),
            zmp: Vector2::zeros(),
            zmp_margin_m: None,
            friction_use: None,
            moment_z_nm: 0.0,
            compression: 0.0,
            tangent: Mat6::zeros(),
            compliance: Mat6::zeros(),
            node_positions: vec![Vec3::zeros(); points],
            node_forces: vec![Vec3::zeros(); points],
            node_states: vec![ContactState::Open; points],
            residual: 0.0,
            law_violation_n: 0.0,
            iterations: 0,
            multiplications: 0,
            slow: false,
            open: points,
            sticking: 0,
            slipping: 0,
            landings: 0,
            lift_offs: 0,
            age_ticks: 0,
        }
    }
}

//! The deformation estimator: force and zero-moment point in, pose of the deformed sole out, once per control tick.

use crate::SoleModel;
use crate::equilibrium::{End, Equilibrium, Limits, Target, Work};
use nalgebra::Vector2;
use spatial::{Mat3, Mat6, Transform, Twist, Vec3, Vec6, Wrench, so3};
use std::sync::Arc;

/// What a contact point does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NodeState {
    /// Off the ground.
    #[default]
    Free,
    /// On the ground, where it was at the tick before.
    Stick,
    /// On the ground and sliding, its friction at the bound.
    Slip,
}

/// Where a foot lands: position of the sole's origin on the ground and heading, world.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Foothold {
    /// Forward (m).
    pub x_m: f64,
    /// Left (m).
    pub y_m: f64,
    /// About the vertical (rad).
    pub yaw_rad: f64,
}

/// Order of the Euler angles whose yaw is held at the first tick (35). It matters by 0.2-0.4 mm at a corner of the sole.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EulerOrder {
    /// `R = Rz(yaw) Ry(pitch) Rx(roll)`.
    #[default]
    YawPitchRoll,
    /// `R = Rx(roll) Ry(pitch) Rz(yaw)`: the order of the co-author's public code.
    RollPitchYaw,
}

impl EulerOrder {
    /// Rotation with the roll and pitch of `r` and the given yaw.
    pub(crate) fn with_yaw(self, r: &Mat3, yaw_rad: f64) -> Mat3 {
        match self {
            Self::YawPitchRoll => so3::about_z(yaw_rad - r[(1, 0)].atan2(r[(0, 0)])) * r,
            Self::RollPitchYaw => r * so3::about_z(yaw_rad - (-r[(0, 1)]).atan2(r[(0, 0)])),
        }
    }

    /// Derivative of [`EulerOrder::with_yaw`] when `r` turns with the angular velocity `w`.
    pub(crate) fn with_yaw_rate(self, r: &Mat3, yaw_rad: f64, w: &Vec3) -> Mat3 {
        let held = self.with_yaw(r, yaw_rad);
        match self {
            Self::YawPitchRoll => {
                let yaw = r[(1, 0)].atan2(r[(0, 0)]);
                let tangent = -r[(2, 0)] / r[(0, 0)].hypot(r[(1, 0)]);
                let yaw_rate = w.z + tangent * (yaw.cos() * w.x + yaw.sin() * w.y);
                so3::about_z(yaw_rad - yaw) * so3::skew(w) * r - yaw_rate * so3::skew(&Vec3::z()) * held
            }
            Self::RollPitchYaw => {
                let roll = (-r[(1, 2)]).atan2(r[(2, 2)]);
                let cosine = r[(1, 2)].hypot(r[(2, 2)]);
                let yaw_rate = (roll.cos() * w.z - roll.sin() * w.y) / cosine;
                so3::skew(w) * held - yaw_rate * held * so3::skew(&Vec3::z())
            }
        }
    }
}

/// Limits and tolerances of the estimator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatorSettings {
    /// Largest residual: force over the load, moment about the ZMP over 0.1 m times the load. 1e-12 is reachable at any load; a
    /// rounding floor applies below about 0.1 N.
    pub tolerance: f64,
    /// Time from tick to tick (s): the references' rates over it predict the next pose, from which the iteration starts. Has no
    /// influence on the answer beyond the tolerance.
    pub period_s: f64,
    /// Newton iterations per attempt.
    pub iterations_max: usize,
    /// Newton iterations in all when the direct attempt fails and the load is followed step by step. 0: never.
    pub continuation_iterations_max: usize,
    /// `|F_t| > friction_use_max * mu F_n` is refused. Near 1 the sliding distance diverges (31 mm at 0.9999).
    pub friction_use_max: f64,
    /// Tilt beyond which linear elasticity is doubtful (rad); reported, not refused.
    pub tilt_doubtful_rad: f64,
    /// [`StanceReport::compression`] beyond which linear elasticity is doubtful; reported, not refused. At 0.1 the stress of confined
    /// Neo-Hookean foam, `mu (l - 1/l) + lambda ln l / l` with `l = 0.9`, is 11 % above Hooke's: as much as at the limit of the tilt.
    pub compression_doubtful: f64,
    /// See [`EulerOrder`].
    pub euler_order: EulerOrder,
}

impl Default for EstimatorSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-9,
            period_s: 0.005,
            iterations_max: 60,
            continuation_iterations_max: 800,
            friction_use_max: 0.99,
            tilt_doubtful_rad: 5.0_f64.to_radians(),
            compression_doubtful: 0.1,
            euler_order: EulerOrder::default(),
        }
    }
}

/// What the ground must do to one foot at this tick: the pattern's plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StanceReference {
    /// Force of the ground on the sole, world (N).
    pub force: Vec3,
    /// Its rate (N/s).
    pub force_rate: Vec3,
    /// Its second rate (N/s^2).
    pub force_acceleration: Vec3,
    /// Zero-moment point on the ground, world (m), its rate and second rate.
    pub zmp: [Vector2<f64>; 3],
}

impl StanceReference {
    /// Constant force and ZMP.
    #[must_use]
    pub fn constant(force: Vec3, zmp: Vector2<f64>) -> Self {
        let zero = Vector2::zeros();
        Self { force, force_rate: Vec3::zeros(), force_acceleration: Vec3::zeros(), zmp: [zmp, zero, zero] }
    }

    fn is_finite(&self) -> bool {
        self.force
            .iter()
            .chain(self.force_rate.iter())
            .chain(self.force_acceleration.iter())
            .chain(self.zmp.iter().flat_map(|z| z.iter()))
            .all(|x| x.is_finite())
    }
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
    /// No pose carries this load: following it from the last one that was carried stops on the way. At full load that is the fold of
    /// the first tick, whose references turn with the sole (35): see the crate.
    Fold {
        /// ZMP of the last load that was carried (m).
        reached_zmp_m: Vector2<f64>,
        /// Part of the way to the wanted load.
        fraction: f64,
    },
    /// Iteration limit.
    NotConverged,
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
    pub node_states: Vec<NodeState>,
    /// Scaled residual of force and moments, see [`EstimatorSettings::tolerance`].
    pub residual: f64,
    /// Largest violation of the contact laws, from the compliance (N), see `friction`'s scaled residual.
    pub law_violation_n: f64,
    /// Newton iterations, all attempts together.
    pub iterations: usize,
    /// Points off, sticking, sliding.
    pub free: usize,
    /// See `free`.
    pub sticking: usize,
    /// See `free`.
    pub sliding: usize,
    /// Points that landed and lifted during the iterations.
    pub landings: usize,
    /// See `landings`.
    pub lift_offs: usize,
    /// Ticks since the reported pose was solved.
    pub age_ticks: u32,
}

impl StanceReport {
    fn new(points: usize) -> Self {
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
            moment_z_nm: 0.0,
            compression: 0.0,
            tangent: Mat6::zeros(),
            compliance: Mat6::zeros(),
            node_positions: vec![Vec3::zeros(); points],
            node_forces: vec![Vec3::zeros(); points],
            node_states: vec![NodeState::Free; points],
            residual: 0.0,
            law_violation_n: 0.0,
            iterations: 0,
            free: points,
            sticking: 0,
            sliding: 0,
            landings: 0,
            lift_offs: 0,
            age_ticks: 0,
        }
    }
}

/// Finds the pose of one sole from the load it must carry, tick by tick, with the contact's history.
///
/// Depends on the references since touch-down alone: a second estimator given the same stance agrees to the bit.
#[derive(Debug, Clone)]
pub struct StanceEstimator {
    settings: EstimatorSettings,
    equilibrium: Equilibrium,
    report: StanceReport,
    in_stance: bool,
    last: Target,
    hull: Vec<Vector2<f64>>,
    friction_max: f64,
    positions: Vec<Vec3>,
    forces: Vec<Vec3>,
}

// For half and double see `equilibrium`: the same measure, the same 2123 ticks of hard cases.

/// Largest turn (rad) from one load to the next that is believed without following the load in smaller steps: 3 degrees, more than a foot
/// tilts in walking. An insurance that costs a twentieth of all iterations: half +5 %, double -4 %, without it -5 % and no other
/// answer. (With steps of 10 mm instead of 2.5 Newton did once leap, by 24 degrees, to where no path of loads led.)
const LEAP_RAD: f64 = 0.06;
/// `K_c` is rebuilt when the contact laws are off by more than this fraction of the load, or the tolerance if that is larger. Seven times
/// what rounding leaves over 100,000 ticks at a tolerance of 1e-12 (1.4e-12). Half and double: no difference.
const REFRESH: f64 = 1e-11;
/// A tick is solved when the contact laws hold to this many times what was asked of Newton, whose own measure differs from the laws' by
/// less (a factor of at most `sqrt(2) (1 + mu)`).
const ACCEPTED: f64 = 10.0;
/// Iterations per step, first and smallest step of the continuation. Half -22, -6, +6 %, double +42, +6, -6 %: what they cost is spent
/// before a fold is reported, whose place the last one resolves.
const CONTINUATION_ITERATIONS: usize = 25;
const CONTINUATION_FIRST: f64 = 0.25;
const CONTINUATION_LAST: f64 = 1.0 / 1024.0;

/// What is done when the contact laws, checked from the compliance, do not hold as well as asked for.
#[derive(Clone, Copy, PartialEq)]
enum Repair {
    /// One more step: Newton's own measure was just met, the laws' measure not.
    Step,
    /// `K_c` anew from the compliance, and every point looked at: it had drifted, or the screening missed a point.
    Refresh,
}

impl StanceEstimator {
    /// In the air.
    #[must_use]
    pub fn new(model: impl Into<Arc<SoleModel>>, settings: EstimatorSettings) -> Self {
        let model = model.into();
        let n = model.contact_points().len();
        let zero = Target { force: [Vec3::zeros(); 3], zmp: [Vector2::zeros(); 3] };
        Self {
            settings,
            report: StanceReport::new(n),
            in_stance: false,
            last: zero,
            hull: sole_mesh::convex_hull(model.contact_points().iter().map(|p| p.xy())),
            friction_max: model.friction().iter().copied().fold(0.0, f64::max),
            positions: vec![Vec3::zeros(); n],
            forces: vec![Vec3::zeros(); n],
            equilibrium: Equilibrium::new(model, settings.euler_order),
        }
    }

    /// The sole.
    #[must_use]
    pub fn model(&self) -> &SoleModel {
        self.equilibrium.model()
    }

    /// The report of the last tick.
    #[must_use]
    pub fn report(&self) -> &StanceReport {
        &self.report
    }

    /// A stance begins at this foothold: history starts anew (35).
    pub fn touch_down(&mut self, foothold: Foothold) {
        self.equilibrium.begin(foothold);
        self.in_stance = true;
        // The continuation, if one is needed, starts from a centred vertical load.
        let centre = self.model().contact_points().iter().sum::<Vec3>() / self.model().contact_points().len() as f64;
        let zero = Vector2::zeros();
        self.last = Target { force: [Vec3::z(), Vec3::zeros(), Vec3::zeros()], zmp: [zero; 3] };
        self.last.zmp[0] = self.equilibrium.pose.point(&centre).xy();
        self.report.sole_pose = self.equilibrium.pose;
        self.report.twist = Twist::zero();
        self.report.acceleration = Twist::zero();
        let points = self.equilibrium.model().contact_points();
        for (position, p) in self.report.node_positions.iter_mut().zip(points) {
            *position = self.equilibrium.pose.point(p);
        }
        self.place_ankle();
    }

    /// Continues a stance from the tangential positions that all contact points had at the previous tick and a pose to start
    /// from (for tools that hold such a history; a controller never needs it).
    pub fn resume(&mut self, pose: Transform, previous_m: &[Vector2<f64>]) {
        assert_eq!(previous_m.len(), self.positions.len(), "one previous position per contact point");
        self.touch_down(Foothold { x_m: pose.translation.x, y_m: pose.translation.y, yaw_rad: 0.0 });
        self.equilibrium.begin_from(pose, previous_m);
        for (position, previous) in self.report.node_positions.iter_mut().zip(previous_m) {
            *position = Vec3::new(previous.x, previous.y, 0.0);
        }
    }

    /// The stance is over; the report keeps the take-off pose.
    pub fn lift_off(&mut self) {
        self.in_stance = false;
        self.report.status = Status::InAir;
        self.report.wrench = Wrench::zero();
        self.report.twist = Twist::zero();
        self.report.acceleration = Twist::zero();
        self.report.node_forces.fill(Vec3::zeros());
        self.report.node_states.fill(NodeState::Free);
    }

    /// One tick.
    pub fn step(&mut self, reference: &StanceReference) -> &StanceReport {
        self.report.iterations = 0;
        let status = self.check(reference).unwrap_or_else(|| self.solve(reference));
        if !status.is_solved() {
            self.report.age_ticks += 1;
        }
        self.report.status = status;
        &self.report
    }

    /// Reasons not to try.
    fn check(&self, reference: &StanceReference) -> Option<Status> {
        if !reference.is_finite() {
            return Some(Status::InvalidInput);
        }
        if !self.in_stance {
            return Some(Status::InAir);
        }
        let (tangential_n, normal_n) = (reference.force.xy().norm(), reference.force.z);
        if normal_n <= 0.0 {
            return Some(Status::NoLoad { normal_n });
        }
        if self.friction_max == 0.0 {
            return Some(Status::Indeterminate);
        }
        let limit_n = self.settings.friction_use_max * self.friction_max * normal_n;
        if tangential_n > limit_n {
            return Some(Status::OutsideFrictionCone { tangential_n, limit_n });
        }
        let pose = self.equilibrium.pose;
        let by_m = crate::hull::distance_outside(
            self.hull.iter().map(|p| pose.point(&Vec3::new(p.x, p.y, 0.0)).xy()),
            self.report.node_positions.iter().map(Vec3::xy),
            &reference.zmp[0],
        );
        if by_m > 0.0 {
            return Some(Status::ZmpOutsideSole { by_m });
        }
        None
    }

    fn solve(&mut self, reference: &StanceReference) -> Status {
        let target =
            Target { force: [reference.force, reference.force_rate, reference.force_acceleration], zmp: reference.zmp };
        self.equilibrium.work = Work::default();
        self.equilibrium.save();
        let limits = Limits { tolerance: self.settings.tolerance, iterations: self.settings.iterations_max };
        let mut failure = None;
        let predicted = self.equilibrium.predict(self.settings.period_s);
        let mut end = self.equilibrium.newton(&target, &limits, predicted == Some(true));
        if end != End::Converged && predicted.is_some() {
            self.equilibrium.restore();
            end = self.equilibrium.newton(&target, &limits, false);
        }
        // Beyond a fold the linear sole may have further equilibria, tilted by tens of degrees: a large turn within one tick must be
        // one that the load leads to.
        let leapt = end == End::Converged && self.equilibrium.turned_since_saved() > LEAP_RAD;
        if end != End::Converged || leapt {
            failure = self.follow(&target);
        }
        if failure.is_none() {
            failure = self.finish(&target, &limits);
        }
        self.report.iterations = self.equilibrium.work.iterations;
        if let Some(status) = failure {
            self.equilibrium.restore();
            return status;
        }
        self.last = target;
        let tilt_rad = self.report.sole_pose.rotation[(2, 2)].clamp(-1.0, 1.0).acos();
        let part = self.report.compression;
        if tilt_rad > self.settings.tilt_doubtful_rad {
            Status::DoubtfulTilt { tilt_rad }
        } else if part > self.settings.compression_doubtful {
            Status::DoubtfulCompression { part }
        } else {
            Status::Converged
        }
    }

    /// Follows the load from the last one carried; says where that stops.
    fn follow(&mut self, target: &Target) -> Option<Status> {
        let budget = self.settings.continuation_iterations_max;
        if budget == 0 {
            return Some(Status::NotConverged);
        }
        self.equilibrium.restore();
        let mut from = self.last;
        if self.equilibrium.is_first() {
            // The same load, vertical and centred: scale does not change where the fold is by much, direction does.
            from.force[0] = Vec3::new(0.0, 0.0, target.force[0].z);
        }
        let limits = Limits {
            tolerance: self.settings.tolerance,
            iterations: self.settings.iterations_max.min(CONTINUATION_ITERATIONS),
        };
        let spent = self.equilibrium.work.iterations;
        let (mut reached, mut step) = (0.0, CONTINUATION_FIRST);
        let mut good = self.equilibrium.clone_state();
        while reached < 1.0 {
            if self.equilibrium.work.iterations > spent + budget {
                return Some(Status::NotConverged);
            }
            let next = f64::min(reached + step, 1.0);
            let before = self.equilibrium.pose.rotation;
            let end = self.equilibrium.newton(&from.between(target, next), &limits, false);
            let turned = so3::log(&(self.equilibrium.pose.rotation * before.transpose())).norm();
            if end == End::Converged && turned < LEAP_RAD {
                reached = next;
                step *= 1.5;
                good = self.equilibrium.clone_state();
            } else {
                self.equilibrium.return_to(&good);
                step *= 0.5;
                if step < CONTINUATION_LAST {
                    let limit = from.between(target, reached);
                    return Some(Status::Fold { reached_zmp_m: limit.zmp[0], fraction: reached });
                }
            }
        }
        None
    }

    /// Checks the laws from the compliance, differentiates, commits and reports.
    fn finish(&mut self, target: &Target, limits: &Limits) -> Option<Status> {
        let load = target.force[0].norm();
        let mut violation = self.equilibrium.settle(&mut self.positions, &mut self.forces);
        for repair in [Repair::Step, Repair::Refresh] {
            if violation <= load * REFRESH.max(self.settings.tolerance) {
                break;
            }
            if repair == Repair::Refresh {
                self.equilibrium.refresh();
            }
            self.equilibrium.screening = repair == Repair::Step;
            let end = self.equilibrium.newton(target, limits, false);
            self.equilibrium.screening = true;
            match (end, repair) {
                (End::Converged, _) => violation = self.equilibrium.settle(&mut self.positions, &mut self.forces),
                (_, Repair::Step) => self.equilibrium.restore(),
                (_, Repair::Refresh) => return Some(Status::NotConverged),
            }
        }
        let asked_n = (load * self.settings.tolerance.max(REFRESH)).max(self.equilibrium.floor_n);
        // Written so that what is not a number is not accepted.
        let holds = violation <= ACCEPTED * asked_n;
        if !holds {
            return Some(Status::NotConverged);
        }
        let residual = self.equilibrium.work.residual;
        let Some((velocity, acceleration)) = self.equilibrium.rates(target) else {
            return Some(Status::NotConverged);
        };
        let fixed = self.equilibrium.tangent;
        self.equilibrium.commit(&self.positions);
        let (force, moment) = self.equilibrium.wrench();
        let report = &mut self.report;
        report.sole_pose = self.equilibrium.pose;
        report.twist = Twist::from_vector(&velocity);
        report.acceleration = Twist::from_vector(&acceleration);
        report.wrench = Wrench { force, moment };
        let o = report.sole_pose.translation;
        // Moment about the world's point under the origin: M_O + O x F.
        let about = moment + Vec3::new(0.0, 0.0, o.z).cross(&force);
        report.zmp = Vector2::new(o.x - about.y / force.z, o.y + about.x / force.z);
        let arm = Vec3::new(report.zmp.x - o.x, report.zmp.y - o.y, 0.0);
        report.moment_z_nm = about.z - arm.cross(&force).z;
        report.compression = self.equilibrium.compression();
        report.tangent = about_moving_origin(&fixed, &force);
        report.compliance = inverse(&report.tangent);
        report.node_positions.copy_from_slice(&self.positions);
        report.node_forces.copy_from_slice(&self.forces);
        report.node_states.copy_from_slice(&self.equilibrium.states);
        report.residual = residual;
        report.law_violation_n = violation;
        let count = |state| report.node_states.iter().filter(|s| **s == state).count();
        (report.free, report.sticking, report.sliding) =
            (count(NodeState::Free), count(NodeState::Stick), count(NodeState::Slip));
        report.landings = self.equilibrium.work.landings;
        report.lift_offs = self.equilibrium.work.lift_offs;
        report.age_ticks = 0;
        self.place_ankle();
        None
    }

    /// The ankle moves rigidly with the sole's clamped face (34).
    fn place_ankle(&mut self) {
        let report = &mut self.report;
        let arm = report.sole_pose.rotation * self.equilibrium.model().ankle_in_sole_m();
        report.ankle_pose = Transform::new(report.sole_pose.rotation, report.sole_pose.translation + arm);
        report.ankle_twist = report.twist.at(&arm);
        let w = report.twist.angular;
        report.ankle_acceleration = report.acceleration.at(&arm);
        report.ankle_acceleration.linear += w.cross(&w.cross(&arm));
    }
}

/// The moment's reference point moves with the sole: `dM = dM_fixed - dO x F`.
pub(crate) fn about_moving_origin(fixed: &Mat6, force: &Vec3) -> Mat6 {
    let mut out = *fixed;
    let mut view = out.fixed_view_mut::<3, 3>(3, 0);
    view += so3::skew(force);
    out
}

/// Inverse of a 6 x 6 matrix that mixes lengths and angles; zero when singular.
fn inverse(matrix: &Mat6) -> Mat6 {
    let mut out = Mat6::zeros();
    for i in 0..6 {
        let mut unit = Vec6::zeros();
        unit[i] = 1.0;
        if let Some(column) = crate::equilibrium::scaled_solve(matrix, &unit) {
            out.set_column(i, &column);
        }
    }
    out
}

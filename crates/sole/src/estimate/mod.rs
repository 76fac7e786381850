//! The deformation estimator: force and zero-moment point in, pose of the deformed sole out, once per control tick.

mod follow;
mod report;
mod stance;

pub use report::{Cause, StanceReport, Status};
pub use stance::{EstimatorSettings, Foothold, StanceReference};

use crate::SoleModel;
use crate::equilibrium::{End, Equilibrium, Limits, Target};
use friction::ContactState;
use nalgebra::Vector2;
use spatial::{Mat6, Transform, Twist, Vec3, Vec6, Wrench, so3};
use std::sync::Arc;

/// Finds the pose of one sole from the load it must carry, tick by tick, with the contact's history.
///
/// Depends on the references since touch-down alone: a second estimator given the same stance agrees to the bit.
#[derive(Debug, Clone)]
pub struct StanceEstimator {
    settings: EstimatorSettings,
    /// Foothold of this stance, world (m). The stance is solved relative to it: at 8 m from the world's origin the digits that positions
    /// lose there are already more than the tolerance of a foot that carries a newton.
    foothold: Vector2<f64>,
    foothold_is_believed: bool,
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
/// tilts in walking. An insurance that costs a fifteenth of all iterations: half +7 %, double -4 %, without it -7 % and no other
/// answer. (With steps of 10 mm instead of 2.5 Newton did once leap, by 24 degrees, to where no path of loads led.)
const LEAP_RAD: f64 = 0.06;
/// `K_c` is rebuilt when the contact laws are off by more than this fraction of the load, or the tolerance if that is larger. Seven times
/// what rounding leaves over 100,000 ticks at a tolerance of 1e-12 (1.4e-12). Half and double: no difference.
const REFRESH: f64 = 1e-11;
/// A tick is solved when the contact laws hold to this many times what was asked of Newton, whose own measure differs from the laws' by
/// less (a factor of at most `sqrt(2) (1 + mu)`).
const ACCEPTED: f64 = 10.0;
/// A load is looked at only if rounding leaves no more than this part of it: three digits.
const ROUNDED_MAX: f64 = 1e-3;

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
            foothold: Vector2::zeros(),
            foothold_is_believed: true,
            report: StanceReport::new(n),
            in_stance: false,
            last: zero,
            hull: spatial::polygon::convex_hull(model.contact_points().iter().map(|p| p.xy())),
            friction_max: model.friction().iter().copied().fold(0.0, f64::max),
            positions: vec![Vec3::zeros(); n],
            forces: vec![Vec3::zeros(); n],
            equilibrium: Equilibrium::new(model, settings.euler_order),
        }
    }

    /// From now on no iteration is begun once a tick has cost this many multiplications, and the slow ways are not tried: the time of a
    /// tick is bounded, and no tick allocates. What is not found within is [`Status::NotFound`], and the next tick tries again.
    /// Multiplications, not seconds, so that every answer stays a function of the references alone.
    pub fn bound_work(&mut self, multiplications_max: u64) {
        self.settings.multiplications_max = multiplications_max;
        self.settings.continuation_iterations_max = 0;
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

    /// Largest entry of `K_c C_cc - 1`: how far updates at landings and lift-offs have taken `K_c` from the inverse of the compliance. For long
    /// runs; costs as much as an inversion.
    #[must_use]
    pub fn stiffness_error(&self) -> f64 {
        self.equilibrium.stiffness_error()
    }

    /// A stance begins at this foothold: history starts anew (35).
    pub fn touch_down(&mut self, foothold: Foothold) {
        self.foothold_is_believed = foothold.is_believed();
        self.foothold = Vector2::new(foothold.x_m, foothold.y_m);
        self.equilibrium.begin(foothold.yaw_within_a_turn_rad());
        self.in_stance = true;
        // The continuation, if one is needed, starts from a centred vertical load.
        let centre = self.model().contact_points().iter().sum::<Vec3>() / self.model().contact_points().len() as f64;
        let zero = Vector2::zeros();
        self.last = Target { force: [Vec3::z(), Vec3::zeros(), Vec3::zeros()], zmp: [zero; 3] };
        self.last.zmp[0] = self.equilibrium.stance.pose.point(&centre).xy();
        self.report.twist = Twist::zero();
        self.report.acceleration = Twist::zero();
        for (position, p) in self.positions.iter_mut().zip(self.equilibrium.model().contact_points()) {
            *position = self.equilibrium.stance.pose.point(p);
        }
        self.place();
    }

    /// Continues a stance from the tangential positions that all contact points had at the previous tick and a pose to start
    /// from (for tools that hold such a history; a controller never needs it).
    pub fn resume(&mut self, pose: Transform, previous_m: &[Vector2<f64>]) {
        assert_eq!(previous_m.len(), self.positions.len(), "one previous position per contact point");
        self.touch_down(Foothold { x_m: pose.translation.x, y_m: pose.translation.y, yaw_rad: 0.0 });
        let origin = Vec3::new(pose.translation.x, pose.translation.y, 0.0);
        for (position, previous) in self.positions.iter_mut().zip(previous_m) {
            *position = Vec3::new(previous.x, previous.y, 0.0) - origin;
        }
        self.equilibrium.begin_from(Transform::new(pose.rotation, pose.translation - origin), &self.positions);
        self.place();
    }

    /// The stance is over; the report keeps the take-off pose.
    pub fn lift_off(&mut self) {
        self.in_stance = false;
        self.report.status = Status::InAir;
        self.report.wrench = Wrench::zero();
        self.report.twist = Twist::zero();
        self.report.acceleration = Twist::zero();
        self.report.node_forces.fill(Vec3::zeros());
        self.report.node_states.fill(ContactState::Open);
    }

    /// One tick.
    pub fn step(&mut self, reference: &StanceReference) -> &StanceReport {
        (self.report.iterations, self.report.multiplications) = (0, 0);
        self.report.slow = false;
        let status = self.check(reference).unwrap_or_else(|| self.solve(reference));
        if !status.is_solved() {
            self.report.age_ticks += 1;
        }
        self.report.status = status;
        &self.report
    }

    /// Reasons not to try.
    fn check(&mut self, reference: &StanceReference) -> Option<Status> {
        if !reference.is_believed() {
            return Some(Status::InvalidInput);
        }
        if !self.in_stance {
            return Some(Status::InAir);
        }
        if !self.foothold_is_believed {
            return Some(Status::InvalidInput);
        }
        let (tangential_n, normal_n) = (reference.force.xy().norm(), reference.force.z);
        (self.report.zmp_margin_m, self.report.friction_use) = (None, None);
        if normal_n <= 0.0 {
            return Some(Status::NoLoad { normal_n });
        }
        let least_n = self.equilibrium.floor_n() / ROUNDED_MAX;
        if reference.force.norm() < least_n {
            return Some(Status::TooLight { normal_n, least_n });
        }
        if self.friction_max == 0.0 {
            return Some(Status::Indeterminate);
        }
        let margin_m = self.zmp_margin(&reference.zmp[0]);
        self.report.friction_use = Some(tangential_n / (self.friction_max * normal_n));
        self.report.zmp_margin_m = Some(margin_m);
        let limit_n = self.settings.friction_use_max * self.friction_max * normal_n;
        if tangential_n > limit_n {
            return Some(Status::OutsideFrictionCone { tangential_n, limit_n });
        }
        // Written so that what is not a number is refused.
        let inside = margin_m >= 0.0;
        if !inside {
            return Some(Status::ZmpOutsideSole { by_m: -margin_m });
        }
        None
    }

    /// How far (m) a ZMP lies inside the contact points, undeformed at the last pose or where they were at the last tick.
    fn zmp_margin(&self, zmp: &Vector2<f64>) -> f64 {
        let pose = self.equilibrium.stance.pose;
        -spatial::polygon::distance_outside(
            self.hull.iter().map(|p| pose.point(&Vec3::new(p.x, p.y, 0.0)).xy()),
            self.report.node_positions.iter().map(|position| position.xy() - self.foothold),
            &(zmp - self.foothold),
        )
    }

    fn solve(&mut self, reference: &StanceReference) -> Status {
        let [zmp, zmp_rate, zmp_acceleration] = reference.zmp;
        let target = Target {
            force: [reference.force, reference.force_rate, reference.force_acceleration],
            zmp: [zmp - self.foothold, zmp_rate, zmp_acceleration],
        };
        self.equilibrium.reset_work();
        if self.equilibrium.is_first() {
            self.equilibrium.lower(target.force[0].z);
        }
        self.equilibrium.save();
        let start = self.equilibrium.stance.pose.rotation;
        let limits = Limits {
            tolerance: self.settings.tolerance,
            iterations: self.settings.iterations_max,
            multiplications: self.settings.multiplications_max,
        };
        let mut failure = None;
        let predicted = self.equilibrium.predict(self.settings.period_s);
        let mut end = self.equilibrium.newton(&target, &limits, predicted == Some(true));
        if end != End::Converged && predicted.is_some() {
            self.equilibrium.restore();
            end = self.equilibrium.newton(&target, &limits, false);
        }
        // Where friction couples many points, all their states at once can run in circles: then the pose alone, contact exact at each.
        if end != End::Converged && self.settings.continuation_iterations_max > 0 {
            self.report.slow = true;
            self.equilibrium.restore();
            end = self.equilibrium.newton_on_pose(&target, &self.slow_limits(self.settings.iterations_max));
        }
        // Beyond a fold the linear sole may have further equilibria, tilted by tens of degrees: a large turn within one tick must be
        // one that the load leads to.
        let leapt = end == End::Converged && self.equilibrium.turned_since(&start) > LEAP_RAD;
        if end != End::Converged || leapt {
            failure = self.follow(&target, end);
        }
        if failure.is_none() {
            failure = self.finish(&target, &limits);
        }
        self.report.iterations = self.equilibrium.work.iterations;
        self.report.multiplications = self.equilibrium.multiplications();
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

    /// Checks the laws from the compliance, differentiates, commits and reports.
    fn finish(&mut self, target: &Target, limits: &Limits) -> Option<Status> {
        let load = target.force[0].norm();
        let found = self.equilibrium.stance.pose.rotation;
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
            // A repair mends digits, or a missed point: it does not turn the foot.
            let leapt = self.equilibrium.turned_since(&found) > LEAP_RAD;
            match (end, repair) {
                (End::Converged, _) if !leapt => {
                    violation = self.equilibrium.settle(&mut self.positions, &mut self.forces)
                }
                (_, Repair::Step) => self.equilibrium.restore(),
                (_, Repair::Refresh) => return Some(Status::NotFound { cause: Cause::Laws }),
            }
        }
        let asked_n = (load * self.settings.tolerance.max(REFRESH)).max(self.equilibrium.floor_n());
        // Written so that what is not a number is not accepted.
        let holds = violation <= ACCEPTED * asked_n;
        if !holds {
            return Some(Status::NotFound { cause: Cause::Laws });
        }
        let residual = self.equilibrium.work.residual;
        let Some((velocity, acceleration)) = self.equilibrium.rates(target) else {
            return Some(Status::NotFound { cause: Cause::Singular });
        };
        let fixed = self.equilibrium.scratch.tangent;
        self.equilibrium.commit(&self.positions);
        let (force, moment) = self.equilibrium.wrench();
        let report = &mut self.report;
        report.twist = Twist::from_vector(&velocity);
        report.acceleration = Twist::from_vector(&acceleration);
        report.wrench = Wrench { force, moment };
        let o = self.equilibrium.stance.pose.translation;
        // About the point on the ground under the origin.
        let below = report.wrench.about(&Vec3::new(0.0, 0.0, -o.z));
        let arm = below.zmp_arm();
        report.zmp = self.foothold + o.xy() + arm;
        report.moment_z_nm = below.about(&Vec3::new(arm.x, arm.y, 0.0)).moment.z;
        report.compression = self.equilibrium.compression();
        report.tangent = about_moving_origin(&fixed, &force);
        report.compliance = inverse(&report.tangent);
        report.node_forces.copy_from_slice(&self.forces);
        report.node_states.copy_from_slice(&self.equilibrium.stance.states);
        report.residual = residual;
        report.law_violation_n = violation;
        let count = |state| report.node_states.iter().filter(|s| **s == state).count();
        (report.open, report.sticking, report.slipping) =
            (count(ContactState::Open), count(ContactState::Stick), count(ContactState::Slip));
        report.landings = self.equilibrium.work.landings;
        report.lift_offs = self.equilibrium.work.lift_offs;
        report.age_ticks = 0;
        self.place();
        None
    }

    /// Sole and contact points in the world, and the ankle, which moves rigidly with the sole's clamped face (34).
    fn place(&mut self) {
        let report = &mut self.report;
        let foothold = Vec3::new(self.foothold.x, self.foothold.y, 0.0);
        let pose = self.equilibrium.stance.pose;
        report.sole_pose = Transform::new(pose.rotation, pose.translation + foothold);
        for (world, position) in report.node_positions.iter_mut().zip(&self.positions) {
            *world = position + foothold;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MeshSource, SoleSettings};

    /// What the repairs of a tick make of its solution when that is off by a turn about y.
    fn repaired(turned_rad: f64) -> (Option<Status>, f64) {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [5, 4, 2] };
        let model = SoleModel::build(&SoleSettings { mesh, ..SoleSettings::default() }).expect("a sole");
        let mut estimator = StanceEstimator::new(model, EstimatorSettings::default());
        estimator.touch_down(Foothold::default());
        let load = StanceReference::constant(Vec3::new(0.0, 0.0, 383.0), Vector2::new(0.02, 0.0));
        assert_eq!(estimator.step(&load).status, Status::Converged);
        let solved = estimator.equilibrium.stance.pose.rotation;
        estimator.equilibrium.save();
        estimator.equilibrium.stance.pose.rotation = so3::exp(&Vec3::new(0.0, turned_rad, 0.0)) * solved;
        let target = estimator.last;
        let limits = Limits { tolerance: 1e-9, iterations: 60, multiplications: u64::MAX };
        let mut failure = None;
        let count = allocation_counter::measure(|| failure = estimator.finish(&target, &limits));
        assert_eq!(count.count_total, 0, "a repair is a part of a tick and does not allocate");
        (failure, estimator.equilibrium.turned_since(&solved))
    }

    #[test]
    fn a_contact_stiffness_that_has_drifted_is_made_anew() {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [5, 4, 2] };
        let model = SoleModel::build(&SoleSettings { mesh, ..SoleSettings::default() }).expect("a sole");
        let mut estimator = StanceEstimator::new(model, EstimatorSettings::default());
        estimator.touch_down(Foothold::default());
        let load = |x_m: f64| StanceReference::constant(Vec3::new(5.0, -3.0, 383.0), Vector2::new(x_m, 0.01));
        estimator.step(&load(0.02));
        let mut drifted = estimator.clone();
        drifted.equilibrium.drift(1e-4);
        for x_m in [0.03, 0.06] {
            let [sound, mended] = [&mut estimator, &mut drifted].map(|one| one.step(&load(x_m)).clone());
            assert_eq!((sound.status, mended.status), (Status::Converged, Status::Converged), "{x_m}");
            assert!(mended.law_violation_n < 1e-8 * 383.0, "{} N", mended.law_violation_n);
            assert!((sound.sole_pose.translation - mended.sole_pose.translation).norm() < 1e-10, "{x_m}");
        }
    }

    #[test]
    fn a_repair_mends_the_solution_but_does_not_turn_the_foot() {
        let (failure, away_rad) = repaired(0.9 * LEAP_RAD);
        assert!(failure.is_none() && away_rad < 1e-6, "{failure:?}, {away_rad}");
        assert_eq!(repaired(1.1 * LEAP_RAD).0, Some(Status::NotFound { cause: Cause::Laws }));
    }
}

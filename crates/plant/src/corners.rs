//! The hard foot for reference: four corners on stiff springs, Coulomb friction by return mapping.
//!
//! ```text
//! f_n = max(0, k_n (s + eta s'))           s: depth of the corner below the ground
//! f_t = k_t ((a - x) - eta x')             a: where the tangential spring is anchored; |f_t| <= mu f_n by return mapping
//! ```
//!
//! The original HRP-4 foot was such a hard plate. It is *nearly* rigid: with the default 1 MN/m per corner half the robot's weight
//! sinks it by 0.05 mm, and the implicit step makes the stiffness harmless. An exactly rigid contact would need a
//! velocity-level complementarity problem that couples both feet, for a difference below that number.

use ranges::{OutOfRange, Range};
use serde::{Deserialize, Serialize};
use sole::Ground;
use spatial::{Mat3, Mat6, Transform, Vec3, Wrench, so3};

/// Four stiff corners.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CornerSettings {
    /// Half of the foot's length (m).
    pub half_length_m: f64,
    /// Half of its width (m).
    pub half_width_m: f64,
    /// `k_n` per corner (N/m).
    pub normal_stiffness_n_per_m: f64,
    /// `k_t` per corner (N/m).
    pub tangential_stiffness_n_per_m: f64,
    /// `eta` (s): Kelvin-Voigt damping.
    pub viscosity_time_s: f64,
    /// `mu`; that of the nominal sole, no file says it.
    #[serde(skip)]
    pub friction: f64,
    /// The ankle in the sole frame (m): where the foot link's origin is above the centre of the four corners. That of the nominal sole, no
    /// file says it.
    #[serde(skip)]
    pub ankle_in_sole_m: [f64; 3],
}

impl Default for CornerSettings {
    fn default() -> Self {
        Self {
            half_length_m: 0.115,
            half_width_m: 0.065,
            normal_stiffness_n_per_m: 1e6,
            tangential_stiffness_n_per_m: 1e6,
            viscosity_time_s: 0.002,
            friction: 0.65,
            ankle_in_sole_m: [-0.015, -0.011, 0.103],
        }
    }
}

impl CornerSettings {
    pub(crate) fn check(&self, path: &str) -> Result<(), OutOfRange> {
        let key = |name: &str| format!("{path}.{name}");
        let side_m = Range::above_zero_to(1.0);
        side_m.demand(key("half_length_m"), self.half_length_m, "half of the foot, in metres")?;
        side_m.demand(key("half_width_m"), self.half_width_m, "half of the foot, in metres")?;
        let stiffness = Range::above_zero_to(1e9);
        stiffness.demand(key("normal_stiffness_n_per_m"), self.normal_stiffness_n_per_m, "1e6 is nearly rigid")?;
        stiffness.demand(
            key("tangential_stiffness_n_per_m"),
            self.tangential_stiffness_n_per_m,
            "1e6 is nearly rigid",
        )?;
        Range::between(0.0, 1.0).demand(key("viscosity_time_s"), self.viscosity_time_s, "0.002 is usual")?;
        Range::between(0.0, 1e3).demand(key("friction"), self.friction, "the sole's")?;
        Range::within(1.0).demand_each(&key("ankle_in_sole_m"), &self.ankle_in_sole_m, "the sole's, in metres")
    }
}

/// Wrench at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactEvaluation {
    /// Wrench of the ground on the sole about the sole frame's origin, world axes.
    pub wrench: Wrench,
    /// Work that friction turns to heat from the accepted state to this one (J), never negative.
    pub slip_work_j: f64,
    /// The contact problem was solved to its tolerance.
    pub converged: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Corner {
    in_sole: Vec3,
    /// Accepted: anchor of the tangential spring and last position; `None` in the air.
    touching: Option<(Vec3, Vec3)>,
    /// Evaluated, not yet accepted.
    trial: Option<(Vec3, Vec3)>,
    force: Vec3,
}

/// State of four corners.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerContact {
    settings: CornerSettings,
    corners: [Corner; 4],
    tangent: Mat6,
    evaluations: u64,
}

impl CornerContact {
    /// In the air.
    #[must_use]
    pub fn new(settings: CornerSettings) -> Self {
        let (l, w) = (settings.half_length_m, settings.half_width_m);
        let corners = [(-l, -w), (l, -w), (l, w), (-l, w)].map(|(x, y)| Corner {
            in_sole: Vec3::new(x, y, 0.0),
            touching: None,
            trial: None,
            force: Vec3::zeros(),
        });
        Self { settings, corners, tangent: Mat6::zeros(), evaluations: 0 }
    }

    /// Forgets all contact.
    pub fn reset(&mut self) {
        *self = Self { evaluations: self.evaluations + 1, ..Self::new(self.settings) };
    }

    /// Force at a pose, `dt_s` after the accepted state.
    pub fn evaluate(&mut self, X_WS: &Transform, ground: &dyn Ground, dt_s: f64) -> ContactEvaluation {
        let mut wrench = Wrench::zero();
        let mut tangent = Mat6::zeros();
        let mut slip_work_j = 0.0;
        for corner in &mut self.corners {
            let r = X_WS.rotation * corner.in_sole;
            let x = X_WS.translation + r;
            let derivative = corner.evaluate(&x, ground, dt_s, &self.settings);
            let f = corner.force;
            slip_work_j += corner.slip_work();
            wrench = wrench + Wrench { force: f, moment: r.cross(&f) };
            // dx = dp + dtheta x r;  d(r x f) = (dtheta x r) x f + r x df
            let k_r = so3::skew(&r);
            let columns = [derivative, -derivative * k_r];
            for (i, df) in columns.iter().enumerate() {
                let mut force_rows = tangent.fixed_view_mut::<3, 3>(0, 3 * i);
                force_rows += df;
                let mut moment_rows = tangent.fixed_view_mut::<3, 3>(3, 3 * i);
                moment_rows += k_r * df;
            }
            let mut turned = tangent.fixed_view_mut::<3, 3>(3, 3);
            turned += so3::skew(&f) * k_r;
        }
        self.tangent = tangent;
        self.evaluations += 1;
        ContactEvaluation { wrench, slip_work_j, converged: true }
    }

    /// Derivative of the wrench at the last evaluation with respect to translation and rotation (left-multiplied rotation vector), world axes.
    #[must_use]
    pub fn tangent(&self) -> Mat6 {
        self.tangent
    }

    /// How often it was evaluated.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// Accepts the last evaluation.
    pub fn commit(&mut self) {
        for corner in &mut self.corners {
            corner.touching = corner.trial;
        }
    }
}

impl Corner {
    /// The anchor moves against the force of the ground on the sole.
    fn slip_work(&self) -> f64 {
        match (self.touching, self.trial) {
            (Some((from, _)), Some((to, _))) => -self.force.dot(&(to - from)),
            _ => 0.0,
        }
    }

    /// Sets force and trial state at the position `x`; returns d force / d x.
    fn evaluate(&mut self, x: &Vec3, ground: &dyn Ground, dt_s: f64, settings: &CornerSettings) -> Mat3 {
        let (height, n) = ground.height_and_normal(x.x, x.y);
        let depth = (height - x.z) * n.z;
        let (anchor, previous) = self.touching.unwrap_or((*x, *x));
        let damped = settings.viscosity_time_s / dt_s;
        // A corner in the air has no previous depth: its viscous part starts from the surface.
        let approach = if self.touching.is_some() { (previous - x).dot(&n) } else { depth.max(0.0) };
        let normal = settings.normal_stiffness_n_per_m * (depth + damped * approach);
        if depth <= 0.0 || normal <= 0.0 {
            self.force = Vec3::zeros();
            self.trial = None;
            return Mat3::zeros();
        }
        let k_n = settings.normal_stiffness_n_per_m * (1.0 + damped);
        let k_t = settings.tangential_stiffness_n_per_m;
        let nn = n * n.transpose();
        let tangential = Mat3::identity() - nn;
        let stuck = tangential * (k_t * ((anchor - x) + damped * (previous - x)));
        // A corner that lands is anchored where it is, wherever that is: no tangential force, no derivative.
        let d_stuck = if self.touching.is_some() { -k_t * (1.0 + damped) * tangential } else { Mat3::zeros() };
        let friction = settings.friction * ground.friction_factor(x.x, x.y);
        let limit = friction * normal;
        let size = stuck.norm();
        if size <= limit {
            self.force = normal * n + stuck;
            self.trial = Some((anchor, *x));
            return -k_n * nn + d_stuck;
        }
        let e = stuck / size;
        self.force = normal * n + limit * e;
        // The anchor follows, so that the spring holds exactly what friction can.
        self.trial = Some((x + limit * e / k_t, *x));
        -k_n * nn - friction * k_n * e * n.transpose() + (limit / size) * (tangential - e * e.transpose()) * d_stuck
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sole::Plane;

    fn wrench_at(contact: &mut CornerContact, X_WS: &Transform) -> spatial::Vec6 {
        contact.evaluate(X_WS, &Plane, 1e-3).wrench.to_vector()
    }

    #[test]
    fn tangent_is_the_derivative_of_the_wrench_sticking_and_slipping() {
        for friction in [0.05, 0.65] {
            let mut contact = CornerContact::new(CornerSettings { friction, ..Default::default() });
            let start = Transform::new(so3::exp(&Vec3::new(2e-4, -1e-4, 0.3)), Vec3::new(0.1, 0.2, -1e-4));
            wrench_at(&mut contact, &start);
            contact.commit();
            let moved = Vec3::new(3e-6, -5e-6, -2e-6);
            let pose =
                Transform::new(so3::exp(&Vec3::new(1e-6, 3e-6, 2e-5)) * start.rotation, start.translation + moved);
            contact.evaluate(&pose, &Plane, 1e-3);
            let tangent = contact.tangent();
            let step = 1e-9;
            for axis in 0..6 {
                let shifted = |sign: f64| {
                    let mut d = spatial::Vec6::zeros();
                    d[axis] = sign * step;
                    let turn = so3::exp(&d.fixed_rows::<3>(3).into());
                    Transform::new(turn * pose.rotation, pose.translation + d.fixed_rows::<3>(0))
                };
                let difference =
                    (wrench_at(&mut contact, &shifted(1.0)) - wrench_at(&mut contact, &shifted(-1.0))) / (2.0 * step);
                assert!(
                    (difference - tangent.column(axis)).norm() < 1e-5 * tangent.norm(),
                    "axis {axis}, mu {friction}"
                );
            }
        }
    }

    #[test]
    fn friction_is_bounded_and_opposes_slip() {
        let settings = CornerSettings { viscosity_time_s: 0.0, ..Default::default() };
        let mut contact = CornerContact::new(settings);
        let mut pose = Transform::from_translation(Vec3::new(0.0, 0.0, -1e-4));
        for _ in 0..100 {
            pose.translation.x += 1e-5;
            let force = contact.evaluate(&pose, &Plane, 1e-3).wrench.force;
            assert!(force.x <= 0.0 && force.x.abs() <= 0.65 * force.z * (1.0 + 1e-12));
            contact.commit();
        }
        let force = contact.evaluate(&pose, &Plane, 1e-3).wrench.force;
        assert!((force.x + 0.65 * force.z).abs() < 1e-9 * force.z);
        assert!((force.z - 4.0 * 1e6 * 1e-4).abs() < 1e-9 * force.z);
    }
}

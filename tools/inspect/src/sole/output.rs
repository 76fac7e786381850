//! What the sole does, as JSON.

use crate::door;
use serde::Serialize;
use sole::{
    Cause, ContactReport, ContactState, ContactStatus, ElementQuality, MeshQuality, SoleModel, StanceReport, Status,
};
use spatial::{Mat6, Transform, Vec3, Wrench, so3};

#[derive(Serialize)]
pub(super) struct PoseOutput {
    pub(super) position: [f64; 3],
    pub(super) rotation: Vec<Vec<f64>>,
    pub(super) roll_pitch_yaw: [f64; 3],
}

#[derive(Serialize)]
pub(super) struct Output {
    pub(super) sole: SoleOutput,
    pub(super) ticks: Vec<TickOutput>,
}

#[derive(Serialize)]
pub(super) struct SoleOutput {
    pub(super) nodes: usize,
    pub(super) tetrahedra: usize,
    pub(super) degrees_of_freedom: usize,
    pub(super) contact_points: usize,
    pub(super) quality: Option<QualityOutput>,
    pub(super) compliance_condition: f64,
    pub(super) build_time_s: f64,
}

#[derive(Serialize)]
pub(super) struct QualityOutput {
    #[serde(rename = "below_0.01")]
    below_0_01: usize,
    #[serde(rename = "below_0.1")]
    below_0_1: usize,
    #[serde(rename = "below_0.3")]
    below_0_3: usize,
    worst: Vec<ElementOutput>,
}

#[derive(Serialize)]
pub(super) struct ElementOutput {
    element: usize,
    quality: f64,
    centre: [f64; 3],
}

impl From<&MeshQuality> for QualityOutput {
    fn from(quality: &MeshQuality) -> Self {
        let [below_0_01, below_0_1, below_0_3] = quality.below;
        let output =
            |e: &ElementQuality| ElementOutput { element: e.element, quality: e.quality, centre: e.centre_m.into() };
        Self { below_0_01, below_0_1, below_0_3, worst: quality.worst.iter().map(output).collect() }
    }
}

#[derive(Serialize)]
pub(super) struct TickOutput {
    pub(super) pose: PoseOutput,
    pub(super) ankle: PoseOutput,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) velocity: Option<[f64; 6]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) acceleration: Option<[f64; 6]>,
    pub(super) force: [f64; 3],
    pub(super) zmp: Option<[f64; 2]>,
    pub(super) moment_z: f64,
    pub(super) node_positions: Vec<[f64; 3]>,
    pub(super) node_forces: Vec<[f64; 3]>,
    pub(super) node_states: Vec<&'static str>,
    pub(super) tangent: Vec<Vec<f64>>,
    pub(super) residual: f64,
    pub(super) law_violation_n: Option<f64>,
    pub(super) iterations: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) multiplications: Option<u64>,
    pub(super) time_us: f64,
    pub(super) status: &'static str,
    pub(super) detail: String,
}

// What the output calls below_0.01 and so on.
const _: () = assert!(matches!(MeshQuality::LIMITS, [0.01, 0.1, 0.3]));

fn pose_output(pose: &Transform) -> PoseOutput {
    PoseOutput {
        position: pose.translation.into(),
        rotation: door::rows(&pose.rotation),
        roll_pitch_yaw: so3::roll_pitch_yaw(&pose.rotation).into(),
    }
}

fn triples(vectors: &[Vec3]) -> Vec<[f64; 3]> {
    vectors.iter().map(|v| (*v).into()).collect()
}

fn state_names(states: &[ContactState]) -> Vec<&'static str> {
    states.iter().map(|state| state.word()).collect()
}

pub(super) fn stance(report: &StanceReport, time_us: f64) -> TickOutput {
    let status = match report.status {
        Status::InAir => "in-air",
        Status::Converged => "converged",
        Status::DoubtfulTilt { .. } => "doubtful-tilt",
        Status::DoubtfulCompression { .. } => "doubtful-compression",
        Status::Indeterminate => "indeterminate",
        Status::NoLoad { .. } => "no-load",
        Status::TooLight { .. } => "too-light",
        Status::OutsideFrictionCone { .. } => "outside-friction-cone",
        Status::ZmpOutsideSole { .. } => "zmp-outside-sole",
        Status::Fold { .. } => "fold",
        Status::NotFound { .. } => "not-found",
        Status::InvalidInput => "invalid-input",
    };
    TickOutput {
        pose: pose_output(&report.sole_pose),
        ankle: pose_output(&report.ankle_pose),
        velocity: Some(report.twist.to_vector().into()),
        acceleration: Some(report.acceleration.to_vector().into()),
        force: report.wrench.force.into(),
        zmp: Some(report.zmp.into()),
        moment_z: report.moment_z_nm,
        node_positions: triples(&report.node_positions),
        node_forces: triples(&report.node_forces),
        node_states: state_names(&report.node_states),
        tangent: door::rows(&report.tangent),
        residual: report.residual,
        law_violation_n: Some(report.law_violation_n),
        iterations: report.iterations,
        multiplications: Some(report.multiplications),
        time_us,
        status,
        detail: stance_in_words(&report.status),
    }
}

pub(super) fn contact(report: &ContactReport, pose: &Transform, model: &SoleModel, time_us: f64) -> TickOutput {
    let status = match report.status {
        ContactStatus::NoContact => "no-contact",
        ContactStatus::Solved => "solved",
        ContactStatus::NotConverged => "not-converged",
        ContactStatus::InvalidInput => "invalid-input",
    };
    let o = pose.translation;
    let force = report.wrench.force;
    let zmp = report.wrench.zmp(&o, 0.0);
    let moment_z = zmp.map_or(0.0, |zmp| report.wrench.about(&(Vec3::new(zmp.x, zmp.y, 0.0) - o)).moment.z);
    let ankle = *pose * Transform::from_translation(model.ankle_in_sole_m());
    TickOutput {
        pose: pose_output(pose),
        ankle: pose_output(&ankle),
        velocity: None,
        acceleration: None,
        force: force.into(),
        zmp: zmp.map(Into::into),
        moment_z,
        node_positions: triples(&report.node_positions),
        node_forces: triples(&report.node_forces),
        node_states: state_names(&report.node_states),
        tangent: door::rows(&report.tangent),
        residual: report.residual,
        law_violation_n: None,
        iterations: report.iterations,
        multiplications: None,
        time_us,
        status,
        detail: contact_in_words(report.status).to_owned(),
    }
}

/// A foot that was posed before and is off the ground now, its sole undeformed.
pub(super) fn in_air(pose: &Transform, model: &SoleModel, time_us: f64) -> TickOutput {
    let points = model.contact_points();
    let report = ContactReport {
        status: ContactStatus::NoContact,
        wrench: Wrench::zero(),
        tangent: Mat6::zeros(),
        node_forces: vec![Vec3::zeros(); points.len()],
        node_positions: points.iter().map(|p| pose.point(p)).collect(),
        node_states: vec![ContactState::Open; points.len()],
        residual: 0.0,
        iterations: 0,
        friction_work_j: 0.0,
        elastic_energy_j: 0.0,
    };
    let status = Status::InAir;
    TickOutput { status: "in-air", detail: stance_in_words(&status), ..contact(&report, pose, model, time_us) }
}

fn stance_in_words(status: &Status) -> String {
    match status {
        Status::InAir => "the foot is in the air".to_owned(),
        Status::Converged => "solved".to_owned(),
        Status::DoubtfulTilt { tilt_rad } => {
            format!("solved, but tilted by {:.2} degrees: linear elasticity is doubtful", tilt_rad.to_degrees())
        }
        Status::DoubtfulCompression { part } => {
            format!(
                "solved, but pressed together by {:.1} % of the thickness: linear elasticity is doubtful",
                100.0 * part
            )
        }
        Status::Indeterminate => "without friction position and heading are free: no unique pose".to_owned(),
        Status::NoLoad { normal_n } => format!("the vertical force is {normal_n} N: the ground can only push"),
        Status::OutsideFrictionCone { tangential_n, limit_n } => {
            format!("the horizontal force is {tangential_n:.3} N, friction allows {limit_n:.3} N")
        }
        Status::ZmpOutsideSole { by_m } => format!("the ZMP lies {:.3} mm outside the sole", 1e3 * by_m),
        Status::TooLight { normal_n, least_n } => format!(
            "the vertical force is {normal_n:e} N: below {least_n:.1e} N no digit of this sole's forces is certain"
        ),
        Status::Fold { reached_zmp_m: z, fraction } => format!(
            "no pose carries this load: on the way from the last one carried the equilibrium turns back after {:.1} %, the ZMP at ({:.4}, {:.4}) m",
            100.0 * fraction,
            z.x,
            z.y
        ),
        Status::NotFound { cause } => {
            format!("no pose was found, which does not say that there is none: {}", cause_in_words(*cause))
        }
        Status::InvalidInput => "a number is not finite, or larger than any that a foot meets".to_owned(),
    }
}

fn cause_in_words(cause: Cause) -> &'static str {
    match cause {
        Cause::Circling => "the states of the contact points run in circles",
        Cause::Steps => "Newton's iterations ran out or led nowhere",
        Cause::Work => "the work of this tick is spent",
        Cause::Laws => "the contact laws do not hold well enough where the iteration ended",
        Cause::Singular => "the tangent is singular",
    }
}

fn contact_in_words(status: ContactStatus) -> &'static str {
    match status {
        ContactStatus::NoContact => "no point touches the ground",
        ContactStatus::Solved => "solved",
        ContactStatus::NotConverged => "the contact laws hold no better than the residual says",
        ContactStatus::InvalidInput => "a number is not finite, or larger than any that a foot meets",
    }
}

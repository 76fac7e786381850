//! Estimates to messages.

use messages::code::{ContactState, Outcome as OutcomeCode};
use messages::{ContactNodes, FootDeformation, Header, MAX_CONTACT_NODES, SoleContact, SoleDeformation, row_major};
use pattern::{FootReference, Reference};
use sole::StanceEstimator;
use spatial::{Twist, Wrench};
use stance::{FootEstimate, Outcome, WalkOnSoles};

/// The message of a tick.
pub(crate) fn deformation_message(
    header: Header,
    walk_time_s: f64,
    pattern_hash: u64,
    reference: &Reference,
    feet: &[FootEstimate; 2],
) -> SoleDeformation {
    let feet = [foot_message(&reference.feet[0], &feet[0]), foot_message(&reference.feet[1], &feet[1])];
    SoleDeformation { header, walk_time_s, pattern_hash, feet }
}

fn foot_message(reference: &FootReference, foot: &FootEstimate) -> FootDeformation {
    FootDeformation {
        loaded: u32::from(foot.loaded),
        status: outcome_code(foot.outcome).code(),
        age_ticks: foot.age_ticks,
        iterations: foot.iterations,
        load_share: reference.share.value,
        ankle_position_m: foot.ankle.pose.translation.into(),
        ankle_rotation: row_major(&foot.ankle.pose.rotation),
        ankle_twist_m_rad_per_s: six(&foot.ankle.twist),
        ankle_acceleration_m_rad_per_s2: six(&foot.ankle.acceleration),
        sole_position_m: foot.sole.translation.into(),
        sole_rotation: row_major(&foot.sole.rotation),
        planned_force_n: reference.force.into(),
        planned_zmp_m: foot.zmp.into(),
        // nalgebra stores columns; the message wants rows.
        compliance_m_rad_per_n_nm: foot.compliance.transpose().as_slice().try_into().expect("6 x 6 numbers"),
        wrench_n_nm: wrench_six(&foot.wrench),
        sole_twist_m_rad_per_s: six(&foot.sole_twist),
        nodes_sticking: foot.nodes_sticking,
        nodes_slipping: foot.nodes_slipping,
        residual: foot.residual,
    }
}

/// What an outcome is called across process borders.
pub(crate) fn outcome_code(outcome: Outcome) -> OutcomeCode {
    use sole::Status;
    match outcome {
        Outcome::Geometric => OutcomeCode::None,
        Outcome::Solved => OutcomeCode::Solved,
        Outcome::Held(status) => match status {
            Status::NotFound { .. } => OutcomeCode::IterationLimit,
            Status::Fold { .. } | Status::Indeterminate => OutcomeCode::Infeasible,
            Status::ZmpOutsideSole { .. }
            | Status::OutsideFrictionCone { .. }
            | Status::NoLoad { .. }
            | Status::TooLight { .. } => OutcomeCode::ReferenceOutside,
            _ => OutcomeCode::Held,
        },
    }
}

/// Both soles node by node; a sole with more nodes than the message holds shows its first ones.
pub(crate) fn contact_message(header: Header, estimator: &WalkOnSoles) -> SoleContact {
    let [left, right] = estimator.stances().map(|stance| stance.map_or_else(ContactNodes::default, nodes_message));
    SoleContact { header, feet: [left, right] }
}

fn nodes_message(stance: &StanceEstimator) -> ContactNodes {
    let report = stance.report();
    let count = report.node_positions.len().min(MAX_CONTACT_NODES);
    let mut out = ContactNodes { count: count as u32, ..ContactNodes::default() };
    for node in 0..count {
        out.position_m[node] = report.node_positions[node].into();
        out.force_n[node] = report.node_forces[node].into();
        let state = match report.node_states[node] {
            sole::ContactState::Open => ContactState::Open,
            sole::ContactState::Stick => ContactState::Stick,
            sole::ContactState::Slip => ContactState::Slip,
        };
        out.state[node] = state.code();
    }
    out
}

fn six(twist: &Twist) -> [f64; 6] {
    twist.to_vector().into()
}

fn wrench_six(wrench: &Wrench) -> [f64; 6] {
    wrench.to_vector().into()
}

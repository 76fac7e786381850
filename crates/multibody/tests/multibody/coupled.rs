//! Joints that follow others, against the same tree without `<mimic>` and the matrix S between the two.

use crate::random_robot::{Mimic, Random, configuration, coupled_urdf, urdf, with_rotors};
use multibody::*;
use nalgebra::{DMatrix, DVector};
use spatial::{Vec3, Wrench};

/// Rounding of recursions over some twenty bodies, relative to the largest entry.
const ROUNDING: f64 = 1e-12;
/// The same through a solution with M.
const SOLVED: f64 = 1e-9;

/// A robot whose joints follow others, the same one whose joints are free, and what maps the coordinates.
struct Pair {
    coupled: Model,
    free: Model,
    S: DMatrix<f64>,
    offsets: DVector<f64>,
    q: Configuration,
    q_free: Configuration,
    random: Random,
}

/// Multiplier, offset and leader of a joint, following the file from joint to joint.
fn resolve<'a>(mimics: &'a [Mimic], name: &'a str) -> (f64, f64, &'a str) {
    match mimics.iter().find(|mimic| mimic.follower == name) {
        None => (1.0, 0.0, name),
        Some(mimic) => {
            let (multiplier, offset, leader) = resolve(mimics, &mimic.leader);
            (mimic.multiplier * multiplier, mimic.multiplier * offset + mimic.offset, leader)
        }
    }
}

fn pairs() -> impl Iterator<Item = Pair> {
    (0..6).flat_map(|seed| [Base::Floating, Base::Fixed].map(|base| pair(seed, base)))
}

fn pair(seed: u64, base: Base) -> Pair {
    let options = ModelOptions { base, gravity: Vec3::new(0.7, -0.4, -9.81), ..ModelOptions::default() };
    let (text, mimics) = coupled_urdf(seed, 24);
    let coupled = with_rotors(Model::from_urdf(&text, &options).unwrap());
    let mut free = Model::from_urdf(&urdf(seed, 24), &options).unwrap();
    for (k, joint) in coupled.joints().iter().enumerate() {
        let same = free.joint(&joint.name).unwrap();
        free.set_rotor_inertia(same, 0.01 * (k % 3) as f64);
    }
    for (k, follower) in coupled.followers().iter().enumerate() {
        let same = free.joint(&follower.name).unwrap();
        free.set_rotor_inertia(same, 0.02 * (k % 2) as f64);
    }
    assert_eq!(coupled.followers().len(), mimics.len());
    assert_eq!(coupled.joint_count() + mimics.len(), free.joint_count());
    let base_dofs = free.base_dofs();
    let (mut S, mut offsets) = (DMatrix::zeros(free.nv(), coupled.nv()), DVector::zeros(free.joint_count()));
    (0..base_dofs).for_each(|k| S[(k, k)] = 1.0);
    for (k, joint) in free.joints().iter().enumerate() {
        let (multiplier, offset, leader) = resolve(&mimics, &joint.name);
        S[(base_dofs + k, coupled.column(coupled.joint(leader).unwrap()))] = multiplier;
        offsets[k] = offset;
    }
    let mut random = Random(300 + seed);
    let q = configuration(&coupled, &mut random);
    let rows = S.view((base_dofs, base_dofs), (free.joint_count(), coupled.joint_count()));
    let q_free = Configuration { base: q.base, joints: rows * &q.joints + &offsets };
    Pair { coupled, free, S, offsets, q, q_free, random }
}

fn close<'a>(
    name: &str,
    found: impl IntoIterator<Item = &'a f64>,
    expected: impl IntoIterator<Item = &'a f64> + Clone,
    tolerance: f64,
) {
    let largest = expected.clone().into_iter().fold(1.0_f64, |largest, x| largest.max(x.abs()));
    let difference = found.into_iter().zip(expected).fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
    assert!(difference < tolerance * largest, "{name}: {difference:e} of {largest:e}");
}

#[test]
fn the_reduced_robot_is_the_free_one_seen_through_s() {
    for Pair { coupled, free, S, q, q_free, mut random, .. } in pairs() {
        let (mut ws, mut ws_free) = (Workspace::new(&coupled), Workspace::new(&free));
        let (v, a) = (random.list(coupled.nv(), 2.0), random.list(coupled.nv(), 5.0));
        let (v_free, a_free) = (&S * &v, &S * &a);
        let frames: Vec<FrameIndex> = (0..coupled.frames().len()).map(FrameIndex).collect();
        let mut terms = WholeBodyTerms::new(&coupled, &frames);
        let mut terms_free = WholeBodyTerms::new(&free, &frames);
        whole_body_terms(&coupled, &mut ws, &q, &v, &mut terms);
        whole_body_terms(&free, &mut ws_free, &q_free, &v_free, &mut terms_free);
        let reduced = S.tr_mul(&(&terms_free.mass_matrix * &S));
        close("M", &terms.mass_matrix, &reduced, ROUNDING);
        close("h", &terms.bias, &S.tr_mul(&terms_free.bias), ROUNDING);
        close("Jcom", &terms.com_jacobian, &(&terms_free.com_jacobian * &S), ROUNDING);
        close("Ag", &terms.centroidal_matrix, &(&terms_free.centroidal_matrix * &S), ROUNDING);
        close("com", &terms.com, &terms_free.com, ROUNDING);
        close("com velocity", &terms.com_velocity, &terms_free.com_velocity, ROUNDING);
        close("com drift", &terms.com_drift, &terms_free.com_drift, ROUNDING);
        close("momentum", &terms.momentum, &terms_free.momentum, ROUNDING);
        close("momentum drift", &terms.centroidal_drift, &terms_free.centroidal_drift, ROUNDING);
        for (frame, other) in terms.frames.iter().zip(&terms_free.frames) {
            close("J", &frame.jacobian, &(&other.jacobian * &S), ROUNDING);
            close("drift", &frame.drift, &other.drift, ROUNDING);
            close("velocity", &frame.velocity.to_vector(), &other.velocity.to_vector(), ROUNDING);
            close("position", &frame.placement.translation, &other.placement.translation, ROUNDING);
            close("rotation", &frame.placement.rotation, &other.placement.rotation, ROUNDING);
        }
        let external = [(frames[frames.len() - 1], Wrench { force: random.vector(50.0), moment: random.vector(5.0) })];
        let (mut tau, mut tau_free) = (DVector::zeros(coupled.nv()), DVector::zeros(free.nv()));
        rnea_with_external(&coupled, &mut ws, &q, &v, &a, &external, &mut tau);
        rnea_with_external(&free, &mut ws_free, &q_free, &v_free, &a_free, &external, &mut tau_free);
        close("rnea", &tau, &S.tr_mul(&tau_free), ROUNDING);
        gravity_forces(&coupled, &mut ws, &q, &mut tau);
        gravity_forces(&free, &mut ws_free, &q_free, &mut tau_free);
        close("gravity", &tau, &S.tr_mul(&tau_free), ROUNDING);
    }
}

#[test]
fn forward_dynamics_are_those_of_the_free_robot_under_the_forces_of_the_coupling() {
    // The free robot, driven by tau on the leaders' axes and by forces that do no work along S, must move along S.
    for Pair { coupled, free, S, q, q_free, mut random, .. } in pairs() {
        let (mut ws, mut ws_free) = (Workspace::new(&coupled), Workspace::new(&free));
        let (v, tau) = (random.list(coupled.nv(), 2.0), random.list(coupled.nv(), 10.0));
        let mut vd = DVector::zeros(coupled.nv());
        aba(&coupled, &mut ws, &q, &v, &tau, &mut vd);
        let (mut forces, mut vd_free) = (DVector::zeros(free.nv()), DVector::zeros(free.nv()));
        rnea(&free, &mut ws_free, &q_free, &(&S * &v), &(&S * &vd), &mut forces);
        close("work of the coupling", &S.tr_mul(&forces), &tau, SOLVED);
        aba(&free, &mut ws_free, &q_free, &(&S * &v), &forces, &mut vd_free);
        close("motion", &vd_free, &(&S * &vd), SOLVED);
    }
}

#[test]
fn joints_are_moved_and_named_as_the_file_says() {
    for Pair { coupled, free, S, offsets, q, q_free, .. } in pairs() {
        for follower in coupled.followers() {
            let JointIndex(row) = free.joint(&follower.name).unwrap();
            assert!((follower.position(&q) - q_free.joints[row]).abs() < 1e-14 * (1.0 + q_free.joints[row].abs()));
            assert!((follower.offset - offsets[row]).abs() < 1e-15);
            let error = coupled.joint(&follower.name).unwrap_err();
            assert!(matches!(error, ModelError::Follows { .. }), "{error}");
        }
        for frame in (0..coupled.frames().len()).map(FrameIndex) {
            for (k, joint) in coupled.joints().iter().enumerate() {
                let column = S.column(coupled.base_dofs() + k);
                let carried = (0..free.joint_count())
                    .any(|i| column[free.base_dofs() + i] != 0.0 && free.moves(JointIndex(i), frame));
                assert_eq!(coupled.moves(JointIndex(k), frame), carried, "{}", joint.name);
            }
            let above = coupled.joint_above(frame).map(|joint| coupled.column(joint));
            let row = free.joint_above(frame).map(|joint| free.column(joint));
            assert_eq!(above, row.map(|row| S.row(row).iter().position(|&x| x != 0.0).unwrap()));
        }
    }
}

#[test]
fn limits_of_followers_bound_their_leaders() {
    for Pair { coupled, free, .. } in pairs() {
        for follower in coupled.followers() {
            let leader = &coupled.joints()[follower.joint.0].limits;
            let own = free.joints()[free.joint(&follower.name).unwrap().0].limits;
            assert_eq!(follower.limits, own);
            for position in [leader.lower, leader.upper] {
                // Infinite where neither of them has limits.
                let position = follower.multiplier * position + follower.offset;
                assert!(position >= own.lower - 1e-15 && position <= own.upper + 1e-15, "{}", follower.name);
            }
            assert!(leader.velocity * follower.multiplier.abs() <= own.velocity * (1.0 + 1e-15));
        }
        for joint in coupled.joints() {
            assert_eq!(joint.limits.effort, free.joints()[free.joint(&joint.name).unwrap().0].limits.effort);
        }
    }
}

#[test]
fn a_rotor_behind_a_gear_counts_by_the_square_of_its_ratio() {
    // A wheel turns on a fixed axis, a second one with -7 times its speed.
    let wheel = |name: &str, moment: f64| {
        format!(
            r#"<link name="{name}"><inertial><mass value="1"/><inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0"
            ixz="0" iyz="0"/></inertial></link>"#
        )
    };
    let text = format!(
        r#"<robot name="gear"><link name="frame"/>{}{}<joint name="slow" type="continuous"><parent link="frame"/>
        <child link="wheel"/><axis xyz="0 0 1"/></joint><joint name="fast" type="continuous"><origin xyz="0.2 0 0"/>
        <parent link="frame"/><child link="pinion"/><axis xyz="0 0 1"/><mimic joint="slow" multiplier="-7"/></joint></robot>"#,
        wheel("wheel", 0.5),
        wheel("pinion", 0.01)
    );
    let mut model = Model::from_urdf(&text, &ModelOptions { base: Base::Fixed, ..ModelOptions::default() }).unwrap();
    let (mut ws, mut vd, zero) = (Workspace::new(&model), DVector::zeros(1), DVector::zeros(1));
    let tau = DVector::from_element(1, 3.0);
    let mut acceleration = |model: &Model| {
        aba(model, &mut ws, &model.neutral(), &zero, &tau, &mut vd);
        vd[0]
    };
    assert!((acceleration(&model) - 3.0 / (0.5 + 49.0 * 0.01)).abs() < 1e-14);
    model.set_follower_rotor_inertia(FollowerIndex(0), 0.002);
    assert!((acceleration(&model) - 3.0 / (0.5 + 49.0 * 0.012)).abs() < 1e-14);
    model.set_rotor_inertia(JointIndex(0), 0.1);
    assert!((acceleration(&model) - 3.0 / (0.6 + 49.0 * 0.012)).abs() < 1e-14);
}

#[test]
fn a_massless_leader_is_carried_by_its_follower() {
    // The crank has no mass, nor has the tree alone a regular M; the slider, 0.1 m per rad, has 2 kg.
    let text = r#"<robot name="crank"><link name="frame"/><link name="crank"/><link name="slider"><inertial><mass value="2"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="turn" type="continuous"><parent link="frame"/><child link="crank"/></joint>
        <joint name="slide" type="prismatic"><parent link="frame"/><child link="slider"/><axis xyz="0 0 1"/>
        <mimic joint="turn" multiplier="0.1" offset="0.3"/></joint></robot>"#;
    let model = Model::from_urdf(text, &ModelOptions { base: Base::Fixed, ..ModelOptions::default() }).unwrap();
    assert_eq!(model.massless_joint(), None);
    let (mut ws, mut vd, zero) = (Workspace::new(&model), DVector::zeros(1), DVector::zeros(1));
    let error = aba_refined(&model, &mut ws, &model.neutral(), &zero, &zero, &mut vd);
    assert!((vd[0] + 9.81 / 0.1).abs() < 1e-12 && error < 1e-15, "{} {error:e}", vd[0]);
    // Its moments go with its mass: without one they would be no body's.
    let massless = text.replacen(r#"mass value="2""#, r#"mass value="0""#, 1);
    let massless = ["ixx", "iyy", "izz"]
        .iter()
        .fold(massless, |text, moment| text.replacen(&format!(r#"{moment}="1""#), &format!(r#"{moment}="0""#), 1));
    let model = Model::from_urdf(&massless, &ModelOptions { base: Base::Fixed, ..ModelOptions::default() }).unwrap();
    assert_eq!(model.massless_joint(), Some(JointIndex(0)));
    assert_eq!(aba_refined(&model, &mut ws, &model.neutral(), &zero, &zero, &mut vd), f64::INFINITY);
    // No number of such a robot is one, not even those of a wheel that has nothing to do with it.
    let wheel = r#"<link name="wheel"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
        </inertial></link><joint name="spin" type="continuous"><parent link="frame"/><child link="wheel"/></joint>"#;
    let two = massless.replace(r#"<link name="crank"/>"#, &format!(r#"{wheel}<link name="crank"/>"#));
    let model = Model::from_urdf(&two, &ModelOptions { base: Base::Fixed, ..ModelOptions::default() }).unwrap();
    let (mut ws, mut vd, ones) = (Workspace::new(&model), DVector::zeros(2), DVector::from_element(2, 1.0));
    aba(&model, &mut ws, &model.neutral(), &ones, &ones, &mut vd);
    assert!(vd.iter().all(|x| x.is_nan()), "{vd}");
}

//! The draft of a robot's folder: what its URDF says, and plausible values where it says nothing.
//!
//! Read off: base, legs (the two lowest chains of six joints), torso (where the arms branch off), half-sitting (the knees
//! bent by [`KNEE_DEG`]), the servos' damping (critical). Assumed: stiffness, rotors, friction, the sole. What is assumed
//! is told in [`Draft::notes`], for nobody should believe it.

use multibody::leg::{LegError, LegKinematics};
use multibody::{
    Base, Configuration, FrameIndex, InertiaCheck, JointIndex, Model, ModelError, ModelOptions, Workspace, crba,
    forward_kinematics, held_links,
};
use robot::{
    EnergyCoefficients, Feet, FootDescription, FootMounting, Friction, LimitFactors, MaterialDescription,
    MeshDescription, RobotDescription, ServoGains, SoleDescription, SolverDescription,
};
use std::collections::BTreeMap;

/// Bend of the knees at half-sitting (deg), of all robots that are known to walk between 30 and 50.
const KNEE_DEG: f64 = 40.0;
/// Young's modulus of the sole (Pa) of a robot of this mass: under a heavier one of stiffer foam the sole gives way as much.
const YOUNG_MODULUS_PA: f64 = 0.32e6;
/// Mass of the robot (kg) whose sole, servos and stabiliser are the model for others.
pub const MODEL_MASS_KG: f64 = 39.0;
/// Stiffness of its servos (N m/rad): of legs and trunk, of the rest.
const SERVO_STIFFNESS: [f64; 2] = [15_000.0, 3_000.0];
/// Rotors behind gears (kg m^2), dry friction (N m) and viscous friction (N m s/rad) of the same.
const ROTOR_KG_M2: [f64; 2] = [0.1, 0.05];
const DRY_FRICTION_NM: [f64; 2] = [2.0, 1.0];
const VISCOUS_FRICTION: [f64; 2] = [1.0, 0.5];
/// Winding loss (W) at the largest torque.
const LOSS_W: f64 = 100.0;
/// A sole of foam under a flat foot (m): length, width, thickness; how high it raises the foot; and its elements.
const SOLE_M: [f64; 3] = [0.23, 0.13, 0.021];
const RAISED_M: f64 = 0.010;
const CELLS: [u32; 3] = [12, 7, 3];
/// Height of an ankle above the foot's bottom (m) where the file has no box for it.
const ANKLE_HEIGHT_M: f64 = 0.093;
/// Axes this near to a point go through it (m): models are rounded.
const ROUNDED_M: f64 = 1e-6;

/// A robot's folder that nobody has looked at yet.
#[derive(Debug, Clone)]
pub struct Draft {
    /// `robot.toml`.
    pub description: RobotDescription,
    /// `sole.toml`.
    pub sole: SoleDescription,
    /// Mass of all links (kg).
    pub mass_kg: f64,
    /// Height of the centre of mass above the ground at half-sitting (m).
    pub com_height_m: f64,
    /// Distance of the ankles at half-sitting (m).
    pub ankle_distance_m: f64,
    /// What was assumed, a sentence each.
    pub notes: Vec<String>,
}

/// Why a URDF makes no walking robot.
#[derive(Debug, thiserror::Error)]
pub enum DraftError {
    /// The file is no robot.
    #[error(transparent)]
    Model(#[from] Box<ModelError>),
    /// There are no two legs. Remedy: lock the joints beyond six (`fixed`), or make the pelvis the root.
    #[error(
        "{found} chains of exactly six joints lead from `{root}` to a link; a robot that walks here has two: make the pelvis the root, and joints beyond the ankles fixed"
    )]
    Legs {
        /// How many.
        found: usize,
        /// The root.
        root: String,
    },
    /// The joints of a leg are no leg.
    #[error("the {side} leg ({joints})")]
    Leg {
        /// Which.
        side: &'static str,
        /// Its joints.
        joints: String,
        /// Why.
        source: LegError,
    },
}

impl From<ModelError> for DraftError {
    fn from(error: ModelError) -> Self {
        Self::Model(Box::new(error))
    }
}

/// A leg as it was found.
struct Leg {
    joints: [JointIndex; 6],
    /// Link of the last joint.
    foot: FrameIndex,
    ankle: FrameIndex,
    kinematics: LegKinematics,
}

/// Drafts the folder of the robot whose URDF this is. `boxes_m` are the collision boxes of links, by link: size and
/// centre in the link.
///
/// # Errors
/// [`DraftError`] says what keeps it from being a robot that walks.
pub fn draft(urdf: &str, file_name: &str, boxes_m: &BTreeMap<String, [[f64; 3]; 2]>) -> Result<Draft, DraftError> {
    let mut notes = Vec::new();
    let options = ModelOptions { inertia: InertiaCheck::Strict, ..ModelOptions::default() };
    let model = Model::from_urdf(urdf, &options)?;
    let legs = legs(&model, &mut notes)?;
    let (root, links) = held_links(urdf)?;
    let name = |joint: &JointIndex| model.joints()[joint.0].name.clone();
    let frame_name = |frame: FrameIndex| model.frames()[frame.0].name.clone();

    let trunk = trunk(&model, &legs);
    let child = |joint: &JointIndex| links.iter().find(|link| link.joint == model.joints()[joint.0].name);
    let torso_link = trunk.last().and_then(child).map_or_else(|| root.clone(), |link| link.name.clone());
    let all: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
    let walking: Vec<JointIndex> = legs.iter().flat_map(|leg| leg.joints).chain(trunk.iter().copied()).collect();
    let still: Vec<String> =
        (0..all.len()).map(JointIndex).filter(|joint| !walking.contains(joint)).map(|joint| name(&joint)).collect();
    let mut groups: BTreeMap<String, Vec<String>> = BTreeMap::from([
        ("left_leg".to_owned(), legs[0].joints.iter().map(name).collect()),
        ("right_leg".to_owned(), legs[1].joints.iter().map(name).collect()),
    ]);
    if !trunk.is_empty() {
        groups.insert("trunk".to_owned(), trunk.iter().map(name).collect());
    }
    if !still.is_empty() {
        notes.push("Joints of arms, hands and head are locked at zero: `walking_locked`.".to_owned());
        groups.insert("still".to_owned(), still);
    }
    let walking_locked = groups.contains_key("still").then(|| "still".to_owned()).into_iter().collect();

    let posture = half_sitting(&model, &legs, &mut notes);
    let named =
        |part: &[&str], what: &str, within: &dyn Fn(FrameIndex) -> bool, else_: String, notes: &mut Vec<String>| {
            let found = (0..model.frames().len()).map(FrameIndex).filter(|frame| within(*frame)).find(|frame| {
                let name = frame_name(*frame).to_lowercase();
                part.iter().any(|part| name.contains(part))
            });
            found.map_or_else(
                || {
                    notes.push(format!("No link's name says that it is {what}: `{else_}` is taken."));
                    else_.clone()
                },
                frame_name,
            )
        };
    let imu_frame = named(&["imu", "gyro"], "the inertial unit", &|_| true, root.clone(), &mut notes);
    let foot = |side: usize, notes: &mut Vec<String>| {
        let leg = &legs[side];
        let here = |frame: FrameIndex| model.joint_above(frame) == Some(leg.joints[5]);
        let link = frame_name(leg.foot);
        let force_sensor_frame =
            named(&["force", "_ft", "sensor"], "a foot's force sensor", &here, link.clone(), notes);
        FootDescription { link, ankle_frame: frame_name(leg.ankle), force_sensor_frame }
    };
    let feet = Feet { left: foot(0, &mut notes), right: foot(1, &mut notes) };
    let (servos, energy) = drives(&model, urdf, &posture, &walking)?;
    notes.push("Stiffness, rotors and friction of all servos are assumed, scaled by mass from HRP-4's.".to_owned());
    notes.push("There are no capsules: nothing keeps links apart.".to_owned());
    let sole = sole(&model, &legs[0], boxes_m, &mut notes);

    let mut ws = Workspace::new(&model);
    let placed = forward_kinematics(&model, &mut ws, &posture);
    let ankles = [placed.pose(legs[0].ankle).translation, placed.pose(legs[1].ankle).translation];
    let com_height_m = placed.center_of_mass().z - 0.5 * (ankles[0].z + ankles[1].z) + sole.foot.ankle_in_sole_m[2];
    let half_sitting_deg = model
        .joints()
        .iter()
        .zip(posture.joints.iter())
        .map(|(joint, angle)| (joint.name.clone(), (1e2 * angle.to_degrees()).round() / 1e2))
        .filter(|(_, degrees)| *degrees != 0.0)
        .collect();
    let description = RobotDescription {
        name: model.name().to_owned(),
        urdf: file_name.to_owned(),
        base_link: root,
        torso_link,
        imu_frame,
        joints: all,
        walking_locked,
        groups,
        half_sitting_deg,
        feet,
        servos,
        energy,
        limits: LimitFactors { position_margin_deg: 0.5, velocity_factor: 0.5, torque_factor: 1.0 },
        capsules: Vec::new(),
        collision_pairs: Vec::new(),
        collision_pairs_left_out: Vec::new(),
    };
    let millimetres = |length_m: f64| (1e3 * length_m).round() / 1e3;
    let ankle_distance_m = millimetres((ankles[0] - ankles[1]).xy().norm());
    let mass_kg = model.total_mass_kg();
    Ok(Draft { description, sole, mass_kg, com_height_m: millimetres(com_height_m), ankle_distance_m, notes })
}

/// The two lowest chains of six joints, left first.
fn legs(model: &Model, notes: &mut Vec<String>) -> Result<[Leg; 2], DraftError> {
    let mut ws = Workspace::new(model);
    let neutral = model.neutral();
    let placed = forward_kinematics(model, &mut ws, &neutral);
    let chain = |frame: FrameIndex| -> Vec<JointIndex> {
        (0..model.joint_count()).map(JointIndex).filter(|joint| model.moves(*joint, frame)).collect()
    };
    let frames: Vec<FrameIndex> = (0..model.frames().len()).map(FrameIndex).collect();
    let longer = |last: JointIndex| {
        frames.iter().any(|frame| model.moves(last, *frame) && model.joint_above(*frame) != Some(last))
    };
    let mut found: Vec<([JointIndex; 6], FrameIndex)> = Vec::new();
    for frame in &frames {
        if let Ok(joints) = <[JointIndex; 6]>::try_from(chain(*frame))
            && !longer(joints[5])
            && found.iter().all(|(known, _)| *known != joints)
        {
            found.push((joints, *frame));
        }
    }
    found.sort_by(|(_, a), (_, b)| placed.pose(*a).translation.z.total_cmp(&placed.pose(*b).translation.z));
    if found.len() < 2 {
        let root = model.frames()[model.base_frame().0].name.clone();
        return Err(DraftError::Legs { found: found.len(), root });
    }
    found.truncate(2);
    found.sort_by(|(_, a), (_, b)| placed.pose(*b).translation.y.total_cmp(&placed.pose(*a).translation.y));
    let mut leg = |side: usize| {
        let (joints, foot) = found[side];
        let word = ["left", "right"][side];
        let here = frames.iter().copied().filter(|frame| model.joint_above(*frame) == Some(joints[5]));
        let ankle = here.clone().find(|frame| is_ankle(model, &joints, *frame)).unwrap_or_else(|| {
            notes.push(format!(
                "No link of the {word} foot lies where the last two axes of its leg cross, with the foot's axes: add one to the URDF."
            ));
            foot
        });
        let kinematics = LegKinematics::of_model(model, &joints, ankle).map_err(|source| {
            let names: Vec<&str> = joints.iter().map(|joint| model.joints()[joint.0].name.as_str()).collect();
            DraftError::Leg { side: word, joints: names.join(", "), source }
        })?;
        Ok::<_, DraftError>(Leg { joints, foot, ankle, kinematics })
    };
    Ok([leg(0)?, leg(1)?])
}

/// Do the last two axes of a leg go through the frame, whose axes are the base's at zero angles?
fn is_ankle(model: &Model, joints: &[JointIndex; 6], frame: FrameIndex) -> bool {
    let mut ws = Workspace::new(model);
    let neutral = model.neutral();
    let mut placed = forward_kinematics(model, &mut ws, &neutral);
    let mut J = nalgebra::DMatrix::zeros(6, model.nv());
    placed.jacobian(frame, &mut J);
    let passes = |joint: &JointIndex| J.column(model.column(*joint)).rows(0, 3).norm() < ROUNDED_M;
    let turned = spatial::so3::log(&placed.pose(frame).rotation).norm();
    joints[4..].iter().all(passes) && turned < ROUNDED_M
}

/// Joints between the base and where the arms branch off: those that move every limb but the legs.
fn trunk(model: &Model, legs: &[Leg; 2]) -> Vec<JointIndex> {
    let is_leg = |joint: JointIndex| legs.iter().any(|leg| leg.joints.contains(&joint));
    let tips: Vec<FrameIndex> = (0..model.frames().len())
        .map(FrameIndex)
        .filter(|frame| model.joint_above(*frame).is_some_and(|joint| !is_leg(joint)))
        .filter(|frame| {
            let last = model.joint_above(*frame);
            let others = (0..model.frames().len()).map(FrameIndex);
            last.is_some_and(|last| {
                others.clone().all(|other| !model.moves(last, other) || model.joint_above(other) == Some(last))
            })
        })
        .collect();
    (0..model.joint_count())
        .map(JointIndex)
        .filter(|joint| tips.len() > 1 && tips.iter().all(|tip| model.moves(*joint, *tip)))
        .collect()
}

/// Both knees bent, the feet level below the hips.
fn half_sitting(model: &Model, legs: &[Leg; 2], notes: &mut Vec<String>) -> Configuration {
    let mut q = model.neutral();
    let bend = 0.5 * KNEE_DEG.to_radians();
    for leg in legs {
        let limits = model.joints()[leg.joints[3].0].limits;
        let knee = if limits.upper.abs() >= limits.lower.abs() { 2.0 * bend } else { -2.0 * bend };
        let mut wanted = leg.kinematics.forward(&[0.0; 6]);
        wanted.translation.z += leg.kinematics.length_m(0.0) - leg.kinematics.length_m(knee);
        let found = leg.kinematics.inverse(&wanted, &[0.0, 0.0, 0.0, knee, 0.0, 0.0]);
        for (joint, angle) in leg.joints.iter().zip(found.joints_rad) {
            q.joints[joint.0] = angle;
            let limits = model.joints()[joint.0].limits;
            if angle < limits.lower || angle > limits.upper {
                notes.push(format!(
                    "At half-sitting {} is beyond its limit: change half_sitting_deg.",
                    model.joints()[joint.0].name
                ));
            }
        }
    }
    q
}

/// A servo and a loss for every joint; damping critical for rotor and link with the base held.
fn drives(
    model: &Model,
    urdf: &str,
    posture: &Configuration,
    walking: &[JointIndex],
) -> Result<(Vec<ServoGains>, Vec<EnergyCoefficients>), DraftError> {
    let held = Model::from_urdf(urdf, &ModelOptions { base: Base::Fixed, ..ModelOptions::default() })?;
    let mut mass = nalgebra::DMatrix::zeros(held.nv(), held.nv());
    crba(&held, &mut Workspace::new(&held), posture, &mut mass);
    let scale = model.total_mass_kg() / MODEL_MASS_KG;
    let round = |x: f64, digits: i32| {
        let unit = 10_f64.powi(x.abs().max(f64::MIN_POSITIVE).log10().floor() as i32 + 1 - digits);
        (x / unit).round() * unit
    };
    let each = model.joints().iter().enumerate().map(|(i, joint)| {
        let kind = usize::from(!walking.contains(&JointIndex(i)));
        let kp = round(scale * SERVO_STIFFNESS[kind], 2);
        let rotor = round(scale * ROTOR_KG_M2[kind], 2);
        let servo = ServoGains {
            of: vec![joint.name.clone()],
            kp_nm_per_rad: kp,
            kd_nm_s_per_rad: round(2.0 * (kp * (rotor + mass[(i, i)])).sqrt(), 3),
            rotor_inertia_kg_m2: rotor,
            coulomb_friction_nm: DRY_FRICTION_NM[kind],
            viscous_friction_nm_s_per_rad: VISCOUS_FRICTION[kind],
        };
        let effort = joint.limits.effort;
        let loss = if effort.is_finite() && effort > 0.0 { round(LOSS_W / (effort * effort), 2) } else { 0.0 };
        let energy = EnergyCoefficients {
            of: vec![joint.name.clone()],
            torque_squared_w_per_nm2: loss,
            power: 1.0,
            speed_squared_w_s2_per_rad2: VISCOUS_FRICTION[kind],
        };
        (servo, energy)
    });
    Ok(each.unzip())
}

/// Foam below the left foot's box, or below an ankle of usual height.
fn sole(
    model: &Model,
    leg: &Leg,
    boxes_m: &BTreeMap<String, [[f64; 3]; 2]>,
    notes: &mut Vec<String>,
) -> SoleDescription {
    let mut ws = Workspace::new(model);
    let neutral = model.neutral();
    let placed = forward_kinematics(model, &mut ws, &neutral);
    let ankle = placed.pose(leg.ankle);
    // Links of the foot that have a box; the lowest one touches the ground.
    let lowest = (0..model.frames().len())
        .map(FrameIndex)
        .filter(|frame| model.joint_above(*frame) == Some(leg.joints[5]))
        .filter_map(|frame| {
            let [size, centre] = boxes_m.get(&model.frames()[frame.0].name)?;
            Some((*size, placed.pose(frame).point(&(*centre).into()) - ankle.translation))
        })
        .min_by(|(a, p), (b, q)| (p.z - 0.5 * a[2]).total_cmp(&(q.z - 0.5 * b[2])));
    let millimetres = |length_m: f64| (1e3 * length_m).round() / 1e3;
    let (box_m, ankle_in_sole_m) = match lowest {
        Some((size, centre)) => {
            let height_m = 0.5 * size[2] - centre.z + RAISED_M;
            ([size[0], size[1], SOLE_M[2]], [-centre.x, -centre.y, height_m])
        }
        None => {
            notes.push("The foot has no collision box: length, width and height of the sole are HRP-4's.".to_owned());
            (SOLE_M, [0.0, 0.0, ANKLE_HEIGHT_M + RAISED_M])
        }
    };
    notes
        .push("The sole's foam is assumed, its stiffness scaled by mass from HRP-4's; friction is HRP-4's.".to_owned());
    let scale = model.total_mass_kg() / MODEL_MASS_KG;
    let young_modulus_pa = (scale * YOUNG_MODULUS_PA * 1e-4).round() * 1e4;
    SoleDescription {
        friction: Friction::Uniform(0.65),
        contact: robot::ContactSet::Bottom,
        mesh: MeshDescription { box_m: Some(box_m.map(millimetres)), cells: Some(CELLS), file: None },
        material: MaterialDescription { young_modulus_pa, poisson_ratio: 0.31 },
        foot: FootMounting { ankle_in_sole_m: ankle_in_sole_m.map(millimetres) },
        solver: SolverDescription::default(),
    }
}

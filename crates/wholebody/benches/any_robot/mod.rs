//! Any robot as URDF, with a file that says what a URDF cannot: see `jvrc1.toml`.

use super::support::Walk;
use gait::GaitSettings;
use multibody::{InertiaCheck, JointIndex, Model, ModelOptions, Workspace, forward_kinematics};
use spatial::Vec3;
use std::path::Path;
use toml::{Table, Value};
use wholebody::{
    FootSettings, LinkCapsule, PostureJoint, ProposalSettings, SoleFace, Verdict, WholeBodySettings, propose_pairs,
};

/// Name, model, settings, and four steps of 0.05 m.
pub fn read(urdf: &Path, file: &Path) -> (String, Model, WholeBodySettings, Walk) {
    let text =
        |path: &Path| std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let table: Table = text(file).parse().unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let key = |key: &str| table.get(key).unwrap_or_else(|| panic!("{}: no `{key}`", file.display())).clone();
    let locked: Vec<String> = of(key("locked"));
    let options = ModelOptions {
        locked_joints: locked.into_iter().map(|joint| (joint, 0.0)).collect(),
        inertia: InertiaCheck::Tolerant,
        ..ModelOptions::default()
    };
    let mut model =
        Model::from_urdf(&text(urdf), &options).unwrap_or_else(|error| panic!("{}: {error}", urdf.display()));
    for joint in 0..model.joint_count() {
        model.set_rotor_inertia(JointIndex(joint), of(key("rotor_inertia_kg_m2")));
    }
    let posture: Table = of(key("posture_deg"));
    let posture: Vec<PostureJoint> = posture
        .into_iter()
        .map(|(joint, deg)| PostureJoint { joint, position_rad: of::<f64>(deg).to_radians() })
        .collect();
    let ankle_height_m: f64 = of(key("ankle_height_m"));
    let [length_m, width_m]: [f64; 2] = of(key("sole_m"));
    let links: [String; 2] = of(key("ankle_links"));
    let torso_link: String = of(key("torso_link"));
    let mut settings = WholeBodySettings::new([&links[0], &links[1]], &torso_link);
    settings.feet = links
        .clone()
        .map(|ankle_link| FootSettings { ankle_link, ankle_in_sole_m: Vec3::new(0.0, 0.0, ankle_height_m) });
    settings.sole = SoleFace { length_m, width_m, ..settings.sole };
    settings.collision.capsules = of::<Vec<robot::Capsule>>(key("capsules"))
        .into_iter()
        .map(|capsule| LinkCapsule {
            name: capsule.name,
            link: capsule.link,
            from_m: Vec3::from(capsule.from_m),
            to_m: Vec3::from(capsule.to_m),
            radius_m: capsule.radius_m,
        })
        .collect();
    // The walk begins where the posture stands.
    let mut q = model.neutral();
    for target in &posture {
        let joint = model.joint(&target.joint).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        q.joints[joint.0] = target.position_rad;
    }
    let proposals = propose_pairs(&model, &settings.collision.capsules, &q, &ProposalSettings::default());
    let proposals = proposals.unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    settings.collision.pairs =
        proposals.into_iter().filter(|p| p.verdict == Verdict::Proposed).map(|p| p.pair).collect();
    settings.posture = posture;
    let mut ws = Workspace::new(&model);
    let placed = forward_kinematics(&model, &mut ws, &q);
    let ankles = links.each_ref().map(|link| placed.pose(model.frame(link).expect("a link")).translation);
    let mut gait =
        GaitSettings { walk: gait::Walk::Straight { swings: 4, step_length_m: 0.05 }, ..GaitSettings::default() };
    gait.body.mass_kg = Some(model.total_mass_kg());
    gait.body.ankle_height_m = Some(ankle_height_m);
    gait.body.com_height_m = placed.center_of_mass().z - ankles[0].z + ankle_height_m;
    gait.sole =
        gait::SoleOutline { length_m: Some(length_m), width_m: Some(width_m), left_ankle_in_sole_m: Some([0.0, 0.0]) };
    gait.start.ankle_distance_m = ankles[0].y - ankles[1].y;
    (model.name().to_owned(), model, settings, Walk::plan(&gait))
}

fn of<T: serde::de::DeserializeOwned>(value: Value) -> T {
    value.try_into().unwrap_or_else(|error| panic!("{error}"))
}

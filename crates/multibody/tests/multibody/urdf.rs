//! What the reader accepts, and how it refuses the rest.

use multibody::*;
use nalgebra::DMatrix;
use spatial::Vec3;

const MASS: &str =
    r#"<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"#;
const LIMIT: &str = r#"<limit lower="-1" upper="1" effort="1" velocity="1"/>"#;

fn link(name: &str, inside: &str) -> String {
    format!(r#"<link name="{name}">{inside}</link>"#)
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, inside: &str) -> String {
    format!(r#"<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inside}</joint>"#)
}

fn robot(parts: &[String]) -> String {
    format!(r#"<?xml version="1.0"?><robot name="test">{}</robot>"#, parts.concat())
}

fn read(parts: &[String]) -> Result<Model, ModelError> {
    Model::from_urdf(&robot(parts), &ModelOptions::default())
}

/// The message of a refusal with all its causes.
fn refused(parts: &[String]) -> (ModelError, String) {
    let error = read(parts).expect_err("this is not a robot");
    let mut message = error.to_string();
    let mut cause = std::error::Error::source(&error);
    while let Some(inner) = cause {
        message += &format!(": {inner}");
        cause = inner.source();
    }
    (error, message)
}

/// Two links and what is between them.
fn pair(between: String) -> Vec<String> {
    vec![link("a", MASS), link("b", MASS), between]
}

macro_rules! assert_refused {
    ($parts:expr, $pattern:pat, $($word:expr),+) => {
        let (error, message) = refused(&$parts);
        assert!(matches!(error, $pattern), "{error:?}");
        $(assert!(message.contains($word), "`{}` is not in: {message}", $word);)+
    };
}

#[test]
fn shapes_cannot_make_a_robot_unreadable() {
    let shapes = r#"<visual><geometry><mesh filename="x.dae"/></geometry><material name="m"><texture/></material></visual>
        <visual><geometry><sphere radius="big"/></geometry></visual><collision/><!-- <joint> --><![CDATA[</link>]]>"#;
    let texture = r#"<material name="m"><color rgba="1 0 0"/><texture/></material><gazebo><plugin a="<"/></gazebo>"#;
    // An unescaped < in an attribute is not XML; everything else above is, and none of it matters here.
    let texture = texture.replace(r#"a="<""#, r#"a="&lt;""#);
    let parts = [link("a", &format!("{shapes}{MASS}")), texture, "<transmission/>".to_owned()];
    assert_eq!(read(&parts).unwrap().total_mass_kg(), 1.0);
}

#[test]
fn every_kind_of_joint_moves_as_it_says() {
    let origin = r#"<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/><axis xyz="0 2 0"/>"#;
    for (kind, limit, moved) in [
        ("revolute", LIMIT, Vec3::zeros()),
        ("continuous", "", Vec3::zeros()),
        ("prismatic", LIMIT, Vec3::new(-0.5, 0.0, 0.0)),
    ] {
        let model = read(&pair(joint("j", kind, "a", "b", &format!("{origin}{limit}")))).unwrap();
        let mut q = model.neutral();
        q.joints[0] = 0.5;
        let mut ws = Workspace::new(&model);
        let placed = forward_kinematics(&model, &mut ws, &q);
        let X_WB = placed.pose(model.frame("b").unwrap());
        assert!((X_WB.translation - Vec3::new(1.0, 2.0, 3.0) - moved).norm() < 1e-15, "{kind}");
        let turned = if kind == "prismatic" { 0.0 } else { 0.5 };
        let expected = spatial::so3::about_z(std::f64::consts::FRAC_PI_2) * spatial::so3::about_y(turned);
        assert!((X_WB.rotation - expected).norm() < 1e-15, "{kind}");
        let limits = model.joints()[0].limits;
        assert_eq!(limits.upper.is_infinite(), kind == "continuous");
    }
}

#[test]
fn fixed_and_massless_links_are_merged_and_remain_frames() {
    let parts = [
        link("footprint", ""),
        link("base", MASS),
        link("camera", ""),
        link("arm", MASS),
        joint("f1", "fixed", "footprint", "base", r#"<origin xyz="0 0 1"/>"#),
        joint("f2", "fixed", "base", "camera", r#"<origin xyz="0 1 0"/>"#),
        joint("j", "revolute", "camera", "arm", &format!(r#"<origin xyz="1 0 0"/>{LIMIT}"#)),
    ];
    let model = read(&parts).unwrap();
    assert_eq!((model.joint_count(), model.frames().len(), model.total_mass_kg()), (1, 4, 2.0));
    let mut ws = Workspace::new(&model);
    let placed = forward_kinematics(&model, &mut ws, &model.neutral());
    let arm = model.frame("arm").unwrap();
    assert!((placed.pose(arm).translation - Vec3::new(1.0, 1.0, 1.0)).norm() < 1e-15);
    let joint = model.joint("j").unwrap();
    assert!(model.moves(joint, arm) && !model.moves(joint, model.frame("camera").unwrap()));
    assert_eq!((model.joint_above(arm), model.joint_above(model.base_frame())), (Some(joint), None));
}

#[test]
fn a_locked_joint_is_as_if_it_had_been_fixed_there() {
    let seed = 11;
    let whole = Model::from_urdf(&crate::random_robot::urdf(seed, 12), &ModelOptions::default()).unwrap();
    let mut random = crate::random_robot::Random(seed);
    let q = crate::random_robot::configuration(&whole, &mut random);
    let locked: Vec<(String, f64)> =
        (0..whole.joint_count()).step_by(2).map(|i| (whole.joints()[i].name.clone(), q.joints[i])).collect();
    let options = ModelOptions { locked_joints: locked.clone(), ..ModelOptions::default() };
    let part = Model::from_urdf(&crate::random_robot::urdf(seed, 12), &options).unwrap();
    assert_eq!(part.joint_count(), whole.joint_count() - locked.len());
    let mut q_part = part.neutral();
    q_part.base = q.base;
    let kept: Vec<usize> = part.joints().iter().map(|joint| whole.joint(&joint.name).unwrap().0).collect();
    kept.iter().enumerate().for_each(|(k, &i)| q_part.joints[k] = q.joints[i]);
    let columns: Vec<usize> = (0..6).chain(kept.iter().map(|i| 6 + i)).collect();
    let (mut M, mut m) = (DMatrix::zeros(whole.nv(), whole.nv()), DMatrix::zeros(part.nv(), part.nv()));
    crba(&whole, &mut Workspace::new(&whole), &q, &mut M);
    crba(&part, &mut Workspace::new(&part), &q_part, &mut m);
    let block = M.select_rows(&columns).select_columns(&columns);
    assert!((block - &m).amax() < 1e-12 * m.amax());
}

/// Revolute j carries prismatic k, which follows it with these attributes.
fn follower(attributes: &str, limit: &str) -> Vec<String> {
    let mimic = format!(r#"<mimic joint="j" {attributes}/>"#);
    vec![
        link("a", MASS),
        link("b", MASS),
        link("c", MASS),
        joint("j", "revolute", "a", "b", LIMIT),
        joint("k", "prismatic", "b", "c", &format!("{limit}{mimic}")),
    ]
}

/// Every entry of `<inertia>` where it belongs, as the file has it and through a quarter turn about x: y becomes z, z becomes -y.
#[test]
fn each_entry_of_the_inertia_tensor_goes_to_its_place() {
    let tensor = r#"<mass value="1"/><inertia ixx="2" iyy="3" izz="4" ixy="0.1" ixz="0.2" iyz="0.3"/>"#;
    for (origin, rows) in [
        ("", [[2.0, 0.1, 0.2], [0.1, 3.0, 0.3], [0.2, 0.3, 4.0]]),
        (r#"<origin rpy="1.5707963267948966 0 0"/>"#, [[2.0, -0.2, 0.1], [-0.2, 4.0, -0.3], [0.1, -0.3, 3.0]]),
    ] {
        let model = read(&[link("a", &format!("<inertial>{origin}{tensor}</inertial>"))]).unwrap();
        let mut mass = DMatrix::zeros(6, 6);
        crba(&model, &mut Workspace::new(&model), &model.neutral(), &mut mass);
        for (i, row) in rows.iter().enumerate() {
            for (j, expected) in row.iter().enumerate() {
                assert!((mass[(3 + i, 3 + j)] - expected).abs() < 1e-15, "{origin} ({i}, {j}): {mass}");
            }
        }
    }
}

#[test]
fn a_follower_is_locked_with_its_leader() {
    let parts = follower(r#"multiplier="2" offset="0.25""#, LIMIT);
    let model = read(&parts).unwrap();
    assert_eq!((model.joint_count(), model.followers().len(), model.nv()), (1, 1, 7));
    let locked = |locks: &[(&str, f64)]| {
        let locked_joints = locks.iter().map(|(name, position)| ((*name).to_owned(), *position)).collect();
        Model::from_urdf(&robot(&parts), &ModelOptions { locked_joints, ..ModelOptions::default() })
    };
    // By its leader, and by itself beside it.
    for (locks, expected) in [(&[("j", 0.5)][..], 1.25), (&[("j", 0.5), ("k", 0.125)][..], 0.125)] {
        let model = locked(locks).unwrap();
        assert_eq!((model.joint_count(), model.followers().len()), (0, 0));
        let mut ws = Workspace::new(&model);
        let placed = forward_kinematics(&model, &mut ws, &model.neutral());
        let found = placed.pose(model.frame("c").unwrap()).translation.x;
        assert!((found - expected).abs() < 1e-15, "{locks:?}: {found}");
    }
    let error = locked(&[("k", 0.1)]).unwrap_err();
    assert!(matches!(error, ModelError::LockedFollower { .. }), "{error}");
    assert!(error.to_string().contains("joint `k` is locked but follows joint `j`"), "{error}");
    // One that only stands at its offset follows nobody: it may be locked where it likes.
    let alone = robot(&follower(r#"multiplier="0" offset="0.25""#, LIMIT));
    let options = ModelOptions { locked_joints: vec![("k".to_owned(), 0.1)], ..ModelOptions::default() };
    assert_eq!(Model::from_urdf(&alone, &options).unwrap().joint_count(), 1);
    assert!(matches!(locked(&[("j", 1e308), ("k", f64::NAN)]), Err(ModelError::NotFinite { .. })));
    assert!(matches!(locked(&[("j", 1e308)]), Err(ModelError::NotFinite { .. })), "twice that is infinite");
}

#[test]
fn what_cannot_move_holds_its_followers() {
    let mut fixed_leader = follower(r#"multiplier="2" offset="0.25""#, LIMIT);
    fixed_leader[3] = joint("j", "fixed", "a", "b", "");
    for (parts, joints) in [(fixed_leader, 0), (follower(r#"multiplier="0" offset="0.25""#, LIMIT), 1)] {
        let model = read(&parts).unwrap();
        assert_eq!((model.joint_count(), model.followers().len()), (joints, 0));
        let mut ws = Workspace::new(&model);
        let placed = forward_kinematics(&model, &mut ws, &model.neutral());
        assert_eq!(placed.pose(model.frame("c").unwrap()).translation.x, 0.25);
    }
    // A fixed joint follows nobody, whatever the file says.
    let fixed = pair(joint("j", "fixed", "a", "b", r#"<mimic joint="nobody"/>"#));
    assert_eq!(read(&fixed).unwrap().joint_count(), 0);
}

#[test]
fn chains_of_followers_are_resolved() {
    let mut parts = follower(r#"multiplier="-2" offset="0.25""#, LIMIT);
    let mimic = r#"<mimic joint="k" multiplier="3" offset="0.125"/>"#;
    parts.push(link("d", MASS));
    parts.push(joint("i", "continuous", "c", "d", mimic));
    let model = read(&parts).unwrap();
    let [k, i] = model.followers() else { panic!("two followers") };
    assert_eq!((k.multiplier, k.offset, k.joint), (-2.0, 0.25, JointIndex(0)));
    assert_eq!((i.multiplier, i.offset, i.joint), (-6.0, 0.875, JointIndex(0)));
    // -1 <= -2 q + 0.25 <= 1, and half the follower's speed.
    let limits = model.joints()[0].limits;
    assert_eq!((limits.lower, limits.upper, limits.velocity, limits.effort), (-0.375, 0.625, 0.5, 1.0));
}

#[test]
fn a_mimic_that_makes_no_sense_names_its_joint() {
    let mimic =
        |joint_name: &str| pair(joint("j", "revolute", "a", "b", &format!(r#"{LIMIT}<mimic joint="{joint_name}"/>"#)));
    assert_refused!(mimic("j"), ModelError::MimicCycle { .. }, "joint `j`");
    assert_refused!(mimic("left_knee"), ModelError::UnknownLeader { .. }, "joint `j` mimics joint `left_knee`");
    let mut circle = follower("", LIMIT);
    circle[3] = joint("j", "revolute", "a", "b", &format!(r#"{LIMIT}<mimic joint="k"/>"#));
    assert_refused!(circle, ModelError::MimicCycle { .. }, "joint `j`");
    for attribute in [r#"multiplier="nan""#, r#"multiplier="inf""#, r#"offset="nan""#, r#"offset="-inf""#] {
        assert_refused!(follower(attribute, LIMIT), ModelError::NotFinite { .. }, "joint `k`", "mimic");
    }
    for steep in [r#"multiplier="1e7""#, r#"multiplier="-1e7""#] {
        assert_refused!(follower(steep, LIMIT), ModelError::Absurd { .. }, "joint `k`", "mimic multiplier");
    }
    let words = follower(r#"multiplier="two""#, LIMIT);
    assert_refused!(words, ModelError::Number { .. }, "joint `k`: <mimic multiplier=\"two\">");
    let nameless = pair(joint("j", "revolute", "a", "b", &format!("{LIMIT}<mimic/>")));
    assert_refused!(nameless, ModelError::Unreadable { .. }, "joint `j`");
    let floating = pair(joint("j", "floating", "a", "b", r#"<mimic joint="k"/>"#));
    assert_refused!(floating, ModelError::UnsupportedJoint { .. }, "joint `j`", "floating");
    let apart = follower(r#"offset="2.5""#, LIMIT);
    assert_refused!(apart, ModelError::MimicLimits { .. }, "joint `k` follows joint `j`", "-3.5 .. -1.5", "-1 .. 1");
}

#[test]
fn a_follower_needs_no_limits_and_can_limit_a_continuous_leader() {
    let limits = read(&follower("", "")).unwrap().joints()[0].limits;
    assert_eq!((limits.lower, limits.upper, limits.velocity), (-1.0, 1.0, 1.0));
    let mut parts = follower(r#"multiplier="0.5""#, LIMIT);
    parts[3] = joint("j", "continuous", "a", "b", "");
    let limits = read(&parts).unwrap().joints()[0].limits;
    assert_eq!((limits.lower, limits.upper, limits.velocity, limits.given), (-2.0, 2.0, 2.0, true));
    assert_eq!(limits.effort, f64::INFINITY);
}

#[test]
fn a_long_chain_is_read_without_recursion() {
    let n = 20_000;
    let mut parts = vec![link("l0", MASS)];
    for i in 1..=n {
        parts.push(link(&format!("l{i}"), ""));
        parts.push(joint(&format!("j{i}"), "fixed", &format!("l{}", i - 1), &format!("l{i}"), ""));
    }
    assert_eq!(read(&parts).unwrap().frames().len(), n + 1);
}

#[test]
fn texts_that_are_no_robots_are_refused() {
    let from = |text: &str| Model::from_urdf(text, &ModelOptions::default()).unwrap_err();
    assert_eq!(from("").to_string(), "the file has no element, a URDF has <robot>");
    assert_eq!(from("<sdf/>").to_string(), "the root element is <sdf>, a URDF has <robot>");
    assert!(matches!(from("<sdf/>"), ModelError::NotARobot { found } if found == "sdf"));
    assert!(matches!(from("<robot/>"), ModelError::NoLink));
    for broken in ["<robot name=\"a\"><link name=\"b\">", "<robot></link></robot>", "<robot><link name=\"a\"></robot>"]
    {
        assert!(matches!(from(broken), ModelError::Xml { line: 1, .. }), "{broken}");
    }
    let third = "<robot>\n<link name=\"a\"/>\n<link name=\"b\"></joint>\n</robot>";
    assert_eq!(from(third).to_string(), "the URDF is not well-formed XML near line 3");
    let two = "<robot name=\"a\"><link name=\"b\"/></robot>\n<robot name=\"c\"><link name=\"d\"/></robot>";
    for (text, second) in [(two, "<robot>, near line 2"), ("<robot/><sdf/>", "<sdf>, near line 1")] {
        assert!(matches!(from(text), ModelError::SeveralElements { .. }), "{text}");
        assert!(from(text).to_string().contains(second), "{}", from(text));
    }
    let macros = r#"<robot name="a"><xacro:include filename="x"/><link name="b"/></robot>"#;
    assert!(matches!(from(macros), ModelError::Macro { element } if element == "xacro:include"));
}

#[test]
fn a_missing_or_wrong_number_names_its_link_or_joint() {
    let no_mass = r#"<inertial><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"#;
    assert_refused!([link("a", MASS), link("heavy", no_mass)], ModelError::Unreadable { .. }, "link `heavy`", "mass");
    let text = MASS.replace(r#"value="1""#, r#"value="one""#);
    assert_refused!(
        [link("heavy", &text)],
        ModelError::Number { .. },
        "link `heavy`: <mass value=\"one\">: one number"
    );
    let empty = MASS.replace(r#"value="1""#, r#"value="""#);
    assert_refused!([link("heavy", &empty)], ModelError::Number { .. }, "link `heavy`: <mass value=\"\">: one number");
    let comma = MASS.replace(r#"ixx="1""#, r#"ixx="0,1""#);
    assert_refused!(
        [link("heavy", &comma)],
        ModelError::Number { .. },
        "link `heavy`: <inertia ixx=\"0,1\">: one number"
    );
    for two in ["1 2", "1, 2, 3", "0.1m 0 0", "0 0 0 m", "0 0 0 0", ""] {
        let origin = format!(r#"<origin xyz="{two}"/>"#);
        let place = format!("joint `j`: <origin xyz=\"{two}\">: three numbers");
        assert_refused!(pair(joint("j", "fixed", "a", "b", &origin)), ModelError::Number { .. }, &place);
    }
    let limit = LIMIT.replace("velocity=\"1\"", "velocity=\"fast\"");
    assert_ne!(limit, LIMIT);
    assert_refused!(
        pair(joint("j", "revolute", "a", "b", &limit)),
        ModelError::Number { .. },
        "<limit velocity=\"fast\">"
    );
    let unnamed = "\n<link name=\"a\"/>\n<link/>".to_owned();
    assert_refused!([unnamed], ModelError::Unreadable { .. }, "link `without a name in line 3`", "name");
    let headless = r#"<joint name="j" type="fixed"><child link="b"/></joint>"#.to_owned();
    assert_refused!(pair(headless), ModelError::Unreadable { .. }, "joint `j`", "parent");
    assert_refused!(pair(joint("j", "twisting", "a", "b", "")), ModelError::Unreadable { .. }, "joint `j`", "twisting");
}

#[test]
fn a_byte_order_mark_is_no_part_of_the_robot() {
    let text = robot(&pair(joint("j", "revolute", "a", "b", LIMIT)));
    let options = ModelOptions::default();
    assert_eq!(
        Model::from_urdf(&format!("\u{feff}\u{feff}{text}"), &options).unwrap(),
        Model::from_urdf(&text, &options).unwrap()
    );
}

#[test]
fn numbers_must_be_finite_and_of_a_robots_size() {
    for (field, from, to) in [("mass", "value=\"1\"", "value=\"nan\""), ("inertia", "ixy=\"0\"", "ixy=\"inf\"")] {
        let text = MASS.replace(from, to);
        assert_refused!([link("l", &text)], ModelError::NotFinite { .. }, "link `l`", field);
    }
    for origin in [r#"xyz="nan 0 0""#, r#"rpy="0 inf 0""#] {
        let inside = format!("<origin {origin}/>");
        assert_refused!(pair(joint("j", "fixed", "a", "b", &inside)), ModelError::NotFinite { .. }, "joint `j`");
    }
    for millimetres in ["35800 0 0", "0 -35800 0", "0 0 35800"] {
        let inside = format!(r#"<origin xyz="{millimetres}"/>"#);
        assert_refused!(pair(joint("j", "fixed", "a", "b", &inside)), ModelError::Absurd { .. }, "joint `j`", "35800");
    }
    let grams = MASS.replace("value=\"1\"", "value=\"1e9\"");
    assert_refused!([link("l", &grams)], ModelError::Absurd { .. }, "link `l`", "kilograms");
    let huge = MASS.replace("izz=\"1\"", "izz=\"1e12\"");
    assert_refused!([link("l", &huge)], ModelError::Absurd { .. }, "link `l`", "inertia");
}

#[test]
fn bodies_that_cannot_exist_are_refused_or_tolerated() {
    let negative = MASS.replace("value=\"1\"", "value=\"-1\"");
    assert_refused!([link("l", &negative)], ModelError::Inertia { .. }, "link `l`", "-1 kg");
    let triangle = MASS.replace("izz=\"1\"", "izz=\"5\"");
    assert_refused!([link("l", &triangle)], ModelError::Inertia { .. }, "link `l`", "exceeds the sum");
    let indefinite = MASS.replace("ixx=\"1\"", "ixx=\"-1\"");
    assert_refused!([link("l", &indefinite)], ModelError::Inertia { .. }, "link `l`", "principal moment");
    let tolerant = ModelOptions { inertia: InertiaCheck::Tolerant, ..ModelOptions::default() };
    let model = Model::from_urdf(&robot(&[link("l", &triangle)]), &tolerant).unwrap();
    assert_eq!(model.impossible_links()[0].0, "l");
    // Tolerance ends where M would be indefinite.
    for text in [&negative, &indefinite] {
        let error = Model::from_urdf(&robot(&[link("l", text)]), &tolerant).unwrap_err();
        assert!(matches!(error, ModelError::Inertia { .. }), "{error}");
    }
    // An exporter's rounding is no error in the first place.
    let rounded = MASS.replace("ixx=\"1\" iyy=\"1\" izz=\"1\"", "ixx=\"1\" iyy=\"1\" izz=\"2.0001\"");
    read(&[link("l", &rounded)]).unwrap();
    let tiny = MASS.replace("ixx=\"1\" iyy=\"1\" izz=\"1\"", "ixx=\"-2e-22\" iyy=\"1e-22\" izz=\"1e-22\"");
    read(&[link("l", &tiny)]).unwrap();
    assert_refused!([link("l", "")], ModelError::NoMass, "mass");
}

#[test]
fn graphs_that_are_no_trees_are_refused() {
    let links = || ["a", "b", "c"].map(|name| link(name, MASS)).to_vec();
    let with = |joints: &[(&str, &str, &str)]| {
        let mut parts = links();
        parts.extend(joints.iter().map(|(name, parent, child)| joint(name, "fixed", parent, child, "")));
        parts
    };
    assert_refused!(with(&[("j", "b", "c")]), ModelError::SeveralRoots { .. }, "a, b", "2 links");
    assert_refused!(with(&[("j", "a", "b"), ("k", "b", "a")]), ModelError::Cycle { .. }, "link `", "joint `");
    assert_refused!(with(&[("j", "b", "c"), ("k", "c", "b")]), ModelError::Cycle { .. }, "cycle");
    assert_refused!(with(&[("j", "a", "a")]), ModelError::Cycle { .. }, "link `a`", "joint `j`");
    assert_refused!(with(&[("j", "a", "b"), ("k", "c", "b")]), ModelError::TwoParents { .. }, "link `b`", "`j`", "`k`");
    assert_refused!(
        with(&[("j", "a", "bb"), ("k", "a", "c")]),
        ModelError::UnknownLink { .. },
        "link `bb`",
        "joint `j`"
    );
    assert_refused!(with(&[("j", "a", "b"), ("j", "a", "c")]), ModelError::Duplicate(_), "joint `j`");
    assert_refused!([link("a", MASS), link("a", MASS)], ModelError::Duplicate(_), "link `a`");
}

#[test]
fn joints_that_cannot_move_are_refused() {
    for kind in ["floating", "planar", "spherical"] {
        assert_refused!(pair(joint("j", kind, "a", "b", "")), ModelError::UnsupportedJoint { .. }, "joint `j`", kind);
    }
    let axis = format!(r#"<axis xyz="0 0 0"/>{LIMIT}"#);
    assert_refused!(pair(joint("j", "revolute", "a", "b", &axis)), ModelError::Axis { .. }, "joint `j`");
    let axis = format!(r#"<axis xyz="nan 0 1"/>{LIMIT}"#);
    assert_refused!(pair(joint("j", "revolute", "a", "b", &axis)), ModelError::Axis { .. }, "joint `j`");
    assert_refused!(pair(joint("j", "revolute", "a", "b", "")), ModelError::MissingLimits { .. }, "joint `j`");
    for (quantity, limit) in [
        ("position", r#"<limit lower="1" upper="-1" effort="1" velocity="1"/>"#),
        ("velocity", r#"<limit lower="-1" upper="1" effort="1" velocity="-1"/>"#),
        ("effort", r#"<limit lower="-1" upper="1" effort="-1" velocity="1"/>"#),
    ] {
        assert_refused!(pair(joint("j", "prismatic", "a", "b", limit)), ModelError::ImpossibleLimits { .. }, quantity);
    }
    // No room and no speed are limits, if strange ones.
    let still = r#"<limit lower="0.5" upper="0.5" effort="0" velocity="0"/>"#;
    let limits = read(&pair(joint("j", "revolute", "a", "b", still))).unwrap().joints()[0].limits;
    assert_eq!((limits.lower, limits.upper, limits.velocity, limits.effort), (0.5, 0.5, 0.0, 0.0));
    // A fixed joint has no limits, whatever the file says; a continuous one none of position.
    let wrong = r#"<limit lower="1" upper="-1" effort="-1" velocity="-1"/>"#;
    assert_eq!(read(&pair(joint("j", "fixed", "a", "b", wrong))).unwrap().joint_count(), 0);
    let endless = read(&pair(joint("j", "continuous", "a", "b", LIMIT))).unwrap().joints()[0].limits;
    assert_eq!((endless.lower, endless.upper), (f64::NEG_INFINITY, f64::INFINITY));
    assert_eq!((endless.velocity, endless.effort, endless.given), (1.0, 1.0, true));
    let nan = r#"<limit lower="nan" upper="1" effort="1" velocity="1"/>"#;
    assert_refused!(pair(joint("j", "revolute", "a", "b", nan)), ModelError::NotFinite { .. }, "joint `j`", "limit");
}

#[test]
fn a_locked_joint_needs_no_limits_but_must_exist() {
    let parts = pair(joint("knee", "revolute", "a", "b", ""));
    let lock = |name: &str, position| ModelOptions {
        locked_joints: vec![(name.to_owned(), position)],
        ..ModelOptions::default()
    };
    assert_eq!(Model::from_urdf(&robot(&parts), &lock("knee", 0.3)).unwrap().joint_count(), 0);
    let error = Model::from_urdf(&robot(&parts), &lock("kne", 0.3)).unwrap_err();
    assert!(matches!(&error, ModelError::UnknownJoint { nearest: Some(near), .. } if near == "knee"), "{error}");
    let error = Model::from_urdf(&robot(&parts), &lock("knee", f64::NAN)).unwrap_err();
    assert!(matches!(error, ModelError::NotFinite { .. }));
}

#[test]
fn unknown_names_suggest_known_ones() {
    let model = read(&pair(joint("left_knee", "revolute", "a", "b", LIMIT))).unwrap();
    let error = model.joint("left_kne").unwrap_err();
    assert!(error.to_string().contains("did you mean `left_knee`?"), "{error}");
    let error = model.frame("bb").unwrap_err();
    assert!(error.to_string().contains("did you mean `b`?"), "{error}");
    assert!(!model.frame("zzz").unwrap_err().to_string().contains("did you mean"));
}

#[test]
fn too_many_joints_are_refused_before_memory_is() {
    let mut parts = vec![link("l0", MASS)];
    for i in 1..=2001 {
        parts.push(link(&format!("l{i}"), ""));
        parts.push(joint(&format!("j{i}"), "continuous", &format!("l{}", i - 1), &format!("l{i}"), ""));
    }
    assert_refused!(parts, ModelError::TooManyJoints { .. }, "2001");
    parts.truncate(parts.len() - 2);
    assert_eq!(read(&parts).unwrap().joint_count(), 2000);
}

#[test]
fn a_link_with_inertia_and_no_mass_is_named() {
    let ghost = MASS.replace(r#"<mass value="1"/>"#, r#"<mass value="0"/>"#);
    let parts = [link("a", MASS), link("ghost", &ghost), joint("j", "fixed", "a", "ghost", "")];
    assert_refused!(parts, ModelError::Inertia { .. }, "link `ghost`", "a moment of inertia of 1 kg m^2 but no mass");
    let options = ModelOptions { inertia: InertiaCheck::Tolerant, ..ModelOptions::default() };
    let model = Model::from_urdf(&robot(&parts), &options).unwrap();
    assert!(
        matches!(model.impossible_links(), [(link, spatial::InertiaError::MomentWithoutMass(_))] if link == "ghost")
    );
    // Nothing at all is no defect: a frame.
    let nothing = r#"<inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>"#;
    assert!(read(&[link("a", MASS), link("frame", nothing), joint("j", "fixed", "a", "frame", "")]).is_ok());
}

//! The shipped robot loads; every way in which a folder can be wrong is named.

use robot::{Friction, Robot, RobotError};
use sole_mesh::Mesh;
use std::path::{Path, PathBuf};

fn shipped() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4")
}

/// A copy of the shipped robot with one text replaced.
fn changed(file: &str, from: &str, to: &str) -> RobotError {
    let folder = tempfile::tempdir().unwrap();
    for name in ["robot.toml", "sole.toml", "hrp4.urdf"] {
        let text = std::fs::read_to_string(shipped().join(name)).unwrap();
        let text = if name == file {
            assert!(text.contains(from), "{file} has no {from}");
            text.replacen(from, to, 1)
        } else {
            text
        };
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    Robot::load(folder.path()).expect_err("the change is wrong")
}

#[test]
fn the_shipped_robot_loads() {
    let robot = Robot::load(&shipped()).unwrap();
    let description = &robot.description;
    assert_eq!(description.name, "HRP-4");
    assert_eq!(description.joints.len(), 34);
    assert_eq!(description.feet[0].ankle_frame, "l_ankle");
    assert_eq!(description.feet[1].ankle_frame, "r_ankle");
    assert_eq!(description.walking_locked_joints().len(), 12);
    assert_eq!(robot.sole.foot.ankle_in_sole_m(0), [-0.015, -0.011, 0.103]);
    assert_eq!(robot.sole.foot.ankle_in_sole_m(1), [-0.015, 0.011, 0.103]);
    for joint in &description.joints {
        assert!(description.servo(joint).is_some() && description.energy_coefficients(joint).is_some());
    }
    assert!(description.servo("tail").is_none() && description.energy_coefficients("tail").is_none());
    assert_eq!(description.servo("R_HIP_R").unwrap().kd_nm_s_per_rad, 303.0);
    assert_eq!(description.half_sitting_rad("R_HIP_P"), -22.02_f64.to_radians());
    assert_eq!(description.half_sitting_rad("NECK_Y"), 0.0);
    assert!(description.walking_locked_joints().contains(&("R_WRIST_P".to_owned(), 0.0)));
}

#[test]
fn a_list_of_joints_and_groups_names_every_joint_once_in_its_order() {
    let description = Robot::load(&shipped()).unwrap().description;
    let names = ["L_KNEE_P", "knees", "CHEST_Y"].map(str::to_owned);
    assert_eq!(description.members(&names), ["L_KNEE_P", "R_KNEE_P", "CHEST_Y"]);
}

#[test]
fn the_smallest_friction_of_a_sole_is_that_of_its_most_slippery_point() {
    assert_eq!(Friction::Uniform(0.65).smallest(), 0.65);
    assert_eq!(Friction::PerPatch(vec![0.5, 0.3, 0.9]).smallest(), 0.3);
}

#[test]
fn legs_are_ten_times_stiffer_than_the_sole_rolls() {
    // Roll stiffness of the sole under half of the robot, as estimated on the real robot (N m/rad).
    const SOLE_ROLL_STIFFNESS: f64 = 890.0;
    let robot = Robot::load(&shipped()).unwrap();
    for joint in &robot.description.groups["left_leg"] {
        assert!(robot.description.servo(joint).unwrap().kp_nm_per_rad > 10.0 * SOLE_ROLL_STIFFNESS);
    }
}

#[test]
fn the_fingerprint_changes_with_the_robot_but_not_with_the_sole() {
    let original = Robot::load(&shipped()).unwrap().fingerprint;
    let folder = tempfile::tempdir().unwrap();
    for name in ["robot.toml", "sole.toml", "hrp4.urdf"] {
        std::fs::copy(shipped().join(name), folder.path().join(name)).unwrap();
    }
    let append = |name: &str| {
        let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
        std::fs::write(folder.path().join(name), text + "\n").unwrap();
        Robot::load(folder.path()).unwrap().fingerprint
    };
    assert_eq!(append("sole.toml"), original);
    let after = append("robot.toml");
    assert_ne!(after, original);
    assert_ne!(append("hrp4.urdf"), after);
}

#[test]
fn a_missing_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let error = Robot::load(folder.path()).unwrap_err();
    assert!(matches!(&error, RobotError::Unreadable { file, .. } if file.ends_with("robot.toml")), "{error}");
    let error = changed("robot.toml", "hrp4.urdf", "hrp5.urdf");
    assert!(matches!(&error, RobotError::Unreadable { file, .. } if file.ends_with("hrp5.urdf")), "{error}");
}

#[test]
fn files_outside_the_folder_are_not_read() {
    let (urdf, block) = ("urdf = \"hrp4.urdf\"", BLOCK);
    for name in ["../../../etc/passwd", "/etc/passwd", "/dev/zero", "meshes/../../x", ""] {
        let error = changed("robot.toml", urdf, &format!("urdf = {name:?}"));
        assert!(matches!(&error, RobotError::Outside { field: "urdf", name: found, .. } if found == name), "{error}");
        let error = changed("sole.toml", block, &format!("file = {name:?}"));
        assert!(matches!(&error, RobotError::Outside { field: "mesh.file", .. }), "{error}");
    }
}

#[test]
fn unknown_keys_are_refused_with_a_suggestion_and_their_place() {
    let error = changed("robot.toml", "radius_m", "radius_mm");
    let RobotError::Toml { line, nearest, .. } = &error else { panic!("{error}") };
    assert!(*line > 100 && nearest.as_deref() == Some("radius_m"), "{error}");
    let error = changed("sole.toml", "young_modulus_pa", "young_modulus");
    assert!(error.to_string().contains("did you mean `young_modulus_pa`?"), "{error}");
    let error = changed("robot.toml", "coulomb_friction_nm", "friction_nm");
    assert!(matches!(error, RobotError::Toml { .. }), "{error}");
}

#[test]
fn wrong_types_are_refused_at_their_place() {
    let error = changed("sole.toml", "friction = 0.65", "friction = \"slippery\"");
    assert!(matches!(error, RobotError::Toml { line: 3, column: 12, .. }), "{error}");
    let error = changed("sole.toml", "cells = [12, 7, 3]", "cells = [12, 7]");
    assert!(matches!(error, RobotError::Toml { .. }), "{error}");
    let error = changed("sole.toml", "friction = 0.65", "friction = \"high\"").to_string();
    assert!(error.contains("a number, or a list of numbers, one per contact point"), "{error}");
}

#[test]
fn numbers_outside_their_range_are_refused_by_their_field() {
    let sole = [
        ("poisson_ratio = 0.31", "poisson_ratio = 0.5", "material.poisson_ratio"),
        ("poisson_ratio = 0.31", "poisson_ratio = -1.0", "material.poisson_ratio"),
        ("young_modulus_pa = 0.32e6", "young_modulus_pa = nan", "material.young_modulus_pa"),
        ("friction = 0.65", "friction = -0.1", "friction"),
        ("friction = 0.65", "friction = 1e6", "friction"),
        ("friction = 0.65", "friction = inf", "friction"),
        ("friction = 0.65", "friction = [0.5, 0.6, 10.1]", "friction[2]"),
        ("cells = [12, 7, 3]", "cells = [12, 0, 3]", "mesh.cells"),
        ("box_m = [0.23, 0.13, 0.021]", "box_m = [0.23, -0.13, 0.021]", "mesh.box_m"),
        // Megapascals, then what no unit makes a sole; millimetres; centimetres; downwards.
        ("young_modulus_pa = 0.32e6", "young_modulus_pa = 0.32", "material.young_modulus_pa"),
        ("young_modulus_pa = 0.32e6", "young_modulus_pa = 0.32e12", "material.young_modulus_pa"),
        ("[-0.015, -0.011, 0.103]", "[-15.0, -11.0, 103.0]", "foot.ankle_in_sole_m"),
        ("[-0.015, -0.011, 0.103]", "[-1.5, -1.1, 10.3]", "foot.ankle_in_sole_m"),
        ("[-0.015, -0.011, 0.103]", "[-0.015, -0.011, -103.0]", "foot.ankle_in_sole_m"),
        // The ankle below the ground.
        ("[-0.015, -0.011, 0.103]", "[-0.015, -0.011, -0.103]", "foot.ankle_in_sole_m[2]"),
    ];
    let robot = [
        ("kp_nm_per_rad = 15000.0", "kp_nm_per_rad = 0.0", "servos[0].kp_nm_per_rad"),
        ("kd_nm_s_per_rad = 93.0", "kd_nm_s_per_rad = -93.0", "servos[0].kd_nm_s_per_rad"),
        ("kd_nm_s_per_rad = 93.0", "kd_nm_s_per_rad = inf", "servos[0].kd_nm_s_per_rad"),
        ("rotor_inertia_kg_m2 = 0.1", "rotor_inertia_kg_m2 = -0.1", "servos[0].rotor_inertia_kg_m2"),
        ("coulomb_friction_nm = 2.0", "coulomb_friction_nm = -2.0", "servos[0].coulomb_friction_nm"),
        (
            "viscous_friction_nm_s_per_rad = 1.0",
            "viscous_friction_nm_s_per_rad = nan",
            "servos[0].viscous_friction_nm_s_per_rad",
        ),
        ("torque_squared_w_per_nm2 = 0.057", "torque_squared_w_per_nm2 = -1.0", "energy[0].torque_squared_w_per_nm2"),
        ("power = 1.0", "power = inf", "energy[0].power"),
        (
            "speed_squared_w_s2_per_rad2 = 1.0",
            "speed_squared_w_s2_per_rad2 = -1.0",
            "energy[0].speed_squared_w_s2_per_rad2",
        ),
        ("position_margin_deg = 0.5", "position_margin_deg = -0.5", "limits.position_margin_deg"),
        ("velocity_factor = 0.5", "velocity_factor = 50.0", "limits.velocity_factor"),
        ("velocity_factor = 0.5", "velocity_factor = 0.0", "limits.velocity_factor"),
        ("torque_factor = 1.0", "torque_factor = 1.01", "limits.torque_factor"),
        ("radius_m = 0.085", "radius_m = -0.085", "capsules.pelvis.radius_m"),
        ("from_m = [-0.025, -0.06, 0.12]", "from_m = [-0.025, nan, 0.12]", "capsules.pelvis.from_m"),
        ("to_m = [-0.025, 0.06, 0.12]", "to_m = [-0.025, 0.06, inf]", "capsules.pelvis.to_m"),
        ("R_HIP_P = -22.02", "R_HIP_P = -2202.0", "half_sitting_deg.R_HIP_P"),
        ("R_HIP_P = -22.02", "R_HIP_P = 2202.0", "half_sitting_deg.R_HIP_P"),
    ];
    let cases = sole.map(|case| ("sole.toml", case)).into_iter().chain(robot.map(|case| ("robot.toml", case)));
    for (file, (from, to, expected)) in cases {
        let error = changed(file, from, to);
        let RobotError::OutOfRange { file: named, field, .. } = &error else { panic!("{to}: {error}") };
        assert_eq!((named.ends_with(file), field.as_str()), (true, expected), "{error}");
    }
    let said = changed("sole.toml", "friction = 0.65", "friction = [0.5, 1e6]").to_string();
    for part in ["sole.toml: ", "friction[1] = 1000000", "0 to 10", "dry rubber has about 1"] {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn blocks_in_other_units_or_of_too_many_cells_are_refused() {
    let cases = [
        ("[0.23, 0.13, 0.021]", "[230.0, 130.0, 21.0]", "the sole is 230 m long"),
        ("[0.23, 0.13, 0.021]", "[23.0, 13.0, 2.1]", "another unit than metres"),
        ("[12, 7, 3]", "[4000, 4000, 4000]", "384000000000 tetrahedra, at most 100000"),
    ];
    for (from, to, expected) in cases {
        let error = changed("sole.toml", from, to);
        let RobotError::Block { source, .. } = &error else { panic!("{to}: {error}") };
        assert!(source.to_string().contains(expected), "{source}");
        assert!(error.to_string().contains("sole.toml"), "{error}");
    }
}

#[test]
fn the_hard_and_the_soft_among_soles_are_believed() {
    for modulus in ["0.005e6", "0.02e6", "50e6"] {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("sole.toml");
        let text = std::fs::read_to_string(shipped().join("sole.toml")).unwrap();
        std::fs::write(&file, text.replace("0.32e6", modulus)).unwrap();
        let sole = Robot::load_on(&shipped(), Some(&file)).unwrap().sole;
        assert_eq!(sole.material.young_modulus_pa, modulus.parse::<f64>().unwrap());
    }
}

#[test]
fn names_must_refer_to_something() {
    let cases = [
        ("[\"left_foot\", \"right_foot\"]", "[\"left_foot\", \"right_fot\"]", "collision_pairs", Some("right_foot")),
        ("pairs = [[\"head\", ", "pairs = [[\"haed\", ", "collision_pairs_left_out", Some("head")),
        ("of = [\"knees\"]", "of = [\"knee\"]", "servos", Some("knees")),
        ("of = [\"chest\"]", "of = [\"chets\"]", "energy", Some("chest")),
        ("of = [\"chest\"]", "of = [\"spine\"]", "energy", None),
        ("R_HIP_P = -22.02", "R_HIP_PITCH = -22.02", "half_sitting_deg", Some("R_HIP_P")),
        ("[\"neck\", ", "[\"nek\", ", "walking_locked", Some("neck")),
        ("chest = [\"CHEST_P\"", "chest = [\"CHEST_PP\"", "groups.chest", Some("CHEST_P")),
    ];
    for (from, to, place, expected) in cases {
        let error = changed("robot.toml", from, to);
        let RobotError::UnknownName { field, nearest, .. } = &error else { panic!("{to}: {error}") };
        assert_eq!((field.as_str(), nearest.as_deref()), (place, expected), "{error}");
    }
}

#[test]
fn a_name_is_given_once() {
    for (from, to, place, twice) in [
        ("\"CHEST_P\", \"CHEST_Y\", \"NECK_Y\"", "\"CHEST_P\", \"CHEST_P\", \"NECK_Y\"", "joints", "CHEST_P"),
        ("[\"R_KNEE_P\", \"L_KNEE_P\"]", "[\"R_KNEE_P\", \"R_KNEE_P\"]", "groups.knees", "R_KNEE_P"),
        ("name = \"right_thigh\"", "name = \"pelvis\"", "capsules", "pelvis"),
        ("[\"left_foot\", \"right_foot\"]", "[\"left_foot\", \"left_foot\"]", "collision_pairs", "left_foot"),
    ] {
        let error = changed("robot.toml", from, to);
        let RobotError::Twice { field, name, .. } = &error else { panic!("{to}: {error}") };
        assert_eq!((field.as_str(), name.as_str()), (place, twice), "{error}");
    }
}

#[test]
fn every_joint_has_one_servo_and_one_set_of_energy_coefficients() {
    let error = changed("robot.toml", "of = [\"knees\"]", "of = [\"R_KNEE_P\"]");
    assert!(matches!(&error, RobotError::Missing { joint, .. } if joint == "L_KNEE_P"), "{error}");
    let error = changed("robot.toml", "of = [\"knees\"]", "of = [\"knees\", \"R_HIP_Y\"]");
    assert!(
        matches!(&error, RobotError::Twice { field, name, .. } if field == "servos" && name == "R_HIP_Y"),
        "{error}"
    );
    let error = changed("robot.toml", "of = [\"chest\"]", "of = [\"CHEST_P\"]");
    let RobotError::Missing { field: "energy", joint, .. } = &error else { panic!("{error}") };
    assert_eq!(joint, "CHEST_Y");
}

const BLOCK: &str = "box_m = [0.23, 0.13, 0.021]\ncells = [12, 7, 3]";

#[test]
fn a_sole_is_a_block_or_a_file_and_the_mistake_is_named() {
    let cases = [
        ("file = \"a.msh\"\nbox_m = [0.23, 0.13, 0.021]\ncells = [12, 7, 3]", "both box_m and file"),
        ("file = \"a.msh\"\ncells = [12, 7, 3]", "cells beside file"),
        ("box_m = [0.23, 0.13, 0.021]", "box_m without cells"),
        ("cells = [12, 7, 3]", "cells without box_m"),
        ("", "neither box_m nor file"),
    ];
    for (mesh, expected) in cases {
        let error = changed("sole.toml", BLOCK, mesh);
        let RobotError::MeshChoice { file, .. } = &error else { panic!("{mesh}: {error}") };
        assert!(file.ends_with("sole.toml"));
        let message = error.to_string();
        assert!(message.contains(expected) && message.contains("give either box_m with cells"), "{message}");
    }
}

/// The shipped robot on a sole in a folder of its own, which names a mesh.
fn on_mesh(text: impl AsRef<[u8]>) -> Result<Robot, RobotError> {
    let folder = tempfile::tempdir().unwrap();
    let sole =
        std::fs::read_to_string(shipped().join("sole.toml")).unwrap().replace(BLOCK, "file = \"meshes/foot.msh\"");
    std::fs::create_dir(folder.path().join("meshes")).unwrap();
    std::fs::write(folder.path().join("meshes/foot.msh"), text).unwrap();
    std::fs::write(folder.path().join("other.toml"), sole).unwrap();
    Robot::load_on(&shipped(), Some(&folder.path().join("other.toml")))
}

#[test]
fn a_mesh_file_beside_the_sole_is_read_and_has_the_outline_of_the_block_it_is() {
    let block = Robot::load(&shipped()).unwrap();
    assert!(block.sole_mesh.is_none() && block.sole_file.ends_with("hrp4/sole.toml"));
    let mesh = Mesh::kuhn_box([0.23, 0.13, 0.021], [4, 3, 2]).unwrap();
    let robot = on_mesh(mesh.to_msh()).unwrap();
    assert_eq!(robot.sole_mesh.as_ref(), Some(&mesh));
    assert!(robot.sole_file.ends_with("other.toml"));
    assert_eq!(robot.sole_outline(), block.sole_outline());
    assert_eq!(robot.fingerprint, block.fingerprint);
    // The second sole that ships: 25 mm round corners cost 7.3 mm along each diagonal.
    let rounded = Robot::load_on(&shipped(), Some(&shipped().join("sole-rounded.toml"))).unwrap().sole_outline();
    assert!((rounded.size_m[0] - 0.23).abs() < 1e-9 && (rounded.size_m[1] - 0.13).abs() < 1e-9);
    assert!((0.20..0.22).contains(&rounded.carrying_m[0]), "{rounded:?}");
    assert!((rounded.carrying_m[0] / rounded.carrying_m[1] - 0.23 / 0.13).abs() < 1e-9);
}

#[test]
fn mesh_files_that_cannot_be_used_are_named() {
    let error = changed("sole.toml", BLOCK, "file = \"nowhere.msh\"");
    assert!(matches!(&error, RobotError::Unreadable { file, .. } if file.ends_with("nowhere.msh")), "{error}");
    let error = on_mesh("hello").unwrap_err();
    assert!(matches!(&error, RobotError::Mesh { file, .. } if file.ends_with("meshes/foot.msh")), "{error}");
    let words = |error: &RobotError| {
        let source = std::error::Error::source(error).expect("the mesh's own error").to_string();
        (error.to_string(), source)
    };
    // Binary, as Gmsh saves it: the header is text, what follows is not.
    let mut binary = b"$MeshFormat\n4.1 1 8\n\x01\0\0\0\n$EndMeshFormat\n$Nodes\n".to_vec();
    binary.extend([0xff, 0xfe, 0x80, 0]);
    let (_, inner) = words(&on_mesh(binary).unwrap_err());
    assert!(inner.contains("MSH version 4.1, binary") && inner.contains("Mesh.Binary = 0"), "{inner}");
    let mut mesh = Mesh::kuhn_box([0.23, 0.13, 0.021], [4, 3, 2]).unwrap();
    let twice =
        Mesh { tetrahedra: mesh.tetrahedra.iter().chain(&mesh.tetrahedra[5..6]).copied().collect(), ..mesh.clone() };
    let (outer, inner) = words(&on_mesh(twice.to_msh()).unwrap_err());
    assert!(outer.ends_with("foot.msh: no mesh of a sole"), "once is enough: {outer}");
    assert!(inner.contains("elements 5 and 144") && inner.contains("(in the file: elements "), "{inner}");
    // A corner at the origin instead of the middle.
    mesh.nodes.iter_mut().for_each(|p| (p.x, p.y) = (p.x + 0.115, p.y + 0.065));
    let error = on_mesh(mesh.to_msh()).unwrap_err();
    let RobotError::OffCentre { centre_m, .. } = &error else { panic!("{error}") };
    assert!(
        (centre_m[0] - 0.115).abs() < 1e-12 && (centre_m[1] - 0.065).abs() < 1e-12 && centre_m[2] == 0.0,
        "{error}"
    );
    assert!(error.to_string().contains("move the mesh"), "{error}");
}

#[test]
fn a_mesh_may_be_off_its_middle_by_rounding_alone_in_every_direction() {
    let block = Mesh::kuhn_box([0.23, 0.13, 0.021], [4, 3, 2]).unwrap();
    for axis in 0..3 {
        for (off_m, accepted) in [(0.9e-5, true), (1.1e-5, false), (-0.9e-5, true), (-1.1e-5, false)] {
            let mut mesh = block.clone();
            mesh.nodes.iter_mut().for_each(|p| p[axis] += off_m);
            let found = on_mesh(mesh.to_msh());
            match &found {
                Ok(_) => assert!(accepted, "{off_m} m along {axis}"),
                Err(error) => assert!(!accepted && matches!(error, RobotError::OffCentre { .. }), "{error}"),
            }
        }
    }
}

#[test]
fn texts_in_other_encodings_are_called_by_their_names() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["robot.toml", "sole.toml", "hrp4.urdf"] {
        std::fs::copy(shipped().join(name), folder.path().join(name)).unwrap();
    }
    let file = folder.path().join("hrp4.urdf");
    let text = std::fs::read_to_string(&file).unwrap().replacen("<link", "<!-- \u{e9}paule --><link", 1);
    let latin: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')).collect();
    let wide = |order: fn(u16) -> [u8; 2], mark: &str| -> Vec<u8> {
        format!("{mark}{text}").encode_utf16().flat_map(order).collect()
    };
    for (bytes, name) in [
        (latin, "ISO-8859-1"),
        (wide(u16::to_le_bytes, "\u{feff}"), "UTF-16"),
        (wide(u16::to_be_bytes, "\u{feff}"), "UTF-16"),
        (wide(u16::to_le_bytes, ""), "UTF-16LE"),
        (wide(u16::to_be_bytes, ""), "UTF-16BE"),
        (text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect(), "UTF-32"),
    ] {
        std::fs::write(&file, bytes).unwrap();
        let error = Robot::load(folder.path()).unwrap_err();
        assert!(matches!(&error, RobotError::Encoding { encoding, .. } if *encoding == name), "{error}");
        assert!(error.to_string().contains(&format!("hrp4.urdf: the text is {name}, UTF-8 expected")), "{error}");
    }
    std::fs::write(&file, &text).unwrap();
    assert!(Robot::load(folder.path()).is_ok(), "the same text as UTF-8");
}

//! Walks on soles that are not the robot's own: Gmsh files, mirrored meshes, friction point by point.

use closed_loop::{ClosedLoop, Tick};
use messages::Plain;
use messages::code::Reason;
use scenario::{Scenario, Setting};
use sole_mesh::Mesh;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// An unstructured mesh made by Gmsh: 1494 tetrahedra, 0.23 x 0.13 x 0.03 m, no symmetry.
const GMSH: &str = include_str!("../../sole/tests/data/sole_1494.msh");
/// What 30 mm of sole change: the ankle is 9 mm higher than on 21 mm, which the sole says; the body shall be, too.
const ON_30_MM: [&str; 1] = ["planner.gait.body.com_height_m=0.799"];
const SHORT: &str = "planner.gait.walk.swings=2";

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name)
}

/// The shipped `sole.toml` with texts replaced, beside a mesh called `foot.msh`.
fn sole(mesh: &str, changes: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut text = std::fs::read_to_string(shipped("robots/hrp4/sole.toml")).expect("it ships");
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    std::fs::write(folder.path().join("thick.toml"), text).expect("writable");
    std::fs::write(folder.path().join("foot.msh"), mesh).expect("writable");
    folder
}

const BLOCK: &str = "box_m = [0.23, 0.13, 0.021]\ncells = [12, 7, 3]";
const FILE: (&str, &str) = (BLOCK, "file = \"foot.msh\"");

fn start(sole: Option<&TempDir>, settings: &[&str]) -> anyhow::Result<ClosedLoop> {
    let mut settings: Vec<Setting> = settings.iter().map(|text| text.parse().expect("a setting")).collect();
    if let Some(folder) = sole {
        let setting = format!("sole_file={}", folder.path().join("thick.toml").display());
        settings.push(setting.parse().expect("a setting"));
    }
    ClosedLoop::new(&Scenario::load(&shipped("config/scenarios/flat.toml"), &settings)?)
}

fn walk(sole: Option<&TempDir>, settings: &[&str]) -> (ClosedLoop, Vec<Tick>) {
    let mut run = start(sole, settings).expect("everything can be built");
    let mut ticks = Vec::new();
    while let Some(tick) = run.step().expect("the controller goes on") {
        ticks.push(tick);
    }
    assert_eq!(run.over(), Some(Reason::Finished));
    assert!(ticks.len() > 500, "a walk, not an empty comparison: {} ticks", ticks.len());
    (run, ticks)
}

/// Everything that was said, to the bit.
fn bits(ticks: &[Tick]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for tick in ticks {
        tick.state.write_bytes(&mut bytes);
        tick.truth.write_bytes(&mut bytes);
        tick.deformation.write_bytes(&mut bytes);
        tick.contact.write_bytes(&mut bytes);
        tick.command.write_bytes(&mut bytes);
    }
    bytes
}

#[test]
fn a_block_given_as_a_gmsh_file_walks_the_same_walk_to_the_bit() {
    let file = Mesh::kuhn_box([0.23, 0.13, 0.021], [12, 7, 3]).expect("a block").to_msh();
    let (_, from_file) = walk(Some(&sole(&file, &[FILE])), &[SHORT]);
    // Plant and estimator cut a block into finer cells, but take a file as it is.
    let cells = ["simulator.sole.mesh_cells=[12, 7, 3]", "estimator.sole.cells=[12, 7, 3]"];
    let (_, from_block) = walk(None, &[SHORT, cells[0], cells[1]]);
    assert!(bits(&from_file) == bits(&from_block));
    let (_, on_other_cells) = walk(None, &[SHORT]);
    assert!(bits(&from_file) != bits(&on_other_cells), "the mesh matters");
}

/// HRP-4 with a posture that is the same to its left and right. Its half-sitting was measured on a robot and is not: a mirrored walk
/// of that robot is another walk, whose centre of mass differs by 8 um while it settles.
fn symmetric_robot() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for entry in std::fs::read_dir(shipped("robots/hrp4")).expect("it ships") {
        let entry = entry.expect("an entry");
        std::fs::copy(entry.path(), folder.path().join(entry.file_name())).expect("copied");
    }
    let file = folder.path().join("robot.toml");
    let mut text = std::fs::read_to_string(&file).expect("it ships");
    for (joint, found, sign) in [
        ("HIP_R", "1.15", -1.0),
        ("HIP_P", "-21.89", 1.0),
        ("KNEE_P", "41.21", 1.0),
        ("ANKLE_P", "-18.74", 1.0),
        ("ANKLE_R", "-1.10", -1.0),
    ] {
        let right = text.split_once(&format!("R_{joint} = ")).and_then(|(_, rest)| rest.split_once('\n'));
        let right: f64 = right.expect("a joint of half-sitting").0.parse().expect("a number");
        let left = format!("L_{joint} = {found}\n");
        assert!(text.contains(&left), "{left}");
        text = text.replace(&left, &format!("L_{joint} = {}\n", sign * right));
    }
    std::fs::write(file, text).expect("writable");
    folder
}

/// How far apart a walk that begins with the right foot and the mirror image of one that begins with the left foot are (m): the estimated
/// ankles, the real centre of mass; and how far the ankles sink.
fn asymmetry(robot: &Path, sole: Option<&TempDir>, settings: &[&str], ankle_height_m: f64) -> [f64; 3] {
    let robot = format!("robot={}", robot.display());
    let walk = |first: &str| walk(sole, &[&[SHORT, &robot, first][..], settings].concat()).1;
    let one = walk("planner.gait.start.first_swing=right");
    let other = walk("planner.gait.start.first_swing=left");
    assert_eq!(one.len(), other.len());
    let mirrored = |p: [f64; 3]| [p[0], -p[1], p[2]];
    let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
    let [mut ankles_m, mut com_m, mut sunk_m] = [0.0_f64; 3];
    for (a, b) in one.iter().zip(&other) {
        for foot in 0..2 {
            let (this, that) = (&a.deformation.feet[foot], &b.deformation.feet[1 - foot]);
            ankles_m = ankles_m.max(apart(this.ankle_position_m, mirrored(that.ankle_position_m)));
            if this.loaded != 0 {
                sunk_m = sunk_m.max(ankle_height_m - this.ankle_position_m[2]);
            }
        }
        com_m = com_m.max(apart(a.truth.com_position_m, mirrored(b.truth.com_position_m)));
    }
    [ankles_m, com_m, sunk_m]
}

/// Poses are found to 1e-9 of the load, which sinks a foot by millimetres; plans to 1e-9 of their forces.
const ANKLES_APART_MAX_M: f64 = 1e-10;
/// The real soles open and close: which patch at the rim carries its last force, rounding decides. While the robot settles, a walk and its image
/// then differ by 3e-8 m of the centre of mass, seen at 1 to 3 Newton steps of the plant. A wrong sign costs a tenth of a millimetre.
const COM_APART_MAX_M: f64 = 1e-7;

#[test]
fn a_walk_and_its_mirror_image_agree_on_a_block_and_on_an_unstructured_mesh() {
    let robot = symmetric_robot();
    let gmsh = sole(GMSH, &[FILE, ("0.103", "0.112")]);
    for (sole, settings, ankle_height_m) in [(None, &[][..], 0.103), (Some(&gmsh), &ON_30_MM[..], 0.112)] {
        let [ankles_m, com_m, sunk_m] = asymmetry(robot.path(), sole, settings, ankle_height_m);
        assert!(sunk_m > 5e-4, "the soles carry the robot: {sunk_m} m");
        assert!(ankles_m < ANKLES_APART_MAX_M, "{ankles_m:e} m");
        assert!(com_m < COM_APART_MAX_M, "{com_m:e} m");
    }
}

/// `friction = [...]`, one value per point.
fn friction_list(values: impl Iterator<Item = f64>) -> String {
    let mut text = String::from("friction = [");
    values.for_each(|mu| write!(text, "{mu}, ").expect("a text"));
    text + "]"
}

const PATCHES: [&str; 3] = [SHORT, "estimator.sole.level=patches", "estimator.sole.patch_cells=[8, 7]"];

#[test]
fn friction_point_by_point_is_that_of_the_point() {
    let same = friction_list(std::iter::repeat_n(0.65, 72));
    let (_, listed) = walk(Some(&sole("", &[("friction = 0.65", &same)])), &PATCHES);
    let (_, uniform) = walk(None, &PATCHES);
    assert!(bits(&listed) == bits(&uniform));
    // Forces are balanced to 1e-9 of the robot's weight, and points that carry a tenth of a newton are looked at.
    const SLACK: f64 = 1e-9 * 39.0 * 9.81 / 0.1;
    // The heel row of patches polished: its points can carry a tenth of their load sideways.
    let polished = friction_list((0..72).map(|point| if point % 9 == 0 { 0.1 } else { 0.65 }));
    let polished = sole("", &[("friction = 0.65", &polished)]);
    let (_, ticks) = walk(Some(&polished), &PATCHES);
    let (mut steepest_heel, mut steepest) = (0.0_f64, 0.0_f64);
    for contact in ticks.iter().flat_map(|tick| &tick.contact.feet) {
        for point in 0..contact.count as usize {
            let [x, y, z] = contact.force_n[point];
            if z > 0.1 {
                let worst = if point % 9 == 0 { &mut steepest_heel } else { &mut steepest };
                *worst = worst.max(x.hypot(y) / z);
            }
        }
    }
    assert!(steepest_heel < 0.1 + SLACK, "{steepest_heel}");
    assert!(steepest > 0.12, "the other points carry more: {steepest}");
}

#[test]
fn what_does_not_fit_the_sole_is_refused_by_name() {
    let refused = |sole: &TempDir, settings: &[&str]| match start(Some(sole), settings) {
        Ok(_) => panic!("{settings:?} fits"),
        Err(error) => format!("{error:#}"),
    };
    let list = friction_list(std::iter::repeat_n(0.65, 72));
    let listed = sole("", &[("friction = 0.65", &list)]);
    let expect = |message: String, words: &[&str]| {
        for word in words {
            assert!(message.contains(word), "no `{word}` in: {message}");
        }
    };
    expect(
        refused(&listed, &[]),
        &["estimator", "thick.toml", "friction has 72 values", "\"patches\"", "42 contact points"],
    );
    expect(refused(&listed, &["estimator.sole.level=lumped"]), &["thick.toml", "friction is a list", "patches"]);
    let patches = ["estimator.sole.patch_cells=[8, 7]", "simulator.sole.level=rigid"];
    expect(refused(&listed, &patches), &["simulator", "thick.toml", "friction is a list"]);
    let patches = ["estimator.sole.patch_cells=[8, 7]", "simulator.sole.patch_cells=[4, 3]"];
    expect(refused(&listed, &patches), &["simulator", "friction has 72 values", "\"patches\"", "20 contact points"]);

    let thick = sole(GMSH, &[FILE, ("0.103", "0.112")]);
    let cells = [&ON_30_MM[..], &["estimator.sole.cells=[6, 4, 2]"]].concat();
    expect(refused(&thick, &cells), &["estimator", "sole.cells", "foot.msh", "remove sole.cells"]);
    let cells = [&ON_30_MM[..], &["simulator.sole.mesh_cells=[6, 4, 2]"]].concat();
    expect(refused(&thick, &cells), &["simulator", "sole.mesh_cells", "foot.msh"]);
    // A plan for another sole.
    let thin = ["planner.gait.body.ankle_height_m=0.103"];
    expect(refused(&thick, &thin), &["gait.body.ankle_height_m = 0.103", "thick.toml says 0.112000", "remove the key"]);
    let short = Mesh::kuhn_box([0.2, 0.13, 0.021], [4, 3, 2]).expect("a block").to_msh();
    let long = ["planner.gait.sole.length_m=0.23"];
    expect(refused(&sole(&short, &[FILE]), &long), &["gait.sole.length_m = 0.23", "says 0.200000"]);
    // A sole that is not everybody's.
    let shipped = shipped("robots/hrp4/sole.toml");
    for process in ["estimator", "controller"] {
        let key = format!("{process}.sole_file");
        let other = format!("{key}={}", shipped.display());
        let other = [&ON_30_MM[..], &[&other]].concat();
        // The planner, which is told what these are told, says so first.
        expect(refused(&thick, &other), &["planner", &key, "thick.toml", "give all processes the same"]);
    }
    // Settings for another sole.
    let slippery = sole("", &[("friction = 0.65", "friction = 0.5")]);
    let rough = ["controller.constraints.friction=0.65"];
    expect(refused(&slippery, &rough), &["`controller.constraints.friction` is 0.65", "thick.toml", "at most 0.5"]);
    let small = sole("", &[("0.23, 0.13", "0.18, 0.13")]);
    expect(
        // So short a sole is pressed together by a little more than a tenth.
        refused(&small, &["planner.sole_compression_max=0.2"]),
        &["simulator", "plant.stabiliser.zmp_half_length_m = 0.092", "thick.toml", "carries 0.090000"],
    );
}

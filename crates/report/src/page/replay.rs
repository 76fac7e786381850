//! What the replay shows: poses at 50 Hz.

use super::pack::Packer;
use super::sample::Grid;
use super::walk::Walk;
use serde_json::{Map, Value, json};

/// Steps of lengths, angles and parts of quaternions (m, rad), of forces (N).
const POSE_STEP: f64 = 1e-5;
const FORCE_STEP: f64 = 0.1;

/// The head of a replay; its columns go to the packer.
pub(super) fn json(walk: &Walk, grid: &Grid, packer: &mut Packer) -> Value {
    let none = Vec::new();
    let numbered = |name: &str, count: usize| -> Vec<Vec<f64>> {
        let column = |i| walk.columns.get(&format!("{name}{i}")).map_or(&none, |column| &column.0);
        (0..count).map(|i| grid.pictures(column(i), walk.tick_zero)).collect()
    };
    let named = |names: &[&str], scale: f64| -> Vec<Vec<f64>> {
        let column = |name: &&str| walk.columns.get(*name).map_or(&none, |column| &column.0);
        let scaled = |values: Vec<f64>| values.into_iter().map(|value| scale * value).collect();
        names.iter().map(|name| scaled(grid.pictures(column(name), walk.tick_zero))).collect()
    };
    let mut columns = Map::new();
    let mut put = |name: &str, step: f64, values: Vec<Vec<f64>>| {
        if values.iter().flatten().any(|value| value.is_finite()) {
            let packed: Vec<_> = values.into_iter().map(|values| packer.add(values.into_iter(), step)).collect();
            columns.insert(name.to_string(), json!(packed));
        }
    };
    let pose = |name: &str| {
        let mut columns = numbered(name, 7);
        same_side(&mut columns[3..]);
        columns
    };
    // In the order of their names, in which JSON keeps them.
    put("base", POSE_STEP, pose("base"));
    put("com", POSE_STEP, named(&["com_x", "com_y", "com_z"], 1e-3));
    put("force_l", FORCE_STEP, numbered("force3_l", 3));
    put("force_r", FORCE_STEP, numbered("force3_r", 3));
    put("joint", POSE_STEP, numbered("joint", walk.body.joints.len()));
    put("push", FORCE_STEP, numbered("push", 3));
    put("push_at", POSE_STEP, numbered("push_at", 3));
    put("sole_l", POSE_STEP, pose("sole_l"));
    put("sole_r", POSE_STEP, pose("sole_r"));
    put("zmp", POSE_STEP, named(&["zmp_x", "zmp_y"], 1e-3));
    put("zmp_l", POSE_STEP, named(&["zmp_l_x", "zmp_l_y"], 1e-3));
    put("zmp_r", POSE_STEP, named(&["zmp_r_x", "zmp_r_y"], 1e-3));
    let n = grid.pictures(&none, walk.tick_zero).len();
    json!({
        "from": grid.from_s(), "step": grid.replay_step_s(), "n": n, "columns": columns, "links": walk.body.links,
        "sole": walk.body.sole_size_m,
    })
}

/// What is to be seen, in words.
pub(super) fn caption(walk: &Walk) -> &'static str {
    match walk.has_truth {
        true => {
            "Robot and soles as they really moved, ground forces (1 m is 1 kN), zero-moment point (pink), centre of mass (green), \
             pushes (yellow, 1 m is 250 N)."
        }
        false => "Joints as measured, base and soles as planned: the recording holds no truth.",
    }
}

/// A quaternion and its negative are the same turn: the one nearer to that before makes small differences.
fn same_side(quaternion: &mut [Vec<f64>]) {
    let count = quaternion.first().map_or(0, Vec::len);
    for i in 1..count {
        let along: f64 = quaternion.iter().map(|part| part[i] * part[i - 1]).sum();
        if along < 0.0 {
            quaternion.iter_mut().for_each(|part| part[i] = -part[i]);
        }
    }
}

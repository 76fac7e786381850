//! Damaged robot folders: errors, never panics, within bounded memory and time.
//!
//! `DAMAGED_FILES=20000 cargo test -p robot --test damage -- --nocapture` is the long form.

use robot::{Robot, read_mesh};
use std::path::Path;

fn shipped(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4").join(name)).expect("it ships")
}

/// Damages a file of the robot's folder, all others being whole.
fn damage(name: &str, quick: u64, words: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["robot.toml", "sole.toml", "hrp4.urdf"] {
        std::fs::write(folder.path().join(name), shipped(name)).expect("writable");
    }
    mutation::campaign(name, quick, &shipped(name), words, |bytes| {
        std::fs::write(folder.path().join(name), bytes).expect("writable");
        if let Ok(robot) = Robot::load(folder.path()) {
            let outline = robot.sole_outline();
            assert!(outline.size_m.iter().all(|size| size.is_finite() && *size > 0.0), "{outline:?}");
        }
    });
}

#[test]
fn damaged_robots_are_errors() {
    damage("robot.toml", 300, &["joints", "servos", "kp_nm_per_rad", "base_link", "[", "]]"]);
}

#[test]
fn damaged_soles_are_errors() {
    damage("sole.toml", 300, &["mesh", "file", "box_m", "cells", "friction", "young_modulus_pa", "1000000"]);
}

#[test]
fn damaged_meshes_are_errors() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("sole.msh");
    let words =
        ["$Nodes", "$EndNodes", "$Elements", "$Entities", "$PhysicalNames", "clamped", "4.1 0 8", "2.2 0 8", "4.1 1 8"];
    mutation::campaign("sole-rounded.msh", 150, &shipped("sole-rounded.msh"), &words, |bytes| {
        std::fs::write(&path, bytes).expect("writable");
        let _ = read_mesh(&path);
    });
}

//! The soles of a robot folder, built: `sole.toml` and a process's own choices in, the two feet's models out.
//!
//! Estimator and simulator read the same `sole.toml` but must not be each other's mirror image: each replaces single figures
//! in its configuration (the estimator by a [`SoleChoice`], the plant by its own settings on top of [`nominal`]). `sole.toml`
//! describes the left sole, block or Gmsh mesh; the right one is its reflection, point for point.
//!
//! Condensing a sole takes tenths of a second to seconds. A [`Store`] keeps the result between runs.
//!
//! This is a crate of its own because the controller reads the robot's folder too and must not carry finite elements.

mod choice;
mod store;

pub use choice::{SoleChoice, SolesError};
pub use store::{Source, Start, Store};

use robot::{ContactSet, Friction, Robot, SoleLevel};
use sole::{Level, Material, MeshSource, SoleModel, SoleSettings};
use spatial::Vec3;

/// The left sole as `sole.toml` describes it, all nodes of the mesh condensed. Where friction is a list, the smallest of it stands here; the
/// list itself is applied by [`both`].
#[must_use]
pub fn nominal(robot: &Robot) -> SoleSettings {
    let description = &robot.sole;
    let mesh = match (&robot.sole_mesh, description.mesh.box_m, description.mesh.cells) {
        (Some(mesh), _, _) => MeshSource::Mesh(mesh.clone()),
        (None, Some(size_m), Some(cells)) => MeshSource::Box { size_m, cells: cells.map(|n| n as usize) },
        _ => panic!("checked when read: a sole without a file is a block with cells"),
    };
    SoleSettings {
        mesh,
        material: Material {
            young_modulus_pa: description.material.young_modulus_pa,
            poisson_ratio: description.material.poisson_ratio,
        },
        friction: description.friction.smallest(),
        contact: match description.contact {
            ContactSet::Bottom => sole::ContactSet::Bottom,
            ContactSet::All => sole::ContactSet::All,
        },
        ankle_in_sole_m: Vec3::from(description.foot.ankle_in_sole_m),
        level: Level::Fem,
    }
}

/// Both soles, left and right, with the choices applied; `None` for [`SoleLevel::Rigid`], which needs no model.
///
/// # Errors
/// [`SolesError`] names file, field and value.
pub fn build(robot: &Robot, choice: &SoleChoice, store: &mut Store) -> Result<Option<[SoleModel; 2]>, SolesError> {
    choice.check()?;
    if choice.cells.is_some() {
        needs_a_block(robot, "sole.cells")?;
    }
    let mut settings = nominal(robot);
    settings.level = match choice.level.unwrap_or(robot.sole.solver.level) {
        SoleLevel::Rigid => return Ok(None),
        SoleLevel::Lumped => Level::Lumped,
        SoleLevel::Winkler => Level::Winkler { cells: choice.patch_cells.map(|n| n as usize) },
        SoleLevel::Fem => Level::Fem,
        SoleLevel::QuadraticFem => Level::QuadraticFem,
        SoleLevel::Patches => Level::Patches { cells: choice.patch_cells.map(|n| n as usize) },
        SoleLevel::QuadraticPatches => Level::QuadraticPatches { cells: choice.patch_cells.map(|n| n as usize) },
    };
    if let MeshSource::Box { cells, .. } = &mut settings.mesh {
        match (choice.cells, &settings.level) {
            (Some(chosen), _) => *cells = chosen.map(|n| n as usize),
            // Patches cost what their contact points cost: they are condensed from a fine mesh, whatever the nominal one is.
            (None, Level::Patches { .. }) => *cells = sole::CELLS_BEHIND_PATCHES,
            (None, _) => {}
        }
    }
    settings.material.young_modulus_pa *= choice.young_modulus_factor;
    settings.friction = choice.friction.unwrap_or(settings.friction);
    let list_factor = if choice.friction.is_some() { None } else { Some(1.0) };
    both(robot, &settings, list_factor, store).map(Some)
}

/// Both soles, left and right, of what a process has made of the [`nominal`] one. The robot's list of friction coefficients, if there is one,
/// is applied with a factor; `None`: one coefficient replaces it, that of the settings.
///
/// # Errors
/// [`SolesError`] names file, field and value.
pub fn both(
    robot: &Robot,
    settings: &SoleSettings,
    list_factor: Option<f64>,
    store: &mut Store,
) -> Result<[SoleModel; 2], SolesError> {
    let list = match (&robot.sole.friction, list_factor) {
        (Friction::PerPatch(list), Some(factor)) => Some((list, factor)),
        _ => None,
    };
    if list.is_some() && matches!(settings.level, Level::Rigid | Level::Lumped) {
        needs_one_friction(robot)?;
    }
    let unsound = |source| SolesError::Sole { file: robot.sole_file.clone(), source };
    let mut left = store.condense(settings).map_err(unsound)?;
    if let Some((list, factor)) = list {
        let (found, expected) = (list.len(), left.contact_points().len());
        if found != expected {
            return Err(SolesError::FrictionCount {
                file: robot.sole_file.clone(),
                level: name(&settings.level),
                found,
                expected,
            });
        }
        left = left.with_friction(list.iter().map(|mu| factor * mu).collect()).map_err(unsound)?;
    }
    let right = left.mirrored();
    Ok([left, right])
}

/// As configurations spell it.
fn name(level: &Level) -> &'static str {
    match level {
        Level::Rigid => "rigid",
        Level::Lumped => "lumped",
        Level::Winkler { .. } => "winkler",
        Level::Fem => "fem",
        Level::QuadraticFem => "quadratic-fem",
        Level::Patches { .. } => "patches",
        Level::QuadraticPatches { .. } => "quadratic-patches",
    }
}

/// A mesh file is taken as it is: a process that would cut a block into other cells is told so.
///
/// # Errors
/// [`SolesError::CellsOfFile`] with the key.
pub fn needs_a_block(robot: &Robot, key: &'static str) -> Result<(), SolesError> {
    match robot.sole.mesh_file(&robot.sole_file) {
        Some(file) => Err(SolesError::CellsOfFile { file, key }),
        None => Ok(()),
    }
}

/// Levels without contact points of the mesh have no place for a list of coefficients.
///
/// # Errors
/// [`SolesError::FrictionList`] with the file.
pub fn needs_one_friction(robot: &Robot) -> Result<(), SolesError> {
    match robot.sole.friction {
        Friction::Uniform(_) => Ok(()),
        Friction::PerPatch(_) => Err(SolesError::FrictionList { file: robot.sole_file.clone() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    /// HRP-4 on a small sole with these lines at the top of its file.
    fn robot(head: &str) -> (tempfile::TempDir, Robot) {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("sole.toml");
        let tail = "[mesh]\nbox_m = [0.23, 0.13, 0.021]\ncells = [3, 2, 2]\n[material]\nyoung_modulus_pa = 0.32e6\npoisson_ratio = 0.31\n\
                    [foot]\nankle_in_sole_m = [-0.015, -0.011, 0.103]\n[solver]\nlevel = \"fem\"\n";
        std::fs::write(&file, format!("{head}\n{tail}")).expect("a file");
        let hrp4 = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../robots/hrp4");
        (folder, Robot::load_on(&hrp4, Some(&file)).expect("a robot"))
    }

    fn built(head: &str, choice: SoleChoice) -> [SoleModel; 2] {
        build(&robot(head).1, &choice, &mut Store::none()).expect("soles").expect("not rigid")
    }

    const PLAIN: &str = "friction = 0.65\ncontact = \"bottom\"";

    #[test]
    fn the_right_sole_is_the_left_one_s_mirror_image_and_a_choice_changes_what_it_names() {
        let [left, right] = built(PLAIN, SoleChoice::default());
        assert_eq!(right, left.mirrored());
        assert_ne!(right.ankle_in_sole_m(), left.ankle_in_sole_m());
        assert_eq!((left.contact_points().len(), left.friction()), (12, &[0.65; 12][..]));
        let [softer, _] = built(PLAIN, SoleChoice { young_modulus_factor: 0.5, ..SoleChoice::default() });
        let apart = (softer.compliance() - left.compliance() * 2.0).norm();
        assert!(apart < 1e-12 * softer.compliance().norm(), "half the modulus, twice the compliance");
        let [smoother, _] = built(PLAIN, SoleChoice { friction: Some(0.2), ..SoleChoice::default() });
        assert_eq!(smoother.friction(), [0.2; 12]);
        let [finer, _] = built(PLAIN, SoleChoice { cells: Some([4, 3, 2]), ..SoleChoice::default() });
        assert_eq!(finer.contact_points().len(), 20);
        // A ring of ten nodes between bottom and top.
        let [all, _] = built("friction = 0.65\ncontact = \"all\"", SoleChoice::default());
        assert_eq!(all.contact_points().len(), 12 + 10);
        let patches = SoleChoice { level: Some(SoleLevel::Patches), patch_cells: [2, 1], ..SoleChoice::default() };
        assert_eq!(built(PLAIN, patches.clone())[0].contact_points().len(), 6);
        let quadratic = SoleChoice { level: Some(SoleLevel::QuadraticPatches), ..patches };
        assert_eq!(built(PLAIN, quadratic)[0].contact_points().len(), 6);
        let rigid = SoleChoice { level: Some(SoleLevel::Rigid), ..SoleChoice::default() };
        assert!(build(&robot(PLAIN).1, &rigid, &mut Store::none()).expect("none is needed").is_none());
    }

    #[test]
    fn a_list_of_frictions_is_point_by_point_scaled_as_asked_and_replaced_by_one_number() {
        let values: Vec<f64> = (0..12).map(|i| 0.3 + 0.05 * f64::from(i)).collect();
        let head = format!("friction = {values:?}\ncontact = \"bottom\"");
        let [left, right] = built(&head, SoleChoice::default());
        assert_eq!((left.friction(), right.friction()), (&values[..], &values[..]));
        let [one, _] = built(&head, SoleChoice { friction: Some(0.2), ..SoleChoice::default() });
        assert_eq!(one.friction(), [0.2; 12]);
        let (_folder, robot) = robot(&head);
        let settings = nominal(&robot);
        assert_eq!(settings.friction, 0.3, "the smallest");
        let [half, _] = both(&robot, &settings, Some(0.5), &mut Store::none()).expect("soles");
        assert!(half.friction().iter().zip(&values).all(|(half, whole)| *half == 0.5 * whole));
        let patches = SoleChoice { level: Some(SoleLevel::Patches), patch_cells: [2, 1], ..SoleChoice::default() };
        let error = build(&robot, &patches, &mut Store::none()).expect_err("six points, twelve values");
        assert!(matches!(error, SolesError::FrictionCount { found: 12, expected: 6, .. }), "{error}");
        let lumped = SoleChoice { level: Some(SoleLevel::Lumped), ..SoleChoice::default() };
        let error = build(&robot, &lumped, &mut Store::none()).expect_err("no points of the mesh");
        assert!(matches!(error, SolesError::FrictionList { .. }), "{error}");
    }
}

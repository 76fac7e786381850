//! The soles of a robot folder, built: `sole.toml` and a process's own choices in, the two feet's models out.
//!
//! Estimator and simulator read the same `sole.toml` but must not be each other's mirror image: each has a [`SoleChoice`] in
//! its configuration that replaces single figures (level, mesh, Young's modulus, friction). `sole.toml` describes the left
//! sole; the right one is its reflection, point for point.
//!
//! This is a crate of its own because the controller reads the robot's folder too and must not carry finite elements.

mod choice;

pub use choice::{SoleChoice, SolesError};

use robot::{ContactSet, Friction, Robot, SoleLevel};
use sole::{Material, MeshSource, SoleModel, SoleSettings};
use spatial::Vec3;

/// Both soles, left and right, with the choices applied; `None` for [`SoleLevel::Rigid`], which needs no model.
///
/// # Errors
/// [`SolesError`] names file, field and value.
pub fn build(robot: &Robot, choice: &SoleChoice) -> Result<Option<[SoleModel; 2]>, SolesError> {
    let description = &robot.sole;
    let level = match choice.level.unwrap_or(description.solver.level) {
        SoleLevel::Rigid => return Ok(None),
        SoleLevel::Fem => sole::Level::Fem,
        SoleLevel::Patches => sole::Level::Patches { cells: choice.patch_cells.map(|n| n as usize) },
        level @ (SoleLevel::Lumped | SoleLevel::Winkler) => return Err(SolesError::Level { level }),
    };
    let file = robot.folder.join("sole.toml");
    let mesh = match (description.mesh.box_m, description.mesh.cells) {
        (Some(size_m), Some(cells)) => {
            let cells = choice.cells.unwrap_or(cells).map(|n| n as usize);
            MeshSource::Box { size_m, cells }
        }
        _ => return Err(SolesError::Mesh { file }),
    };
    let uniform = match (&choice.friction, &description.friction) {
        (Some(mu), _) | (None, Friction::Uniform(mu)) => Some(*mu),
        (None, Friction::PerPatch(_)) => None,
    };
    let settings = SoleSettings {
        mesh,
        material: Material {
            young_modulus_pa: description.material.young_modulus_pa * choice.young_modulus_factor,
            poisson_ratio: description.material.poisson_ratio,
        },
        friction: uniform.unwrap_or(0.0),
        contact: match description.contact {
            ContactSet::Bottom => sole::ContactSet::Bottom,
            ContactSet::All => sole::ContactSet::All,
        },
        ankle_in_sole_m: Vec3::from(description.foot.ankle_in_sole_m),
        level,
    };
    let refuse = |source| SolesError::Sole { file: file.clone(), source };
    let mut left = SoleModel::build(&settings).map_err(refuse)?;
    if let (None, Friction::PerPatch(list)) = (uniform, &description.friction) {
        left = left.with_friction(list.clone()).map_err(refuse)?;
    }
    let right = left.mirrored();
    Ok(Some([left, right]))
}

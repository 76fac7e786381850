//! The soles of a robot folder, built: `sole.toml` and a process's own choices in, the two feet's models out.
//!
//! Estimator and simulator read the same `sole.toml` but must not be each other's mirror image: each replaces single figures
//! in its configuration (the estimator by a [`SoleChoice`], the plant by its own settings on top of [`nominal`]). `sole.toml`
//! describes the left sole; the right one is its reflection, point for point.
//!
//! This is a crate of its own because the controller reads the robot's folder too and must not carry finite elements.

mod choice;

pub use choice::{SoleChoice, SolesError};

use robot::{ContactSet, Friction, Robot, SoleLevel};
use sole::{Material, MeshSource, SoleModel, SoleSettings};
use spatial::Vec3;

/// The left sole as `sole.toml` describes it, all nodes of the mesh condensed.
///
/// # Errors
/// [`SolesError`] names file, field and value.
pub fn nominal(robot: &Robot) -> Result<SoleSettings, SolesError> {
    let description = &robot.sole;
    let file = robot.folder.join("sole.toml");
    let mesh = match (description.mesh.box_m, description.mesh.cells) {
        (Some(size_m), Some(cells)) => MeshSource::Box { size_m, cells: cells.map(|n| n as usize) },
        _ => return Err(SolesError::Mesh { file }),
    };
    let Friction::Uniform(friction) = description.friction else { return Err(SolesError::FrictionList { file }) };
    Ok(SoleSettings {
        mesh,
        material: Material {
            young_modulus_pa: description.material.young_modulus_pa,
            poisson_ratio: description.material.poisson_ratio,
        },
        friction,
        contact: match description.contact {
            ContactSet::Bottom => sole::ContactSet::Bottom,
            ContactSet::All => sole::ContactSet::All,
        },
        ankle_in_sole_m: Vec3::from(description.foot.ankle_in_sole_m),
        level: sole::Level::Fem,
    })
}

/// Both soles, left and right, with the choices applied; `None` for [`SoleLevel::Rigid`], which needs no model.
///
/// # Errors
/// [`SolesError`] names file, field and value.
pub fn build(robot: &Robot, choice: &SoleChoice) -> Result<Option<[SoleModel; 2]>, SolesError> {
    let mut settings = nominal(robot)?;
    settings.level = match choice.level.unwrap_or(robot.sole.solver.level) {
        SoleLevel::Rigid => return Ok(None),
        SoleLevel::Lumped => sole::Level::Lumped,
        SoleLevel::Winkler => sole::Level::Winkler { cells: choice.patch_cells.map(|n| n as usize) },
        SoleLevel::Fem => sole::Level::Fem,
        SoleLevel::QuadraticFem => sole::Level::QuadraticFem,
        SoleLevel::Patches => sole::Level::Patches { cells: choice.patch_cells.map(|n| n as usize) },
    };
    if let (Some(chosen), MeshSource::Box { cells, .. }) = (choice.cells, &mut settings.mesh) {
        *cells = chosen.map(|n| n as usize);
    }
    settings.material.young_modulus_pa *= choice.young_modulus_factor;
    settings.friction = choice.friction.unwrap_or(settings.friction);
    let file = robot.folder.join("sole.toml");
    let left = SoleModel::build(&settings).map_err(|source| SolesError::Sole { file, source })?;
    let right = left.mirrored();
    Ok(Some([left, right]))
}

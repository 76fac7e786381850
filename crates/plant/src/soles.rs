//! The plant's own soles: the nominal sole of the robot with another mesh and stated errors.
//!
//! The simulator must not be the estimator's mirror image. Its sole is the same foam, but solved on its own finer mesh, with viscosity
//! (see [`crate::settings::ContactSettings`]) and, where a run asks for it, with other constants than the estimator believes in.

use ranges::{OutOfRange, Range};
use serde::{Deserialize, Serialize};
use sole::{Level, MeshSource, SoleError, SoleModel};
use spatial::Vec3;

use crate::corners::CornerSettings;
use crate::foot::PlantSole;

/// How the plant's sole is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlantSoleLevel {
    /// No foam: the hard plate of the original foot on four stiff corners ([`CornerSettings`]).
    Rigid,
    /// Four springs with the sole's stiffness as a whole.
    Lumped,
    /// A grid of independent springs.
    Winkler,
    /// A fine mesh condensed onto a grid of contact patches.
    #[default]
    Patches,
    /// Every bottom node of the mesh is a contact point; slow with a fine mesh.
    Fem,
    /// Quadratic tetrahedra on the same mesh; same number of contact points.
    QuadraticFem,
    /// Quadratic tetrahedra condensed onto a grid of contact patches.
    QuadraticPatches,
}

/// Cells of the plant's own mesh of a block: 10,764 tetrahedra.
pub const MESH_CELLS: [usize; 3] = sole::CELLS_BEHIND_PATCHES;

/// The plant's soles relative to the nominal one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlantSoleSettings {
    /// How it is computed.
    pub level: PlantSoleLevel,
    /// Boxes along length, width and thickness (each is cut into six tetrahedra); [`MESH_CELLS`] if not given. For a nominal sole that is a
    /// block only: a mesh is taken as it is.
    pub mesh_cells: Option<[usize; 3]>,
    /// Cells of the patch grid, or of the grid of springs, along length and width; there is one contact point more each way.
    pub patch_cells: [usize; 2],
    /// Young's modulus over the nominal one.
    pub young_modulus_factor: f64,
    /// Friction coefficient over the nominal one.
    pub friction_factor: f64,
    /// Thickness over the nominal one; the ankle moves with it.
    pub thickness_factor: f64,
    /// For the level `rigid`; ankle and friction are taken from the nominal sole.
    pub rigid: CornerSettings,
}

impl Default for PlantSoleSettings {
    fn default() -> Self {
        Self {
            level: PlantSoleLevel::Patches,
            mesh_cells: None,
            patch_cells: [8, 7],
            young_modulus_factor: 1.0,
            friction_factor: 1.0,
            thickness_factor: 1.0,
            rigid: CornerSettings::default(),
        }
    }
}

impl PlantSoleSettings {
    /// Is every value one that can be?
    ///
    /// # Errors
    /// The first that is not, by name.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let factor = "a stated error of the estimator's model: 0.5 to 2 is plausible";
        Range::between(0.01, 100.0).demand("sole.young_modulus_factor", self.young_modulus_factor, factor)?;
        Range::between(0.0, 100.0).demand("sole.friction_factor", self.friction_factor, factor)?;
        Range::between(0.1, 10.0).demand("sole.thickness_factor", self.thickness_factor, factor)?;
        let cells = |key: &str, cells: &[usize], remedy| {
            let cells: Vec<f64> = cells.iter().map(|count| *count as f64).collect();
            Range::between(1.0, 1000.0).demand_each(key, &cells, remedy)
        };
        cells(
            "sole.mesh_cells",
            &self.mesh_cells.unwrap_or(MESH_CELLS),
            "two or more through the thickness are usual",
        )?;
        cells("sole.patch_cells", &self.patch_cells, "8 by 7 is usual")?;
        self.rigid.check("sole.rigid")
    }

    /// The constants of the left sole: what [`build`](Self::build) builds, for callers who keep condensed soles.
    #[must_use]
    pub fn left(&self, nominal: &sole::SoleSettings) -> sole::SoleSettings {
        let mut own = nominal.clone();
        own.material.young_modulus_pa *= self.young_modulus_factor;
        own.friction *= self.friction_factor;
        let thickness_m = match &mut own.mesh {
            MeshSource::Box { size_m, cells } => {
                *cells = self.mesh_cells.unwrap_or(MESH_CELLS);
                let nominal_m = size_m[2];
                size_m[2] *= self.thickness_factor;
                nominal_m
            }
            MeshSource::Mesh(mesh) => {
                let heights = || mesh.nodes.iter().map(|node| node.z);
                let nominal_m = heights().fold(f64::MIN, f64::max) - heights().fold(f64::MAX, f64::min);
                mesh.nodes.iter_mut().for_each(|node| node.z *= self.thickness_factor);
                nominal_m
            }
        };
        own.ankle_in_sole_m.z += (self.thickness_factor - 1.0) * thickness_m;
        own.level = match self.level {
            PlantSoleLevel::Rigid => Level::Rigid,
            PlantSoleLevel::Lumped => Level::Lumped,
            PlantSoleLevel::Winkler => Level::Winkler { cells: self.patch_cells },
            PlantSoleLevel::Patches => Level::Patches { cells: self.patch_cells },
            PlantSoleLevel::Fem => Level::Fem,
            PlantSoleLevel::QuadraticFem => Level::QuadraticFem,
            PlantSoleLevel::QuadraticPatches => Level::QuadraticPatches { cells: self.patch_cells },
        };
        own
    }

    /// Left and right sole; the right one is the mirrored left one.
    ///
    /// # Errors
    /// A sole that the sole crate cannot build.
    pub fn build(&self, nominal: &sole::SoleSettings) -> Result<[PlantSole; 2], SoleError> {
        if let Some(plates) = self.plates(nominal) {
            return Ok(plates);
        }
        let left = SoleModel::build(&self.left(nominal))?;
        let right = left.mirrored();
        Ok([left.into(), right.into()])
    }

    /// Left and right hard plate at the level [`PlantSoleLevel::Rigid`], which needs no model; `None` at the others.
    #[must_use]
    pub fn plates(&self, nominal: &sole::SoleSettings) -> Option<[PlantSole; 2]> {
        if self.level != PlantSoleLevel::Rigid {
            return None;
        }
        let own = self.left(nominal);
        let ankle = own.ankle_in_sole_m;
        let corners = |ankle: Vec3| {
            PlantSole::Corners(CornerSettings { friction: own.friction, ankle_in_sole_m: ankle.into(), ..self.rigid })
        };
        Some([corners(ankle), corners(Vec3::new(ankle.x, -ankle.y, ankle.z))])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stated_errors_reach_the_sole() {
        let nominal = sole::SoleSettings::default();
        let settings = PlantSoleSettings {
            young_modulus_factor: 0.8,
            friction_factor: 0.5,
            thickness_factor: 1.2,
            ..Default::default()
        };
        let own = settings.left(&nominal);
        assert_eq!(own.material.young_modulus_pa, 0.8 * nominal.material.young_modulus_pa);
        assert_eq!(own.friction, 0.5 * nominal.friction);
        let rise_m = own.ankle_in_sole_m.z - nominal.ankle_in_sole_m.z;
        assert!((rise_m - 0.2 * 0.021).abs() < 1e-15);
        let MeshSource::Box { size_m, cells } = own.mesh else { panic!("a block stays a block") };
        assert!((size_m[2] - 0.0252).abs() < 1e-15);
        assert_eq!(cells, [23, 13, 6]);
    }

    #[test]
    fn the_right_foot_mirrors_the_left() {
        let settings = PlantSoleSettings { mesh_cells: Some([8, 5, 2]), patch_cells: [4, 3], ..Default::default() };
        let rigid = PlantSoleSettings { level: PlantSoleLevel::Rigid, ..settings };
        for settings in [settings, rigid] {
            let [left, right] = settings.build(&sole::SoleSettings::default()).unwrap();
            let (l, r) = (left.ankle_in_sole_m(), right.ankle_in_sole_m());
            assert_eq!((l.x, l.y, l.z), (r.x, -r.y, r.z));
        }
    }
}

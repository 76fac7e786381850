//! What a process may replace in `sole.toml`.

use ranges::{OutOfRange, Range};
use robot::{FRICTION_MAX, SoleLevel};
use serde::Deserialize;
use std::path::PathBuf;

/// Section `[sole]` of a process's configuration; what is not given comes from the robot's `sole.toml`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SoleChoice {
    /// How much of the sole is modelled.
    pub level: Option<SoleLevel>,
    /// Boxes of the mesh along each edge, each cut into six tetrahedra. For a block only: a mesh file is taken as it is.
    /// Without it those of `sole.toml`, at level `patches` [`sole::CELLS_BEHIND_PATCHES`].
    pub cells: Option<[u32; 3]>,
    /// Cells of the grid of the levels `patches`, `quadratic-patches` and `winkler`, forward and sideways: one contact point at each of its corners
    /// that lies on the sole.
    pub patch_cells: [u32; 2],
    /// Multiplies Young's modulus.
    pub young_modulus_factor: f64,
    /// Coulomb friction, the same everywhere, also where `sole.toml` has a list.
    pub friction: Option<f64>,
}

impl Default for SoleChoice {
    fn default() -> Self {
        Self { level: None, cells: None, patch_cells: [8, 7], young_modulus_factor: 1.0, friction: None }
    }
}

impl SoleChoice {
    /// Is every number one that can be?
    ///
    /// # Errors
    /// [`OutOfRange`] with the key below `sole`.
    pub fn check(&self) -> Result<(), OutOfRange> {
        if let Some(mu) = self.friction {
            Range::between(0.0, FRICTION_MAX).demand("sole.friction", mu, "dry rubber has about 1")?;
        }
        let factor = Range::between(0.01, 100.0);
        factor.demand("sole.young_modulus_factor", self.young_modulus_factor, "0.5 to 2 is plausible")?;
        let cells = |key: &str, cells: &[u32]| {
            let cells: Vec<f64> = cells.iter().copied().map(f64::from).collect();
            Range::between(1.0, 1000.0).demand_each(key, &cells, "some tens at most are usual")
        };
        cells("sole.cells", self.cells.as_ref().map_or(&[][..], |cells| &cells[..]))?;
        cells("sole.patch_cells", &self.patch_cells)
    }
}

/// Why there are no soles.
#[derive(Debug, thiserror::Error)]
pub enum SolesError {
    /// Mesh, material or friction cannot be.
    #[error("{}: no such sole can be built", .file.display())]
    Sole {
        /// The description.
        file: PathBuf,
        /// What is wrong.
        source: sole::SoleError,
    },
    /// A number in the process's configuration cannot be.
    #[error(transparent)]
    Choice(#[from] OutOfRange),
    /// The levels `rigid` and `lumped` have no contact points of the mesh. Remedy: another level, or one coefficient.
    #[error(
        "{}: friction is a list, one value per contact point: the levels rigid and lumped have none; choose sole.level patches, \
         quadratic-patches, winkler, fem or quadratic-fem, or give one number", .file.display()
    )]
    FrictionList {
        /// The description.
        file: PathBuf,
    },
    /// A list of coefficients for another sole. Planner, estimator and plant may have different contact points: the same `sole.level` and
    /// `sole.patch_cells` in all three configurations give them the same.
    #[error(
        "{}: friction has {found} values, but at this process's sole.level = \"{level}\" the sole has {expected} contact points: give as many, \
         with the same sole.level and sole.patch_cells in the configurations of planner, estimator and simulator; or one number",
        .file.display()
    )]
    FrictionCount {
        /// The description.
        file: PathBuf,
        /// Level of the process that counted.
        level: &'static str,
        /// Number of values.
        found: usize,
        /// Number of contact points.
        expected: usize,
    },
    /// Cells for a mesh that is not cut into cells.
    #[error("{key} is for a block, but the sole is the mesh {}, which is taken as it is: remove {key}", .file.display())]
    CellsOfFile {
        /// The mesh.
        file: PathBuf,
        /// Key in the process's configuration.
        key: &'static str,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_cannot_be_are_refused_by_key() {
        assert!(SoleChoice::default().check().is_ok());
        for mu in [0.0, 0.65, FRICTION_MAX] {
            assert!(SoleChoice { friction: Some(mu), ..SoleChoice::default() }.check().is_ok(), "{mu}");
        }
        for mu in [-0.1, 10.1, 1e6, f64::INFINITY, f64::NAN] {
            let error = SoleChoice { friction: Some(mu), ..SoleChoice::default() }.check().expect_err("no friction");
            let said = format!("`sole.friction` is {}, must be at least 0 and at most 10: ", ranges::number(mu));
            assert!(error.to_string().starts_with(&said), "{error}");
        }
        for young_modulus_factor in [0.0, -1.0, 1e-9, 1e9, f64::INFINITY, f64::NAN] {
            let error = SoleChoice { young_modulus_factor, ..SoleChoice::default() }.check().expect_err("no foam");
            assert_eq!(error.key, "sole.young_modulus_factor");
        }
        let error = SoleChoice { patch_cells: [8, 0], ..SoleChoice::default() }.check().expect_err("no cells");
        assert_eq!(error.key, "sole.patch_cells[1]");
        let error =
            SoleChoice { cells: Some([12, 4_000_000, 3]), ..SoleChoice::default() }.check().expect_err("too many");
        assert_eq!(error.key, "sole.cells[1]");
    }
}

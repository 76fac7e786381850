//! What is known of a sole before it touches anything.

use crate::elasticity::spd_inverse;
use crate::{ContactSet, ElasticBody, Material, Mesh, SoleError};
use nalgebra::DMatrix;
use spatial::Vec3;

/// Where the mesh comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshSource {
    /// [`Mesh::kuhn_box`].
    Box {
        /// Edges (m).
        size_m: [f64; 3],
        /// Hexahedral cells along each edge.
        cells: [usize; 3],
    },
    /// A mesh built by the caller.
    Mesh(Mesh),
}

/// How the deformable sole is represented.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Level {
    /// Linear tetrahedra condensed to the contact nodes: the paper's sole.
    #[default]
    Fem,
    /// The same mesh condensed onto a coarse grid of contact patches, `cells` along x and y: (cells+1) points each way.
    Patches {
        /// Cells of the coarse grid along x and y.
        cells: [usize; 2],
    },
}

/// What a sole is made of; parsed elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct SoleSettings {
    /// Geometry and elements.
    pub mesh: MeshSource,
    /// Elastic constants.
    pub material: Material,
    /// Friction coefficient of every contact point, >= 0.
    pub friction: f64,
    /// Which nodes may touch the ground.
    pub contact: ContactSet,
    /// Ankle in the sole frame (m).
    pub ankle_in_sole_m: Vec3,
    /// Representation.
    pub level: Level,
}

impl Default for SoleSettings {
    /// HRP-4's left sole: method 2.1.
    fn default() -> Self {
        Self {
            mesh: MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [12, 7, 3] },
            material: Material { young_modulus_pa: 0.32e6, poisson_ratio: 0.31 },
            friction: 0.65,
            contact: ContactSet::Bottom,
            ankle_in_sole_m: Vec3::new(-0.015, -0.011, 0.103),
            level: Level::Fem,
        }
    }
}

/// A sole ready for contact: contact points, compliance and friction in the sole frame. Constant once built.
#[derive(Debug, Clone, PartialEq)]
pub struct SoleModel {
    points: Vec<Vec3>,
    compliance: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    friction: Vec<f64>,
    ankle: Vec3,
    mesh: Option<Mesh>,
}

impl SoleModel {
    /// Meshes, assembles, factorises and condenses.
    ///
    /// # Errors
    /// [`SoleError`] names the mesh defect, material constant or friction value.
    pub fn build(settings: &SoleSettings) -> Result<Self, SoleError> {
        let mesh = match &settings.mesh {
            MeshSource::Box { size_m, cells } => Mesh::kuhn_box(*size_m, *cells)?,
            MeshSource::Mesh(mesh) => mesh.clone().checked()?,
        };
        let mesh = match settings.contact {
            ContactSet::Bottom => mesh,
            ContactSet::All => mesh.with_contact(ContactSet::All)?,
        };
        let body = ElasticBody::new(&mesh, &settings.material)?;
        let weights = match settings.level {
            Level::Fem => mesh.contact.iter().map(|node| vec![(*node, 1.0)]).collect(),
            Level::Patches { cells } => crate::patches::weights(&mesh, cells)?,
        };
        let points: Vec<Vec3> = weights
            .iter()
            .map(|patch: &Vec<(usize, f64)>| patch.iter().map(|(node, weight)| *weight * mesh.nodes[*node]).sum())
            .collect();
        let friction = vec![settings.friction; points.len()];
        let mut model = Self::from_parts(points, body.compliance(&weights), friction, settings.ankle_in_sole_m)?;
        model.mesh = Some(mesh);
        Ok(model)
    }

    /// From contact points (m), their compliance (3n x 3n, m/N, x, y, z per point, symmetric positive definite), friction
    /// coefficients and ankle (m), all in the sole frame.
    ///
    /// # Errors
    /// [`SoleError::Count`], [`SoleError::Friction`], [`SoleError::NoContactCandidate`], [`SoleError::NotPositiveDefinite`].
    pub fn from_parts(
        points: Vec<Vec3>,
        compliance: DMatrix<f64>,
        friction: Vec<f64>,
        ankle_in_sole_m: Vec3,
    ) -> Result<Self, SoleError> {
        if points.is_empty() {
            return Err(SoleError::NoContactCandidate);
        }
        if let Some(node) = points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(SoleError::NodeNotFinite { node });
        }
        for found in [friction.len(), compliance.nrows() / 3, compliance.ncols() / 3] {
            if found != points.len() {
                return Err(SoleError::Count { expected: points.len(), found });
            }
        }
        if let Some(point) = friction.iter().position(|mu| !(mu.is_finite() && *mu >= 0.0)) {
            return Err(SoleError::Friction { point, friction: friction[point] });
        }
        if compliance.iter().any(|c| !c.is_finite()) {
            return Err(SoleError::NotPositiveDefinite { matrix: "compliance", size: compliance.nrows() });
        }
        let stiffness = spd_inverse(&compliance, "compliance")?;
        Ok(Self { points, compliance, stiffness, friction, ankle: ankle_in_sole_m, mesh: None })
    }

    /// The other foot's sole: reflected in the sagittal plane, point for point, so that mirrored loads give mirrored poses.
    /// (A second Kuhn mesh would not do: its diagonals are 3-7 % asymmetric.)
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let flip = |p: &Vec3| Vec3::new(p.x, -p.y, p.z);
        let sign = |i: usize| if i % 3 == 1 { -1.0 } else { 1.0 };
        let reflect = |m: &DMatrix<f64>| DMatrix::from_fn(m.nrows(), m.ncols(), |i, j| sign(i) * sign(j) * m[(i, j)]);
        let mesh = self.mesh.as_ref().map(|mesh| Mesh {
            nodes: mesh.nodes.iter().map(flip).collect(),
            tetrahedra: mesh.tetrahedra.iter().map(|t| [t[0], t[2], t[1], t[3]]).collect(),
            clamped: mesh.clamped.clone(),
            contact: mesh.contact.clone(),
        });
        Self {
            points: self.points.iter().map(flip).collect(),
            compliance: reflect(&self.compliance),
            stiffness: reflect(&self.stiffness),
            friction: self.friction.clone(),
            ankle: flip(&self.ankle),
            mesh,
        }
    }

    /// The same sole with other friction coefficients, one per contact point.
    ///
    /// # Errors
    /// [`SoleError::Count`], [`SoleError::Friction`].
    pub fn with_friction(mut self, friction: Vec<f64>) -> Result<Self, SoleError> {
        if friction.len() != self.points.len() {
            return Err(SoleError::Count { expected: self.points.len(), found: friction.len() });
        }
        if let Some(point) = friction.iter().position(|mu| !(mu.is_finite() && *mu >= 0.0)) {
            return Err(SoleError::Friction { point, friction: friction[point] });
        }
        self.friction = friction;
        Ok(self)
    }

    /// Undeformed contact points (m) in the sole frame.
    #[must_use]
    pub fn contact_points(&self) -> &[Vec3] {
        &self.points
    }

    /// Compliance `C_S` (3n x 3n, m/N) in the sole frame, x, y, z per contact point.
    #[must_use]
    pub fn compliance(&self) -> &DMatrix<f64> {
        &self.compliance
    }

    /// `C_S^-1` (N/m).
    #[must_use]
    pub fn stiffness(&self) -> &DMatrix<f64> {
        &self.stiffness
    }

    /// Friction coefficient of each contact point.
    #[must_use]
    pub fn friction(&self) -> &[f64] {
        &self.friction
    }

    /// Ankle in the sole frame (m).
    #[must_use]
    pub fn ankle_in_sole_m(&self) -> Vec3 {
        self.ankle
    }

    /// The mesh behind the compliance, when it was built from one.
    #[must_use]
    pub fn mesh(&self) -> Option<&Mesh> {
        self.mesh.as_ref()
    }
}

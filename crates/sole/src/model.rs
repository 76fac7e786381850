//! What is known of a sole before it touches anything.

use crate::elasticity::spd_inverse;
use crate::quadratic::QuadraticBody;
use crate::{ContactSet, ElasticBody, Material, Mesh, MeshError, SoleError, patches};
use nalgebra::DMatrix;
use spatial::{Mat6, Vec3, so3};

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

/// How the deformable sole is represented. Every level is a set of contact points with a compliance, so estimator and plant use
/// them all in the same way; they differ in what the compliance knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Level {
    /// Four corners on a support so stiff that nothing is seen to move ([`RIGID_STIFFNESS_N_PER_M`]).
    Rigid,
    /// Four points of independent springs that have the bonded sole's vertical, roll, pitch and mean shear stiffness: a spring
    /// with six degrees of freedom, which can still lift a side and slide.
    Lumped,
    /// A grid of independent springs (Winkler's foundation): the bonded sole's vertical and mean shear stiffness spread by area.
    Winkler {
        /// Cells of the grid along x and y; one point more each way.
        cells: [usize; 2],
    },
    /// Linear tetrahedra condensed to the contact nodes: the paper's sole.
    #[default]
    Fem,
    /// Quadratic tetrahedra on the same mesh: no locking, about eight times the degrees of freedom offline, as many contact points. Each of
    /// them is a weighted mean over the faces around a contact node. On a block those of the edge lie a quarter of a cell inside it, and
    /// the reach of the ZMP ends there: 4.8 mm short of each end and 4.6 mm of each side of HRP-4's sole on 12 x 7 cells, 2.4 and
    /// 2.3 mm on twice as many.
    QuadraticFem,
    /// The same mesh condensed onto a coarse grid of contact patches: accuracy of a fine mesh at the price of a coarse one.
    Patches {
        /// Cells of the coarse grid along x and y; one point more each way.
        cells: [usize; 2],
    },
    /// Quadratic tetrahedra condensed onto such a grid: no locking and few contact points. 9 x 8 of them on 12 x 7 x 3 cells are as near to
    /// ever finer quadratic elements as linear ones never come; see `docs/performance.md`.
    QuadraticPatches {
        /// Cells of the coarse grid along x and y; one point more each way.
        cells: [usize; 2],
    },
}

/// Vertical stiffness of the level [`Level::Rigid`] (N/m): an aluminium plate; 0.4 um under 400 N.
pub const RIGID_STIFFNESS_N_PER_M: f64 = 1e9;

/// Most contact points of a sole. Their compliance and its inverse are dense, 162 MB each at so many: the block of 49 x 29 x 11 cells took 92 s
/// and 1.2 GB. More than twice the finest mesh that is walked on (627), and 200 Hz ends at 300.
pub const CONTACT_POINTS_MAX: usize = 1500;

/// Most quadratic tetrahedra. The factors of a deep block of 97,000 have 14 GB, 16,200 with 589 contacts took 27 s and 1 GB.
const QUADRATIC_ELEMENTS_MAX: usize = 25_000;

/// What a sole was condensed from.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Statistics {
    /// Nodes of the mesh (with midpoints for quadratic elements).
    pub nodes: usize,
    /// Elements.
    pub tetrahedra: usize,
    /// Unknowns of the elastic problem.
    pub degrees_of_freedom: usize,
    /// Worst shape quality, see [`Mesh::quality`]; 0 when there is no mesh.
    pub worst_quality: f64,
    /// Height of the mesh (m); 0 when there is none.
    pub thickness_m: f64,
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
    statistics: Statistics,
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
        check_count(&settings.level, &mesh)?;
        let mu = settings.friction;
        let ankle = settings.ankle_in_sole_m;
        let mut statistics = Statistics {
            nodes: mesh.nodes.len(),
            tetrahedra: mesh.tetrahedra.len(),
            degrees_of_freedom: 0,
            worst_quality: (0..mesh.tetrahedra.len()).map(|t| mesh.quality(t)).fold(f64::INFINITY, f64::min),
            thickness_m: (mesh.bounds().1 - mesh.bounds().0).z,
        };
        let condensed = |body: &ElasticBody, nodes: &[Vec3], weights: &[Vec<(usize, f64)>]| {
            let points = weights.iter().map(|patch| patch.iter().map(|(node, weight)| *weight * nodes[*node]).sum());
            let points: Vec<Vec3> = points.collect();
            let friction = vec![mu; points.len()];
            Self::from_parts(points, body.compliance(weights), friction, ankle)
        };
        let mut model = match settings.level {
            Level::Rigid => Self::springs(&patches::corners(&mesh), [RIGID_STIFFNESS_N_PER_M; 2], mu, ankle)?,
            Level::QuadraticFem | Level::QuadraticPatches { .. } => {
                let quadratic = QuadraticBody::new(&mesh, &settings.material)?;
                statistics.nodes = quadratic.nodes.len();
                statistics.degrees_of_freedom = quadratic.body.size();
                let hats = quadratic.weights(&mesh);
                let weights = match settings.level {
                    Level::QuadraticPatches { cells } => patches::weights(&mesh, cells)?.over(&mesh, &hats),
                    _ => hats,
                };
                condensed(&quadratic.body, &quadratic.nodes, &weights)?
            }
            level => {
                let body = ElasticBody::new(&mesh, &settings.material)?;
                statistics.degrees_of_freedom = body.size();
                let nodal: Vec<_> = mesh.contact.iter().map(|node| vec![(*node, 1.0)]).collect();
                match level {
                    Level::Patches { cells } => {
                        condensed(&body, &mesh.nodes, &patches::weights(&mesh, cells)?.weights)?
                    }
                    Level::Winkler { cells } => {
                        let bonded = condensed(&body, &mesh.nodes, &nodal)?.bonded_stiffness();
                        let grid = patches::weights(&mesh, cells)?;
                        Self::springs(&grid.points(&mesh), shear_and_vertical(&bonded), mu, ankle)?
                    }
                    Level::Lumped => {
                        let bonded = condensed(&body, &mesh.nodes, &nodal)?.bonded_stiffness();
                        Self::springs(&patches::equivalent_corners(&bonded), shear_and_vertical(&bonded), mu, ankle)?
                    }
                    _ => condensed(&body, &mesh.nodes, &nodal)?,
                }
            }
        };
        model.mesh = Some(mesh);
        Ok(model.with_statistics(statistics))
    }

    /// Independent springs: points with their share of the total shear and vertical stiffness (N/m).
    fn springs(
        points: &[(Vec3, f64)],
        [shear, vertical]: [f64; 2],
        friction: f64,
        ankle: Vec3,
    ) -> Result<Self, SoleError> {
        let mut compliance = DMatrix::zeros(3 * points.len(), 3 * points.len());
        for (i, (_, share)) in points.iter().enumerate() {
            for (axis, stiffness) in [shear, shear, vertical].into_iter().enumerate() {
                compliance[(3 * i + axis, 3 * i + axis)] = 1.0 / (share * stiffness);
            }
        }
        let friction = vec![friction; points.len()];
        Self::from_parts(points.iter().map(|(p, _)| *p).collect(), compliance, friction, ankle)
    }

    /// From contact points (m), their compliance (3n x 3n, m/N, x, y, z per point, symmetric positive definite), friction
    /// coefficients and ankle (m), all in the sole frame.
    ///
    /// # Errors
    /// [`SoleError::Count`], [`SoleError::Friction`], [`SoleError::Mesh`], [`SoleError::NotPositiveDefinite`].
    pub fn from_parts(
        points: Vec<Vec3>,
        compliance: DMatrix<f64>,
        friction: Vec<f64>,
        ankle_in_sole_m: Vec3,
    ) -> Result<Self, SoleError> {
        if points.is_empty() {
            return Err(MeshError::NoContactCandidate.into());
        }
        if let Some(node) = points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(MeshError::NodeNotFinite { node }.into());
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
        let statistics = Statistics::default();
        Ok(Self { points, compliance, stiffness, friction, ankle: ankle_in_sole_m, mesh: None, statistics })
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
            statistics: self.statistics,
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

    /// What it was condensed from.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    pub(crate) fn with_statistics(mut self, statistics: Statistics) -> Self {
        self.statistics = statistics;
        self
    }

    /// Stiffness `B' C^-1 B` (force and moment about the sole's origin per translation and rotation) while all contact points are
    /// glued to the ground: the sole as one spring.
    #[must_use]
    pub fn bonded_stiffness(&self) -> Mat6 {
        let b = self.rigid_motions();
        let k = b.tr_mul(&(&self.stiffness * &b));
        Mat6::from_fn(|i, j| k[(i, j)])
    }

    /// Displacements (3n x 6) of the contact points by the six rigid motions.
    fn rigid_motions(&self) -> DMatrix<f64> {
        let mut b = DMatrix::zeros(3 * self.points.len(), 6);
        for (i, p) in self.points.iter().enumerate() {
            b.fixed_view_mut::<3, 3>(3 * i, 0).fill_with_identity();
            b.fixed_view_mut::<3, 3>(3 * i, 3).copy_from(&-so3::skew(p));
        }
        b
    }

    /// Condition number of the compliance: how well forces follow from displacements (20-80 on usual soles).
    #[must_use]
    pub fn compliance_condition(&self) -> f64 {
        let eigenvalues = self.compliance.clone().symmetric_eigenvalues();
        eigenvalues.max() / eigenvalues.min()
    }
}

/// Before the memory is asked for.
fn check_count(level: &Level, mesh: &Mesh) -> Result<(), SoleError> {
    let grid = |cells: &[usize; 2]| cells[0].saturating_add(1).saturating_mul(cells[1].saturating_add(1));
    let elements = mesh.tetrahedra.len();
    let is_quadratic = matches!(level, Level::QuadraticFem | Level::QuadraticPatches { .. });
    if is_quadratic && elements > QUADRATIC_ELEMENTS_MAX {
        return Err(MeshError::TooFine { elements, most: QUADRATIC_ELEMENTS_MAX }.into());
    }
    let points = match level {
        Level::Rigid => return Ok(()),
        Level::Patches { cells } | Level::QuadraticPatches { cells } => grid(cells),
        Level::Winkler { cells } => grid(cells).max(mesh.contact.len()),
        Level::Lumped | Level::Fem | Level::QuadraticFem => mesh.contact.len(),
    };
    if points > CONTACT_POINTS_MAX {
        return Err(SoleError::TooManyPoints { points, most: CONTACT_POINTS_MAX });
    }
    Ok(())
}

/// Mean shear and vertical stiffness of a bonded sole (N/m).
fn shear_and_vertical(bonded: &Mat6) -> [f64; 2] {
    [0.5 * (bonded[(0, 0)] + bonded[(1, 1)]), bonded[(2, 2)]]
}

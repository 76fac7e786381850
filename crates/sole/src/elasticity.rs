//! Linear isotropic elasticity on tetrahedra: element stiffness, assembly, condensation to chosen nodes.
//!
//! `u' K u = INT sigma(u) : eps(u) dV` with `sigma = lame_lambda tr(eps) I + 2 lame_mu eps` (16)-(19). With the clamped nodes
//! removed, the compliance of the contact candidates is the block `C_S = (K^-1)_SS` (20): the interior nodes are force-free,
//! so this equals `(K_SS - K_SI K_II^-1 K_IS)^-1` without forming a Schur complement.

use crate::{Mesh, SoleError};
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::Llt;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};
use nalgebra::{DMatrix, SMatrix};
use spatial::{Mat3, Vec3};

/// Isotropic linear elasticity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Young's modulus E (Pa), positive.
    pub young_modulus_pa: f64,
    /// Poisson's ratio nu, in (-1, 0.5). Linear tetrahedra lock from about 0.45.
    pub poisson_ratio: f64,
}

impl Material {
    /// # Errors
    /// [`SoleError::Material`] outside the range in which the energy is positive.
    pub fn check(&self) -> Result<(), SoleError> {
        let Self { young_modulus_pa, poisson_ratio } = *self;
        let sound = young_modulus_pa.is_finite()
            && young_modulus_pa > 0.0
            && poisson_ratio.is_finite()
            && poisson_ratio > -1.0
            && poisson_ratio < 0.5;
        if sound { Ok(()) } else { Err(SoleError::Material { young_modulus_pa, poisson_ratio }) }
    }

    /// First Lamé coefficient (Pa).
    #[must_use]
    pub fn lame_lambda(&self) -> f64 {
        let nu = self.poisson_ratio;
        self.young_modulus_pa * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    }

    /// Shear modulus (Pa).
    #[must_use]
    pub fn lame_mu(&self) -> f64 {
        self.young_modulus_pa / (2.0 * (1.0 + self.poisson_ratio))
    }

    /// `INT (dNa/di sigma_ij) .. ` for two gradients: the 3 x 3 block
    /// `volume (lambda ga gb' + mu gb ga' + mu (ga . gb) I)`.
    pub(crate) fn block(&self, ga: &Vec3, gb: &Vec3, volume: f64) -> Mat3 {
        let (lambda, mu) = (self.lame_lambda(), self.lame_mu());
        volume * (lambda * ga * gb.transpose() + mu * gb * ga.transpose() + mu * ga.dot(gb) * Mat3::identity())
    }
}

/// Gradients (1/m) of the four barycentric coordinates and the volume (m^3).
#[must_use]
pub fn gradients(corners: &[Vec3; 4]) -> ([Vec3; 4], f64) {
    let [a, b, c, d] = *corners;
    let (u, v, w) = (b - a, c - a, d - a);
    let six_volumes = u.dot(&v.cross(&w));
    let (gb, gc, gd) = (v.cross(&w) / six_volumes, w.cross(&u) / six_volumes, u.cross(&v) / six_volumes);
    ([-(gb + gc + gd), gb, gc, gd], six_volumes / 6.0)
}

/// 12 x 12 stiffness of the linear tetrahedron, degrees of freedom x, y, z per corner.
#[must_use]
pub fn element_stiffness(corners: &[Vec3; 4], material: &Material) -> SMatrix<f64, 12, 12> {
    let (g, volume) = gradients(corners);
    let mut k = SMatrix::<f64, 12, 12>::zeros();
    for a in 0..4 {
        for b in 0..4 {
            k.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(&material.block(&g[a], &g[b], volume));
        }
    }
    k
}

/// The clamped sole as a factorised linear system `K u = f`.
pub struct ElasticBody {
    /// Number of the first degree of freedom of each node; `None` when clamped.
    first_dof: Vec<Option<usize>>,
    size: usize,
    factor: Llt<usize, f64>,
    stiffness: SparseColMat<usize, f64>,
}

/// Right-hand sides solved together: large enough for the blocked solver, small enough to keep 25,000-element soles in memory.
const BLOCK_COLUMNS: usize = 96;

impl ElasticBody {
    /// Assembles and factorises.
    ///
    /// # Errors
    /// [`SoleError::Material`], [`SoleError::NotPositiveDefinite`].
    pub fn new(mesh: &Mesh, material: &Material) -> Result<Self, SoleError> {
        material.check()?;
        let blocks = mesh.tetrahedra.iter().flat_map(|t| {
            let (g, volume) = gradients(&t.map(|i| mesh.nodes[i]));
            let t = *t;
            (0..16).map(move |ab| (t[ab / 4], t[ab % 4], material.block(&g[ab / 4], &g[ab % 4], volume)))
        });
        Self::from_blocks(mesh.nodes.len(), &mesh.clamped, blocks)
    }

    /// From 3 x 3 blocks (row node, column node, block) of the stiffness; blocks of a pair are summed.
    ///
    /// # Errors
    /// [`SoleError::NotPositiveDefinite`].
    pub fn from_blocks(
        node_count: usize,
        clamped: &[usize],
        blocks: impl Iterator<Item = (usize, usize, Mat3)>,
    ) -> Result<Self, SoleError> {
        let mut first_dof = vec![Some(0); node_count];
        for c in clamped {
            first_dof[*c] = None;
        }
        let mut size = 0;
        for dof in first_dof.iter_mut().flatten() {
            *dof = size;
            size += 3;
        }
        let mut triplets = Vec::new();
        for (a, b, block) in blocks {
            if let (Some(row), Some(column)) = (first_dof[a], first_dof[b]) {
                for i in 0..3 {
                    for j in 0..3 {
                        triplets.push(Triplet::new(row + i, column + j, block[(i, j)]));
                    }
                }
            }
        }
        let singular = SoleError::NotPositiveDefinite { matrix: "stiffness", size };
        let stiffness = SparseColMat::<usize, f64>::try_new_from_triplets(size, size, &triplets)
            .expect("degrees of freedom are numbered below the size");
        let factor = stiffness.sp_cholesky(Side::Lower).map_err(|_| singular)?;
        Ok(Self { first_dof, size, factor, stiffness })
    }

    /// Number of free degrees of freedom.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of stored entries of the sparse stiffness.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.stiffness.compute_nnz()
    }

    /// Displacement (m) of every node under nodal forces (N).
    #[must_use]
    pub fn displacement(&self, force: &[Vec3]) -> Vec<Vec3> {
        assert_eq!(force.len(), self.first_dof.len(), "one force per node");
        let mut rhs = Mat::<f64>::zeros(self.size, 1);
        for (dof, f) in self.first_dof.iter().zip(force) {
            if let Some(dof) = dof {
                for i in 0..3 {
                    rhs[(dof + i, 0)] = f[i];
                }
            }
        }
        self.factor.solve_in_place(&mut rhs);
        let at = |dof: usize| Vec3::new(rhs[(dof, 0)], rhs[(dof + 1, 0)], rhs[(dof + 2, 0)]);
        self.first_dof.iter().map(|dof| dof.map_or_else(Vec3::zeros, at)).collect()
    }

    /// `L' K^-1 L` (3m x 3m, m/N), symmetric, where column `j` of the scalar weights `L` spreads the force on patch `j` over
    /// nodes: `patches[j]` lists (node, weight). Single nodes with weight 1 give the nodal compliance `C_S` (20).
    #[must_use]
    pub fn compliance(&self, patches: &[Vec<(usize, f64)>]) -> DMatrix<f64> {
        let m = 3 * patches.len();
        let mut compliance = DMatrix::zeros(m, m);
        for start in (0..m).step_by(BLOCK_COLUMNS) {
            let width = BLOCK_COLUMNS.min(m - start);
            let mut rhs = Mat::<f64>::zeros(self.size, width);
            for column in 0..width {
                let (patch, axis) = ((start + column) / 3, (start + column) % 3);
                for (node, weight) in &patches[patch] {
                    let dof = self.first_dof[*node].expect("contact candidates are not clamped");
                    rhs[(dof + axis, column)] += weight;
                }
            }
            self.factor.solve_in_place(&mut rhs);
            for column in 0..width {
                for (patch, weights) in patches.iter().enumerate() {
                    for (node, weight) in weights {
                        let dof = self.first_dof[*node].expect("contact candidates are not clamped");
                        for axis in 0..3 {
                            compliance[(3 * patch + axis, start + column)] += weight * rhs[(dof + axis, column)];
                        }
                    }
                }
            }
        }
        (&compliance + compliance.transpose()) * 0.5
    }
}

/// Inverse of a symmetric positive definite matrix, symmetrised.
pub(crate) fn spd_inverse(matrix: &DMatrix<f64>, name: &'static str) -> Result<DMatrix<f64>, SoleError> {
    let n = matrix.nrows();
    let a = Mat::<f64>::from_fn(n, n, |i, j| matrix[(i, j)]);
    let factor = a.llt(Side::Lower).map_err(|_| SoleError::NotPositiveDefinite { matrix: name, size: n })?;
    let mut inverse = Mat::<f64>::identity(n, n);
    factor.solve_in_place(&mut inverse);
    Ok(DMatrix::from_fn(n, n, |i, j| 0.5 * (inverse[(i, j)] + inverse[(j, i)])))
}

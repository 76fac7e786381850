//! The soft sole: finite elements, exact frictional contact, and the pose of the deformed sole from the load it carries.
//!
//! # Problem
//! A block of foam is glued to the rigid foot and touches the ground. Given at every control tick the force `F^d` that the ground
//! must exert and the zero-moment point `P^d` it must have, find where the foot is:
//!
//! ```text
//! u = C_S f                                  elastic sole, condensed to the contact points (16)-(20)
//! P = O + R (p + u),  F = R f                deformed points and forces in the world (25)-(26)
//! delta = P - Q                              Q: where the point touched before, on the ground (21), (28), (35)
//! 0 <= F_n _|_ delta_n >= 0                  Signorini (22)
//! |F_t| <= mu F_n, opposite to delta_t       Coulomb (23)-(24)
//! sum F = F^d,  sum (P - P^d) x F = 0        six equations for O and R (31)-(32)
//! ```
//!
//! | letter | meaning | size, unit |
//! |---|---|---|
//! | `p` | undeformed contact points, sole frame | n x 3, m |
//! | `C_S` ([`SoleModel::compliance`]) | compliance of the contact points, sole frame, x, y, z per point | 3n x 3n, m/N |
//! | `O`, `R` | pose `X_WS` of the sole frame: origin at the centre of the undeformed bottom face | m |
//! | `K_c` | stiffness `(C_cc)^-1` of the points in contact | N/m |
//! | `v` | slip of the sliding points since the previous tick | m |
//!
//! # What is here
//! - [`Mesh`], [`Material`], [`ElasticBody`]: linear tetrahedra as in the paper (own box mesher, Gmsh files: `sole_mesh`), sparse Cholesky by faer.
//! - [`SoleModel`]: contact points and their compliance, at a [`Level`] from rigid corners to quadratic elements and patches, all behind one
//!   interface; [`SoleModel::mirrored`] for the other foot; [`SoleModel::to_bytes`] to condense once.
//! - [`StanceEstimator`]: force and ZMP in; pose, velocity, acceleration, node forces and states, tangent out; history of contact.
//! - [`PoseDrivenContact`]: pose in, wrench and tangent out, on any [`Ground`], with viscosity: the simulated robot's foot.
//! - [`NestedEstimator`]: the paper's own scheme, plainly written, to hold the fast one against.
//!
//! # How
//! *Sole frame.* `W = H C_S H'` is never formed: `C_S` stays, the ground turns. *Stiffness form.* For a set of points in contact the forces are
//! `f = K_c u`, linear in ten numbers of the pose and two per sliding point, so pose, forces and slips are found together by Newton with a
//! 6 x 6 system after the slips are eliminated; node states follow from Alart-Curnier's functions between the steps; a point that lands or
//! lifts is a rank-3 update. *No line search*: capped steps converge where a monotone search fails. Where the points' states run in circles
//! instead, the pose alone is iterated, with a line search, the contact solved exactly at each pose. When that fails too, or has leapt, the load
//! is followed from the last one carried, straight, in steps of equal ratios of the vertical force (large ones whose states circle: on the pose
//! alone as well; at a first tick, if that is in vain, the ZMP first and the push after it). Where no step leads on, the curve of equilibria is
//! followed by its arc length: it turns back, and no pose of it carries the load ([`Status::Fold`]: shown), or it leads on. What is not found by
//! then, or not within the work of a tick, is [`Status::NotFound`], which says nothing about whether there is a pose. A solution is accepted only with a positive determinant of the tangent.
//! *Which solution*. Coulomb friction may allow several. The walking soles here have one as far as found; a sole with Poisson's ratio 0.49 on
//! friction 0.65 has five at least under one and the same first load, whose sinkages differ by up to a tenth, each to all digits
//! a solution. Taken is the one that the first of these ways reaches from the last tick's pose and states (at touch-down: flat, all points
//! that the load can reach sticking): always the same one for the same stance.
//! *How far the ZMP can go* depends on what holds the points (`tests/suite/edge.rs`; 30 mm sole, 383 N). At the first tick the references turn
//! with the sole about its foothold (35): tilting draws the loaded edge in by `L/2 (1 - cos)`, and at 0.91 of the half-length (17 degrees) the
//! ZMP folds back. Later the points stay where they stick; the sole rolls about an edge that holds its place, and there is no fold up to the
//! edge, at any friction from 0.02 to 1.5: 24 degrees at 0.99 of the half-length, the tangent regular all the way. That number is the mesh's, not
//! the foam's (44 degrees on 10,764 elements: the pressed strip is narrower than an element): linear elasticity is over long before,
//! which [`Status::DoubtfulTilt`] says from 5 degrees on (0.83 of the half-length). A stance that begins at 0.05 N, as in walking, meets no fold.
//! *Derivatives* are implicit: velocity and acceleration follow from the tangent and the references' own rates, not from differences.
//!
//! # Example
//! The paper's sole under a foot of HRP-4 that carries its whole weight, 30 mm before the sole's middle:
//!
//! ```
//! use nalgebra::Vector2;
//! use sole::{EstimatorSettings, Foothold, SoleModel, SoleSettings, StanceEstimator, StanceReference};
//! use spatial::Vec3;
//!
//! let sole = SoleModel::build(&SoleSettings::default())?;
//! let mut estimator = StanceEstimator::new(sole, EstimatorSettings::default());
//! estimator.touch_down(Foothold::default());
//! let load = StanceReference::constant(Vec3::new(0.0, 0.0, 383.0), Vector2::new(0.03, 0.0));
//! let report = estimator.step(&load);
//! assert!(report.status.is_solved());
//! let sunk_mm = -1e3 * report.sole_pose.translation.z;
//! assert!((0.3..2.0).contains(&sunk_mm), "{sunk_mm} mm");
//! # Ok::<(), sole::SoleError>(())
//! ```
//!
//! # Not modelled
//! Large strains (doubtful past about 5 degrees of tilt, said by [`Status::DoubtfulTilt`], and a tenth of the thickness,
//! [`Status::DoubtfulCompression`]; a Neo-Hookean sole differs by 3 % in height at a compression of 0.03 and by 5-12 % in tilt up to there).
//! The equations keep a solution far beyond: foam of E = 0.02 MPa carries a walking stance of 383 N at half its thickness and 12 degrees, the
//! contact laws exact at every tick, and every tick past the limits says so (`tests/suite/hard_cases.rs`). Nor inertia and weight of the foam,
//! viscosity in the estimator, side faces unless [`ContactSet::All`].
//!
//! Times, errors, memory and what each way of solving is worth: `docs/performance.md`.
//!
//! References: G. De Magistris, S. Miossec, A. Escande, A. Kheddar, *Design of optimized soft soles for humanoid robots* and *Humanoid walking with
//! compliant soles using a deformation estimator* (2017), section 4, whose equation numbers are used; P. Alart, A. Curnier (1991);
//! C. Duriez, F. Dubois, A. Kheddar, C. Andriot (2006).
#![allow(non_snake_case)] // monogram notation
#![allow(clippy::needless_range_loop)] // indices are those of the formulas

mod cache;
mod columns;
mod elasticity;
mod equilibrium;
mod error;
mod estimate;
mod euler_order;
mod ground;
mod list;
mod model;
mod nested;
mod patches;
mod pose_driven;
mod quadratic;
mod stiffness;
mod vtk;

pub use cache::CacheError;
pub use elasticity::{ElasticBody, Material, element_stiffness, gradients};
pub use error::SoleError;
pub use estimate::{Cause, EstimatorSettings, Foothold, StanceEstimator, StanceReference, StanceReport, Status};
pub use euler_order::EulerOrder;
pub use friction::ContactState;
pub use ground::{Ground, Plane, Slope};
pub use model::{CONTACT_POINTS_MAX, Level, MeshSource, RIGID_STIFFNESS_N_PER_M, SoleModel, SoleSettings, Statistics};
pub use nested::{NestedEstimator, NestedReport, NestedSettings};
pub use pose_driven::{ContactReport, ContactStatus, FARTHEST_M, PoseDrivenContact, PoseDrivenSettings};
pub use sole_mesh::{ContactSet, ElementQuality, Mesh, MeshError, MeshQuality, MshError, MshSets};
pub use vtk::deformed_sole_vtk;

/// Cells of a block along length, width and thickness from whose mesh contact patches are condensed: 10,764 tetrahedra.
pub const CELLS_BEHIND_PATCHES: [usize; 3] = [23, 13, 6];

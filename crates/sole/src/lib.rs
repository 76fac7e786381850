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
//! is followed from the last one carried (steps of 1/32 and more whose states circle: on the pose alone as well; at a first tick, if that is
//! in vain, the ZMP first and the push after it), and where that stops is reported ([`Status::Fold`]). A solution is accepted only with a positive
//! determinant of the tangent.
//! *Which solution*. Coulomb friction may allow several. The walking soles here have one as far as found; a sole with Poisson's ratio 0.49 on
//! friction 0.65 has five at least under one and the same first load, whose sinkages differ by up to a tenth, each to all digits
//! a solution. Taken is the one that the first of these ways reaches from the last tick's pose and states (at touch-down: flat, all points
//! sticking): always the same one for the same stance. Of 1920 first ticks with Poisson's ratios to 0.499 and friction to 5
//! (`cargo run --profile bench -p sole --example hard_cases`) 24 find none, all at Poisson's
//! ratios from 0.45 on and friction from 0.65 on, 15 of them at 0.499: every way of loads that is tried ends before them. One that is not found there
//! may take seconds.
//! *How far the ZMP can go* depends on what holds the points (`tests/suite/edge.rs`; 30 mm sole, 383 N). At the first tick the references turn
//! with the sole about its foothold (35): tilting draws the loaded edge in by `L/2 (1 - cos)`, and at 0.91 of the half-length (17 degrees) the
//! ZMP folds back. Later the points stay where they stick; the sole rolls about an edge that holds its place, and there is no fold up to the
//! edge, at any friction from 0.02 to 1.5: 24 degrees at 0.99 of the half-length, the tangent regular all the way. That number is the mesh's, not
//! the foam's (44 degrees on 10,764 elements: the pressed strip is narrower than an element): linear elasticity is over long before,
//! which [`Status::DoubtfulTilt`] says from 5 degrees on (0.83 of the half-length). A stance that begins at 0.05 N, as in walking, meets no fold.
//! *Derivatives* are implicit: velocity and acceleration follow from the tangent and the references' own rates, not from differences.
//!
//! # Not modelled
//! Large strains (doubtful past about 5 degrees of tilt, said by [`Status::DoubtfulTilt`], and a tenth of the thickness,
//! [`Status::DoubtfulCompression`]; a Neo-Hookean sole differs by 3 % in height at a compression of 0.03 and by 5-12 % in tilt up to there).
//! The equations keep a solution far beyond: foam of E = 0.02 MPa carries a walking stance of 383 N at half its thickness and 12 degrees, the
//! contact laws exact at every tick, and every tick past the limits says so (`tests/suite/hard_cases.rs`). Nor inertia and weight of the foam,
//! viscosity in the estimator, side faces unless [`ContactSet::All`].
//!
//! # Measured
//! `cargo bench --profile release -p sole` (thread CPU time, shared 2-core AMD EPYC, us), walking stance of 199 ticks with horizontal forces to 0.3 of the vertical:
//!
//! | | median | p99 |
//! |---|---|---|
//! | estimator, 1512 tets, 104 contacts, 1e-6 | 58 | 275 |
//! | the same, both feet in double support | 132 | 531 |
//! | the same, one foot, nested scheme of the paper | 3200 | 5770 |
//! | estimator, 1500 tets, 66 contacts, 1e-6 | 25 | 116 |
//! | the same, nested scheme of the paper | 1150 | 1790 |
//! | estimator, 42 patches, 1e-6 | 14 | 81 |
//! | friction, cold, 1e-8, 66 contacts | 75 | 115 |
//! | friction, cold, 1e-8, 104 contacts | 193 | 285 |
//! | pose-driven, 72 patches, warm | 38 | 74 |
//!
//! The machine is shared: the first row had 56 and 331, 58 and 296 in runs beside other work.
//! The slow ticks are the first one and the last ones before lift-off, where at a load of a few newtons all 61 points slide at once.
//!
//! *Bounded work.* Loads that leap as no walk's do, and first ticks that fold, are followed step by step: 40 of 80 such ticks are solved, in
//! 40 ms median, 66 ms at most (`--profile dev`, beside much other work). Where time counts, [`StanceEstimator::bound_work`] ends a tick after a number of multiplications, without
//! allocating; the pose is then the last tick's, and the next tick tries again. The same 80 ticks, 1512 tets:
//!
//! | millions of multiplications | longest tick, ms | of them solved | of 199 ticks of walking solved |
//! |---|---|---|---|
//! | 2 | 1.8 | 2 | 116 |
//! | 4 | 1.8 | 8 | 124 |
//! | 8 (`soleus-estimator` in real time) | 2.5 | 5 | 199 |
//!
//! `python3 tools/oracles/sole.py`: displacements differ from scikit-fem's by at most 2.1e-14 of the largest on four soles.
//!
//! `cargo run --profile bench -p sole --example speed_against_error -- plot.svg` (`docs/speed_against_error.svg`), the same stance against
//! 10,764 quadratic tetrahedra, tolerance 1e-9. *Pressure* is the way by which the vertical force would have to be moved along the sole to lie
//! where the reference has it. Memory is counted by the allocator: while the compliance is condensed, and what model and estimator keep. Errors
//! and memory repeat exactly, times within a tenth, all but the build's:
//!
//! | model | contacts | median us | p99 us | ankle rms / max mm | rms deg | pressure rms mm | build s | build MB | kept MB |
//! |---|---|---|---|---|---|---|---|---|---|
//! | rigid | 4 | 3 | 9 | 0.99 / 1.6 | 0.70 | 26 | 0 | 0.1 | 0.1 |
//! | lumped | 4 | 3 | 9 | 0.21 / 0.37 | 0.19 | 7.9 | 0 | 10 | 0.1 |
//! | Winkler 10 x 5 | 66 | 25 | 156 | 0.11 / 0.18 | 0.063 | 2.6 | 0 | 10 | 1.3 |
//! | linear, 432 tets | 36 | 13 | 51 | 0.26 / 0.48 | 0.15 | 2.4 | 0 | 2.4 | 0.4 |
//! | linear, 1512 tets (the paper's size) | 104 | 65 | 318 | 0.115 / 0.22 | 0.062 | 2.0 | 0 | 10 | 3.0 |
//! | the same, tolerance 1e-3 | 104 | 51 | 263 | 0.115 / 0.22 | 0.062 | 2.0 | | | |
//! | the same, tolerance 1e-6 | 104 | 59 | 274 | 0.115 / 0.22 | 0.062 | 2.0 | | | |
//! | the same, tolerance 1e-12 | 104 | 72 | 365 | 0.115 / 0.22 | 0.062 | 2.0 | | | |
//! | the same, all free surface nodes | 180 | 92 | 395 | 0.115 / 0.22 | 0.062 | 2.0 | 0.1 | 13 | 8.5 |
//! | linear, 3456 tets | 170 | 170 | 1020 | 0.078 / 0.15 | 0.042 | 1.9 | 0.1 | 19 | 7.6 |
//! | linear, 10764 tets | 336 | 773 | 5302 | 0.046 / 0.09 | 0.024 | 1.9 | 0.4 | 76 | 29 |
//! | linear, 24192 tets | 627 | 6747 | 36043 | 0.031 / 0.060 | 0.016 | 1.9 | 2.3 | 196 | 100 |
//! | 6 x 5 patches of 10764 linear tets | 42 | 17 | 75 | 0.033 / 0.066 | 0.018 | 2.8 | 0.2 | 76 | 0.9 |
//! | 6 x 5 patches of 24192 linear tets | 42 | 17 | 67 | 0.017 / 0.043 | 0.010 | 2.8 | 0.9 | 163 | 1.4 |
//! | **quadratic, 432 tets** | 36 | 15 | 55 | **0.013 / 0.037** | 0.010 | 3.8 | 0 | 21 | 0.4 |
//! | **quadratic, 1512 tets** | 104 | 73 | 379 | **0.004 / 0.010** | 0.003 | 3.6 | 0.3 | 85 | 3.0 |
//!
//! No pressure is nearer than 1.9 mm, because the contact points of quadratic elements, the reference's too, are means that stand inside the
//! sole's edge, those of linear ones on it: below that the column says how fine the grid is, not how right.
//!
//! The finest linear mesh walks every tick on all its 627 bottom nodes, but not at 200 Hz: its worst ticks take seven periods. Nor is that
//! needed: 42 patches of the same mesh are within 0.02 mm of it, and linear elements approach the truth slowly (0.115, 0.078, 0.046, 0.031 mm: with
//! the first power of their size; `tests/suite/hard_cases.rs`).
//! So the error of the paper's mesh is the stiffness of linear elements, not the number of contacts: quadratic elements cost nothing in the tick and
//! take it away; 36 of their contacts are nine times more accurate than 104 linear ones in a quarter of the time. (The reference is of the same
//! family; the patches of ever finer *linear* meshes approach it too: 0.033, 0.017 mm.) The tolerance of the iteration, 1e-3 to
//! 1e-12, moves the ankle by less than a thousandth of a millimetre, and the side faces never touch, neither in this stance nor at 24 degrees with the ZMP at 0.99 of the half-length: the bottom face suffices
//! as contact set, with and without them the ankle is at the same place to 1e-12 m (`tests/suite/stances.rs`).
//!
//! *Single precision does not pay.* `cargo run --profile bench -p sole --example single_precision` repeats the stance's landings and lift-offs on
//! `K_c` in both precisions, forces and pose against the estimator's (worst tick above 5 N, us per tick, two runs equal to 0.4 us):
//!
//! | `K_c` | updates us | refinement us | force, relative | position um | rotation mrad |
//! |---|---|---|---|---|---|
//! | 1512 tets, cond(C) 21, tick 71: 64 bits | 10.4 | - | 2e-15 | 7e-13 | 2e-14 |
//! | 32 bits | 6.0 | - | 7e-7 | 4e-4 | 6e-6 |
//! | 32 bits, `f += K_c (u - C f)` once, residual in 64 | 6.2 | 9.8 | 5e-13 | 5e-10 | 4e-12 |
//! | 12 x 7 patches of 10764 tets, cond(C) 192, tick 75: 64 bits | 11.1 | - | 2e-12 | 9e-10 | 2e-11 |
//! | 32 bits | 6.1 | - | 6e-4 | 0.35 | 6e-3 |
//! | 32 bits, refined once | 6.2 | 8.3 | 3e-6 | 4e-4 | 4e-6 |
//!
//! So 32 bits save 4 us of a mean tick of 71, and every residual that gives the digits back costs 10: a slower tick. Without it the forces miss a
//! tolerance of 1e-6 on patches by far, and at the default one of 1e-9 the check of the contact laws would ask for a repair at every tick.
//! Nor is there more to gain elsewhere. Of the tick (`perf record` of the 1512 tets) the Newton matrix takes 20 %, updates of `K_c` 17,
//! factors and solves for sliding points 13, the laws' check 13, gaps of free points 8; what need not be exact of these, all but the check, at
//! half its time would make the tick 1.4 times as fast if it cost no further iteration. A tick of 0.05 ms in 5 needs none of that.
//!
//! References: G. De Magistris, S. Miossec, A. Escande, A. Kheddar, *Design of optimized soft soles for humanoid robots* and *Humanoid walking with
//! compliant soles using a deformation estimator* (2017), section 4, whose equation numbers are used; P. Alart, A. Curnier (1991);
//! C. Duriez, F. Dubois, A. Kheddar, C. Andriot (2006).
#![allow(non_snake_case)] // monogram notation
#![allow(clippy::needless_range_loop)] // indices are those of the formulas

mod cache;
mod elasticity;
mod equilibrium;
mod error;
mod estimate;
mod ground;
mod hull;
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
pub use estimate::{
    EstimatorSettings, EulerOrder, Foothold, NodeState, StanceEstimator, StanceReference, StanceReport, Status,
};
pub use ground::{Ground, Plane, Slope};
pub use model::{CONTACT_POINTS_MAX, Level, MeshSource, RIGID_STIFFNESS_N_PER_M, SoleModel, SoleSettings, Statistics};
pub use nested::{NestedEstimator, NestedReport, NestedSettings};
pub use pose_driven::{ContactReport, ContactStatus, FARTHEST_M, PoseDrivenContact, PoseDrivenSettings};
pub use sole_mesh::{ContactSet, ElementQuality, Mesh, MeshError, MeshQuality, MshError, MshSets};
pub use vtk::deformed_sole_vtk;

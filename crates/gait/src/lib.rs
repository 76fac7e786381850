//! Walking pattern generation: the walk as a quadratic program.
//!
//! [`GaitSettings`] say where the feet go, how long the phases last, what is minimised and what must hold; [`plan()`] returns a
//! [`pattern::WalkPattern`] with its cost and the solver's residuals; [`check()`] measures the finished pattern on a
//! fine grid and lets legs follow it.
//!
//! # The problem
//! De Magistris, Pajon, Miossec, Kheddar, *Humanoid walking with compliant soles using a deformation estimator* (Robotics and
//! Autonomous Systems, 2017), section 3 and appendices A, B; numbers in brackets are that paper's. What the pattern is made of
//! is in the crate [`pattern`].
//!
//! ```text
//! minimise    lambda INT |F|^2 dt  +  (1 - lambda) INT_SSP |Ga|^2 dt
//!             + (1 - lambda)/2 INT_DSP (|Ga_1|^2 + |Ga_2|^2) dt  +  mu INT_DSP (|P''_Z1|^2 + |P''_Z2|^2) dt          (4)
//! subject to  COM velocity continuous, zero at both ends                                                 (A.2), (A.4), (A.6)
//!             each ZMP inside the sole of its foot, shrunk by a margin, at evenly spaced instants                      (3.5)
//!             each free landing within reach of, and clear of, the foot that stands                                    (3.5)
//! ```
//!
//! | letter | meaning | unit |
//! |---|---|---|
//! | `F = M P''_COM` | horizontal force on the COM | N |
//! | `Ga = F z_a - M g (P_a - P_Z)` | ankle torque about a horizontal axis; in double support times the foot's load share | N m |
//! | `P_a, z_a` | ankle: projection, height | m |
//! | `P_Z1, P_Z2` | ZMPs of foot 1 (about to leave) and foot 2 (just landed) | m |
//! | `lambda, mu` | weights | -, N^2 s^4/m^2 |
//!
//! Unknowns, phases and scaling are in the documentation of the module `layout`, rows of every quantity over a phase's unknowns
//! in `basis`, the integrals in `cost`, the inequalities in `constraint`.
//!
//! # Decisions
//! - **Horizontal torques only.** The vertical component of (6) is quadratic in the unknowns; without it (4) stays a QP.
//! - **COM positions, not `V, W`, are unknowns.** They span the same motions; position is then continuous by construction, and
//!   no phase is too short: `V, W` of (9) reach kilometres on a phase of 0.05 s (see [`pattern::ComSolution`]).
//! - **The paper's elimination (A.7) is not used**: it makes the Hessian dense. Kept sparse, work grows linearly with the
//!   number of swings. `tests/gait/second_formulation.rs` carries it out and finds the same walks to 1e-6 m.
//! - **Two programs where nothing turns**: then polygons are boxes, and x and y know nothing of each other. A walk as a whole
//!   may have any heading: it is planned in the frame of its starting pose, so it is also the same a kilometre away.
//! - **Few rows first** ([`qp::solve_generating`]): three samples per polynomial, then those that the solution breaks.
//! - **Samples instead of sums of squares**: between the samples a ZMP may leave its polygon by the amounts below; [`check()`]
//!   says by how much it does.
//! - **Start and stop hold each foot's ZMP under its ankle**, so the margin may not exclude the ankle.
//!
//! # Figures
//! The paper's Fig. 7a, 7b and 9a, one file per lambda:
//!
//! ```text
//! for l in 0 0.5 1; do
//!   cargo run --release -p soleus-inspect -- pattern --config config/planner.toml --set cost.lambda=$l --svg lambda-$l.svg > lambda-$l.json
//! done
//! ```
//!
//! # Not modelled
//! Vertical motion, angular momentum about the COM, the swing leg's mass; the ground is the plane z = 0. The duration of phases
//! is given, not optimised.
//!
//! # Speed against error
//! `cargo bench -p gait --bench plan` (release with thin LTO; CPU time in ms as median / 99 % / maximum; AMD EPYC, two cores with
//! other work on both). 0.05 m straight ahead, mu = 15; iterations of the x and of the y program, over all rounds; "outside" is the
//! largest violation of a constraint on a 1 ms grid; costs against those of the same walk with 41 samples.
//!
//! | lambda | swings (runs) | unknowns | rows | iterations | build | solve | over 10 swings | outside | error of the cost |
//! |---|---|---|---|---|---|---|---|---|---|
//! | 0.6 | 1 (201) | 50 | 190 | 8 + 18 | 0.12 / 0.17 / 0.19 | 0.58 / 0.77 / 0.81 | 0.2 | 0.02 mm | 7.5e-6 |
//! | | 10 (201) | 312 | 960 | 8 + 23 | 0.44 / 0.58 / 0.67 | 4.07 / 4.37 / 4.50 | 1 | 0.06 mm | 6.1e-5 |
//! | | 11 (201) | 342 | 1048 | 8 + 23 | 0.45 / 0.56 / 0.58 | 4.35 / 4.59 / 4.62 | 1.1 | 0.06 mm | 6.1e-5 |
//! | | 100 (101) | 3012 | 8880 | 8 + 23 | 2.84 / 3.30 / 4.40 | 36 / 39 / 39 | 8.7 | 0.06 mm | 6.5e-5 |
//! | | 1000 (21) | 30012 | 88080 | 8 + 23 | 22.9 / 48 / 48 | 417 / 437 / 437 | 98 | 0.06 mm | 6.5e-5 |
//! | 1 | 10 (201) | 312 | 960 | 10 + 25 | 0.32 / 0.37 / 0.39 | 4.57 / 4.76 / 4.78 | 1 | 0.22 mm | 4.7e-4 |
//! | | 100 (101) | 3012 | 8880 | 14 + 25 | 1.79 / 2.00 / 2.00 | 46 / 47 / 48 | 9.7 | 0.22 mm | 2.0e-4 |
//! | | 1000 (21) | 30012 | 88080 | 15 + 25 | 18.8 / 20.2 / 20.2 | 538 / 570 / 570 | 114 | 0.22 mm | 1.7e-4 |
//!
//! The authors' public MATLAB planner is said to take about 3 s to build and 0.24 s to solve (Clarabel) 11 swings; quoted, not measured
//! here.
//!
//! A thousand swings should take at most 120 times the time of ten: 92 times the rows, the rest is a memory that no longer fits the
//! processor's caches (a tenth to a fifth, more while others use them), and at lambda = 1 iterations: the x program needs 15 instead of
//! 10, 14 of them from a hundred swings on. There nothing but the force on the COM is paid for: ahead, its best speed is a profile over the
//! whole walk instead of one step repeated: of 100 swings the ZMP drifts under the feet from 65 mm behind the ankle to 60 mm before it, so
//! from swing to swing by a millimetre, of 1000 by a tenth of that, and an interior point takes longer to tell which samples hold
//! it back. At lambda = 0.99 and below every step is like the one before, and the iterations do not grow.
//!
//! The unknowns keep the scales of the module `layout`: the solver's own scaling on top of them costs one to three iterations, and digits.
//! With its usual regularisation (1e-8 instead of 1e-10) the longest walk takes 17 iterations and ends with a residual of 7e-10 instead
//! of 6e-12, for the objective is nearly flat along a speed that varies slowly. Other scalings of the cost (0.01 to 1000 times) and longer
//! steps of the solver change the counts, not their growth.
//!
//! | samples per polynomial (N = 11, lambda = 1, 101 runs) | rows | build | solve | outside | error of the cost |
//! |---|---|---|---|---|---|
//! | 3 | 210 | 0.24 / 0.32 / 0.35 | 2.73 / 3.02 / 3.07 | 3.84 mm | 2.1e-2 |
//! | 5 | 402 | 0.27 / 0.35 / 0.36 | 3.80 / 4.21 / 4.29 | 1.10 mm | 7.7e-3 |
//! | 7 | 594 | 0.28 / 0.37 / 0.41 | 4.32 / 4.77 / 5.53 | 0.56 mm | 2.5e-3 |
//! | 11 (default) | 978 | 0.33 / 0.43 / 0.43 | 4.85 / 5.04 / 5.04 | 0.22 mm | 4.4e-4 |
//! | 15 | 1362 | 0.37 / 0.43 / 0.49 | 5.78 / 5.94 / 5.95 | 0.09 mm | 3.4e-4 |
//! | 21 | 1938 | 0.44 / 0.55 / 0.55 | 6.79 / 7.04 / 7.07 | 0.04 mm | 1.4e-4 |
//! | 41 | 3858 | 0.65 / 0.79 / 0.82 | 11.4 / 11.8 / 11.8 | 0.01 mm | (reference) |
//!
//! | tolerance (N = 11, lambda = 0.6, 101 runs) | build | solve | KKT residual | outside | error of the cost | of the COM | of the ZMP |
//! |---|---|---|---|---|---|---|---|
//! | 1e-3 | 0.30 / 0.32 / 0.41 | 2.68 / 2.83 / 2.84 | 1.0e-5 | 0.045 mm | 4.1e-5 | 2.2e-5 m | 7.0e-5 m |
//! | 1e-4 | 0.31 / 0.34 / 0.35 | 2.95 / 3.12 / 3.15 | 8.2e-7 | 0.058 mm | 1.5e-6 | 7.6e-6 m | 2.5e-5 m |
//! | 1e-6 | 0.31 / 0.36 / 0.37 | 3.54 / 3.66 / 3.67 | 2.0e-8 | 0.059 mm | 2.4e-8 | 6.8e-7 m | 2.9e-6 m |
//! | 1e-8 | 0.31 / 0.37 / 0.38 | 3.90 / 4.07 / 4.23 | 1.3e-10 | 0.059 mm | 1.7e-10 | 7.2e-9 m | 3.0e-8 m |
//! | 1e-10 (default) | 0.31 / 0.34 / 0.40 | 4.14 / 4.24 / 4.24 | 1.7e-12 | 0.059 mm | 2.2e-12 | 9.2e-11 m | 3.9e-10 m |
//! | 1e-12 | 0.31 / 0.35 / 0.36 | 4.39 / 4.50 / 4.52 | 1.8e-14 | 0.059 mm | (reference) |  |  |
//!
//! | shape (N = 11, lambda = 0.6, 101 runs) | programs | build | solve | outside | error of the cost |
//! |---|---|---|---|---|---|
//! | straight | 2 | 0.31 / 0.35 / 0.37 | 4.17 / 4.26 / 4.28 | 0.06 mm | 6.1e-5 |
//! | circle of 0.9 m | 1 | 0.40 / 0.45 / 0.46 | 9.49 / 9.72 / 9.79 | 0.06 mm | 6.0e-5 |
//! | free footholds | 2 | 0.35 / 0.50 / 0.58 | 4.02 / 4.18 / 4.22 | 0.02 mm | 1.2e-6 |
#![allow(non_snake_case)] // T, M, V, W as in the paper

mod basis;
mod check;
mod constraint;
mod cost;
mod error;
mod layout;
mod plan;
mod problem;
pub mod quadrature;
mod route;
mod settings;
mod validate;

pub use check::{CheckReport, LegClearance, LegReach, Quantity, RodLegs, TightestReach, Worst, ankle_pose, check};
pub use constraint::{RowLabel, ZmpOf};
pub use cost::CostTerms;
pub use error::GaitError;
pub use plan::{Plan, PlanReport, ProgramReport, plan};
pub use problem::PatternProblem;
pub use route::{Footstep, Route};
pub use settings::{
    BodySettings, CostSettings, DiscretisationSettings, GaitSettings, Landing, LimitSettings, SoleOutline,
    SolverSettings, StartSettings, SwingSettings, TimingSettings, Walk,
};
pub use validate::{PHASES_MAX, SAMPLES_MAX};

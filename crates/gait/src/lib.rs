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
//! | 0.6 | 1 (201) | 50 | 190 | 8 + 21 | 0.11 / 0.20 / 0.22 | 0.62 / 0.83 / 0.86 | 0.2 | 0.02 mm | 7.5e-6 |
//! | | 10 (201) | 312 | 960 | 9 + 27 | 0.39 / 0.53 / 0.68 | 4.41 / 4.73 / 4.87 | 1 | 0.06 mm | 6.1e-5 |
//! | | 11 (201) | 342 | 1048 | 9 + 27 | 0.41 / 0.52 / 0.62 | 4.72 / 5.05 / 5.09 | 1.1 | 0.06 mm | 6.1e-5 |
//! | | 100 (101) | 3012 | 8880 | 9 + 28 | 2.7 / 3.4 / 3.9 | 43 / 46 / 48 | 9.5 | 0.06 mm | 6.5e-5 |
//! | | 1000 (21) | 30012 | 88080 | 9 + 28 | 26 / 44 / 44 | 476 / 523 / 523 | 105 | 0.06 mm | 6.5e-5 |
//! | 1 | 10 (201) | 312 | 960 | 10 + 28 | 0.24 / 0.29 / 0.33 | 4.44 / 4.66 / 4.74 | 1 | 0.22 mm | 4.7e-4 |
//! | | 100 (101) | 3012 | 8880 | 15 + 28 | 1.6 / 2.3 / 2.7 | 48 / 50 / 50 | 10.5 | 0.22 mm | 2.0e-4 |
//! | | 1000 (21) | 30012 | 88080 | 18 + 28 | 22 / 29 / 29 | 568 / 602 / 602 | **126** | 0.22 mm | 1.7e-4 |
//!
//! The authors' public MATLAB planner is said to take about 3 s to build and 0.24 s to solve (Clarabel) 11 swings; quoted, not measured
//! here.
//!
//! A thousand swings should take at most 120 times the time of ten. They take 105 times as long (92 times the rows, and caches), but 126
//! times **at lambda = 1**, where the x program needs 18 iterations instead of 10. There nothing but the force on the COM is paid for:
//! ahead, its best speed is a profile over the whole walk (of 100 swings: the ZMP drifts under the feet from 65 mm behind the ankle to 60 mm
//! before it) instead of one step repeated, and every swing is coupled with all others. At lambda = 0.99 and below every step is like
//! the one before, and the iterations do not grow. Other scalings of the cost, and doing without the solver's own scaling, changed the
//! counts, not their growth.
//!
//! | samples per polynomial (N = 11, lambda = 1, 101 runs) | rows | build | solve | outside | error of the cost |
//! |---|---|---|---|---|---|
//! | 3 | 210 | 0.18 / 0.21 / 0.21 | 2.44 / 2.62 / 2.69 | 3.84 mm | 2.1e-2 |
//! | 5 | 402 | 0.20 / 0.22 / 0.24 | 3.91 / 4.01 / 4.02 | 1.10 mm | 7.7e-3 |
//! | 7 | 594 | 0.21 / 0.25 / 0.28 | 4.30 / 4.52 / 4.53 | 0.56 mm | 2.5e-3 |
//! | 11 (default) | 978 | 0.25 / 0.27 / 0.28 | 4.79 / 4.99 / 5.03 | 0.22 mm | 4.4e-4 |
//! | 15 | 1362 | 0.28 / 0.31 / 0.33 | 5.51 / 5.63 / 5.63 | 0.09 mm | 3.4e-4 |
//! | 21 | 1938 | 0.33 / 0.36 / 0.37 | 6.34 / 6.61 / 6.90 | 0.05 mm | 1.4e-4 |
//! | 41 | 3858 | 0.51 / 0.60 / 0.63 | 9.94 / 10.3 / 11.0 | 0.01 mm | (reference) |
//!
//! | tolerance (N = 11, lambda = 0.6, 101 runs) | build | solve | KKT residual | outside | error of the cost | of the COM | of the ZMP |
//! |---|---|---|---|---|---|---|---|
//! | 1e-3 | 0.26 / 0.28 / 0.29 | 3.07 / 3.17 / 3.22 | 5.0e-6 | 0.055 mm | 1.2e-5 | 1.4e-5 m | 4.7e-5 m |
//! | 1e-4 | 0.26 / 0.32 / 0.35 | 3.41 / 3.90 / 3.91 | 3.4e-7 | 0.059 mm | 5.3e-7 | 4.3e-6 m | 1.6e-5 m |
//! | 1e-6 | 0.27 / 0.31 / 0.38 | 3.78 / 4.47 / 4.62 | 5.1e-8 | 0.059 mm | 6.0e-8 | 1.3e-6 m | 5.5e-6 m |
//! | 1e-8 | 0.27 / 0.32 / 0.33 | 4.18 / 4.40 / 4.79 | 6.9e-10 | 0.059 mm | 8.4e-10 | 3.6e-8 m | 1.5e-7 m |
//! | 1e-10 (default) | 0.26 / 0.29 / 0.30 | 4.39 / 4.49 / 4.49 | 1.6e-11 | 0.059 mm | 2.0e-11 | 8.6e-10 m | 3.7e-9 m |
//! | 1e-12 | 0.27 / 0.30 / 0.31 | 4.65 / 4.85 / 5.10 | 1.7e-13 | 0.059 mm | (reference) |  |  |
//!
//! | shape (N = 11, lambda = 0.6, 101 runs) | programs | build | solve | outside | error of the cost |
//! |---|---|---|---|---|---|
//! | straight | 2 | 0.26 / 0.30 / 0.31 | 4.41 / 4.56 / 4.56 | 0.06 mm | 6.1e-5 |
//! | circle of 0.9 m | 1 | 0.33 / 0.36 / 0.65 | 10.08 / 10.66 / 11.03 | 0.06 mm | 6.0e-5 |
//! | free footholds | 2 | 0.28 / 0.33 / 0.34 | 4.36 / 4.49 / 4.54 | 0.02 mm | 1.2e-6 |
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
mod ranges;
mod route;
mod settings;

pub use check::{CheckReport, LegClearance, LegReach, Quantity, RodLegs, TightestReach, Worst, ankle_pose, check};
pub use constraint::{RowLabel, ZmpOf};
pub use cost::CostTerms;
pub use error::GaitError;
pub use plan::{Plan, PlanReport, ProgramReport, plan};
pub use problem::PatternProblem;
pub use ranges::{PHASES_MAX, SAMPLES_MAX};
pub use route::{Footstep, Route};
pub use settings::{
    BodySettings, CostSettings, DiscretisationSettings, GaitSettings, Landing, LimitSettings, SoleOutline,
    SolverSettings, StartSettings, SwingSettings, TimingSettings, Walk,
};

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
//! `cargo bench --profile dev -p gait --bench plan` (the optimised development profile; CPU time, median, AMD EPYC, other work
//! on the machine). 0.05 m straight ahead, lambda = 0.6, mu = 15; iterations of the x and of the y program, over all rounds:
//!
//! | swings | unknowns | rows | iterations | build | solve | over 10 swings |
//! |---|---|---|---|---|---|---|
//! | 1 | 50 | 190 | 8 + 21 | 0.2 ms | 0.8 ms | 0.2 |
//! | 10 | 312 | 960 | 9 + 27 | 0.5 ms | 5.2 ms | 1 |
//! | 11 | 342 | 1048 | 9 + 27 | 0.5 ms | 5.6 ms | 1.1 |
//! | 100 | 3012 | 8880 | 9 + 28 | 2.5 ms | 48 ms | 8.9 |
//! | 1000 | 30012 | 88080 | 9 + 28 | 34 ms | 562 ms | 105 |
//!
//! Eleven swings on a circle of 0.9 m, where x and y are one program: 12.8 ms; with free footholds: 5.8 ms.
//!
//! | samples per polynomial (N = 11, lambda = 1) | rows | solve | ZMP outside between samples | error of the cost |
//! |---|---|---|---|---|
//! | 3 | 210 | 3.2 ms | 3.84 mm | 2.1e-2 |
//! | 5 | 402 | 5.0 ms | 1.10 mm | 7.7e-3 |
//! | 7 | 594 | 5.6 ms | 0.56 mm | 2.5e-3 |
//! | 11 (default) | 978 | 6.3 ms | 0.22 mm | 4.4e-4 |
//! | 21 | 1938 | 8.3 ms | 0.05 mm | 1.4e-4 |
//! | 41 | 3858 | 12.3 ms | 0.01 mm | (reference) |
//!
//! | tolerance (N = 11, lambda = 0.6) | solve | KKT residual | error of the cost | of the COM | of the ZMP |
//! |---|---|---|---|---|---|
//! | 1e-4 | 4.4 ms | 3.4e-7 | 5.3e-7 | 4.3e-6 m | 1.6e-5 m |
//! | 1e-6 | 5.0 ms | 5.1e-8 | 6.0e-8 | 1.3e-6 m | 5.5e-6 m |
//! | 1e-8 | 5.5 ms | 6.9e-10 | 8.4e-10 | 3.6e-8 m | 1.5e-7 m |
//! | 1e-10 (default) | 5.8 ms | 1.6e-11 | 2.0e-11 | 8.6e-10 m | 3.7e-9 m |
//! | 1e-12 | 6.1 ms | 1.7e-13 | (reference) | | |
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

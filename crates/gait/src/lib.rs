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
//! # Example
//! The shipped walk, eleven swings of 5 cm, planned and looked at in its middle:
//!
//! ```
//! use gait::{GaitSettings, check, plan};
//!
//! let settings = GaitSettings::default();
//! let plan = plan(&settings)?;
//! let middle = plan.pattern.evaluate(0.5 * plan.pattern.duration_s());
//! assert!((middle.zmp.position.x - 0.25).abs() < 0.05, "halfway along half a metre");
//!
//! let report = check(&plan, &settings, 1e-3, None);
//! let beyond_m = report.largest_violation().map_or(0.0, |worst| worst.value);
//! assert!(beyond_m < 1e-3, "between the samples no ZMP is a millimetre outside its polygon");
//! # Ok::<(), gait::GaitError>(())
//! ```
//!
//! Times and errors: `docs/performance.md`.
#![allow(non_snake_case)] // T, M, V, W as in the paper

mod basis;
mod check;
mod constraint;
mod cost;
mod error;
mod label;
mod layout;
mod plan;
mod problem;
pub mod quadrature;
mod route;
mod settings;
mod validate;

pub use check::{CheckReport, LegClearance, LegReach, Quantity, TightestReach, Worst, ankle_pose, check};
pub use cost::CostTerms;
pub use error::{GaitError, PHASES_MAX, SAMPLES_MAX};
pub use label::{RowLabel, ZmpOf};
pub use plan::{Plan, PlanReport, ProgramReport, plan};
pub use problem::PatternProblem;
pub use route::{Footstep, Route};
pub use settings::{
    BodySettings, CostSettings, DiscretisationSettings, GaitSettings, Landing, LimitSettings, SoleOutline,
    SolverSettings, StartSettings, SwingSettings, TimingSettings, Walk,
};

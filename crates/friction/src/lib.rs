//! Contact with dry friction: Signorini's and Coulomb's laws exactly, on a dense Delassus operator.
//!
//! # Problem
//! For `n` contacts with rows (t1, t2, n) each, given `W` (3n x 3n, symmetric positive semi-definite), `q` (3n) and
//! friction coefficients `mu_a >= 0`, find forces `F` and relative displacements (or velocities) `delta` with
//!
//! ```text
//! delta = W F + q
//! 0 <= F_n  _|_  delta_n >= 0                                        (Signorini)
//! |F_t| <= mu F_n,  and where delta_t != 0:  F_t = -mu F_n delta_t/|delta_t|   (Coulomb)
//! ```
//!
//! In one line (De Saxcé): `K_a = {|F_t| <= mu F_n}` and `F_a in K_a, delta_a + mu |delta_t,a| n in K_a*`, orthogonal.
//! The law is *not* convexified or regularised: a sticking contact does not move at all, a sliding one has no
//! artificial lift-off.
//!
//! # Judge
//! One residual judges every solver: `r = F - P_K(F - rho (delta + mu |delta_t| n))`, `rho_a = 3/trace(W_aa)`. It is
//! taken twice: as a force relative to `|F|`, and as a displacement, `r/rho`, relative to `|q|`. With `rho = 1`
//! instead, as is common, metres would be added to newtons: on a soft sole a residual of 2e-8 then went with force
//! errors of 4e-5. Relative to `|F|` alone, forces that grow without end would hide any penetration.
//!
//! # Solvers
//! | | idea | use |
//! |---|---|---|
//! | [`gauss_seidel`] | contact after contact with an exact local solve; `delta` is updated by columns; shorter steps when it runs in circles | first choice |
//! | [`newton`] | semi-smooth Newton with active sets on all contacts at once | tight tolerances, stiff coupling |
//! | [`proximal`] | a sequence of problems with `W + alpha I` | `W` rank-deficient, where the others stall; also a contact's own block |
//! | [`solve`] | the first and the second in turns, then the third, from better starts by an accelerated projected gradient | when the answer matters more than the way |
//!
//! # Problems without a solution
//! Where `y >= 0` on the normals has `W y = 0` and `q . y < 0`, no forces help: `y . delta = q . y < 0`, so some
//! `delta_n < 0`. A body pinched between two fixed walls is of that kind. [`solve`] looks for such a `y` before it
//! gives up, says [`Status::Impossible`] and names the contacts ([`Obstruction`]); [`Status::IterationLimit`] only says
//! that nothing was found.
//!
//! A solution exists for every `q` and `mu` when `W` is positive definite; it is unique only for small `mu`. A sliding
//! sole of 60 mm and Poisson's ratio 0.47 has at friction 1.5 two at least, whose forces differ by a sixth: which one
//! is found depends on the start. On the 40 problems of soles in `sole`'s tests Gauss-Seidel and Newton each converge,
//! and to the same forces, from friction 0 to 1.5; [`solve`] to 10.
//!
//! # Not modelled
//! Static and sliding friction differ nowhere; rolling and drilling friction do not exist for points.
//!
//! References: Acary, Brémond, Huber, *On solving contact problems with Coulomb friction* (2018) for formulations and
//! residuals; Jourdan, Alart, Jean (1998) for Gauss-Seidel; Alart, Curnier (1991) for the Newton equations.
#![allow(non_snake_case)] // `W` is the Delassus operator in the formulas
#![allow(clippy::needless_range_loop)] // indices are those of the formulas

mod accelerated;
mod cone;
mod definite;
pub mod dense;
mod gauss_seidel;
mod newton;
mod obstruction;
mod problem;
mod proximal;
mod single_contact;
mod solve;
mod workspace;

pub use cone::{natural_map, project_on_cone};
pub use gauss_seidel::gauss_seidel;
pub use newton::newton;
pub use obstruction::Obstruction;
pub use problem::{ContactProblem, ProblemError, Residual};
pub use proximal::proximal;
pub use single_contact::{ContactState, SingleContact};
pub use solve::solve;
pub use workspace::{Report, Settings, Status, Workspace};

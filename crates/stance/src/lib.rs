//! The walk on its soles: where both feet are at any tick, from pattern, plan changes and tick alone (the paper's section 4).
//!
//! The pattern says which force each foot shall carry and at which zero-moment point. A soft sole carries exactly that force there only
//! if the ankle sinks and tilts by what the sole deforms. [`WalkOnSoles::at_tick`] gives that pose, its velocity and its acceleration.
//!
//! - **A foot under load** (planned normal force above [`EstimatorSettings::touch_down_force_n`]): one tick of
//!   [`sole::StanceEstimator`] with its history of contact, begun anew at touch-down.
//!   Its ZMP is moved by what the body adds to the plan ([`BodyZmpSettings`]); its pose follows late, as viscous foam does
//!   ([`EstimatorSettings::viscosity_time_s`]).
//! - **A foot in the air**: a quintic from the pose at take-off (with the creep of the stance) to the next foothold, flat and
//!   at rest.
//!
//! **Who certifies calls the code that runs.** The estimator asks `at_tick` at 200 Hz; the planner's certificate, [`certify`], asks it for
//! every tick before anybody walks, with the same settings.
//!
//! **The way there does not matter.** Before time zero and after the end the pattern is held and the sole's history does not advance.
//! Ticks that were left out are caught up with. After a restart the present stance is computed again from its touch-down. All ways
//! agree to the bit.
//!
//! **No answer.** When the reference asks for what the sole cannot carry, the last good pose is kept, at rest, and its age counted:
//! [`FootEstimate::age_ticks`].
//!
//! With level `rigid` the sole is taken as undeformable: the ankles follow the footholds. That is the paper's comparison
//! "without estimator".
#![allow(non_snake_case)] // monogram notation, see the style guide

mod certify;
mod foot;
mod load;
mod settings;
mod viscosity;
mod walk;

pub use certify::{Carried, Largest, NotCarried, certify};
pub use foot::{FootEstimate, Outcome};
pub use load::BodyZmpSettings;
pub use settings::{EstimatorError, EstimatorSettings, SolverSettings, StanceSettings};
pub use walk::WalkOnSoles;

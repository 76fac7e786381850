//! Turns the planned forces into ankle poses through the soles (the paper's section 4, as a process).
//!
//! At every tick the pattern says which force each foot shall carry and at which zero-moment point. The soft sole carries
//! exactly that force there only if the ankle sinks and tilts by what the sole deforms: this process computes that pose, its
//! velocity and its acceleration, and publishes them as `sole/deformation`.
//!
//! - **A foot under load** (planned normal force above [`EstimatorSettings::touch_down_force_n`]): one tick of
//!   [`sole::StanceEstimator`] with its history of contact, begun anew at touch-down.
//! - **A foot in the air**: a quintic from the pose at take-off (with the creep of the stance) to the next foothold, flat and
//!   at rest.
//!
//! The result depends on **pattern and tick alone**, not on how the process got there: before time zero and after the end the
//! pattern is held and the sole's history does not advance; ticks that were left out are caught up with, after a restart the present
//! stance is computed again from its touch-down, tick by tick, and both agree to the bit with what an uninterrupted process says.
//!
//! When the solver does not answer (the reference asks for what the sole cannot carry), the last good pose is kept, at rest,
//! and its age counted: see [`FootEstimate::age_ticks`].
//!
//! With level `rigid` the sole is taken as undeformable: the ankles follow the footholds. That is the paper's comparison
//! "without estimator".
#![allow(non_snake_case)] // monogram notation, see the style guide

mod convert;
mod estimator;
mod foot;
mod settings;
mod step;

pub use estimator::Estimator;
pub use foot::{FootEstimate, Outcome};
pub use settings::{EstimatorError, EstimatorSettings, SolverSettings};
pub use step::{EstimatorOutput, EstimatorProcess, Summary};

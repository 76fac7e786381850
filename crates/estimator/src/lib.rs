//! Says at every tick where the feet must be for the soles to carry what is planned (the paper's section 4, as a process).
//!
//! Pattern, time zero and the robot's tick come in; `sole/deformation` and `sole/contact` go out. What stands in them is computed by
//! [`stance::WalkOnSoles`], from pattern, plan changes and tick alone.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod convert;
mod step;

pub use stance::{EstimatorError, EstimatorSettings};
pub use step::{EstimatorOutput, EstimatorProcess, Summary};

//! The simulated robot: multibody, servo, sensors, soft soles and stabiliser.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod corners;
pub mod disturbance;
pub mod energy;
mod fall;
mod foot;
pub mod ground;
pub mod leg;
mod linear;
mod noise;
mod plant;
mod polygon;
pub mod sensor;
pub mod servo;
pub mod settings;
pub mod stabiliser;
pub mod step;
mod truth;

pub use corners::CornerSettings;
pub use fall::{Fall, FallReason};
pub use foot::PlantSole;
pub use plant::{Plant, PlantCommand, PlantError, PlantFrames};
pub use sensor::PlantSensors;
pub use settings::{PlantSettings, SettingsError};
pub use stabiliser::{FootPlan, Plan};
pub use truth::{FootTruth, Integration, Truth};

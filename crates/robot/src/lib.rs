//! One folder of `robots/`, read and checked.
//!
//! A robot is a folder: `robot.toml` ([`RobotDescription`]: what the URDF cannot say), the URDF that it names, `sole.toml`
//! ([`SoleDescription`]), and an `ORIGIN.md` for people that says where every figure comes from. This crate reads the text
//! and checks everything that can be checked without building a model: units are in the keys, unknown keys are refused with
//! the nearest known one suggested, every name refers to something that exists, every number is in its range.
//!
//! The sole's Gmsh file, where `sole.toml` names one, is read and checked, too; [`Robot::sole_outline`] is what planner and controller know a
//! sole by, block or mesh. A sole can be exchanged without another robot: [`Robot::load_on`].
//!
//! The URDF is handed on as text; `multibody` reads it.

mod check;
mod description;
mod error;
mod joint_map;
mod load;
mod sole;

pub use description::{Capsule, EnergyCoefficients, Feet, FootDescription, LimitFactors, RobotDescription, ServoGains};
pub use error::RobotError;
pub use joint_map::JointMap;
pub use load::{Robot, fingerprint, read_mesh};
pub use sole::{
    ContactSet, FRICTION_MAX, FootMounting, Friction, MaterialDescription, MeshDescription, SoleDescription, SoleLevel,
    SolverDescription,
};

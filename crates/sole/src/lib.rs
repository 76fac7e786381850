//! The soft sole: finite elements, exact frictional contact, and the pose of the deformed sole from the load it carries.
#![allow(non_snake_case)] // monogram notation

mod cache;
mod elasticity;
mod equilibrium;
mod error;
mod estimate;
mod ground;
mod hull;
mod mesh;
mod model;
mod msh;
mod nested;
mod patches;
mod pose_driven;
mod quadratic;
mod stiffness;
mod vtk;

pub use cache::CacheError;
pub use elasticity::{ElasticBody, Material, element_stiffness, gradients};
pub use error::SoleError;
pub use estimate::{
    EstimatorSettings, EulerOrder, Foothold, NodeState, StanceEstimator, StanceReference, StanceReport, Status,
};
pub use ground::{Ground, Plane, Slope};
pub use mesh::{ContactSet, Mesh};
pub use model::{Level, MeshSource, RIGID_STIFFNESS_N_PER_M, SoleModel, SoleSettings, Statistics};
pub use msh::{MshError, MshSets};
pub use nested::{NestedEstimator, NestedReport, NestedSettings};
pub use vtk::deformed_sole_vtk;
pub use pose_driven::{ContactReport, ContactStatus, PoseDrivenContact, PoseDrivenSettings};

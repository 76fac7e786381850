//! Tests of the public interface.
#![allow(non_snake_case)] // monogram notation
#![allow(clippy::needless_range_loop)] // indices are those of the formulas

mod derivatives;
mod edge;
mod families;
mod far;
mod files;
mod finite_elements;
mod friction_on_soles;
mod hard_cases;
mod light;
mod long_run;
mod pictures;
mod pose_driven;
mod reference_cases;
mod sequences;
mod sliver;
mod stances;
mod walking_stance;

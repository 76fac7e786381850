//! Kinematic trees from URDF and their rigid-body algorithms.

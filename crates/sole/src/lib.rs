//! Finite elements of the soft sole, its contact with the ground, and the deformation estimator.

//! One whole-body control step as a quadratic program.

//! Walking pattern generation: the walk as a quadratic program.

//! Plans the walk and publishes the pattern.

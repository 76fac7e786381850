//! Plans the walk and publishes the pattern.

fn main() {}

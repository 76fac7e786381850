//! Writes every topic to MCAP.

fn main() {}

//! Starts, supervises and stops the processes of a scenario.

fn main() {}

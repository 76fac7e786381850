//! All checks and chores.

fn main() {}

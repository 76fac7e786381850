//! JSON doors to the libraries.

fn main() {}

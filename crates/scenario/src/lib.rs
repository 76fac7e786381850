//! A scenario file: which configuration each process runs with.

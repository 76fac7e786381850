//! One folder of robots/, read and checked.

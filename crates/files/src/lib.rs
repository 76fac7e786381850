//! Files of others, read with care; files of our own, made so that they replace nothing.
//!
//! A file that somebody hands us may be a named pipe that never says anything, a device without an end, or larger
//! than the memory. [`read`] takes regular files only and no more bytes than its caller believes; [`stays_inside`]
//! says whether a name out of a file leads out of a folder. [`create_new`] makes files that only their owner can read
//! and that were not there before.

mod create;
mod read;
pub mod utc;

pub use create::{create_new, free_name, replace};
pub use read::{Refused, open, read, read_text, size_text};

use std::path::{Component, Path};

/// Largest configuration that is read (bytes); those that ship have a few kilobytes.
pub const CONFIG_MAX_BYTES: u64 = 4 << 20;
/// Largest description of a robot that is read (bytes); those of humanoids have 20 to 500 kilobytes.
pub const URDF_MAX_BYTES: u64 = 32 << 20;
/// Largest mesh that is read (bytes): some millions of elements, far more than a sole can be computed with.
pub const MESH_MAX_BYTES: u64 = 256 << 20;

/// How many folders deep a name may lead.
const DEPTH_MAX: usize = 8;

/// Whether a name that is relative to a folder stays in it: no root, no `..`, no `.`, not empty, at most eight parts.
#[must_use]
pub fn stays_inside(name: &Path) -> bool {
    let parts = name.components().count();
    let text_parts = name.as_os_str().as_encoded_bytes().split(|byte| *byte == b'/').count();
    // `components` drops what means nothing (`a//b`, `a/./b`): such names are nobody's.
    (1..=DEPTH_MAX).contains(&parts)
        && parts == text_parts
        && !name.as_os_str().as_encoded_bytes().contains(&0)
        && name.components().all(|part| matches!(part, Component::Normal(_)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_out_of_a_folder_are_seen() {
        for inside in ["a", "hrp4.urdf", "meshes/left/foot.stl", "..a", "a b"] {
            assert!(stays_inside(Path::new(inside)), "{inside}");
        }
        let deep = "a/".repeat(DEPTH_MAX) + "a";
        for outside in ["", ".", "..", "/etc/passwd", "../a", "a/../../b", "a//b", "a/./b", "./a", "a/", "a\0b", &deep]
        {
            assert!(!stays_inside(Path::new(outside)), "{outside:?}");
        }
    }
}

//! Rotations as messages carry them.

use spatial::Mat3;

/// Row by row.
#[must_use]
pub fn row_major(rotation: &Mat3) -> [f64; 9] {
    rotation.transpose().as_slice().try_into().expect("3 x 3 numbers")
}

/// The matrix whose rows these are; whether it is a rotation is not asked.
#[must_use]
pub fn from_row_major(rows: &[f64; 9]) -> Mat3 {
    Mat3::from_row_slice(rows)
}

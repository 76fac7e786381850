//! Turns the planned forces into ankle poses through the soles.

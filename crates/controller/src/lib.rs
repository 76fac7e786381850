//! Tracks pattern and ankle poses with the whole body.

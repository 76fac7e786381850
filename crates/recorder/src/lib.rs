//! Writes every topic to MCAP.

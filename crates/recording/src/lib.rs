//! Messages to and from MCAP files.

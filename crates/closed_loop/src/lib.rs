//! The steps of all processes composed in one thread.

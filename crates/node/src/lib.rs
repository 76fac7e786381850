//! The shell of a periodic process: arguments, pace, clock, health, shutdown.

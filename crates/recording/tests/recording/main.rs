//! Recordings give back what was put in, bit for bit, and survive being killed.

mod foreign;
mod recovery;
mod round_trip;
mod samples;
mod viewers;

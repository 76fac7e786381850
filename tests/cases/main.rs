//! The system as people start it.
//!
//! The cases run one after the other: a walk is five busy processes, and several at a time would only wait for each other.

mod faults;
mod feedback;
mod latency;
mod mistakes;
mod programs;
mod python;
mod replay;
mod same_numbers;
mod soles;
mod stops;
mod trust;
mod units;
mod walk;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Held while a case runs processes.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    // A case that failed does not make the others fail.
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

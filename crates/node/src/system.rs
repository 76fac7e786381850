//! The few calls to the operating system that have no safe wrapper.
#![allow(unsafe_code, reason = "system calls; each states why it is sound")]

use std::io;

/// Asks a process to stop (SIGTERM).
///
/// # Errors
/// If there is no such process or it is not ours.
pub fn terminate(process_id: u32) -> io::Result<()> {
    signal(process_id, libc::SIGTERM)
}

/// Interrupts a process, as Ctrl-C does (SIGINT).
///
/// # Errors
/// As [`terminate`].
pub fn interrupt(process_id: u32) -> io::Result<()> {
    signal(process_id, libc::SIGINT)
}

/// Lets a process go on that was stopped by a signal (SIGCONT).
///
/// # Errors
/// As [`terminate`].
pub fn resume(process_id: u32) -> io::Result<()> {
    signal(process_id, libc::SIGCONT)
}

/// Stops a process until it is resumed (SIGSTOP).
///
/// # Errors
/// As [`terminate`].
pub fn pause(process_id: u32) -> io::Result<()> {
    signal(process_id, libc::SIGSTOP)
}

/// Ends a process at once (SIGKILL).
///
/// # Errors
/// As [`terminate`].
pub fn kill(process_id: u32) -> io::Result<()> {
    signal(process_id, libc::SIGKILL)
}

fn signal(process_id: u32, signal: libc::c_int) -> io::Result<()> {
    let process_id = libc::pid_t::try_from(process_id).map_err(|_| io::ErrorKind::InvalidInput)?;
    // Zero and negative numbers would mean groups of processes.
    if process_id <= 0 {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    // SAFETY: plain numbers, no memory involved.
    check(unsafe { libc::kill(process_id, signal) })
}

/// Lets the calling process receive SIGTERM when its parent dies, however that happens. To be called between fork and exec.
///
/// # Errors
/// If the system refuses.
pub fn die_with_parent() -> io::Result<()> {
    // SAFETY: plain numbers, no memory involved; allowed between fork and exec.
    check(unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGTERM) })
}

/// Time of `CLOCK_MONOTONIC`.
pub(crate) fn clock_monotonic_ns() -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is valid for writing. The call cannot fail: the clock exists on every Linux.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut time) };
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// Sleeps until a time of `CLOCK_MONOTONIC`, or a signal.
pub(crate) fn sleep_until_ns(time_ns: u64) {
    let time = libc::timespec {
        tv_sec: (time_ns / 1_000_000_000) as libc::time_t,
        tv_nsec: (time_ns % 1_000_000_000) as libc::c_long,
    };
    // SAFETY: `time` is valid for reading, and the remaining time is not asked for.
    unsafe { libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &time, std::ptr::null_mut()) };
}

/// Locks all memory, present and future.
pub(crate) fn lock_memory() -> io::Result<()> {
    // SAFETY: plain numbers, no memory involved.
    check(unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) })
}

/// Puts the calling thread under SCHED_FIFO with a priority.
pub(crate) fn schedule_fifo(priority: i32) -> io::Result<()> {
    let parameter = libc::sched_param { sched_priority: priority };
    // SAFETY: `parameter` is valid for reading.
    check(unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &parameter) })
}

/// Scheduling policy and priority of the calling thread, as the system sees them.
pub(crate) fn scheduling() -> (libc::c_int, i32) {
    let mut parameter = libc::sched_param { sched_priority: 0 };
    // SAFETY: `parameter` is valid for writing.
    unsafe {
        libc::sched_getparam(0, &mut parameter);
        (libc::sched_getscheduler(0), parameter.sched_priority)
    }
}

fn check(result: libc::c_int) -> io::Result<()> {
    if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

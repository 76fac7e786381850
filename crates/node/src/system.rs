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
pub fn sleep_until_ns(time_ns: u64) {
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

/// Most cores that are spoken of: as many as the C library's set holds.
pub(crate) const CORES_MAX: usize = libc::CPU_SETSIZE as usize;

/// Scheduling policies that are told apart here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Policy {
    /// `SCHED_FIFO`.
    Fifo,
    /// Any other.
    Other,
}

/// Memory that is taken from the system beforehand, beside what is in use (bytes): more than any loop here still asks for.
const HEAP_RESERVE: usize = 16 << 20;

/// Keeps freed memory in the process, and some more: what is taken from the system later faults.
pub(crate) fn keep_freed_memory() {
    #[cfg(target_env = "gnu")]
    // SAFETY: plain numbers. Where it is refused memory is given back as usual, which only costs time.
    unsafe {
        libc::mallopt(libc::M_TRIM_THRESHOLD, -1);
        libc::mallopt(libc::M_MMAP_MAX, 0);
    }
}

/// Takes the reserve and gives it back to the heap, which keeps it: after [`keep_freed_memory`].
pub(crate) fn touch_heap() {
    let mut reserve = vec![1_u8; HEAP_RESERVE];
    std::hint::black_box(&mut reserve);
}

/// How much of the stack is touched beforehand: more than any step here uses (bytes).
const STACK_TOUCHED: usize = 512 << 10;

/// Touches the stack, so that it is there and stays, as memory is locked.
#[inline(never)]
pub(crate) fn touch_stack() {
    let mut stack = [0_u8; STACK_TOUCHED];
    std::hint::black_box(&mut stack);
}

/// Puts the calling thread under SCHED_FIFO with a priority.
pub(crate) fn schedule_fifo(priority: u32) -> io::Result<()> {
    let sched_priority = libc::c_int::try_from(priority).map_err(|_| io::ErrorKind::InvalidInput)?;
    let parameter = libc::sched_param { sched_priority };
    // SAFETY: `parameter` is valid for reading.
    check(unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &parameter) })
}

/// Lets the calling thread stand behind others of the ordinary policy.
pub(crate) fn be_nice(nice: i32) -> io::Result<()> {
    // SAFETY: plain numbers; the calling thread.
    check(unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, nice) })
}

/// Lets the calling thread run on one core only.
pub(crate) fn pin(core: u32) -> io::Result<()> {
    let core = core as usize;
    if core >= CORES_MAX {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    // SAFETY: a set of bits, for which zero is valid; `core` lies in it; the set is valid for reading.
    unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        libc::CPU_SET(core, &mut set);
        check(libc::sched_setaffinity(0, size_of_val(&set), &set))
    }
}

/// The cores that the calling thread may use; none if the system does not say.
pub(crate) fn allowed_cores() -> Vec<u32> {
    // SAFETY: a set of bits, for which zero is valid, and which is valid for writing; every index lies in it.
    unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        if libc::sched_getaffinity(0, size_of_val(&set), &mut set) != 0 {
            return Vec::new();
        }
        (0..CORES_MAX).filter(|core| libc::CPU_ISSET(*core, &set)).map(|core| core as u32).collect()
    }
}

/// Scheduling policy and priority of the calling thread, as the system sees them.
pub(crate) fn scheduling() -> (Policy, u32) {
    let mut parameter = libc::sched_param { sched_priority: 0 };
    // SAFETY: `parameter` is valid for writing.
    let policy = unsafe {
        libc::sched_getparam(0, &mut parameter);
        libc::sched_getscheduler(0)
    };
    // A flag may be set that only says what children get.
    let policy = if policy & !libc::SCHED_RESET_ON_FORK == libc::SCHED_FIFO { Policy::Fifo } else { Policy::Other };
    (policy, u32::try_from(parameter.sched_priority).unwrap_or(0))
}

/// Whether limits or capabilities allow a priority under SCHED_FIFO.
pub(crate) fn may_use_fifo(priority: u32) -> bool {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: `limit` is valid for writing.
    let known = unsafe { libc::getrlimit(libc::RLIMIT_RTPRIO, &mut limit) } == 0;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    (known && limit.rlim_cur >= libc::rlim_t::from(priority)) || has_sys_nice(&status)
}

/// Number of the capability CAP_SYS_NICE.
const CAP_SYS_NICE: u32 = 23;

/// Whether the effective capabilities in /proc/self/status hold CAP_SYS_NICE.
fn has_sys_nice(status: &str) -> bool {
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    let bits = effective.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok());
    bits.is_some_and(|bits| bits >> CAP_SYS_NICE & 1 == 1)
}

/// Time of the processor that the calling thread has used (ns).
pub(crate) fn thread_cpu_ns() -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is valid for writing. The call cannot fail: every thread has this clock.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// Page faults of the calling thread so far: minor, major.
pub(crate) fn page_faults() -> (u64, u64) {
    // SAFETY: plain numbers, for which zero is valid; valid for writing.
    let usage = unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        libc::getrusage(libc::RUSAGE_THREAD, &mut usage);
        usage
    };
    (usage.ru_minflt as u64, usage.ru_majflt as u64)
}

fn check(result: libc::c_int) -> io::Result<()> {
    if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn capabilities_are_read_from_what_the_system_says() {
        let status = |bits: &str| format!("Name:\tx\nCapEff:\t{bits}\nCapBnd:\t000001ffffffffff\n");
        assert!(has_sys_nice(&status("000001ffffffffff")) && has_sys_nice(&status("0000000000800000")));
        assert!(!has_sys_nice(&status("0000000000000000")) && !has_sys_nice(&status("none")) && !has_sys_nice(""));
    }

    #[test]
    fn processor_time_passes_with_work_and_faults_with_fresh_memory() {
        let (before_ns, before) = (thread_cpu_ns(), page_faults().0);
        let fresh = vec![1_u8; 8 << 20];
        assert!(std::hint::black_box(&fresh).iter().map(|byte| u64::from(*byte)).sum::<u64>() > 0);
        assert!(thread_cpu_ns() > before_ns && page_faults().0 > before);
    }
}

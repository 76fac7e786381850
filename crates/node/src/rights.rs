//! Rights: under which policy and on which core a process runs by the clock, what the system granted of it, and what to grant.

use crate::system::{self, Policy};
use lateness::{PolicyWish, RightsSettings};
use std::io;

/// How far behind the others a background process stands.
const BACKGROUND_NICE: i32 = 5;

/// What was granted, read back from the system, and what was refused with the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Rights {
    /// Priority under `SCHED_FIFO`; zero under the ordinary policy.
    pub fifo_priority: u32,
    /// The only core it may run on, if there is just one.
    pub core: Option<u32>,
    /// Whether all memory is locked.
    pub memory_locked: bool,
    /// What was asked for and refused.
    pub refused: Vec<String>,
}

impl Rights {
    /// Locks all memory, present and future, keeps what is freed, and touches stack and a reserve of the heap: before threads and ports are made, so that
    /// nothing faults afterwards.
    pub(crate) fn lock_memory(settings: &RightsSettings) -> Self {
        let mut rights = Self::default();
        if settings.policy == PolicyWish::Fifo {
            system::keep_freed_memory();
            system::touch_heap();
            match system::lock_memory() {
                Ok(()) => rights.memory_locked = true,
                Err(refusal) => rights.refused.push(memory_refused(&refusal)),
            }
            system::touch_stack();
        }
        rights
    }

    /// For a thread of a measuring tool: policy and core, and what was granted. Memory is left as it is.
    #[must_use]
    pub fn of_thread(settings: &RightsSettings) -> Self {
        let mut rights = Self::default();
        rights.enter(settings);
        rights
    }

    /// Enters policy and core for the calling thread, then reads back what there is. Threads that were started before keep theirs.
    pub(crate) fn enter(&mut self, settings: &RightsSettings) {
        if let Some(core) = settings.core
            && let Err(refusal) = system::pin(core)
        {
            self.refused.push(core_refused(core, &refusal, &system::allowed_cores()));
        }
        match settings.policy {
            PolicyWish::Ordinary => {}
            PolicyWish::Background => {
                // Nobody is refused to stand behind the others.
                let _ = system::be_nice(BACKGROUND_NICE);
            }
            PolicyWish::Fifo => {
                if let Err(refusal) = system::schedule_fifo(settings.priority) {
                    let said = system::may_use_fifo(settings.priority);
                    self.refused.push(fifo_refused(settings.priority, &refusal, said));
                }
            }
        }
        self.fifo_priority = match system::scheduling() {
            (Policy::Fifo, priority) => priority,
            _ => 0,
        };
        self.core = match system::allowed_cores()[..] {
            [core] => Some(core),
            _ => None,
        };
    }
}

impl std::fmt::Display for Rights {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.fifo_priority {
            0 => f.write_str("ordinary scheduling")?,
            priority => write!(f, "SCHED_FIFO {priority}")?,
        }
        match self.core {
            Some(core) => write!(f, ", core {core}")?,
            None => f.write_str(", any core")?,
        }
        f.write_str(if self.memory_locked { ", memory locked" } else { ", memory not locked" })
    }
}

fn memory_refused(refusal: &io::Error) -> String {
    format!(
        "memory cannot be locked ({refusal}): grant `memlock unlimited` in /etc/security/limits.d, LimitMEMLOCK=infinity in a unit, or \
         CAP_IPC_LOCK"
    )
}

fn core_refused(core: u32, refusal: &io::Error, allowed: &[u32]) -> String {
    let allowed: Vec<String> = allowed.iter().map(u32::to_string).collect();
    format!(
        "`real_time.core` = {core} is refused ({refusal}): this process may use {}; widen CPUAffinity= or its cpuset, or change the key",
        allowed.join(", ")
    )
}

/// `permitted`: whether limits and capabilities allow it. Then it is the control group that does not.
fn fifo_refused(priority: u32, refusal: &io::Error, permitted: bool) -> String {
    let remedy = if permitted {
        "limits and capabilities allow it, so its CPU control group has no real-time budget (kernel with CONFIG_RT_GROUP_SCHED): run it in \
         the root group, or set cpu.rt_runtime_us there; for a unit, no CPUQuota= and no CPU accounting"
            .to_string()
    } else {
        format!(
            "grant `rtprio {priority}` in /etc/security/limits.d, LimitRTPRIO={priority} in a unit, or CAP_SYS_NICE"
        )
    };
    format!("SCHED_FIFO {priority} is refused ({refusal}): {remedy}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_says_what_to_grant() {
        let refusal = || io::Error::from_raw_os_error(libc::EPERM);
        let of_limits = fifo_refused(65, &refusal(), false);
        assert!(of_limits.contains("`rtprio 65`") && of_limits.contains("LimitRTPRIO=65"), "{of_limits}");
        let of_group = fifo_refused(65, &refusal(), true);
        assert!(of_group.contains("CONFIG_RT_GROUP_SCHED") && !of_group.contains("rtprio"), "{of_group}");
        assert!(memory_refused(&refusal()).contains("`memlock unlimited`"));
        let of_core = core_refused(7, &io::Error::from_raw_os_error(libc::EINVAL), &[0, 1]);
        assert!(of_core.contains("`real_time.core` = 7") && of_core.contains("may use 0, 1"), "{of_core}");
    }

    /// In a thread of its own, which ends with what it was granted. What is granted depends on who runs the test; that it is told does not.
    #[test]
    fn what_is_asked_for_is_there_or_refused_and_never_only_believed() {
        let entered = std::thread::spawn(|| {
            let core = *system::allowed_cores().last().expect("it runs somewhere");
            let settings = RightsSettings { policy: PolicyWish::Fifo, priority: 3, core: Some(core) };
            let mut rights = Rights::default();
            rights.enter(&settings);
            (rights, core, system::scheduling())
        });
        let (rights, core, (policy, priority)) = entered.join().expect("it only asks");
        assert_eq!(rights.core, Some(core), "one of its own cores is granted to everybody");
        let granted = policy == Policy::Fifo && priority == 3;
        assert_eq!(rights.fifo_priority == 3, granted);
        assert_eq!(rights.refused.is_empty(), granted, "{:?}", rights.refused);
        let beyond = std::thread::spawn(|| {
            let mut rights = Rights::default();
            rights.enter(&RightsSettings { core: Some(system::CORES_MAX as u32 - 1), ..RightsSettings::default() });
            rights
        });
        let refused = beyond.join().expect("it only asks").refused;
        assert!(refused.len() == 1 && refused[0].contains("real_time.core"), "{refused:?}");
    }

    #[test]
    fn rights_are_told_in_a_line() {
        let rights = Rights { fifo_priority: 65, core: Some(1), memory_locked: true, refused: Vec::new() };
        assert_eq!(rights.to_string(), "SCHED_FIFO 65, core 1, memory locked");
        assert_eq!(Rights::default().to_string(), "ordinary scheduling, any core, memory not locked");
    }
}

//! What a process asks of the system in order to be on time.

use ranges::{OutOfRange, Range};
use serde::Deserialize;

/// Section `[real_time]` of a process's configuration; counts with `--real-time` only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RightsSettings {
    /// How it is scheduled.
    pub policy: PolicyWish,
    /// Priority under `fifo`; has no meaning under the others.
    #[serde(default)]
    pub priority: u32,
    /// The only core it runs on; without it any.
    #[serde(default)]
    pub core: Option<u32>,
}

/// How a process asks to be scheduled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PolicyWish {
    /// As every program (`SCHED_OTHER`).
    #[default]
    Ordinary,
    /// As every program, but after the others (`SCHED_OTHER`, nice 5).
    Background,
    /// Before every ordinary program, memory locked (`SCHED_FIFO`).
    Fifo,
}

/// Priorities for programs; 99 is the kernel's own, whose watchdogs must get through.
const PRIORITY: Range = Range::between(1.0, 98.0);
/// Cores that the system's calls speak of.
const CORE: Range = Range::between(0.0, 1023.0);
impl RightsSettings {
    /// `SCHED_FIFO` on one core.
    #[must_use]
    pub const fn fifo(priority: u32, core: u32) -> Self {
        Self { policy: PolicyWish::Fifo, priority, core: Some(core) }
    }

    /// Behind the others, on one core.
    #[must_use]
    pub const fn background(core: u32) -> Self {
        Self { policy: PolicyWish::Background, priority: 0, core: Some(core) }
    }

    /// Is every number one that can be?
    ///
    /// # Errors
    /// [`OutOfRange`] with the key as the file has it.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let check = || {
            if self.policy == PolicyWish::Fifo {
                PRIORITY.demand(
                    "priority",
                    self.priority.into(),
                    "between the robot's other threads: 60 to 80 is usual",
                )?;
            } else if self.priority > 98 {
                PRIORITY.demand("priority", self.priority.into(), "it counts under policy = \"fifo\" only")?;
            }
            CORE.demand("core", self.core.unwrap_or(0).into(), "`nproc` says how many there are, counted from 0")
        };
        check().map_err(|wrong| wrong.under("real_time"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(text: &str) -> Result<RightsSettings, String> {
        let settings: RightsSettings = toml::from_str(text).map_err(|error| error.to_string())?;
        settings.check().map_err(|error| error.to_string()).map(|()| settings)
    }

    #[test]
    fn what_a_person_writes_is_taken_or_refused_by_its_key() {
        let fifo = settings("policy = \"fifo\"\npriority = 65\ncore = 1").expect("usual");
        assert_eq!(fifo, RightsSettings::fifo(65, 1));
        assert_eq!(settings("policy = \"ordinary\"").expect("nothing asked"), RightsSettings::default());
        for (text, told) in [
            ("policy = \"fifo\"", "`real_time.priority` is 0"),
            ("policy = \"fifo\"\npriority = 99", "at most 98"),
            ("policy = \"ordinary\"\npriority = 400", "`real_time.priority` is 400"),
            ("policy = \"background\"\ncore = 40000", "`real_time.core` is 40000"),
            ("policy = \"deadline\"", "unknown variant `deadline`"),
            ("cores = 1", "unknown field `cores`"),
            ("policy = \"fifo\"\npriority = -1", "priority"),
            ("core = 1", "missing field `policy`"),
        ] {
            let refused = settings(text).expect_err(text);
            assert!(refused.contains(told), "{text}: {refused}");
        }
    }
}

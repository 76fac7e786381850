//! What machine this is, and how it is just now.

use std::fs::read_to_string;

/// Times of all processors so far, from /proc/stat, in its clock ticks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ProcessorTimes {
    all: u64,
    steal: u64,
}

impl ProcessorTimes {
    /// Now; zeros where the system does not say.
    pub fn now() -> Self {
        Self::read(&read_to_string("/proc/stat").unwrap_or_default())
    }

    fn read(stat: &str) -> Self {
        let line = stat.lines().next().and_then(|line| line.strip_prefix("cpu "));
        let times: Vec<u64> =
            line.unwrap_or_default().split_whitespace().filter_map(|time| time.parse().ok()).collect();
        // user, nice, system, idle, iowait, irq, softirq, steal; guests are in user already.
        Self { all: times.iter().take(8).sum(), steal: times.get(7).copied().unwrap_or(0) }
    }

    /// Share of the time since then that the host gave to others.
    pub fn steal_share_since(self, before: Self) -> f64 {
        let all = self.all.saturating_sub(before.all);
        if all == 0 { 0.0 } else { self.steal.saturating_sub(before.steal) as f64 / all as f64 }
    }
}

/// Says what a reader must know of the machine, and returns it: names and values.
pub fn tell() -> Vec<(String, String)> {
    let facts = facts();
    facts.iter().for_each(|(name, value)| eprintln!("{name:<22} {value}"));
    facts
}

fn facts() -> Vec<(String, String)> {
    let file = |path: &str| read_to_string(path).map(|text| text.trim().to_string()).unwrap_or_default();
    let cpu = file("/proc/cpuinfo");
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or_default();
    let cores = std::thread::available_parallelism().map_or(0, std::num::NonZero::get);
    let load: Vec<String> = file("/proc/loadavg").split(' ').take(3).map(str::to_string).collect();
    let pressure = file("/proc/pressure/cpu");
    let pressure = pressure.lines().next().and_then(|line| line.split(' ').nth(1)).unwrap_or("unknown");
    let command_line = file("/proc/cmdline");
    let isolation: Vec<&str> = command_line
        .split(' ')
        .filter(|word| ["isolcpus", "nohz_full", "rcu_nocbs"].iter().any(|key| word.starts_with(key)))
        .collect();
    let or = |text: String, otherwise: &str| if text.is_empty() { otherwise.to_string() } else { text };
    [
        ("processor", format!("{}, {cores} cores", model.trim_start_matches([' ', '\t', ':']))),
        ("kernel", format!("{} {}", file("/proc/sys/kernel/osrelease"), preemption(&file("/proc/sys/kernel/version")))),
        ("isolation", or(isolation.join(" "), "none")),
        ("governor", or(file("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"), "not told")),
        ("clock source", or(file("/sys/devices/system/clocksource/clocksource0/current_clocksource"), "not told")),
        ("real-time throttling", format!("{} us of a second", file("/proc/sys/kernel/sched_rt_runtime_us"))),
        ("load average", load.join(" ")),
        ("processor pressure", pressure.to_string()),
        ("version", node::VERSION.to_string()),
        (
            "build",
            if cfg!(debug_assertions) { "not a release build: times mean nothing" } else { "release" }.to_string(),
        ),
    ]
    .map(|(name, value)| (name.to_string(), value))
    .to_vec()
}

/// The kernel's way of preemption out of its version line.
fn preemption(version: &str) -> &str {
    version.split(' ').find(|word| word.starts_with("PREEMPT")).unwrap_or("no preemption told")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steal_is_a_share_of_the_time_that_passed() {
        let before = ProcessorTimes::read("cpu  100 0 50 800 0 0 0 50 7 0\ncpu0 1 2");
        let after = ProcessorTimes::read("cpu  200 0 100 1500 0 0 0 200 9 0\n");
        assert!((after.steal_share_since(before) - 0.15).abs() < 1e-12);
        assert_eq!(ProcessorTimes::read("nothing of the kind").steal_share_since(before), 0.0);
    }

    #[test]
    fn the_kernel_tells_its_preemption() {
        assert_eq!(preemption("#1 SMP PREEMPT_DYNAMIC Thu"), "PREEMPT_DYNAMIC");
        assert_eq!(preemption("#1 SMP PREEMPT_RT Debian"), "PREEMPT_RT");
    }
}

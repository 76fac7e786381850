//! One process under supervision.

use crate::Ending;
use crate::folder::RunFolder;
use bus::DomainName;
use messages::code::Process;
use node::ExitCode;
use std::fs::File;
use std::io;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// A process that was started. Dropped, it is killed if it still lives.
pub struct Supervised {
    /// Which.
    pub process: Process,
    child: Child,
    log: PathBuf,
    ended: Option<ExitStatus>,
}

/// What is passed to every process.
pub struct Start<'a> {
    /// The domain.
    pub domain: &'a DomainName,
    /// By the clock.
    pub real_time: bool,
    /// With all rights that the processes ask for, or not at all.
    pub require_real_time: bool,
    /// In lock-step, how many times as fast as real time it may be.
    pub pace: Option<f64>,
    /// Who takes part.
    pub processes: &'a [Process],
    /// How diagnostics are written.
    pub log_format: node::LogFormat,
}

impl Supervised {
    /// Starts the binary beside our own.
    pub fn start(process: Process, folder: &RunFolder, start: &Start) -> Result<Self, Ending> {
        let name = format!("soleus-{process}");
        let ours = std::env::current_exe().map_err(|error| Ending::with_causes(ExitCode::Start, error))?;
        let binary = ours.with_file_name(&name);
        let log = folder.log(process.word());
        let log_file = File::create(&log)
            .map_err(|error| Ending::new(ExitCode::Start, format!("cannot write {}: {error}", log.display())))?;
        let mut command = Command::new(&binary);
        command.arg("--config").arg(folder.config(process.word())).arg("--domain").arg(start.domain.to_string());
        if start.real_time {
            command.arg("--real-time");
        }
        if start.require_real_time {
            command.arg("--require-real-time");
        }
        if start.real_time && [Process::Controller, Process::Simulator].contains(&process) {
            // Whoever launches a scenario wants it walked.
            command.arg("--walk");
        }
        if let (Some(pace), Process::Simulator) = (start.pace, process) {
            command.arg("--pace").arg(pace.to_string());
        }
        if start.log_format == node::LogFormat::Json {
            command.args(["--log-format", "json"]);
        }
        if process == Process::Simulator {
            let others = start.processes.iter().filter(|other| **other != process);
            command.arg("--wait-for").arg(others.map(|other| other.word()).collect::<Vec<_>>().join(","));
        }
        // A group of its own: Ctrl-C reaches the launcher alone, which stops the others in order.
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log_file).process_group(0);
        // SAFETY: between fork and exec only `prctl` is called, which is allowed there; nothing is allocated.
        #[allow(unsafe_code, reason = "the only way to be told of the parent's death")]
        unsafe {
            command.pre_exec(node::die_with_parent);
        }
        let child = command.spawn().map_err(|error| {
            let hint =
                if error.kind() == io::ErrorKind::NotFound { " (build it: cargo build --release --bins)" } else { "" };
            Ending::new(ExitCode::Start, format!("cannot start {}: {error}{hint}", binary.display()))
        })?;
        Ok(Self { process, child, log, ended: None })
    }

    /// Process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// How it ended, if it has.
    pub fn ended(&mut self) -> Option<ExitStatus> {
        if self.ended.is_none() {
            // Only one's own living child can be waited for, and this is one.
            self.ended = self.child.try_wait().ok().flatten();
        }
        self.ended
    }

    /// Asks it to stop.
    pub fn ask_to_stop(&mut self) {
        if self.ended().is_none() {
            // It may end in this very moment: then there is nobody to ask.
            let _ = node::terminate(self.id());
            if self.process == Process::Recorder {
                // One that is stopped by a signal would hear it only when it goes on, and has a file to finish. The others stay as they
                // are and are killed: on a robot nothing they would still say may be obeyed.
                let _ = node::resume(self.id());
            }
        }
    }

    /// Waits for its end, and kills it when patience is over or `hurry` says so.
    pub fn wait_or_kill(&mut self, patience: Duration, hurry: &dyn Fn() -> bool) {
        let start = Instant::now();
        while self.ended().is_none() {
            if start.elapsed() > patience || hurry() {
                tracing::warn!("{} does not stop and is killed", self.process);
                let _ = self.child.kill();
                self.ended = self.child.wait().ok();
                return;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// What an unexpected end means: the launcher's exit code and the words for it, with the last thing the process said.
    pub fn explain(&self, status: ExitStatus) -> Ending {
        let (exit, how) = meaning(self.process, status);
        let said = std::fs::read_to_string(&self.log).unwrap_or_default();
        let lines: Vec<&str> = said.lines().filter(|line| !line.trim().is_empty()).collect();
        let last = lines.iter().rev().find(|line| line.contains("ERROR")).or(lines.last());
        let last = last.map(|line| format!(":\n  {line}")).unwrap_or_default();
        // What could not begin leaves no folder, so no log either.
        let log = match exit {
            ExitCode::Configuration => String::new(),
            _ => format!(" (its log is {})", self.log.display()),
        };
        Ending::new(exit, format!("the {} {how}{log}{last}", self.process))
    }
}

/// The launcher's exit code for an unexpected end, and the words for it.
fn meaning(process: Process, status: ExitStatus) -> (ExitCode, String) {
    let exit = status.code().and_then(ExitCode::from_code);
    let how = match (exit, status.code(), status.signal()) {
        (Some(ExitCode::Bug), ..) => "broke down (a bug)".to_string(),
        (_, Some(code), _) => format!("ended with code {code}"),
        (_, None, Some(signal)) => format!("was killed by signal {signal}{}", cause_of(signal)),
        (_, None, None) => "ended".to_string(),
    };
    let exit = match exit {
        Some(exit @ (ExitCode::Configuration | ExitCode::Occupied | ExitCode::Start)) => exit,
        // However it ended: what is missing is the recording.
        _ if process == Process::Recorder => ExitCode::Recording,
        // Of the launcher itself the code would say that it broke down.
        Some(ExitCode::Bug) => ExitCode::Failed,
        None | Some(ExitCode::Done | ExitCode::Interrupted) => ExitCode::SafetyStop,
        Some(exit) => exit,
    };
    (exit, how)
}

/// What a signal that the system sends by itself is about.
fn cause_of(signal: i32) -> &'static str {
    match signal {
        4 => " (SIGILL: the binaries are built for processors with AVX2 and FMA)",
        6 => " (SIGABRT: out of memory, or memory limited by `ulimit -v`)",
        7 => " (SIGBUS: /dev/shm or the disk is full, or a file in use was cut)",
        11 => " (SIGSEGV)",
        24 => " (SIGXCPU: more processor time than `ulimit -t` allows)",
        25 => " (SIGXFSZ: a file larger than `ulimit -f` allows)",
        _ => "",
    }
}

impl Drop for Supervised {
    fn drop(&mut self) {
        if self.ended().is_none() {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_end_has_a_code_and_words() {
        // As `wait` has it: the code in the second byte, the signal in the first.
        use ExitCode::{Configuration, Failed, NotSettled, Occupied, Recording, SafetyStop};
        let (controller, recorder) = (Process::Controller, Process::Recorder);
        for (process, status, exit, how) in [
            (controller, 0, SafetyStop, "ended with code 0"),
            (controller, 1 << 8, Failed, "ended with code 1"),
            (controller, 6 << 8, NotSettled, "ended with code 6"),
            (controller, 7 << 8, Occupied, "ended with code 7"),
            (controller, 77 << 8, SafetyStop, "ended with code 77"),
            (controller, 101 << 8, Failed, "broke down (a bug)"),
            (controller, 9, SafetyStop, "was killed by signal 9"),
            (
                controller,
                7,
                SafetyStop,
                "was killed by signal 7 (SIGBUS: /dev/shm or the disk is full, or a file in use was cut)",
            ),
            (recorder, 9, Recording, "was killed by signal 9"),
            (recorder, 1 << 8, Recording, "ended with code 1"),
            (recorder, 2 << 8, Configuration, "ended with code 2"),
        ] {
            assert_eq!(meaning(process, ExitStatus::from_raw(status)), (exit, how.to_string()));
        }
    }
}

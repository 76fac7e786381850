//! Builds the binaries, starts launches as a person would, and looks at how they end.

use bus::DomainName;
use messages::{Message, Topic, topic};
use recording::{Recording, recover};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Far longer than anything here takes, even on a busy machine; only a hanging launch meets it.
pub const PATIENCE: Duration = Duration::from_secs(180);

/// Root of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ is in the workspace").to_path_buf()
}

/// Folder of the binaries, built once per test run; or that in `SOLEUS_BINARIES`, to test what is installed there.
pub fn binaries() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        if let Some(folder) = std::env::var_os("SOLEUS_BINARIES") {
            return folder.into();
        }
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        // This test program lies in `deps` beside them.
        let ours = std::env::current_exe().expect("a running program has a path");
        let folder = ours.ancestors().nth(2).expect("target/PROFILE/deps/NAME").to_path_buf();
        let profile = match folder.file_name().and_then(|name| name.to_str()) {
            // The only folder that is not called as its profile.
            Some("debug") | None => "dev",
            Some(profile) => profile,
        };
        // With the tests, so that the same features are chosen as for `cargo test` and nothing is compiled twice.
        let build = ["build", "--workspace", "--bins", "--tests", "--profile", profile];
        let status = Command::new(cargo).args(build).current_dir(root()).status();
        assert!(status.expect("cargo can be started").success(), "the binaries cannot be built");
        folder
    })
}

/// A launch to be.
pub struct Launch {
    scenario: PathBuf,
    settings: Vec<String>,
    arguments: Vec<String>,
    cache: Option<PathBuf>,
    shared_memory_bytes: Option<u64>,
    domain: DomainName,
    folder: tempfile::TempDir,
}

impl Launch {
    /// Of a scenario file, in a folder and a domain of its own.
    pub fn of(scenario: impl AsRef<Path>) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Self {
            scenario: scenario.as_ref().to_path_buf(),
            settings: Vec::new(),
            arguments: Vec::new(),
            cache: None,
            shared_memory_bytes: None,
            domain: format!("system-{}-{number}", std::process::id()).parse().expect("short and lower-case"),
            folder: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    /// Of the flat walk, made short: two swings.
    pub fn short_walk() -> Self {
        Self::of(root().join("config/scenarios/flat.toml")).set("planner.gait.walk.swings=2")
    }

    /// With a key changed.
    pub fn set(mut self, setting: &str) -> Self {
        self.settings.push(setting.to_string());
        self
    }

    /// With one more argument.
    pub fn argument(mut self, argument: &str) -> Self {
        self.arguments.push(argument.to_string());
        self
    }

    /// The run's folder to be.
    pub fn folder(&self) -> PathBuf {
        self.folder.path().join("run")
    }

    /// With condensed soles kept in a folder; else none are, whatever the environment of the tests says.
    pub fn cache(mut self, folder: &Path) -> Self {
        self.cache = Some(folder.to_path_buf());
        self
    }

    /// With a `/dev/shm` of its own of so many bytes. Where [`may_mount`] says no, the launch fails.
    pub fn shared_memory(mut self, bytes: u64) -> Self {
        self.shared_memory_bytes = Some(bytes);
        self
    }

    /// Into the folder of a launch before, with what else the command line shall have.
    pub fn again(mut self, before: Finished, arguments: &[&str]) -> Self {
        self.folder = before.folder;
        self.arguments = arguments.iter().map(|argument| (*argument).to_string()).collect();
        self
    }

    /// Starts it.
    pub fn start(self) -> Running {
        let launcher = binaries().join("soleus-launch");
        let mut command = match self.shared_memory_bytes {
            None => Command::new(launcher),
            Some(bytes) => {
                // The launcher takes the place of the shell: its process id is the child's.
                let script = "mount -t tmpfs -o size=\"$0\",mode=1777 none /dev/shm && exec \"$@\"";
                let mut command = Command::new("unshare");
                command.args(["--mount", "--", "sh", "-c", script, &bytes.to_string()]).arg(launcher);
                command
            }
        };
        command.arg(&self.scenario).arg("--domain").arg(self.domain.to_string());
        command.arg("--out").arg(self.folder.path().join("run"));
        command.args(&self.arguments);
        for setting in &self.settings {
            command.arg("--set").arg(setting);
        }
        command.env("SOLEUS_CACHE", self.cache.as_deref().unwrap_or(Path::new("")));
        // What the logs hold is looked at; who runs the tests may want them otherwise.
        command.env_remove("RUST_LOG");
        let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        Running { child: child.expect("the launcher can be started"), launch: self }
    }

    /// Starts it and waits for its end.
    pub fn finish(self) -> Finished {
        self.start().finish()
    }
}

/// A launch that is under way; killed when dropped.
pub struct Running {
    child: Child,
    launch: Launch,
}

impl Running {
    /// Process id of the launcher.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// The domain.
    pub fn domain(&self) -> &DomainName {
        &self.launch.domain
    }

    /// Process ids of the launcher's children, by name: `soleus-planner`, ..
    pub fn children(&self) -> Vec<(String, u32)> {
        children_of(self.id())
    }

    /// Process id of one of them, as soon as it is there.
    pub fn wait_for_child(&self, name: &str) -> u32 {
        let mut found = None;
        eventually(name, || {
            found = self.children().into_iter().find(|(child, _)| child == name).map(|(_, id)| id);
            found.is_some()
        });
        found.expect("just found")
    }

    /// The run's folder.
    pub fn folder(&self) -> PathBuf {
        self.launch.folder()
    }

    /// The recording while it is being written.
    pub fn partial_recording(&self) -> PathBuf {
        self.launch.folder.path().join("run/walk.mcap.partial")
    }

    /// Waits until the robot has been commanded for a while, and this could be read in the recording even if all ended now.
    pub fn wait_until_walking(&mut self) {
        eventually("commands in the recording", || {
            if let Some(status) = self.child.try_wait().expect("it is ours") {
                let mut said = String::new();
                self.child.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
                panic!("the launch ended before its time: {status}\n{said}");
            }
            self.recorded_so_far(topic::ROBOT_COMMAND) > 100
        });
    }

    /// How many messages of a topic could be recovered of the recording now.
    fn recorded_so_far<T: Message>(&self, topic: Topic<T>) -> usize {
        let folder = tempfile::tempdir().expect("a temporary folder");
        if std::fs::copy(self.partial_recording(), folder.path().join("walk.mcap.partial")).is_err() {
            // Not begun yet.
            return 0;
        }
        let Some(recovered) = recover(folder.path()).expect("writable").recovered.pop() else { return 0 };
        let recording = Recording::open(&recovered.path).expect("finished");
        recording.messages(topic).expect("whole").len()
    }

    /// Waits for its end.
    pub fn finish(self) -> Finished {
        self.finish_within(PATIENCE).expect("it ends")
    }

    /// Waits for its end for a while; kills it if there is none.
    pub fn finish_within(mut self, patience: Duration) -> Option<Finished> {
        let (status, [stdout, stderr]) = match end(&mut self.child, patience) {
            Ok(ended) => ended,
            Err(said) => {
                eprintln!("the launch hangs; it said\n{}\n{}", said[0], said[1]);
                return None;
            }
        };
        // The folder outlives the launch, the child is gone.
        let launch = std::mem::replace(&mut self.launch, Launch::of(""));
        Some(Finished { status, stdout, stderr, domain: launch.domain, folder: launch.folder })
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A launch that has ended.
pub struct Finished {
    /// How.
    pub status: ExitStatus,
    /// Results.
    pub stdout: String,
    /// Diagnostics.
    pub stderr: String,
    domain: DomainName,
    folder: tempfile::TempDir,
}

impl Finished {
    /// The exit code; -1 if a signal ended it.
    pub fn code(&self) -> i32 {
        self.status.code().unwrap_or(-1)
    }

    /// The run's folder.
    pub fn folder(&self) -> PathBuf {
        self.folder.path().join("run")
    }

    /// The recording.
    pub fn recording(&self) -> PathBuf {
        self.folder().join("walk.mcap")
    }

    /// The recording if it was not finished.
    pub fn partial_recording(&self) -> PathBuf {
        self.folder().join("walk.mcap.partial")
    }

    /// Asserts that nothing is left in shared memory. Of a launcher that was killed, all processes must have ended.
    pub fn assert_nothing_left(&self) {
        let left = self.domain.leftovers();
        assert!(left.is_empty(), "left in shared memory: {left:?}\n{}", self.stderr);
    }
}

/// Whether this user may have file systems of its own: root, in most containers.
pub fn may_mount() -> bool {
    let script = "mount -t tmpfs -o size=1m none /dev/shm";
    let tried = Command::new("unshare").args(["--mount", "--", "sh", "-c", script]).stderr(Stdio::null()).status();
    tried.is_ok_and(|status| status.success())
}

/// Runs a process of a recorded walk again: exit code, results, diagnostics.
pub fn replay(recording: &Path, process: &str, more: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::new(binaries().join("soleus-replayer"));
    command.arg(recording).args(["--process", process]).args(more);
    let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let ended = end(&mut child.expect("it can be started"), PATIENCE);
    let (status, [stdout, stderr]) =
        ended.unwrap_or_else(|said| panic!("the replay hangs; it said\n{}\n{}", said[0], said[1]));
    (status.code(), stdout, stderr)
}

/// Waits for the end of a child with pipes: how it ended, and what it said on standard output and error. One that does not end is killed.
fn end(child: &mut Child, patience: Duration) -> Result<(ExitStatus, [String; 2]), [String; 2]> {
    // Read as it comes: a full pipe would stop the child.
    let hear = |mut pipe: Box<dyn Read + Send>| {
        std::thread::spawn(move || {
            let mut said = String::new();
            pipe.read_to_string(&mut said).map(|_| said)
        })
    };
    let (stdout, stderr) = (child.stdout.take().expect("piped"), child.stderr.take().expect("piped"));
    let ears = [hear(Box::new(stdout)), hear(Box::new(stderr))];
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("it is ours") {
            break Some(status);
        }
        if start.elapsed() > patience {
            let _ = child.kill();
            let _ = child.wait();
            break None;
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let said = ears.map(|ear| ear.join().expect("it only reads").expect("text"));
    match status {
        Some(status) => Ok((status, said)),
        None => Err(said),
    }
}

/// Asserts that a process of a recorded walk, run again, says the same to the bit.
pub fn assert_replays(recording: &Path, process: &str) {
    let (code, stdout, stderr) = replay(recording, process, &[]);
    assert_eq!(code, Some(0), "{process}: {stdout}\n{stderr}");
    assert!(
        !stdout.is_empty() && stdout.lines().all(|line| line.ends_with("the same to the bit")),
        "{process}: {stdout}"
    );
}

/// Process ids of a process's children, by name.
pub fn children_of(parent: u32) -> Vec<(String, u32)> {
    let is_child = |id: &u32| {
        let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
        // State and parent follow the name, which is in parentheses and may hold anything.
        let parents = stat.rsplit_once(") ").and_then(|(_, rest)| rest.split(' ').nth(1)?.parse().ok());
        parents == Some(parent)
    };
    let named = |id: u32| {
        let line = std::fs::read(format!("/proc/{id}/cmdline")).ok()?;
        let program = String::from_utf8_lossy(line.split(|byte| *byte == 0).next()?).into_owned();
        Some((Path::new(&program).file_name()?.to_string_lossy().into_owned(), id))
    };
    // Not /proc/PARENT/task/PARENT/children: it is not on every kernel, and may skip some while others end.
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let ids = processes.filter_map(|entry| entry.file_name().to_string_lossy().parse().ok());
    ids.filter(is_child).filter_map(named).collect()
}

/// Process ids of all that was started for a domain and is alive.
pub fn living_in(domain: &DomainName) -> Vec<u32> {
    let wanted = ["--domain".to_string(), domain.to_string()];
    let belongs = |id: &u32| {
        let line = std::fs::read(format!("/proc/{id}/cmdline")).unwrap_or_default();
        let words: Vec<String> =
            line.split(|byte| *byte == 0).map(|word| String::from_utf8_lossy(word).into_owned()).collect();
        words.windows(2).any(|pair| pair == wanted) && is_alive(*id)
    };
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    processes.filter_map(|entry| entry.file_name().to_string_lossy().parse().ok()).filter(belongs).collect()
}

/// Whether a process is alive (not gone, not a zombie).
pub fn is_alive(id: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    // The state follows the name, which is in parentheses.
    stat.rsplit_once(") ").is_some_and(|(_, rest)| !rest.starts_with('Z'))
}

/// Waits for a condition.
pub fn eventually(what: &str, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < PATIENCE, "in vain: {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

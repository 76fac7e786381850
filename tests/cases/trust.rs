//! Whose files are whose, and what is left of what did not come about.

use crate::alone;
use harness::{Launch, binaries, eventually, may_mount, root};
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};

fn mode(path: &Path) -> u32 {
    path.symlink_metadata().expect("it is there").permissions().mode() & 0o777
}

#[test]
fn a_run_is_its_users_alone_and_is_not_overwritten_by_chance() {
    let _alone = alone();
    let run = Launch::short_walk().set("planner.gait.walk.swings=1").finish();
    assert_eq!(run.code(), 0, "{}", run.stderr);
    assert!(run.stdout.contains("recording              complete\n"), "{}", run.stdout);
    assert!(run.stderr.contains(&format!("runtime folder {}", bus::runtime_folder().display())), "{}", run.stderr);
    for folder in ["", "config", "logs"] {
        assert_eq!(mode(&run.folder().join(folder)), 0o700, "{folder}");
    }
    for file in ["walk.mcap", "config/scenario.toml", "config/planner.toml", "logs/planner.log"] {
        assert_eq!(mode(&run.folder().join(file)), 0o600, "{file}");
    }
    let before = std::fs::read(run.recording()).expect("it is there");
    let again = |more: &[&str]| {
        let mut command = Command::new(binaries().join("soleus-launch"));
        command.arg(root().join("config/scenarios/flat.toml")).arg("--out").arg(run.folder());
        command.args(["--set", "planner.gait.walk.swings=1"]).args(more).output().expect("it can be started")
    };
    let refused = again(&[]);
    assert_eq!(refused.status.code(), Some(2), "{refused:?}");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(said.contains("there is something in it") && said.contains("--overwrite"), "{said}");
    assert_eq!(std::fs::read(run.recording()).expect("untouched"), before);
    std::fs::write(run.folder().join("notes.txt"), "mine").expect("ours");
    let over = again(&["--overwrite"]);
    assert_eq!(over.status.code(), Some(0), "{over:?}");
    assert!(std::fs::read(run.recording()).expect("a new one") != before, "it holds the domain's name, at least");
    assert_eq!(std::fs::read_to_string(run.folder().join("notes.txt")).expect("not a part of a run"), "mine");
}

#[test]
fn what_is_refused_leaves_no_folder() {
    let _alone = alone();
    let wrong = "planner.gait.cost.lambda=much";
    let run = Launch::short_walk().set(wrong).finish();
    assert_eq!(run.code(), 2, "{}", run.stderr);
    assert!(!run.folder().exists(), "{:?}", run.folder().read_dir().map(Iterator::count));
    run.assert_nothing_left();
    // One that was there stays, empty as it was.
    let launch = Launch::short_walk().set(wrong);
    std::fs::create_dir(launch.folder()).expect("writable");
    let run = launch.finish();
    assert_eq!(run.folder().read_dir().expect("it stays").count(), 0);
}

#[test]
fn nobody_listening_is_no_reason_to_break_down() {
    let _alone = alone();
    let controller = root().join("config/controller.toml");
    for (name, line) in [
        (
            "soleus-launch",
            format!("{} --set planner.gait.walk.swings=1", root().join("config/scenarios/flat.toml").display()),
        ),
        ("soleus-launch", "domain --domain nobody".to_string()),
        (
            "soleus-controller",
            format!("--config {} --check --set robot={}", controller.display(), root().join("robots/hrp4").display()),
        ),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        // Both pipes are closed before anything is written.
        let script = format!("{{ {} {line}; echo $? > code; }} 2>&1 | exec true", binaries().join(name).display());
        let status =
            Command::new("bash").args(["-c", &script]).current_dir(folder.path()).stdout(Stdio::null()).status();
        assert!(status.expect("bash is there").success());
        let code = || std::fs::read_to_string(folder.path().join("code")).unwrap_or_default();
        eventually("it ends", || code().ends_with('\n'));
        assert_eq!(code(), "0\n", "{name} {line}");
    }
}

#[test]
fn a_killed_serve_leaves_nothing_that_stays() {
    let _alone = alone();
    let domain = format!("serve-{}", std::process::id());
    let serve = || {
        let mut command = Command::new(binaries().join("soleus-launch"));
        command.args(["serve", "--domain", &domain]).stderr(Stdio::null()).spawn().expect("it can be started")
    };
    let name: bus::DomainName = domain.parse().expect("a name");
    let is_served = || name.living().iter().any(|(process, _)| process.is_none());
    let mut first = serve();
    eventually("it is served", is_served);
    let second = Command::new(binaries().join("soleus-launch")).args(["serve", "--domain", &domain]).output();
    let second = second.expect("it can be started");
    let said = String::from_utf8_lossy(&second.stderr);
    assert_eq!(second.status.code(), Some(7), "{said}");
    assert!(said.contains(&format!("in use by process {}", first.id())), "{said}");
    first.kill().expect("ours");
    first.wait().expect("ours");
    let mut heir = serve();
    eventually("it is served again", is_served);
    node::terminate(heir.id()).expect("it lives");
    assert!(heir.wait().expect("ours").success());
    assert_eq!(name.leftovers(), [] as [std::path::PathBuf; 0]);
}

#[test]
fn little_memory_is_told_in_words() {
    let _alone = alone();
    let scenario = root().join("config/scenarios/flat.toml");
    // From less than the launcher needs to nearly enough (kilobytes).
    for limit in [60_000, 150_000, 300_000, 600_000] {
        let folder = tempfile::tempdir().expect("a folder");
        let launch = binaries().join("soleus-launch");
        let script = format!(
            "ulimit -v {limit}; exec {} {} --set planner.gait.walk.swings=1 --out run",
            launch.display(),
            scenario.display()
        );
        let output =
            Command::new("bash").args(["-c", &script]).current_dir(folder.path()).output().expect("bash is there");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!said.contains("panicked"), "{limit}: {said}");
        assert!(output.status.success() || !said.trim().is_empty(), "{limit}: {output:?}");
    }
}

#[test]
fn shared_memory_that_fills_up_ends_no_walk() {
    let _alone = alone();
    if !may_mount() {
        eprintln!("SKIPPED: only who may mount can have a small /dev/shm");
        return;
    }
    // Too little for a domain: refused before anything is made.
    let refused = Launch::short_walk().shared_memory(1 << 20).finish();
    assert_eq!(refused.code(), 3, "{}", refused.stderr);
    assert!(refused.stderr.contains("shared memory is nearly full"), "{}", refused.stderr);
    // Enough, until somebody else takes all that is left, to the last byte.
    let mut running = Launch::short_walk().set("recorder.flush_period_s=0.05").shared_memory(256 << 20).start();
    running.wait_until_walking();
    let filler = format!("/proc/{}/root/dev/shm/of-somebody-else", running.id());
    let mut file = std::fs::File::create(filler).expect("root may enter");
    let filled = loop {
        if let Err(error) = file.write_all(&[1; 4096]) {
            break error;
        }
    };
    assert_eq!(filled.kind(), std::io::ErrorKind::StorageFull, "{filled}");
    let run = running.finish();
    assert_eq!(run.code(), 0, "{}", run.stderr);
    assert!(run.stdout.contains("recording              complete\n"), "{}", run.stdout);
}

#[test]
fn an_older_processor_gets_a_sentence() {
    let run = |processor: &str| {
        let controller = binaries().join("soleus-controller");
        Command::new("qemu-x86_64").args(["-cpu", processor]).arg(controller).arg("--version").output()
    };
    let Ok(old) = run("Nehalem") else {
        eprintln!("SKIPPED: no qemu-x86_64 (Debian: qemu-user) to be an older processor");
        return;
    };
    let said = String::from_utf8_lossy(&old.stderr);
    assert_eq!(old.status.code(), Some(node::ExitCode::Start.code().into()), "{old:?}");
    assert!(said.contains("AVX2") && said.contains("target-cpu"), "{said}");
    let new = run("max").expect("it can be started");
    assert!(new.status.success(), "{new:?}");
}

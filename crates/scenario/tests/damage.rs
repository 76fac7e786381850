//! Damaged configurations: errors, never panics, within bounded memory and time.
//!
//! `DAMAGED_FILES=20000 cargo test -p scenario --test damage -- --nocapture` is the long form.

use scenario::{Config, Scenario};
use std::path::{Path, PathBuf};

fn config(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config").join(name)
}

#[test]
fn damaged_scenarios_are_errors() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir_all(folder.path().join("scenarios")).expect("writable");
    for process in scenario::PROCESSES {
        let file = format!("{process}.toml");
        std::fs::copy(config(&file), folder.path().join(&file)).expect("it ships");
    }
    let path = folder.path().join("scenarios/x.toml");
    let whole = std::fs::read(config("scenarios/feedback.toml")).expect("it ships");
    let setting = "planner.gait.cost.lambda=0.8".parse().expect("a setting");
    mutation::campaign("scenario", 300, &whole, &["[planner]", "config", "on = false", "robot", "gait"], |bytes| {
        std::fs::write(&path, bytes).expect("writable");
        let _ = Scenario::load(&path, std::slice::from_ref(&setting));
    });
}

#[test]
fn damaged_configurations_are_errors() {
    let path = config("controller.toml");
    let whole = std::fs::read(&path).expect("it ships");
    mutation::campaign("controller.toml", 300, &whole, &["[tasks.com]", "weight", "[[", "]]", "{", "'''"], |bytes| {
        let text = String::from_utf8_lossy(bytes).into_owned();
        if let Ok(config) = Config::from_text(&path, text) {
            let _ = config.effective_text();
            let _ = config.parse::<toml::Table>();
        }
    });
}

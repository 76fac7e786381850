//! Figures of recordings, and the assets of the page.

mod support;

use report::{Verdict, figures};
use std::path::Path;
use std::process::Command;
use support::{DISTANCE_M, Kind, ZMP_ERROR_M, recorded};

#[test]
fn figures_of_a_recording_are_those_of_its_messages() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let figures = figures(&recorded(folder.path(), &Kind::default())).expect("readable");
    assert_eq!(figures.verdict, Verdict::Walked, "{}", figures.verdict_reason);
    assert!((figures.distance_m.expect("truth") - DISTANCE_M).abs() < 1e-9);
    assert!((figures.planned_distance_m.expect("pattern") - DISTANCE_M).abs() < 1e-9);
    assert!((figures.com_error_max_m.expect("truth") - 0.001).abs() < 1e-9);
    assert!((figures.zmp_error_max_m.expect("truth") - ZMP_ERROR_M).abs() < 1e-9);
    assert!((figures.zmp_error_max_time_s.expect("truth") - 2.0).abs() < 1e-9);
    // From time zero to the tick before the finished plan is reached.
    assert_eq!((figures.ticks_compared, figures.ticks_without_plan), (1203, 0));
    assert!((figures.times_real_time.expect("simulator") - 5.0).abs() < 1e-9);
    assert_eq!(figures.sole_estimates.solved, 2 * 1600);
}

#[test]
fn verdicts_of_recordings_tell_falls_early_ends_and_missing_truth() {
    let verdict = |kind: Kind| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        figures(&recorded(folder.path(), &kind)).expect("readable").verdict
    };
    assert_eq!(verdict(Kind { falls: true, ..Kind::default() }), Verdict::Fell);
    assert_eq!(verdict(Kind { ends_early: true, ..Kind::default() }), Verdict::EndedEarly);
    assert_eq!(verdict(Kind { has_truth: false, ..Kind::default() }), Verdict::Unjudged);
    assert_eq!(verdict(Kind { zmp_error_m: 0.2, ..Kind::default() }), Verdict::OffPlan);
}

#[test]
fn vendored_libraries_are_those_of_the_lock_file() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let check = Command::new("sha256sum").args(["--check", "--strict", "SHA256SUMS"]).current_dir(&assets).output();
    match check {
        Ok(check) => assert!(check.status.success(), "{}", String::from_utf8_lossy(&check.stdout)),
        Err(error) => eprintln!("SKIPPED: sha256sum is not here ({error})"),
    }
    let lock = std::fs::read_to_string(assets.join("package-lock.json")).expect("it ships");
    for line in std::fs::read_to_string(assets.join("LICENSES")).expect("it ships").lines() {
        if let Some((name, rest)) = line.split_once(' ').filter(|(name, _)| ["uplot", "three"].contains(name)) {
            let version = rest.split(' ').next().expect("a version");
            let locked = format!("\"node_modules/{name}\": {{\n      \"version\": \"{version}\"");
            assert!(lock.contains(&locked), "{name} {version} is not the locked one");
        }
    }
}

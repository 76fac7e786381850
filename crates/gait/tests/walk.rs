//! The default walk, through the public API.
use gait::{GaitSettings, plan};

#[test]
fn the_default_walk_is_the_papers_slow_one() {
    let plan = plan(&GaitSettings::default()).expect("the default is feasible");
    let pattern = &plan.pattern;
    pattern.check().expect("a plan is well formed");
    assert_eq!(pattern.phases.len(), 34, "m = 3 n + 4 with n = 10");
    assert!((pattern.duration_s() - 14.42).abs() < 1e-12);
    let (_, last) = plan.landings[10];
    assert!((last.x_m - 0.5).abs() < 1e-15);
}

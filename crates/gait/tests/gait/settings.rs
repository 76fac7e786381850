//! Configurations: what is shipped, what is refused.

use crate::support::straight;
use gait::{GaitError, GaitSettings, Walk};

fn parse(text: &str) -> Result<GaitSettings, toml::de::Error> {
    toml::from_str(text)
}

#[test]
fn the_shipped_file_spells_out_the_defaults() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../config/planner.toml");
    let text = std::fs::read_to_string(path).expect("shipped");
    let table: toml::Table = text.parse().expect("TOML");
    let settings: GaitSettings = table["gait"].clone().try_into().expect("a gait");
    assert_eq!(settings, GaitSettings::default());
    let written = toml::Table::try_from(&settings).expect("serialisable");
    let shipped = table["gait"].as_table().expect("a table");
    assert_eq!(without_empty(&written), *shipped, "every key is shown in the file");
}

/// The robot's figures are not shown: what is left of a table of theirs is empty.
fn without_empty(table: &toml::Table) -> toml::Table {
    let empty = |value: &toml::Value| value.as_table().is_some_and(toml::Table::is_empty);
    table.iter().filter(|(_, value)| !empty(value)).map(|(key, value)| (key.clone(), value.clone())).collect()
}

#[test]
fn unknown_keys_and_wrong_types_are_refused() {
    for text in ["[cost]\nlamda = 0.5", "[cost]\nlambda = \"half\"", "[walk]\nkind = \"jump\"", "[speed]\nx = 1"] {
        let error = parse(text).expect_err(text).to_string();
        assert!(error.contains("line"), "{error}");
    }
}

/// `[table]` and key, the values on both sides of the range.
const RANGES: [(&str, &str, &[&str]); 24] = [
    ("cost", "lambda", &["-0.1", "1.1"]),
    ("cost", "mu", &["-1.0", "1e7", "1e300"]),
    ("body", "mass_kg", &["0.0", "-1.0", "1e308", "1e-300"]),
    ("body", "gravity_m_per_s2", &["0.0", "1e-300", "1e300"]),
    ("body", "com_height_m", &["0.0", "1e-300", "1e300"]),
    ("body", "ankle_height_m", &["-0.1", "0.791", "1e300"]),
    ("sole", "length_m", &["-1.0", "1e-300", "1e300"]),
    ("sole", "width_m", &["0.0", "1e300"]),
    ("start", "x_m", &["1e5", "-1e300"]),
    ("start", "y_m", &["-1e5", "1e300"]),
    ("start", "yaw_rad", &["1001.0", "1e300"]),
    ("start", "ankle_distance_m", &["0.0", "1e300"]),
    ("timing", "start_s", &["0.04", "61.0", "1e300"]),
    ("timing", "single_support_s", &["0.01", "1e300"]),
    ("timing", "double_support_s", &["0.01", "1e300"]),
    ("timing", "stop_s", &["0.01", "1e300"]),
    ("limits", "zmp_margin_m", &["-0.01", "1e300"]),
    ("limits", "feet_gap_min_m", &["-1e300", "1e300"]),
    ("limits", "step_length_max_m", &["0.0", "1e300"]),
    ("limits", "step_width_max_m", &["0.0", "1e300"]),
    ("swing", "apex_m", &["-0.1", "1e300"]),
    ("solver", "tolerance", &["0.1", "0.0"]),
    // Whole numbers.
    ("discretisation", "quadrature_nodes", &["3", "65"]),
    ("solver", "iterations_max", &["0", "4294967295"]),
];

fn refused_for(text: &str, field: &str) {
    let error = gait::plan(&parse(text).expect(text)).expect_err(text);
    let GaitError::Setting(refused) = error else { panic!("{text}: {error}") };
    assert_eq!(refused.key, field, "{text}");
    assert!(!refused.remedy.is_empty());
}

#[test]
fn numbers_out_of_range_are_refused_by_name() {
    for (table, key, values) in RANGES {
        let whole = values[0].parse::<i64>().is_ok();
        let never: &[&str] = if whole { &[] } else { &["nan", "-nan", "inf", "-inf"] };
        for value in values.iter().chain(never) {
            refused_for(&format!("[{table}]\n{key} = {value}"), &format!("{table}.{key}"));
        }
    }
    for (text, field) in [
        ("[sole]\nleft_ankle_in_sole_m = [0.2, 0.0]", "sole.left_ankle_in_sole_m[0]"),
        ("[sole]\nleft_ankle_in_sole_m = [0.0, nan]", "sole.left_ankle_in_sole_m[1]"),
        ("[timing]\nsingle_support_each_s = [0.0]", "timing.single_support_each_s[0]"),
        ("[timing]\ndouble_support_each_s = [100.0]", "timing.double_support_each_s[0]"),
        ("[discretisation]\nsamples_per_polynomial = 2", "discretisation.samples_per_polynomial"),
        ("[discretisation]\nsamples_per_polynomial = 4000000000", "discretisation.samples_per_polynomial"),
        ("[discretisation]\nsingle_support_polynomials = 0", "discretisation.single_support_polynomials"),
        ("[discretisation]\nsingle_support_polynomials = 4000000000", "discretisation.single_support_polynomials"),
        ("[walk]\nkind = \"path\"\nlandings = []", "walk.swings"),
        ("[walk]\nkind = \"path\"\nlandings = [{foot = \"left\", x_m = 1e300, y_m = 0.1}]", "walk.landings[0].x_m"),
        ("[walk]\nkind = \"path\"\nlandings = [{foot = \"left\", x_m = 0.0, y_m = nan}]", "walk.landings[0].y_m"),
    ] {
        refused_for(text, field);
    }
}

#[test]
fn a_refusal_shows_the_number_as_a_person_would_write_it() {
    for (text, shown) in [("1e308", "is 1e308,"), ("1e-300", "is 1e-300,"), ("0.0", "is 0,"), ("nan", "is NaN,")] {
        let error = gait::plan(&parse(&format!("[body]\nmass_kg = {text}")).expect(text)).expect_err(text).to_string();
        assert!(error.contains(shown), "{error}");
    }
}

#[test]
fn walks_out_of_range_are_refused_by_name() {
    for (kind, numbers, field) in [
        ("straight", "swings = 0, step_length_m = 0.1", "walk.swings"),
        ("straight", "swings = 3, step_length_m = 1e300", "walk.step_length_m"),
        ("sideways", "swings = 3, step_width_m = nan", "walk.step_width_m"),
        ("circle", "swings = 3, step_length_m = inf, radius_m = 1.0", "walk.step_length_m"),
        ("circle", "swings = 3, step_length_m = 0.1, radius_m = 0.0", "walk.radius_m"),
        ("circle", "swings = 3, step_length_m = 0.1, radius_m = 1e-300", "walk.radius_m"),
        ("circle", "swings = 3, step_length_m = 0.1, radius_m = -1e300", "walk.radius_m"),
        ("in_place", "swings = 3, turn_per_swing_rad = 1e300", "walk.turn_per_swing_rad"),
        ("free", "swings = 3, distance_m = -1e300", "walk.distance_m"),
        ("free", "swings = 1, distance_m = 0.5", "walk.swings"),
    ] {
        refused_for(&format!("walk = {{kind = \"{kind}\", {numbers}}}"), field);
    }
    let error = gait::plan(&free(1, 0.5)).expect_err("the distance would be ignored");
    assert!(error.to_string().contains("at least 2"), "{error}");
    for (swings, distance_m) in [(1, 0.0), (2, 0.1)] {
        let plan = gait::plan(&free(swings, distance_m)).expect("feasible");
        let end = plan.pattern.evaluate(plan.pattern.duration_s());
        assert!((end.com.position.x - distance_m).abs() < 1e-12, "{swings}");
    }

    fn free(swings: u32, distance_m: f64) -> GaitSettings {
        GaitSettings { walk: Walk::Free { swings, distance_m }, ..GaitSettings::default() }
    }
}

#[test]
fn walks_that_are_too_large_are_refused_before_anything_is_built() {
    for swings in [3400, 100_000, u32::MAX] {
        let error = gait::plan(&straight(swings)).expect_err("too many");
        let GaitError::TooLarge { phases, samples: 11 } = error else { panic!("{error}") };
        assert_eq!(phases, 3 * swings as usize + 1);
    }
    let mut settings = straight(1000);
    settings.discretisation.samples_per_polynomial = 1000;
    assert!(matches!(gait::plan(&settings), Err(GaitError::TooLarge { phases: 3001, samples: 1000 })));
    settings.discretisation = gait::DiscretisationSettings { single_support_polynomials: 20, ..Default::default() };
    assert!(matches!(gait::plan(&settings), Err(GaitError::TooLarge { phases: 20_965, samples: 11 })));
    let mut settings = straight(1000);
    settings.timing.single_support_s = 60.0;
    settings.timing.double_support_s = 60.0;
    let error = gait::plan(&settings).expect_err("33 hours");
    assert!(error.to_string().contains("more than a day"), "{error}");
}

#[test]
fn the_number_of_phases_is_known_beforehand() {
    for swings in [1, 2, 3, 4, 11] {
        for polynomials in [1, 2, 5] {
            let mut settings = straight(swings);
            settings.discretisation.single_support_polynomials = polynomials;
            let built = gait::PatternProblem::build(&settings).expect("in range");
            assert_eq!(built.phases(), settings.phases(), "{swings} {polynomials}");
        }
    }
}

#[test]
fn the_corners_of_the_ranges_end_in_a_sound_walk_or_in_an_error() {
    let mut planned = 0;
    for mass_kg in [0.1, 1e4] {
        for gravity_m_per_s2 in [0.1, 100.0] {
            for (com_height_m, ankle_height_m) in [(0.1, 0.0), (0.1, 0.1), (10.0, 0.0), (10.0, 10.0)] {
                for phase_s in [0.05, 60.0] {
                    for (lambda, mu) in [(0.0, 0.0), (0.0, 1e6), (1.0, 0.0), (1.0, 1e6)] {
                        let mut settings = straight(2);
                        let (mass_kg, ankle_height_m) = (Some(mass_kg), Some(ankle_height_m));
                        settings.body = gait::BodySettings { mass_kg, gravity_m_per_s2, com_height_m, ankle_height_m };
                        settings.timing.single_support_s = phase_s;
                        settings.timing.double_support_s = phase_s;
                        settings.cost = gait::CostSettings { lambda, mu };
                        match gait::plan(&settings) {
                            Ok(plan) => {
                                assert_eq!(plan.pattern.check(), Ok(()), "{settings:?}");
                                planned += 1;
                            }
                            Err(GaitError::Infeasible { .. } | GaitError::NotSolved { .. }) => {}
                            Err(error) => panic!("{error}: {settings:?}"),
                        }
                    }
                }
            }
        }
    }
    assert!(planned > 32, "{planned} of 128");
}

#[test]
fn lists_of_durations_are_complete_or_absent() {
    let mut settings = GaitSettings::default();
    for found in [1, 9, 11] {
        settings.timing.double_support_each_s = vec![0.4; found];
        let error = gait::plan(&settings).expect_err("neither all nor none");
        let said = format!("`timing.double_support_each_s` is a list of {found} numbers, must be one of 10");
        assert!(error.to_string().starts_with(&said), "{error}");
    }
}

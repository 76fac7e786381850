//! Configurations: what is shipped, what is refused.

use gait::{GaitError, GaitSettings};

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
    assert_eq!(&written, shipped, "every key is shown in the file");
}

#[test]
fn unknown_keys_and_wrong_types_are_refused() {
    for text in ["[cost]\nlamda = 0.5", "[cost]\nlambda = \"half\"", "[walk]\nkind = \"jump\"", "[speed]\nx = 1"] {
        let error = parse(text).expect_err(text).to_string();
        assert!(error.contains("line"), "{error}");
    }
}

#[test]
fn numbers_out_of_range_are_refused_by_name() {
    for (text, field) in [
        ("[cost]\nlambda = 1.1", "cost.lambda"),
        ("[cost]\nmu = -1.0", "cost.mu"),
        ("[cost]\nmu = nan", "cost.mu"),
        ("[body]\nmass_kg = 0.0", "body.mass_kg"),
        ("[body]\ncom_height_m = inf", "body.com_height_m"),
        ("[body]\nankle_height_m = -0.1", "body.ankle_height_m"),
        ("[sole]\nlength_m = -1.0", "sole.length_m"),
        ("[sole]\nleft_ankle_in_sole_m = [0.2, 0.0]", "sole.left_ankle_in_sole_m[0]"),
        ("[start]\nx_m = inf", "start.x_m"),
        ("[timing]\nsingle_support_s = 0.01", "timing.single_support_s"),
        ("[timing]\ndouble_support_each_s = [100.0]", "timing.double_support_each_s"),
        ("[limits]\nzmp_margin_m = -0.01", "limits.zmp_margin_m"),
        ("[limits]\nstep_length_max_m = 0.0", "limits.step_length_max_m"),
        ("[swing]\napex_m = -0.1", "swing.apex_m"),
        ("[discretisation]\nsamples_per_polynomial = 2", "discretisation.samples_per_polynomial"),
        ("[discretisation]\nquadrature_nodes = 3", "discretisation.quadrature_nodes"),
        ("[discretisation]\nsingle_support_polynomials = 0", "discretisation.single_support_polynomials"),
        ("[solver]\ntolerance = 0.1", "solver.tolerance"),
        ("[solver]\niterations_max = 0", "solver.iterations_max"),
        ("[walk]\nkind = \"straight\"\nswings = 0\nstep_length_m = 0.1", "walk.swings"),
        ("[walk]\nkind = \"circle\"\nswings = 3\nstep_length_m = 0.1\nradius_m = 0.0", "walk.radius_m"),
        ("[walk]\nkind = \"path\"\nlandings = []", "walk.swings"),
    ] {
        let error = gait::plan(&parse(text).expect(text)).expect_err(text);
        let GaitError::Setting { field: found, remedy, .. } = error else { panic!("{text}: {error}") };
        assert_eq!(found, field);
        assert!(!remedy.is_empty());
    }
}

#[test]
fn lists_of_durations_are_complete_or_absent() {
    let mut settings = GaitSettings::default();
    settings.timing.double_support_each_s = vec![0.4; 11];
    let error = gait::plan(&settings).expect_err("one too many");
    assert_eq!(error, GaitError::Durations { field: "timing.double_support_each_s", found: 11, expected: 10 });
}

//! Layers, and every way in which a configuration can be wrong.

use scenario::{Config, ConfigError, Problem, Scenario, Setting};
use serde::Deserialize;
use std::path::Path;

#[derive(Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Planner {
    robot: Option<String>,
    sole_file: Option<String>,
    mesh_file: Option<String>,
    gait: Gait,
    footsteps: Vec<Footstep>,
}

#[derive(Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Gait {
    lambda: f64,
    step_duration_s: f64,
    level: Level,
}

#[derive(Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Footstep {
    x_m: f64,
}

#[derive(Debug, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Level {
    Rigid,
    Fem,
}

const PLANNER: &str = r#"
mesh_file = "sole.msh"
footsteps = [ { x_m = 0.1 }, { x_m = 0.2 } ]

[gait]
lambda = 0.6
step_duration_s = 1
level = "fem"
"#;

fn parse(text: &str, settings: &[&str]) -> Result<Planner, ConfigError> {
    let settings: Vec<Setting> = settings.iter().map(|text| text.parse().expect("a setting")).collect();
    Config::from_text(Path::new("/here/planner.toml"), text.to_string())?.with_settings(&settings).parse()
}

fn message(text: &str, settings: &[&str]) -> String {
    parse(text, settings).expect_err("it is wrong").to_string()
}

#[test]
fn later_layers_replace_single_keys_and_paths_become_absolute() {
    let planner = parse(PLANNER, &["gait.lambda=0.8", "gait.level=rigid"]).expect("correct");
    assert_eq!(planner.gait, Gait { lambda: 0.8, step_duration_s: 1.0, level: Level::Rigid });
    assert_eq!(planner.mesh_file.as_deref(), Some("/here/sole.msh"));
    assert_eq!(planner.footsteps, [Footstep { x_m: 0.1 }, Footstep { x_m: 0.2 }]);
}

#[test]
fn robot_file_and_folder_are_paths_wherever_they_stand_and_nothing_else_is() {
    let text = r#"
robot = "../robots/hrp4"
title = "../x"
a_file = "./a/../b"
b_file = "/there/b"
c_file = ""
[table]
d_folder = "d"
folder_name = "e"
robot = 3
"#;
    let config = Config::from_text(Path::new("/here/config/x.toml"), text.to_string()).expect("correct");
    let setting = "table.e_file=/elsewhere/../e".parse().expect("a setting");
    let config = config.with_settings(&[setting]);
    let (top, table) = (config.table(), config.table()["table"].as_table().expect("a table"));
    for (value, expected) in [
        (&top["robot"], "/here/robots/hrp4"),
        (&top["title"], "../x"),
        (&top["a_file"], "/here/config/b"),
        (&top["b_file"], "/there/b"),
        (&top["c_file"], ""),
        (&table["d_folder"], "/here/config/d"),
        (&table["folder_name"], "e"),
        (&table["e_file"], "/e"),
    ] {
        assert_eq!(value.as_str(), Some(expected));
    }
    // Of the command line: against the working directory.
    let config = config.with_settings(&["a_file=b".parse().expect("a setting")]);
    let here = std::env::current_dir().expect("tests have one").join("b");
    assert_eq!(config.table()["a_file"].as_str(), here.to_str());
}

#[test]
fn an_unknown_key_names_file_line_and_the_nearest_known_one() {
    assert_eq!(
        message(&PLANNER.replace("lambda", "lamda"), &[]),
        "/here/planner.toml:6: `gait.lamda`: unknown; did you mean `lambda`?"
    );
    assert_eq!(
        message(PLANNER, &["gait.lamda=1"]),
        "command line (--set): `gait.lamda`: unknown; did you mean `lambda`?"
    );
    assert_eq!(
        message(PLANNER, &["gait.zzz=1"]),
        "command line (--set): `gait.zzz`: unknown; known here: lambda, step_duration_s, level"
    );
    // Half of its letters are other ones: nobody meant that.
    assert_eq!(
        message(PLANNER, &["gait.gamma=1"]),
        "command line (--set): `gait.gamma`: unknown; known here: lambda, step_duration_s, level"
    );
    assert_eq!(
        message(&PLANNER.replace("{ x_m = 0.2 }", "{ xm = 0.2 }"), &[]),
        "/here/planner.toml:3: `footsteps.1.xm`: unknown; did you mean `x_m`?"
    );
}

#[test]
fn an_unknown_choice_names_the_nearest_known_one() {
    assert_eq!(
        message(&PLANNER.replace("\"fem\"", "\"fam\""), &[]),
        "/here/planner.toml:8: `gait.level`: unknown; did you mean `fem`?"
    );
}

#[test]
fn a_wrong_type_names_what_was_found_and_expected() {
    assert_eq!(
        message(&PLANNER.replace("0.6", "\"much\""), &[]),
        "/here/planner.toml:6: `gait.lambda`: invalid type: string \"much\", expected f64"
    );
    assert!(message(PLANNER, &["gait=3"]).starts_with("command line (--set): `gait`: invalid type: integer `3`"));
}

#[test]
fn a_missing_key_is_named_with_its_file() {
    assert_eq!(
        message(&PLANNER.replace("lambda = 0.6", ""), &[]),
        "/here/planner.toml:5: `gait.lambda`: missing; the configuration that ships documents it, copy it from there"
    );
}

#[test]
fn a_missing_key_is_named_in_full_even_if_it_is_called_as_its_table() {
    #[derive(Debug, Deserialize)]
    struct Outer {
        #[expect(dead_code, reason = "never read")]
        level: Inner,
    }
    #[derive(Debug, Deserialize)]
    struct Inner {
        #[expect(dead_code, reason = "never read")]
        level: f64,
    }
    let config = Config::from_text(Path::new("/x.toml"), "[level]".to_string()).expect("TOML");
    let message = config.parse::<Outer>().expect_err("incomplete").to_string();
    assert!(message.starts_with("/x.toml:1: `level.level`: missing"), "{message}");
}

#[test]
fn broken_toml_names_the_line() {
    let message = message(&PLANNER.replace("= 0.6", "= = 0.6"), &[]);
    assert!(message.starts_with("/here/planner.toml:6: not valid TOML: "), "{message}");
}

#[test]
fn settings_are_toml_values_or_else_texts() {
    let value = |text: &str| text.parse::<Setting>().expect("a setting").value;
    assert_eq!(value("a=1"), toml::Value::Integer(1));
    assert_eq!(value("a.b=[1.5]"), toml::Value::Array(vec![toml::Value::Float(1.5)]));
    assert_eq!(value("a=true"), toml::Value::Boolean(true));
    assert_eq!(value("a=../x/y"), toml::Value::String("../x/y".to_string()));
    assert!("a".parse::<Setting>().is_err());
    assert!("=1".parse::<Setting>().is_err());
    assert!("a..b=1".parse::<Setting>().is_err());
}

#[test]
fn the_example_of_a_setting_is_a_key_that_ships() {
    let said = "nothing".parse::<Setting>().expect_err("no setting").to_string();
    let example: Setting = said.rsplit(' ').next().expect("it ends with the example").parse().expect("a setting");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/flat.toml");
    let shipped = |settings: &[Setting]| {
        let scenario = Scenario::load(&path, settings).expect("it ships");
        scenario.config("planner").expect("on").table().clone()
    };
    let find = |table: &toml::Table| {
        let first = toml::Value::Table(table.clone());
        example.key[1..].iter().try_fold(first, |value, part| value.get(part).cloned())
    };
    assert_eq!(example.key[0], "planner");
    let before = find(&shipped(&[])).expect("the key is in the configuration that ships");
    let after = find(&shipped(std::slice::from_ref(&example))).expect("still");
    assert!(before != after && after == example.value, "{before} becomes {after}");
}

struct Files(tempfile::TempDir);

impl Files {
    fn new(scenario: &str) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::create_dir_all(folder.path().join("robots/hrp4")).expect("writable");
        std::fs::write(folder.path().join("planner.toml"), PLANNER).expect("writable");
        std::fs::create_dir(folder.path().join("scenarios")).expect("writable");
        std::fs::write(folder.path().join("scenarios/flat.toml"), scenario).expect("writable");
        Self(folder)
    }

    fn load(&self, settings: &[&str]) -> Result<Scenario, ConfigError> {
        let settings: Vec<Setting> = settings.iter().map(|text| text.parse().expect("a setting")).collect();
        Scenario::load(&self.0.path().join("scenarios/flat.toml"), &settings)
    }

    fn message(&self, settings: &[&str]) -> String {
        let message = self.load(settings).expect_err("it is wrong").to_string();
        message.replace(&self.0.path().display().to_string(), "")
    }
}

const FLAT: &str = r#"robot = "../robots/hrp4"
title = "On flat ground."
[planner]
config = "../planner.toml"
gait.lambda = 0.7
"#;

#[test]
fn a_scenario_changes_the_files_it_names_and_the_command_line_changes_both() {
    let files = Files::new(FLAT);
    let lambda = |settings: &[&str]| {
        let scenario = files.load(settings).expect("correct");
        scenario.config("planner").expect("on").parse::<Planner>().expect("correct").gait.lambda
    };
    assert_eq!(lambda(&[]), 0.7);
    assert_eq!(lambda(&["planner.gait.lambda=0.9"]), 0.9);
    let scenario = files.load(&[]).expect("correct");
    assert_eq!((scenario.name.as_str(), scenario.title.as_str()), ("flat", "On flat ground."));
    let planner: Planner = scenario.config("planner").expect("on").parse().expect("correct");
    let root = files.0.path().canonicalize().expect("it is there");
    assert_eq!(planner.robot.expect("given to every process"), root.join("robots/hrp4").display().to_string());
    assert_eq!(planner.mesh_file.expect("in the file"), files.0.path().join("sole.msh").display().to_string());
}

#[test]
fn a_table_in_braces_replaces_the_whole_table_and_any_other_changes_single_keys() {
    let gait = |scenario: &str, settings: &[&str]| {
        let files = Files::new(scenario);
        let scenario = files.load(settings).expect("correct");
        scenario.config("planner").expect("on").table()["gait"].to_string()
    };
    let whole = "{ level = \"rigid\" }";
    let in_braces = FLAT.replace("gait.lambda = 0.7", &format!("gait = {whole}"));
    assert_eq!(gait(&in_braces, &[]), whole);
    assert_eq!(gait(FLAT, &[&format!("planner.gait={whole}")]), whole);
    // Their keys are merged again by what comes later.
    assert_eq!(gait(&in_braces, &["planner.gait.lambda=1"]), "{ lambda = 1, level = \"rigid\" }");
    let merged = "{ lambda = 0.7, level = \"rigid\", step_duration_s = 1 }";
    assert_eq!(gait(&format!("{FLAT}gait.level = \"rigid\"\n"), &[]), merged);
    assert_eq!(gait(&FLAT.replace("gait.", "[planner.gait]\nlevel = \"rigid\"\n"), &[]), merged);
    assert_eq!(gait(FLAT, &["planner.gait.level=rigid"]), merged);
    // What is missing then is missing where the table is.
    let files = Files::new(FLAT);
    let scenario = files.load(&["planner.gait={lambda=1}"]).expect("not yet parsed");
    let error = scenario.config("planner").expect("on").parse::<Planner>().expect_err("incomplete").to_string();
    assert!(error.starts_with("command line (--set): `gait.step_duration_s`: missing"), "{error}");
}

#[test]
fn another_sole_is_given_to_every_process_and_the_command_line_chooses_last() {
    let sole_of = |scenario: &Scenario| {
        let planner: Planner = scenario.config("planner").expect("on").parse().expect("correct");
        assert_eq!(planner.sole_file, scenario.sole_file.as_ref().map(|path| path.display().to_string()));
        planner.sole_file
    };
    let files = Files::new(FLAT);
    assert_eq!(sole_of(&files.load(&[]).expect("correct")), None);
    let files = Files::new(&format!("sole_file = \"../robots/thick.toml\"\n{FLAT}"));
    let root = files.0.path().canonicalize().expect("it is there");
    for name in ["thick", "thin"] {
        std::fs::write(root.join(format!("robots/{name}.toml")), "").expect("writable");
    }
    let named = |name: &str| Some(root.join(format!("robots/{name}.toml")).display().to_string());
    assert_eq!(sole_of(&files.load(&[]).expect("correct")), named("thick"));
    let chosen = format!("sole_file={}", root.join("robots/thin.toml").display());
    assert_eq!(sole_of(&files.load(&[&chosen]).expect("correct")), named("thin"));
    let before = format!("sole_file={}", root.join("robots/thick.toml").display());
    assert_eq!(sole_of(&files.load(&[&before, &chosen]).expect("correct")), named("thin"), "the last word counts");
    let missing = Files::new(&format!("sole_file = \"../robots/thick.toml\"\n{FLAT}")).message(&[]);
    assert_eq!(
        missing,
        "cannot read /scenarios/../robots/thick.toml (named in /scenarios/flat.toml:1): check the path"
    );
    let message = files.message(&["sole_file=/nowhere/thin.toml"]);
    assert_eq!(message, "cannot read /nowhere/thin.toml (named in command line (--set)): check the path");
    let message = files.message(&["sole_file=3"]);
    assert!(
        message.starts_with("command line (--set): `sole_file`") && message.contains("a sole's description"),
        "{message}"
    );
}

#[test]
fn what_is_stored_reads_back_as_the_same_configuration() {
    let scenario = Files::new(FLAT).load(&["planner.gait.level=rigid"]).expect("correct");
    let config = scenario.config("planner").expect("on");
    let again = Config::from_text(Path::new("/run/planner.toml"), config.effective_text()).expect("correct");
    assert_eq!(again.table(), config.table());
}

#[test]
fn processes_can_be_switched_off() {
    let files = Files::new(FLAT);
    assert!(files.load(&[]).expect("correct").has("planner"));
    let without = files.load(&["planner.on=false"]).expect("correct");
    assert!(!without.has("planner"));
    assert!(matches!(without.config("planner"), Err(ConfigError::Key { problem: Problem::Missing, .. })));
    assert_eq!(without.processes().count(), 0);
}

#[test]
fn mistakes_in_the_scenario_are_found_where_they_are() {
    assert_eq!(
        Files::new("[plannr]").message(&[]),
        "/scenarios/flat.toml:1: `plannr`: unknown; did you mean `planner`?"
    );
    assert_eq!(
        Files::new(FLAT).message(&["planer.x=1"]),
        "command line (--set): `planer.x`: unknown; did you mean `planner`?"
    );
    assert_eq!(
        Files::new(FLAT).message(&["planner=3"]),
        "command line (--set): `planner`: a process, not a key: name one of its keys, as in planner.gait.cost.lambda=0.8"
    );
    let no_file = Files::new(&FLAT.replace("planner.toml", "plan.toml")).message(&[]);
    assert_eq!(no_file, "cannot read /scenarios/../plan.toml (named in /scenarios/flat.toml:4): check the path");
    let no_robot = Files::new(&FLAT.replace("hrp4", "hrp5")).message(&[]);
    assert!(
        no_robot.starts_with("cannot read /scenarios/../robots/hrp5 (named in /scenarios/flat.toml:1)"),
        "{no_robot}"
    );
    let in_scenario =
        Files::new(&FLAT.replace("gait.lambda = 0.7", "gait.lamda = 0.7")).load(&[]).expect("not yet parsed");
    let error = in_scenario.config("planner").expect("on").parse::<Planner>().expect_err("unknown key").to_string();
    assert!(error.ends_with("/scenarios/flat.toml:5: `gait.lamda`: unknown; did you mean `lambda`?"), "{error}");
    assert!(
        Files::new(&FLAT.replace("config = \"../planner.toml\"", ""))
            .message(&[])
            .contains("`planner.config`: missing")
    );
}

const ESTIMATOR: &str = "touch_down_n = 0.05\n[solver]\ntolerance = 1e-9\n";

/// A planner that certifies with what the estimator is told.
fn with_estimator(scenario: &str, planner: &str) -> Files {
    let files = Files::new(scenario);
    std::fs::write(files.0.path().join("planner.toml"), format!("{PLANNER}{planner}")).expect("writable");
    std::fs::write(files.0.path().join("estimator.toml"), ESTIMATOR).expect("writable");
    files
}

const KNOWS: &str = "[estimator]\nconfig = \"estimator.toml\"\nsolver.tolerance = 1e-8\n";

#[test]
fn a_process_is_told_what_another_one_is_told() {
    let files = with_estimator(FLAT, KNOWS);
    let alone = Config::read(&files.0.path().join("planner.toml")).expect("correct");
    assert_eq!(alone.table()["estimator"]["touch_down_n"].as_float(), Some(0.05));
    assert_eq!(
        alone.table()["estimator"]["solver"]["tolerance"].as_float(),
        Some(1e-8),
        "changed by the planner's file"
    );
    let scenario = format!("{FLAT}[estimator]\nconfig = \"../estimator.toml\"\ntouch_down_n = 0.1\n");
    let files = with_estimator(&scenario, KNOWS);
    let scenario = files.load(&["estimator.solver.tolerance=1e-7"]).expect("correct");
    let [planner, estimator] = ["planner", "estimator"].map(|name| scenario.config(name).expect("on").table());
    assert_eq!(planner["estimator"].as_table(), Some(estimator));
    assert_eq!(estimator["solver"]["tolerance"].as_float(), Some(1e-7));
}

#[test]
fn a_key_of_another_process_is_refused_where_it_has_no_effect() {
    let scenario = format!("{FLAT}[estimator]\nconfig = \"../estimator.toml\"\n");
    let refused = with_estimator(&scenario, KNOWS).message(&["planner.estimator.touch_down_n=0.1"]);
    assert!(refused.starts_with("command line (--set): `planner.estimator.touch_down_n`"), "{refused}");
    assert!(refused.contains("`estimator.KEY`"), "{refused}");
    let inside = scenario.replace("gait.lambda = 0.7", "estimator.touch_down_n = 0.1");
    let refused = with_estimator(&inside, KNOWS).message(&[]);
    assert!(refused.starts_with("/scenarios/flat.toml:5: `planner.estimator`"), "{refused}");
    // Wrong values are told with the file that holds them.
    let files = with_estimator(FLAT, &KNOWS.replace("estimator.toml", "nowhere.toml"));
    let refused = files.message(&[]);
    assert!(refused.contains("nowhere.toml (named in ") && refused.contains("planner.toml:10)"), "{refused}");
}

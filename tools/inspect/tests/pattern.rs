//! `soleus-inspect pattern` as somebody outside uses it: a configuration in, fields and exit code out.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn inspect(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_soleus-inspect"));
    command.arg("pattern").args(arguments).output().expect("the binary runs")
}

/// The answer, if everything was solved.
fn solved(arguments: &[&str]) -> Value {
    let output = inspect(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON on stdout")
}

fn list<'a>(value: &'a Value, place: &str) -> &'a Vec<Value> {
    value.pointer(place).and_then(Value::as_array).unwrap_or_else(|| panic!("no list {place}"))
}

fn number(value: &Value, place: &str) -> f64 {
    value.pointer(place).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number {place}"))
}

fn write(folder: &tempfile::TempDir, name: &str, text: &[u8]) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, text).expect("writable");
    path
}

#[test]
fn the_example_is_a_complete_configuration_and_means_the_defaults() {
    let example = inspect(&["--example"]);
    assert_eq!(example.status.code(), Some(0));
    let table: toml::Table = String::from_utf8(example.stdout.clone()).expect("UTF-8").parse().expect("TOML");
    for name in ["body", "sole", "start", "walk", "timing", "cost", "limits", "swing", "discretisation", "solver"] {
        assert!(table[name].is_table(), "{name}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let file = write(&folder, "gait.toml", &example.stdout);
    let from_file = solved(&["--config", file.to_str().expect("UTF-8")]);
    assert_eq!(from_file["pattern"], solved(&[])["pattern"]);
}

#[test]
fn the_processes_own_configuration_is_read_too() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/planner.toml");
    let answer = solved(&["--config", path.to_str().expect("UTF-8"), "--rate-hz", "10"]);
    assert_eq!(answer["pattern"], solved(&[])["pattern"], "it ships with the defaults");
}

#[test]
fn an_answer_has_phases_samples_cost_checks_sizes_and_times() {
    let answer = solved(&[]);
    assert_eq!(answer["status"], "solved");
    assert!(answer["message"].is_null());
    assert!((number(&answer, "/duration_s") - 14.42).abs() < 1e-12);
    assert!((number(&answer, "/omega_per_s").powi(2) - 9.81 / 0.79).abs() < 1e-12);
    assert_eq!(list(&answer, "/pattern/phases").len(), 34);
    let landings = list(&answer, "/landings");
    assert_eq!(landings.len(), 11);
    assert_eq!(landings[0]["foot"], "right");
    assert!((number(&landings[10], "/ankle/x_m") - 0.5).abs() < 1e-12);

    // 200 Hz from 0 to 14.42 s.
    let samples = list(&answer, "/samples");
    assert_eq!(samples.len(), 2885);
    let end = &samples[2884];
    assert!((number(end, "/com/position/0") - 0.5).abs() < 1e-9 && number(end, "/com/velocity/0").abs() < 1e-9);
    for foot in ["/feet/0", "/feet/1"] {
        assert!((number(end, &format!("{foot}/load_share")) - 0.5).abs() < 1e-12);
        assert_eq!(end.pointer(&format!("{foot}/in_contact")), Some(&Value::Bool(true)));
        assert!((number(end, &format!("{foot}/force/2")) - 0.5 * 39.0 * 9.81).abs() < 1e-9);
        assert_eq!(list(end, &format!("{foot}/ankle/rotation")).len(), 3);
        assert!((number(end, &format!("{foot}/ankle/position/2")) - 0.103).abs() < 1e-12);
    }

    let weights =
        [("com_force", 0.6), ("ankle_torque_single", 0.4), ("ankle_torque_double", 0.4), ("zmp_acceleration", 15.0)];
    let mut sum = 0.0;
    for (term, weight) in weights {
        let (raw, weighted) =
            (number(&answer, &format!("/cost/raw/{term}")), number(&answer, &format!("/cost/weighted/{term}")));
        assert!(raw > 0.0 && (weighted - weight * raw).abs() <= 1e-12 * weighted, "{term}");
        sum += weighted;
    }
    assert!((sum - number(&answer, "/cost/objective")).abs() <= 1e-12 * sum);

    let largest = &answer["largest_violation"];
    assert!(number(largest, "/value").abs() < 1e-3 && number(largest, "/time_s") <= 14.42, "{largest}");
    assert!(largest["quantity"].is_string() && largest["phase"].is_u64() && largest["step"].is_u64(), "{largest}");
    let quantities: Vec<_> = list(&answer, "/check").iter().filter_map(|found| found["quantity"].as_str()).collect();
    for quantity in [
        "zmp_outside_polygon_m",
        "step_too_long_m",
        "step_too_wide_m",
        "feet_too_close_m",
        "com_equation_m_per_s2",
        "load_balance_m",
        "zmp_jump_m",
        "zmp_velocity_jump_m_per_s",
        "zmp_acceleration_jump_m_per_s2",
        "foot_zmp_jump_m",
        "foot_zmp_velocity_jump_m_per_s",
        "foot_zmp_acceleration_jump_m_per_s2",
        "com_jump_m",
        "com_velocity_jump_m_per_s",
        "speed_at_ends_m_per_s",
        "friction_demand",
        "negative_zmp_margin_m",
    ] {
        assert!(quantities.contains(&quantity), "{quantity} in {quantities:?}");
    }

    assert_eq!(number(&answer, "/sizes/phases"), 34.0);
    let programs = list(&answer, "/sizes/programs");
    assert_eq!(programs.len(), 2, "x and y");
    for program in programs {
        assert_eq!(program["status"], "Solved");
        for residual in ["/kkt_stationarity", "/kkt_feasibility", "/kkt_complementarity"] {
            assert!(number(program, residual) <= 1e-8, "{residual}");
        }
        for size in
            ["/variables", "/equalities", "/inequalities", "/hessian_entries", "/constraint_entries", "/iterations"]
        {
            assert!(number(program, size) > 0.0, "{size}");
        }
    }
    for stage in ["/times_us/build", "/times_us/solve", "/times_us/check"] {
        assert!(number(&answer, stage) > 0.0, "{stage}");
    }
}

/// Somebody who evaluates the polynomials by the book gets the samples.
#[test]
fn samples_are_what_the_polynomials_say() {
    let answer = solved(&["--set", "walk.swings=3", "--rate-hz", "50"]);
    let phases = list(&answer, "/pattern/phases");
    for sample in list(&answer, "/samples") {
        let phase = &phases[number(sample, "/phase") as usize];
        let t = number(sample, "/t_s") - number(phase, "/start_s");
        for axis in 0..2 {
            let at = |place: &str| {
                let coefficients = list(phase, &format!("{place}/{axis}"));
                coefficients.iter().rev().fold(0.0, |sum, a| sum * t + a.as_f64().expect("a number"))
            };
            let zmp = number(sample, &format!("/zmp/position/{axis}"));
            assert!((at("/zmp") - zmp).abs() < 1e-12, "{sample}");
            // The cart-table's force: both feet together.
            let force: f64 = (0..2).map(|foot| number(sample, &format!("/feet/{foot}/force/{axis}"))).sum();
            let com = number(sample, &format!("/com/position/{axis}"));
            assert!((force - 39.0 * 9.81 / 0.79 * (com - zmp)).abs() < 1e-9, "{sample}");
        }
    }
}

#[test]
fn single_keys_are_set_on_top_and_the_rate_is_the_samples() {
    let usual = solved(&["--rate-hz", "10"]);
    let heavier = solved(&["--rate-hz", "20", "--set", "cost.lambda=1.0", "--set", "start={x_m=2.0}"]);
    let named = solved(&["--rate-hz", "20", "--set", "gait.cost.lambda=1.0", "--set", "gait.start={x_m=2.0}"]);
    assert_eq!(named["pattern"], heavier["pattern"]);
    assert_eq!((list(&usual, "/samples").len(), list(&heavier, "/samples").len()), (146, 290));
    assert_eq!(number(&heavier, "/cost/weighted/ankle_torque_single"), 0.0);
    assert!((number(&heavier, "/samples/0/com/position/0") - 2.0).abs() < 1e-12);
}

#[test]
fn a_picture_shows_paths_and_feet() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("walk.svg");
    solved(&["--svg", file.to_str().expect("UTF-8"), "--rate-hz", "1"]);
    let svg = std::fs::read_to_string(file).expect("written");
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    for word in ["ZMP", "COM", "left ankle", "right ankle", "sole less margin", "polyline"] {
        assert!(svg.contains(word), "{word}");
    }
    assert!(svg.lines().all(|line| line.parse() != Ok(0.0) || !line.starts_with('-')), "zero has no sign");
}

#[test]
fn what_cannot_be_walked_is_an_answer_with_exit_code_1() {
    for (arguments, status, words) in [
        (["--set", "walk.step_length_m=0.4"], "infeasible", "step 1"),
        (["--set", "walk={kind=\"free\",swings=6,distance_m=1.6}"], "infeasible", "length of step"),
        (["--set", "timing={start_s=0.05,single_support_s=5.0}"], "infeasible", "SingleSupport"),
        (["--set", "solver.iterations_max=2"], "not_solved", "2 iterations"),
    ] {
        let output = inspect(&arguments);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        let answer: Value = serde_json::from_slice(&output.stdout).expect("JSON on stdout");
        assert_eq!(answer["status"], status, "{arguments:?}");
        assert!(answer["message"].as_str().is_some_and(|message| message.contains(words)), "{answer}");
        assert!(answer.get("pattern").is_none(), "{answer}");
    }
}

#[test]
fn what_cannot_be_understood_is_an_error_with_exit_code_2_that_names_it() {
    let refused = |arguments: &[&str], words: &str| {
        let output = inspect(arguments);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {errors}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert!(errors.contains(words), "{arguments:?}: {errors} does not say {words}");
    };
    for (assignment, words) in [
        (
            "cost.lamda=0.5",
            "--set cost.lamda=0.5 is no gait configuration (--example prints one): unknown field `lamda`",
        ),
        ("cost.lambda=\"half\"", "half"),
        ("cost.lambda=1.1", "`cost.lambda` is 1.1"),
        ("cost.lambda", "expected KEY=VALUE"),
        ("cost.lambda=0,5", "is no TOML value"),
        ("cost.lambda.x=1", "lambda is not a table"),
        ("walk.kind=\"jump\"", "jump"),
        ("walk.swings=-1", "-1"),
        ("walk.swings=0", "`walk.swings` is 0"),
        ("walk.swings=4294967295", "12884901886 polynomials"),
        ("walk={kind=\"free\",swings=1,distance_m=0.5}", "at least 2"),
        ("body.mass_kg=1e308", "`body.mass_kg` is 1e308"),
        ("body.gravity_m_per_s2=1e-300", "`body.gravity_m_per_s2` is 1e-300"),
        ("body.gravity_m_per_s2=1e300", "`body.gravity_m_per_s2` is 1e300"),
        ("discretisation.samples_per_polynomial=4000000000", "samples_per_polynomial"),
        ("discretisation.single_support_polynomials=4000000000", "single_support_polynomials"),
        ("timing.double_support_each_s=[0.4]", "double_support_each_s` is a list of 1 numbers"),
        ("limits.zmp_margin_m=0.065", "leave no support polygon"),
        ("limits.zmp_margin_m=0.06", "the ankle's distance from the edge of the sole"),
    ] {
        refused(&["--set", assignment], words);
    }
    // A file may be mended by what is set; what is wrong in it otherwise is not laid to that.
    let file = std::env::temp_dir().join(format!("gait-{}.toml", std::process::id()));
    std::fs::write(&file, "[gait.cost]\nlamda = 0.5\n").expect("writable");
    let path = file.to_str().expect("plain");
    refused(&["--config", path, "--set", "walk.swings=3"], &format!("{path} is no gait configuration"));
    let example = String::from_utf8(inspect(&["--example"]).stdout).expect("text");
    let (before, after) = example.split_once("lambda = ").expect("the weight is in it");
    std::fs::write(&file, format!("{before}lambda = \"half\" # {after}")).expect("writable");
    let mended = inspect(&["--config", path, "--set", "cost.lambda=0.5", "--set", "walk.swings=3", "--rate-hz", "20"]);
    assert_eq!(mended.status.code(), Some(0), "{}", String::from_utf8_lossy(&mended.stderr));
    std::fs::remove_file(&file).expect("it is ours");
    for rate in ["0", "-1", "nan", "inf", "1e7"] {
        refused(&[&format!("--rate-hz={rate}")], "give a positive rate");
    }
    refused(&["--rate-hz", "1e6"], "give a lower rate");
    refused(&["--rate-hz", "often"], "often");
    refused(&["--speed", "1"], "--speed");

    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, text: &str| write(&folder, name, text.as_bytes()).to_str().expect("UTF-8").to_string();
    refused(&["--config", &file("no.toml", "[cost\nlambda = 1")], "is not TOML");
    refused(&["--config", &file("flat.toml", "gait = 3")], "gait is not a table");
    refused(
        &["--config", &file("other.toml", "[speed]\nx = 1")],
        "other.toml is no gait configuration (--example prints one)",
    );
    refused(&["--config", &file("half.toml", "[walk]\nswings = 3")], "kind");
    let missing = folder.path().join("missing");
    refused(&["--config", missing.to_str().expect("UTF-8")], "reading");
    let nowhere = missing.join("walk.svg");
    refused(&["--svg", nowhere.to_str().expect("UTF-8"), "--rate-hz", "1"], "writing");
}

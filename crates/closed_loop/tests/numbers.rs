//! Every number of the simulator's and the controller's configurations that ship, made wrong: refused with its name, or harmless. Of
//! lists the first two elements.

use closed_loop::ClosedLoop;
use controller::{ControllerProcess, ControllerSettings};
use messages::code::Reason;
use messages::missing::STOP_AFTER_TICKS;
use messages::{RobotCommand, RobotState, SoleDeformation};
use scenario::{Config, Scenario, Setting};
use simulator::{SimulatorProcess, SimulatorSettings};
use std::path::{Path, PathBuf};
use toml::Value;

fn config(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config").join(name)
}

/// Makes a setting out of another value.
type Rewrite = Box<dyn Fn(&str) -> String>;

/// Every number in a table: its key, and the setting that gives it another value. Elements of lists count one by one.
fn numbers(value: &Value, key: &str, out: &mut Vec<(String, Rewrite)>) {
    let key_owned = key.to_string();
    match value {
        Value::Integer(_) | Value::Float(_) => {
            out.push((key.to_string(), Box::new(move |x| format!("{key_owned}={x}"))))
        }
        Value::Array(list) => {
            for i in 0..list.len().min(2) {
                let mut inner = Vec::new();
                numbers(&list[i], "", &mut inner);
                for (below, write) in inner {
                    let (list, key_owned) = (list.clone(), key.to_string());
                    let replaced = move |x: &str| {
                        let element = write(x);
                        let texts = list.iter().enumerate().map(|(j, other)| {
                            if i == j { element.trim_start_matches('=').to_string() } else { other.to_string() }
                        });
                        format!("{key_owned}=[{}]", texts.collect::<Vec<_>>().join(", "))
                    };
                    out.push((format!("{key}[{i}]{below}"), Box::new(replaced)));
                }
            }
        }
        Value::Table(table) => {
            for (name, below) in table {
                let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                numbers(below, &key, out);
            }
        }
        _ => {}
    }
}

/// Makes every number wrong: no number, huge, negative, zero, too large an integer. `works` builds and runs a process with the configuration, or says why not.
fn make_wrong(file: &str, extra: &[&str], skip: &[&str], works: impl Fn(&Config) -> Result<(), String>) {
    let parse = |text: &str| text.parse::<Setting>().expect("a setting");
    let extra: Vec<Setting> = extra.iter().map(|text| parse(text)).collect();
    let base = Config::read(&config(file)).expect("it ships").with_settings(&extra);
    works(&base).expect("what ships works");
    let mut all = Vec::new();
    numbers(&Value::Table(base.table().clone()), "", &mut all);
    assert!(all.len() > 25, "the whole configuration: {} numbers", all.len());
    let (mut refused, mut accepted) = (0, 0);
    for (key, write) in &all {
        if skip.iter().any(|skipped| key.starts_with(skipped)) {
            continue;
        }
        let last = key.rsplit('.').next().expect("a key has a part");
        let name = last.split('[').next().expect("a name");
        for wrong in ["nan", "1e300", "-1", "0", "9223372036854775807"] {
            match works(&base.clone().with_settings(&[parse(&write(wrong))])) {
                Ok(()) => {
                    assert!(!["nan", "1e300"].contains(&wrong), "{key} = {wrong} is accepted");
                    accepted += 1;
                }
                Err(message) => {
                    assert!(message.contains(name), "{key} = {wrong}: `{message}` does not name it");
                    refused += 1;
                }
            }
        }
    }
    assert!(refused > 2 * all.len() && accepted > 0, "{refused} refused, {accepted} accepted");
}

/// What a walk's first ticks said.
fn said() -> Vec<(RobotState, SoleDeformation, RobotCommand)> {
    let scenario = Scenario::load(&config("scenarios/flat.toml"), &[]).expect("it ships");
    let mut run = ClosedLoop::new(&scenario).expect("it can be built");
    let mut tick = || run.step().expect("it goes on").expect("not over");
    (0..4).map(|_| tick()).map(|tick| (tick.state, tick.deformation, tick.command)).collect()
}

#[test]
fn every_number_of_the_simulator_is_refused_by_name_or_harmless() {
    let said = said();
    // A plate for a sole: nothing is condensed.
    let extra = ["sole.level=rigid"];
    let works = |config: &Config| {
        let settings: SimulatorSettings = config.parse().map_err(|error| error.to_string())?;
        let mut simulator = SimulatorProcess::new(settings).map_err(|error| error.to_string())?;
        simulator.place(&said[0].2).map_err(|error| error.to_string())?;
        for (_, _, command) in &said {
            simulator.advance();
            simulator.take_command(command);
        }
        Ok(())
    };
    make_wrong("simulator.toml", &extra, &["sole.patch_cells"], works);
}

#[test]
fn every_number_of_the_controller_is_refused_by_name_or_harmless() {
    let said = said();
    let planned = planner::plan(&scenario::load(&config("planner.toml"), &[]).expect("it ships")).expect("a walk");
    let works = |config: &Config| {
        let settings: ControllerSettings = config.parse().map_err(|error| error.to_string())?;
        let mut controller = ControllerProcess::new(&settings).map_err(|error| error.to_string())?;
        controller.take_pattern(&planned.header, &planned.phases).map_err(|error| error.to_string())?;
        for (state, deformation, _) in &said {
            controller.step(state, Some(deformation)).map_err(|error| error.to_string())?;
        }
        Ok(())
    };
    make_wrong("controller.toml", &[], &[], works);
}

#[test]
fn commands_that_no_robot_could_follow_are_counted_and_change_nothing() {
    let said = said();
    let build = || {
        let mut simulator = SimulatorProcess::new(scenario::load(&config("simulator.toml"), &[]).expect("it ships"))
            .expect("it builds");
        simulator.place(&said[0].2).expect("a place");
        simulator
    };
    let (mut told, mut left_alone) = (build(), build());
    for (_, _, command) in &said {
        let mut impossible = *command;
        impossible.header.tick += 1000;
        impossible.plan.feet[0].wrench_n_nm[2] = -200.0;
        impossible.plan.feet[1].wrench_n_nm[2] = 20.0;
        told.take_command(&impossible);
        for simulator in [&mut told, &mut left_alone] {
            simulator.take_command(command);
        }
        assert_eq!(told.advance().truth, left_alone.advance().truth);
    }
    assert_eq!((told.figures().commands_refused, left_alone.figures().commands_refused), (said.len() as u64, 0));
    // Nobody who says nothing else keeps the robot standing for ever: it is as if nothing came.
    let over_after = |ticks: i64, is_impossible: fn(i64) -> bool| {
        let mut simulator = build();
        for tick in 1..=ticks {
            assert_eq!(simulator.advance().over, None, "tick {tick}");
            let mut command = said[0].2;
            command.header.tick = tick;
            if is_impossible(tick) {
                command.joint_count = 0;
            }
            simulator.take_command(&command);
        }
        simulator.advance().over
    };
    assert_eq!(over_after(STOP_AFTER_TICKS, |_| true), Some(Reason::Infeasible));
    assert_eq!(over_after(399, |tick| tick % 8 != 0), None, "eight are not enough");
    let mut impossible = said[0].2;
    impossible.plan.base_rotation = [0.0; 9];
    assert!(build().place(&impossible).is_err());
}

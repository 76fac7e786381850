//! `soleus-inspect driver-check`: looks on while a driver works in a domain, and says what of its manners is wrong.

mod manners;

use crate::door::Outcome;
use anyhow::Context;
use bus::{Domain, DomainName, Robot as Whose};
use manners::{Limits, Manners};
use messages::code::Process;
use messages::topic;
use robot::Robot;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Look on while a robot's driver (or the simulator) works, and judge its manners: order, stamps, skipped ticks, ranges, and whether it holds
/// the driver's place in the domain alone.
///
/// The domain must be running (soleus-launch serve, then planner, estimator, controller and the driver). Nothing is published.
/// Exit codes: 0 nothing is wrong; 1 something is (the lines say what); 2 the command cannot look.
#[derive(clap::Args)]
pub struct Arguments {
    /// The domain.
    #[arg(long, value_name = "NAME", default_value = "default")]
    domain: DomainName,
    /// Folder of the robot: fingerprint, joints and their limits are held against it.
    #[arg(long, value_name = "FOLDER", default_value = "robots/hrp4")]
    robot: PathBuf,
    /// How many states are looked at.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    ticks: u32,
    /// How long is waited for a state before it counts as silence (s).
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = patience)]
    patience: f64,
}

fn patience(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("`{text}` is no number"))?;
    (0.1..=3600.0).contains(&seconds).then_some(seconds).ok_or_else(|| "must be from 0.1 to 3600 seconds".to_string())
}

/// Messages that may wait: more than half a second's.
const DEPTH: usize = 128;
/// How long one look for messages takes at most.
const LOOK: Duration = Duration::from_millis(100);

/// Looks on and prints.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let robot = Robot::load(&arguments.robot)?;
    let limits = Limits::of(&robot).context("the robot's joints")?;
    let domain = Domain::observe(&arguments.domain, Duration::from_secs(5))?;
    let mut states = domain.subscriber(topic::ROBOT_STATE, Whose::Any, DEPTH)?;
    let mut commands = domain.subscriber(topic::ROBOT_COMMAND, Whose::Any, DEPTH)?;
    let mut manners = Manners::new(limits);
    let patience = Duration::from_secs_f64(arguments.patience);
    let mut heard = Instant::now();
    while manners.states() < u64::from(arguments.ticks) && heard.elapsed() < patience {
        if let Some(state) = states.wait(LOOK)? {
            heard = Instant::now();
            manners.state(&state, node::clock_monotonic_ns());
        }
        while let Some(command) = commands.try_next()? {
            manners.command(&command);
        }
    }
    let counts = states.counts();
    // Lost by us, who are slow, is not skipped by the driver: those show in its ticks as well.
    manners.not_seen(counts.lost);
    let holds_place = arguments.domain.living().iter().any(|(process, _)| *process == Some(Process::Simulator));
    manners.place(holds_place, counts.strangers, counts.restarts);
    let (text, good) = manners.verdict();
    print!("{text}");
    Ok(if good { Outcome::Solved } else { Outcome::NotSolved })
}

//! Walks by the clock, each with one fault at a random instant, as a table: what the launcher said, and how the robot stood.
//!
//! ```text
//! cargo run --release -p system --example clock_faults -- [ROUNDS [SEED]]
//! ```
//! A campaign, not a test: what the clock does depends on the machine. The table is what there is to judge; only what must never be ends
//! it with an error: a fault without a name, or something left in shared memory.
#![allow(clippy::print_stdout)]

use harness::{Finished, Launch, Running, root};
use std::fmt::Write as _;
use std::time::{Duration, Instant};

#[derive(Debug, Clone, Copy)]
enum Fault {
    Nothing,
    Pause(&'static str, u64),
    Kill(&'static str),
    Interrupt,
}

const PROCESSES: [&str; 5] =
    ["soleus-planner", "soleus-estimator", "soleus-controller", "soleus-simulator", "soleus-recorder"];

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Nothing => f.pad("nothing"),
            Self::Pause(process, ms) => f.pad(&format!("SIGSTOP {ms} ms {}", short(process))),
            Self::Kill(process) => f.pad(&format!("kill -9 {}", short(process))),
            Self::Interrupt => f.pad("Ctrl-C"),
        }
    }
}

fn short(process: &str) -> &str {
    process.trim_start_matches("soleus-")
}

fn main() {
    let numbers: Vec<u64> = std::env::args().skip(1).map(|text| text.parse().expect("a number")).collect();
    let (rounds, seed) = (numbers.first().copied().unwrap_or(1), numbers.get(1).copied().unwrap_or(1));
    let mut random = fastrand::Rng::with_seed(seed);
    println!(
        "{:<28} {:>5} {:>8} {:>5} {:>7} {:>7}  by the clock",
        "fault", "code", "named s", "fell", "COM mm", "ZMP mm"
    );
    let mut wrong = 0;
    for _ in 0..rounds {
        let pauses = PROCESSES.into_iter().flat_map(|process| [20, 200].map(|ms| Fault::Pause(process, ms)));
        let kills = PROCESSES.into_iter().map(Fault::Kill);
        for fault in [Fault::Nothing, Fault::Interrupt].into_iter().chain(pauses).chain(kills) {
            let running = start();
            let (finished, named_s) = meet(fault, running, &mut random);
            wrong += u32::from(!told(fault, &finished, named_s));
            println!("{}", row(&fault.to_string(), &finished, named_s));
        }
        // Two domains at once, each with all it needs.
        let both = [start(), start()];
        for (running, name) in both.into_iter().zip(["two at once, the one", "two at once, the other"]) {
            println!("{}", row(name, &running.finish(), None));
        }
    }
    if wrong > 0 {
        eprintln!("{wrong} faults without a name, or with something left");
        std::process::exit(1);
    }
}

fn start() -> Running {
    Launch::of(root().join("config/scenarios/flat.toml"))
        .set("recorder.flush_period_s=0.05")
        .argument("--real-time")
        .argument("--no-report")
        .start()
}

/// Lets a fault happen in the walk; how the launch ended, and how long after the fault it did.
fn meet(fault: Fault, mut running: Running, random: &mut fastrand::Rng) -> (Finished, Option<f64>) {
    running.wait_until_walking();
    // The robot stands for a second, and has walked by then.
    std::thread::sleep(Duration::from_millis(random.u64(3000..9000)));
    let happened = Instant::now();
    let worked = match fault {
        Fault::Nothing => Ok(()),
        Fault::Pause(process, ms) => {
            let id = running.wait_for_child(process);
            let paused = node::pause(id);
            std::thread::sleep(Duration::from_millis(ms));
            paused.and_then(|()| node::resume(id))
        }
        Fault::Kill(process) => node::kill(running.wait_for_child(process)),
        Fault::Interrupt => node::interrupt(running.id()),
    };
    worked.expect("it lives");
    let ends = matches!(fault, Fault::Kill(_) | Fault::Interrupt);
    let finished = running.finish();
    (finished, ends.then(|| happened.elapsed().as_secs_f64()))
}

/// Whether a fault that ends a launch is named, and nothing is left.
fn told(fault: Fault, finished: &Finished, ended_s: Option<f64>) -> bool {
    finished.assert_nothing_left();
    match fault {
        Fault::Kill(process) => {
            ended_s.is_some() && finished.stderr.contains(&format!("the {} was killed by signal 9", short(process)))
        }
        Fault::Interrupt => finished.code() == 130,
        // Held for too long: then it says so.
        Fault::Pause(..) => [0, 1, 5].contains(&finished.code()),
        Fault::Nothing => true,
    }
}

fn row(fault: &str, finished: &Finished, ended_s: Option<f64>) -> String {
    let figures = std::fs::read_to_string(finished.folder().join("figures.json")).unwrap_or_default();
    let figures: serde_json::Value = serde_json::from_str(&figures).unwrap_or_default();
    let mm = |key: &str| figures[key].as_f64().map_or("-".to_string(), |m| format!("{:.1}", 1e3 * m));
    let fell = figures["fallen"].as_bool().map_or("-", |fell| if fell { "yes" } else { "no" });
    let ended = ended_s.map_or("-".to_string(), |s| format!("{s:.2}"));
    let clock = finished.stdout.lines().find_map(|line| line.strip_prefix("by the clock")).unwrap_or("").trim();
    let mut row = format!("{fault:<28} {:>5} {ended:>8} {fell:>5}", finished.code());
    let _ = write!(row, " {:>7} {:>7}  {clock}", mm("com_error_max_m"), mm("zmp_error_max_m"));
    row
}

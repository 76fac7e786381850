//! Walks a scenario in one thread and prints how it goes: `cargo run --release -p closed_loop --example walk -- SCENARIO [KEY=VALUE]...`
//!
//! The last line is one hash over every number of all commands and truths: it stays as it is as long as code is only moved.
#![allow(clippy::print_stdout)]

use closed_loop::{ClosedLoop, NumberHash};
use scenario::{Scenario, Setting};
use std::path::PathBuf;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let path = PathBuf::from(arguments.next().unwrap_or_else(|| "config/scenarios/flat.toml".to_string()));
    let settings = arguments.map(|text| text.parse::<Setting>()).collect::<Result<Vec<_>, _>>()?;
    let scenario = Scenario::load(&path, &settings)?;
    let built = std::time::Instant::now();
    let mut walk = ClosedLoop::new(&scenario)?;
    println!("built in {:.2} s", built.elapsed().as_secs_f64());
    let started = std::time::Instant::now();
    let mut ticks = 0;
    let mut hash = NumberHash::default();
    while let Some(tick) = walk.step()? {
        ticks += 1;
        hash.take(&tick.command);
        hash.take(&tick.truth);
        if let Some(start) = &tick.start {
            println!("settled at tick {}, time zero at tick {}", tick.state.header.tick, start.tick_zero);
        }
        if tick.state.header.tick % 100 == 0 {
            let (t, c) = (&tick.truth, &tick.command);
            println!(
                "t {:6.2}  walk {:6.2}  com {:7.4} {:7.4} {:7.4}  plan {:7.4} {:7.4}  zmp {:7.4} {:7.4}  plan {:7.4} {:7.4}  Fz {:6.1} {:6.1}  mode {} status {}",
                t.time_s,
                t.walk_time_s,
                t.com_position_m[0],
                t.com_position_m[1],
                t.com_position_m[2],
                c.plan.com_position_m[0],
                c.plan.com_position_m[1],
                t.zmp_m[0],
                t.zmp_m[1],
                c.plan.zmp_m[0],
                c.plan.zmp_m[1],
                t.foot_wrench_n_nm[0][2],
                t.foot_wrench_n_nm[1][2],
                c.mode,
                c.status
            );
        }
    }
    let wall_s = started.elapsed().as_secs_f64();
    println!("{:?} after {ticks} ticks, {:.1} x real time", walk.over(), ticks as f64 * 0.005 / wall_s);
    print!("{}", report::table(&walk.figures()));
    println!("numbers of commands and truth: {hash}");
    Ok(())
}

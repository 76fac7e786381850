//! JSON doors to the libraries, so that anybody can hold one against their own code; and a look into recordings and living domains.
//!
//! One file per subcommand. To add one: a module with `Arguments` (clap) and `run(&Arguments) -> anyhow::Result<Outcome>`,
//! a variant of [`Subcommand`] and an arm of [`run`].
#![allow(clippy::print_stdout)] // results go to stdout

mod door;
mod driver_check;
mod dynamics;
mod figures;
mod friction;
mod layout;
mod live;
mod order;
mod pattern;
mod qp;
mod recording;
mod report;
mod robot;
mod sole;

use clap::Parser;
use door::Outcome;
use messages::code::Order;
use std::process::ExitCode;

/// JSON in, JSON out (but for recordings and domains): matrices are row-major nested lists, units are SI.
///
/// Exit codes: 0 everything was solved; 1 something was not (the output says what); 2 the input or the command is wrong.
#[derive(Parser)]
#[command(name = "soleus-inspect", version)]
struct Command {
    #[command(subcommand)]
    subcommand: Subcommand,
}

#[derive(clap::Subcommand)]
enum Subcommand {
    /// Contact with dry friction: one problem given by its Delassus operator.
    Friction(friction::Arguments),
    /// A soft sole under a sequence of loads or poses.
    Sole(Box<sole::Arguments>),
    /// Rigid-body kinematics and dynamics of a robot given as URDF.
    Dynamics(dynamics::Arguments),
    /// Dense quadratic programs: the solvers of the whole-body controller.
    Qp(qp::Arguments),
    /// Drafts the folder of a robot from its URDF: what is to be filled in, and a walk to try it.
    Robot(robot::Arguments),
    /// Walking patterns from a gait configuration, as numbers and as a picture.
    Pattern(pattern::Arguments),
    /// What is in a recording, a topic of it as a table, and finishing what a killed recorder left.
    Recording(recording::Arguments),
    /// Recorded walks in figures, as a table or as JSON.
    Figures(figures::Arguments),
    /// A robot's driver at work in a domain: order, stamps, skipped ticks, ranges, locks.
    DriverCheck(driver_check::Arguments),
    /// The page of a recorded walk: figures, ground track, replay; one file for any browser.
    Report(report::Arguments),
    /// The page of two recorded walks, one over the other.
    Compare(report::CompareArguments),
    /// The topics of a living domain and who is in it.
    List(live::ListArguments),
    /// How often messages come in a living domain.
    Hz(live::HzArguments),
    /// The messages of a topic of a living domain.
    Echo(live::EchoArguments),
    /// The layout of every message for C and Python.
    Layout(layout::Arguments),
    /// Tell a robot that runs by the clock to walk off, as soon as it stands still.
    Start(order::Arguments),
    /// Tell a robot to stand: the step under way is completed, and the posture held on both feet.
    Stop(order::Arguments),
}

fn run(subcommand: &Subcommand) -> anyhow::Result<Outcome> {
    match subcommand {
        Subcommand::Friction(arguments) => friction::run(arguments),
        Subcommand::Sole(arguments) => sole::run(arguments),
        Subcommand::Dynamics(arguments) => dynamics::run(arguments),
        Subcommand::Qp(arguments) => qp::run(arguments),
        Subcommand::Robot(arguments) => robot::run(arguments),
        Subcommand::Pattern(arguments) => pattern::run(arguments),
        Subcommand::Recording(arguments) => recording::run(arguments),
        Subcommand::Figures(arguments) => figures::run(arguments),
        Subcommand::DriverCheck(arguments) => driver_check::run(arguments),
        Subcommand::Report(arguments) => report::run(arguments),
        Subcommand::Compare(arguments) => report::compare(arguments),
        Subcommand::List(arguments) => live::list(arguments),
        Subcommand::Hz(arguments) => live::hz(arguments),
        Subcommand::Echo(arguments) => live::echo(arguments),
        Subcommand::Layout(arguments) => layout::run(arguments),
        Subcommand::Start(arguments) => order::give(Order::Start, arguments),
        Subcommand::Stop(arguments) => order::give(Order::Stop, arguments),
    }
}

fn main() -> ExitCode {
    match run(&Command::parse().subcommand) {
        Ok(Outcome::Solved) => ExitCode::SUCCESS,
        Ok(Outcome::NotSolved) => ExitCode::from(1),
        Err(error) => {
            eprintln!("soleus-inspect: {}", door::chain(&error));
            ExitCode::from(2)
        }
    }
}

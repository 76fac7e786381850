//! How a walk went: figures from messages, a table of them for a terminal, and a page from a recording.
//!
//! # What is compared with what
//!
//! Command *k* holds the plan for tick *k + 1*; it is sent during one period, and the drives drive to it during the next. So at tick *k* the
//! robot is where the plan of command *k - 2* wanted it ([`messages::timing::REACHED_TICKS`]), if it follows perfectly. **Errors are distances
//! between the truth of tick *k* and that plan.** Against the plan of tick *k* itself a perfect robot would be wrong by two periods of its
//! own speed, 2 mm at 0.2 m/s; that is the interface's delay, the same for every walk, and no robot can do anything about it.
//!
//! | error | real | planned |
//! |---|---|---|
//! | COM | `com_position_m` of the truth, x and y | `plan.com_position_m`, the pattern's |
//! | ZMP | `zmp_m` of the truth | `plan.zmp_m`, what the whole-body step computed |
//! | tilt | z axis of the base | z axis of the planned base |
//! | ZMP, body to cart | `plan.zmp_m` | the pattern's ZMP of the same tick: what the cart-table does not know of a swinging leg |
//!
//! They are taken at every tick from time zero on until the plan of a finished walk is reached, or the robot falls. A tick whose command
//! was lost has no plan and is counted in [`WalkFigures::ticks_without_plan`].
//!
//! *Not here*: what a figure should be. Only the verdict has a limit, [`ReportSettings::zmp_error_max_m`].

mod estimates;
mod figures;
mod gather;
mod limbs;
mod page;
mod settings;
mod spread;
mod table;
mod tracking;
mod verdict;

pub use estimates::Estimates;
pub use figures::{ClockTimes, ControllerSteps, Feedback, Lateness, ProcessTimes, WalkFigures};
pub use gather::{Gather, Said};
pub use limbs::JointTicks;
pub use page::{Chart, LogLine, Page, PageError, PageSettings, Table, compare, log_lines, page, sheet};
pub use settings::ReportSettings;
pub use spread::Spread;
pub use table::table;
pub use tracking::Tracking;
pub use verdict::Verdict;

use messages::code::Process;
use messages::topic;
use recording::{ReadError, Recording};

/// The figures of a recorded walk, judged by the settings that are recorded with it.
///
/// # Errors
/// If the recording cannot be read.
pub fn figures(recording: &Recording) -> Result<WalkFigures, ReadError> {
    let mut gather = Gather::default();
    each(recording, |said| gather.take(said))?;
    let settings = ReportSettings::recorded(&recording.files()?);
    Ok(gather.finish(&settings))
}

/// Everything in a recording that figures and page need: plans, then the truth, then the rest, in three passes over the file. Memory holds
/// one message.
pub(crate) fn each(recording: &Recording, mut take: impl FnMut(Said)) -> Result<(), ReadError> {
    recording.each(|entry| {
        if let Some((header, phases)) = entry.pattern()? {
            take(Said::Pattern(&header, &phases));
        } else if let Some(start) = entry.read(topic::WALK_START)? {
            take(Said::Start(&start));
        } else if let Some(command) = entry.read(topic::ROBOT_COMMAND)? {
            take(Said::Command(&command));
        }
        Ok::<_, ReadError>(())
    })?;
    recording.each(|entry| {
        if let Some(truth) = entry.read(topic::TRUTH_ROBOT)? {
            take(Said::Truth(&truth));
        }
        Ok::<_, ReadError>(())
    })?;
    recording.each(|entry| {
        if let Some(deformation) = entry.read(topic::SOLE_DEFORMATION)? {
            take(Said::Deformation(&deformation));
        } else if let Some(state) = entry.read(topic::ROBOT_STATE)? {
            take(Said::State(&state));
        } else {
            for process in Process::ALL {
                if let Some(health) = entry.read(topic::health(*process))? {
                    take(Said::Health(&health));
                }
            }
        }
        Ok::<_, ReadError>(())
    })
}

//! `soleus-inspect echo`.

use super::{SLICE, Until, Where, reader_is_gone, topic_name};
use crate::door::Outcome;
use anyhow::Context;
use bus::{Domain, Robot};
use clap::Args;
use messages::topic::{self, Element, Topic, Visitor};
use messages::{MAX_JOINTS, MAX_PHASES, Message, Plain};
use recording::columns;
use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;

/// Print the messages of a topic as they come, a number a line, named as in `soleus-inspect recording --csv`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// The topic: robot/state, health/controller, ..
    #[arg(value_name = "TOPIC")]
    topic: String,
    #[command(flatten)]
    place: Where,
    /// End after so many messages.
    #[arg(long, value_name = "N")]
    count: Option<u64>,
    /// Only one message in so many ticks.
    #[arg(long, value_name = "TICKS", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Only numbers whose name begins so (several may be given).
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// A JSON object a line.
    #[arg(long)]
    json: bool,
    /// Folder of the robot, for the names of its joints [default: joint_0, joint_1, ..]
    #[arg(long, value_name = "FOLDER")]
    robot: Option<PathBuf>,
}

/// Prints.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let wanted = topic_name(&arguments.topic)?;
    let until = Until::signals()?;
    let domain = arguments.place.observe()?;
    let joints = match &arguments.robot {
        Some(folder) => joints(folder)?,
        None => (0..MAX_JOINTS).map(|k| format!("joint_{k}")).collect(),
    };
    let mut echo = Echo { domain: &domain, wanted, joints, arguments, until: &until };
    match topic::visit(&mut echo) {
        Err(error) if reader_is_gone(&error) => Ok(Outcome::Solved),
        other => other.map(|()| Outcome::Solved),
    }
}

fn joints(folder: &std::path::Path) -> anyhow::Result<Vec<String>> {
    let path = folder.join("robot.toml");
    let text = std::fs::read_to_string(&path).with_context(|| format!("--robot: cannot read {}", path.display()))?;
    let table: toml::Table = text.parse().with_context(|| format!("{}", path.display()))?;
    let list = table.get("joints").and_then(toml::Value::as_array);
    let list = list.with_context(|| format!("{}: no list `joints`", path.display()))?;
    Ok(list.iter().filter_map(|name| name.as_str().map(str::to_string)).collect())
}

struct Echo<'a> {
    domain: &'a Domain,
    wanted: &'static str,
    joints: Vec<String>,
    arguments: &'a Arguments,
    until: &'a Until,
}

impl Echo<'_> {
    /// Prints what `next` gives until it is over.
    fn print<T: Message>(
        &self,
        mut next: impl FnMut() -> anyhow::Result<Option<T>>,
        lost: impl FnOnce() -> u64,
    ) -> anyhow::Result<()> {
        let names = self.columns::<T>()?;
        let (mut printed, mut text, mut due) = (0, String::new(), None::<i64>);
        while self.arguments.count.is_none_or(|count| printed < count) {
            let Some(message) = next()? else {
                if self.until.over(self.domain) {
                    break;
                }
                continue;
            };
            let tick = message.header().tick;
            if due.is_some_and(|due| (due - i64::from(self.arguments.every) + 1..due).contains(&tick)) {
                continue;
            }
            due = Some(tick.saturating_add(i64::from(self.arguments.every)));
            text.clear();
            write_message(&message, &names, self.arguments.json, &mut text);
            let mut out = std::io::stdout().lock();
            out.write_all(text.as_bytes())?;
            out.flush()?;
            printed += 1;
            if self.until.stop.asked() {
                break;
            }
        }
        let lost = lost();
        if lost > 0 {
            eprintln!("soleus-inspect: {lost} messages were lost: they came faster than they could be printed");
        }
        Ok(())
    }

    /// Names of the numbers to be printed; `None` for the others.
    fn columns<T: Message>(&self) -> anyhow::Result<Vec<Option<String>>> {
        let only = &self.arguments.only;
        let mut names = columns(T::SHAPE, &self.joints);
        if let Some(unknown) = only.iter().find(|start| !names.iter().flatten().any(|name| name.starts_with(*start))) {
            anyhow::bail!("--only {unknown}: no number of {} is called so", self.wanted);
        }
        for name in &mut names {
            let wanted = name.as_ref().is_some_and(|name| only.is_empty() || only.iter().any(|s| name.starts_with(s)));
            if !wanted {
                *name = None;
            }
        }
        Ok(names)
    }
}

fn write_message<T: Plain>(message: &T, names: &[Option<String>], json: bool, text: &mut String) {
    let mut names = names.iter();
    let mut first = true;
    message.for_each_number("", &mut |_, number| {
        let Some(Some(name)) = names.next() else { return };
        // A string takes everything.
        let _ = match (json, number.is_finite()) {
            (false, _) => writeln!(text, "{name}: {number}"),
            // JSON has no word for them.
            (true, false) => write!(text, "{}\"{name}\":null", if first { '{' } else { ',' }),
            (true, true) => write!(text, "{}\"{name}\":{number}", if first { '{' } else { ',' }),
        };
        first = false;
    });
    text.push_str(match (json, first) {
        (true, false) => "}\n",
        (true, true) => "{}\n",
        (false, _) => "---\n",
    });
}

impl Visitor for Echo<'_> {
    type Error = anyhow::Error;

    fn message<T: Message>(&mut self, topic: Topic<T>) -> anyhow::Result<()> {
        if topic.name() != self.wanted {
            return Ok(());
        }
        let subscriber = std::cell::RefCell::new(self.domain.subscriber(topic, Robot::Any, usize::MAX)?);
        self.print(|| Ok(subscriber.borrow_mut().wait(SLICE)?), || subscriber.borrow().counts().lost)
    }

    fn slice<H: Message, E: Element>(&mut self, topic: Topic<H>) -> anyhow::Result<()> {
        if topic.name() != self.wanted {
            return Ok(());
        }
        // The only topic of slices; its header says what was planned.
        let subscriber = std::cell::RefCell::new(self.domain.pattern_subscriber(Robot::Any, MAX_PHASES)?);
        let next = || Ok(subscriber.borrow_mut().wait(SLICE)?.map(|pattern| pattern.header));
        self.print(next, || subscriber.borrow().counts().lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::{Header, WalkStart};

    #[test]
    fn messages_are_printed_for_people_and_for_programs() {
        let message = WalkStart { header: Header::new(7, 1), pattern_hash: 3, tick_zero: 9 };
        let mut names = columns(WalkStart::SHAPE, &[]);
        for name in &mut names {
            if !name.as_ref().is_some_and(|name| name.ends_with("tick") || name == "tick_zero") {
                *name = None;
            }
        }
        let mut text = String::new();
        write_message(&message, &names, false, &mut text);
        assert_eq!(text, "header.tick: 7\ntick_zero: 9\n---\n");
        text.clear();
        write_message(&message, &names, true, &mut text);
        assert_eq!(text, "{\"header.tick\":7,\"tick_zero\":9}\n");
    }
}

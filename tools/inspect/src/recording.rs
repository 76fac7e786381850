//! `soleus-inspect recording`: what is in a recording; one topic as a table; finishing what a killed recorder left.

use crate::door::Outcome;
use anyhow::{Context, bail};
use messages::topic::{Element, Visitor, visit};
use messages::{Message, Topic};
use recording::{Entry, ReadError, Recording, columns};
use serde::Deserialize;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::PathBuf;

/// Look into a recording: what it says about its run, its topics, how often they come, what is missing.
///
/// With --csv, one topic as a table: a row per message, a column per number, named after joint, foot and axis, with
/// units. With --recover, finish a recording that a killed recorder left: everything whole is kept, the file gets a
/// name of its own.
#[derive(clap::Args)]
pub struct Arguments {
    /// The recording (walk.mcap), or with --recover the unfinished one (walk.mcap.partial).
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Print this topic as comma-separated values: robot/state, truth/robot, health/controller, ..
    #[arg(long, value_name = "TOPIC", conflicts_with = "recover")]
    csv: Option<String>,
    /// Finish an unfinished recording.
    #[arg(long)]
    recover: bool,
}

/// Reads and prints.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    let printed = if arguments.recover {
        let recovered = recording::recover_file(&arguments.file)?;
        writeln!(out, "recovered {} messages as {}", recovered.messages, recovered.path.display())
            .map_err(anyhow::Error::from)
    } else {
        let recording = Recording::open(&arguments.file)?;
        match &arguments.csv {
            Some(topic) => table(&recording, topic.trim_start_matches('/'), &mut out),
            None => overview(&recording, &mut out),
        }
    };
    let printed = printed.and_then(|()| out.flush().context("writing to stdout"));
    match printed {
        // A reader that goes away early is not an error.
        Err(error) if error.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == ErrorKind::BrokenPipe) => {
            Ok(Outcome::Solved)
        }
        other => other.map(|()| Outcome::Solved),
    }
}

fn overview(recording: &Recording, out: &mut impl Write) -> anyhow::Result<()> {
    let survey = recording.survey()?;
    // A file of another program has topics as well.
    match recording.facts() {
        Ok(facts) => {
            for (key, value) in facts.iter().filter(|(_, value)| !value.is_empty()) {
                writeln!(out, "{key:<22} {value}")?;
            }
        }
        Err(error) => writeln!(out, "{error}")?,
    }
    writeln!(out, "{:<22} {}\n", "size", files::size_text(recording.size_bytes()))?;
    writeln!(
        out,
        "{:<22} {:>9} {:>9} {:>10} {:>10} {:>9}  longest gap        schema",
        "topic", "messages", "Hz", "from s", "to s", "raw MB"
    )?;
    let seconds = |ns: u64| ns as f64 * 1e-9;
    for (name, topic) in &survey.topics {
        let rate = topic.rate_hz().map_or("-".to_string(), |rate| format!("{rate:.1}"));
        let gap = format!("{:.3} s at {:.3}", seconds(topic.longest_gap_ns), seconds(topic.longest_gap_at_ns));
        writeln!(
            out,
            "{name:<22} {:>9} {rate:>9} {:>10.3} {:>10.3} {:>9.2}  {gap:<18} {}",
            topic.messages,
            seconds(topic.first_ns),
            seconds(topic.last_ns),
            topic.bytes as f64 * 1e-6,
            topic.schema
        )?;
    }
    for (name, topic) in &survey.topics {
        match topic.lost {
            Some(lost) if lost > 0 => writeln!(out, "{name}: {lost} messages are not in it")?,
            _ => {}
        }
        if topic.restarts > 0 {
            writeln!(out, "{name}: its process was restarted {} times", topic.restarts)?;
        }
        if topic.backwards > 0 {
            writeln!(out, "{name}: {} messages lie after later ones", topic.backwards)?;
        }
    }
    Ok(())
}

fn table(recording: &Recording, topic: &str, out: &mut impl Write) -> anyhow::Result<()> {
    let mut find = Find { wanted: topic, joints: joints(recording)?, recording, out, found: false, known: Vec::new() };
    visit(&mut find)?;
    if !find.found {
        bail!("--csv {topic}: not a topic with a table; there are {}", find.known.join(", "));
    }
    Ok(())
}

/// Names of the robot's joints, from its description in the recording; without it they have numbers.
fn joints(recording: &Recording) -> anyhow::Result<Vec<String>> {
    #[derive(Deserialize)]
    struct Description {
        joints: Vec<String>,
    }
    let files = recording.files()?;
    let text = files.iter().find(|(name, _)| name == "robot/robot.toml").map(|(_, content)| content);
    let text = text.map(|content| String::from_utf8_lossy(content));
    let description = text.and_then(|text| toml::from_str::<Description>(&text).ok());
    Ok(description.map_or_else(|| (0..messages::MAX_JOINTS).map(|k| format!("joint_{k}")).collect(), |d| d.joints))
}

/// Looks for a topic by name, then prints it.
struct Find<'a, W> {
    wanted: &'a str,
    joints: Vec<String>,
    recording: &'a Recording,
    out: &'a mut W,
    found: bool,
    known: Vec<&'static str>,
}

impl<W: Write> Visitor for Find<'_, W> {
    type Error = anyhow::Error;

    fn message<T: Message>(&mut self, topic: Topic<T>) -> anyhow::Result<()> {
        self.known.push(topic.name());
        if topic.name() != self.wanted {
            return Ok(());
        }
        self.found = true;
        let columns = columns(T::SHAPE, &self.joints);
        let names: Vec<&str> = columns.iter().flatten().map(String::as_str).collect();
        writeln!(self.out, "{}", names.join(","))?;
        let mut row = String::new();
        self.recording.each(|entry: &mut Entry| -> anyhow::Result<()> {
            let read = entry.read(topic).map_err(|error: ReadError| anyhow::Error::from(error))?;
            let Some(message) = read else { return Ok(()) };
            row.clear();
            let mut columns = columns.iter();
            message.for_each_number("", &mut |_, number| {
                if columns.next().is_some_and(Option::is_some) {
                    let comma = if row.is_empty() { "" } else { "," };
                    use std::fmt::Write;
                    write!(row, "{comma}{number}").expect("a string takes everything");
                }
            });
            Ok(writeln!(self.out, "{row}")?)
        })
    }

    fn slice<H: Message, E: Element>(&mut self, _: Topic<H>) -> anyhow::Result<()> {
        Ok(())
    }
}

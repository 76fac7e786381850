//! `soleus-inspect recording`: what is in a recording; one topic as a table; finishing what a killed recorder left.

mod parquet;

use crate::door::Outcome;
use anyhow::{Context, bail};
use messages::topic::{Element, Visitor, visit};
use messages::{Message, Shape, Topic};
use parquet::{Column, Kind, Table};
use recording::{Entry, ReadError, Recording, columns};
use serde::Deserialize;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Look into a recording: what it says about its run, its topics, how often they come, what is missing.
///
/// With --csv or --parquet, one topic as a table: a row per message, a column per number, named after joint, foot and
/// axis, with units. CSV has numbers as people read them, Parquet every bit. With --recover, finish a recording that a killed recorder left: everything whole is kept, the file gets a
/// name of its own.
#[derive(clap::Args)]
pub struct Arguments {
    /// The recording (walk.mcap), or with --recover the unfinished one (walk.mcap.partial).
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Print this topic as comma-separated values: robot/state, truth/robot, health/controller, ..
    #[arg(long, value_name = "TOPIC", conflicts_with = "recover")]
    csv: Option<String>,
    /// Write this topic as a Parquet file (zstd), for Polars, pandas, DuckDB, ..
    #[arg(long, value_name = "TOPIC", conflicts_with_all = ["recover", "csv"])]
    parquet: Option<String>,
    /// The Parquet file [default: beside the recording: walk.truth-robot.parquet]
    #[arg(short, long, value_name = "FILE", requires = "parquet")]
    output: Option<PathBuf>,
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
        match (&arguments.csv, &arguments.parquet) {
            (Some(topic), _) => csv(&recording, topic.trim_start_matches('/'), &mut out),
            (_, Some(topic)) => parquet_file(&recording, topic.trim_start_matches('/'), arguments, &mut out),
            _ => overview(&recording, &mut out),
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

fn csv(recording: &Recording, topic: &str, out: &mut impl Write) -> anyhow::Result<()> {
    find(recording, "--csv", topic, Csv { out })
}

fn parquet_file(recording: &Recording, topic: &str, arguments: &Arguments, out: &mut impl Write) -> anyhow::Result<()> {
    let beside = || {
        let stem = arguments.file.file_stem().unwrap_or_default().to_string_lossy();
        arguments.file.with_file_name(format!("{stem}.{}.parquet", topic.replace('/', "-")))
    };
    let path = arguments.output.clone().unwrap_or_else(beside);
    find(recording, "--parquet", topic, Parquet { path: &path })?;
    Ok(writeln!(out, "{}", path.display())?)
}

/// Hands the wanted topic to `write`.
fn find<W: WriteTable>(recording: &Recording, option: &str, topic: &str, write: W) -> anyhow::Result<()> {
    let joints = joints(recording)?;
    let mut find = Find { wanted: topic, joints, recording, write, found: false, known: Vec::new() };
    visit(&mut find)?;
    if !find.found {
        bail!("{option} {topic}: not a topic with a table; there are {}", find.known.join(", "));
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

/// A way to write one topic.
trait WriteTable {
    fn write<T: Message>(&mut self, topic: Topic<T>, recording: &Recording, joints: &[String]) -> anyhow::Result<()>;
}

/// Looks for a topic by name, then writes it.
struct Find<'a, W> {
    wanted: &'a str,
    joints: Vec<String>,
    recording: &'a Recording,
    write: W,
    found: bool,
    known: Vec<&'static str>,
}

impl<W: WriteTable> Visitor for Find<'_, W> {
    type Error = anyhow::Error;

    fn message<T: Message>(&mut self, topic: Topic<T>) -> anyhow::Result<()> {
        self.known.push(topic.name());
        if topic.name() != self.wanted {
            return Ok(());
        }
        self.found = true;
        self.write.write(topic, self.recording, &self.joints)
    }

    fn slice<H: Message, E: Element>(&mut self, _: Topic<H>) -> anyhow::Result<()> {
        Ok(())
    }
}

/// Calls `row` with each message of a topic.
fn rows<T: Message>(
    topic: Topic<T>,
    recording: &Recording,
    mut row: impl FnMut(&T) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    recording.each(|entry: &mut Entry| {
        let read = entry.read(topic).map_err(|error: ReadError| anyhow::Error::from(error))?;
        read.map_or(Ok(()), |message| row(&message))
    })
}

struct Csv<'a, W> {
    out: &'a mut W,
}

impl<W: Write> WriteTable for Csv<'_, W> {
    fn write<T: Message>(&mut self, topic: Topic<T>, recording: &Recording, joints: &[String]) -> anyhow::Result<()> {
        let columns = columns(T::SHAPE, joints);
        let names: Vec<&str> = columns.iter().flatten().map(String::as_str).collect();
        writeln!(self.out, "{}", names.join(","))?;
        let mut line = String::new();
        rows(topic, recording, |message| {
            line.clear();
            let mut columns = columns.iter();
            message.for_each_number("", &mut |_, number| {
                if columns.next().is_some_and(Option::is_some) {
                    let comma = if line.is_empty() { "" } else { "," };
                    use std::fmt::Write;
                    write!(line, "{comma}{number}").expect("a string takes everything");
                }
            });
            Ok(writeln!(self.out, "{line}")?)
        })
    }
}

struct Parquet<'a> {
    path: &'a Path,
}

impl WriteTable for Parquet<'_> {
    fn write<T: Message>(&mut self, topic: Topic<T>, recording: &Recording, joints: &[String]) -> anyhow::Result<()> {
        let mut kinds = Vec::new();
        flatten(T::SHAPE, &mut 0, &mut kinds);
        let names = columns(T::SHAPE, joints);
        let columns = names.into_iter().zip(kinds);
        let columns = columns.filter_map(|(name, (kind, at))| Some(Column { name: name?, kind, at })).collect();
        let failed = || format!("cannot write {}", self.path.display());
        let file = BufWriter::new(File::create(self.path).with_context(failed)?);
        let mut table = Table::begin(file, columns, T::SHAPE.size()).with_context(failed)?;
        let mut bytes = Vec::new();
        rows(topic, recording, |message| {
            bytes.clear();
            message.write_bytes(&mut bytes);
            table.row(&bytes).with_context(failed)
        })?;
        let facts: Vec<_> = recording.facts().into_iter().flatten().collect();
        table.finish(&facts).map(|_| ()).with_context(failed)
    }
}

/// Kind and place of every number of a message, in the order in which they lie.
fn flatten(shape: &Shape, at: &mut usize, kinds: &mut Vec<(Kind, usize)>) {
    let kind = match shape {
        Shape::Array(element, count) => return (0..*count).for_each(|_| flatten(element, at, kinds)),
        Shape::Struct { fields, .. } => return fields.iter().for_each(|field| flatten(field.shape, at, kinds)),
        Shape::U32 => Kind::U32,
        Shape::U64 => Kind::U64,
        Shape::I64 => Kind::I64,
        Shape::F64 => Kind::F64,
    };
    kinds.push((kind, *at));
    *at += kind.size();
}

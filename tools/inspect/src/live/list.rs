//! `soleus-inspect list`.

use super::Where;
use crate::door::Outcome;
use anyhow::Context;
use bus::DomainName;
use clap::Args;
use messages::topic::{self, Element, Row, Topic, Visitor};
use messages::{Message, code::Process};
use std::convert::Infallible;
use std::fmt::Write;

/// Print the topics of a domain, with message, rate and publisher, and who lives in it.
///
/// Without --domain and with several domains alive, their names are printed.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    place: Where,
}

/// Prints.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let living = DomainName::all_living()?;
    if arguments.place.domain.is_none() && living.len() != 1 {
        let mut text = String::new();
        living.iter().try_for_each(|name| writeln!(text, "{name}"))?;
        if living.is_empty() {
            text += "no domain lives: start a launch, or soleus-launch serve --domain NAME\n";
        }
        node::say(&text).context("writing to stdout")?;
        return Ok(Outcome::Solved);
    }
    let domain = arguments.place.observe()?;
    let members = domain.name().living();
    let mut table = Table { text: format!("domain {}\n", domain.name()), members: &members };
    for (process, id) in &members {
        writeln!(table.text, "  {:<12} process {id}", process.map_or("owner", Process::word))?;
    }
    writeln!(table.text, "\n{:<20} {:<20} {:>5} {:>5}  from", "topic", "message", "Hz", "kept")?;
    let Ok(()) = topic::visit(&mut table);
    node::say(&table.text).context("writing to stdout")?;
    Ok(Outcome::Solved)
}

struct Table<'a> {
    text: String,
    members: &'a [(Option<Process>, String)],
}

impl Table<'_> {
    fn row(&mut self, row: &Row, message: &str) {
        let rate = if row.rate_hz == 0 { "once".to_string() } else { row.rate_hz.to_string() };
        let lives = self.members.iter().any(|(process, _)| *process == Some(row.from));
        let gone = if lives { "" } else { " (not there)" };
        let message = message.trim_start_matches("soleus.");
        self.text += &format!("{:<20} {message:<20} {rate:>5} {:>5}  {}{gone}\n", row.name, row.kept, row.from);
    }
}

impl Visitor for Table<'_> {
    type Error = Infallible;

    fn message<T: Message>(&mut self, topic: Topic<T>) -> Result<(), Infallible> {
        self.row(&topic.row, T::WIRE_NAME);
        Ok(())
    }

    fn slice<H: Message, E: Element>(&mut self, topic: Topic<H>) -> Result<(), Infallible> {
        self.row(&topic.row, H::WIRE_NAME);
        Ok(())
    }
}

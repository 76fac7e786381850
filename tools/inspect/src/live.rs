//! A look into a living domain: `list`, `hz`, `echo`. Whoever looks takes nobody's place and delays nobody.

mod echo;
mod hz;
mod list;

pub use echo::Arguments as EchoArguments;
pub use hz::Arguments as HzArguments;
pub use list::Arguments as ListArguments;
pub use {echo::run as echo, hz::run as hz, list::run as list};

use anyhow::{Context, bail};
use bus::{Domain, DomainName};
use clap::Args;
use messages::topic::ROWS;
use node::Stop;
use std::time::Duration;

/// How long the owner of a domain is waited for, in case a launch is just starting.
const OWNER_PATIENCE: Duration = Duration::from_secs(2);
/// How often one who waits looks whether the domain is still there, and whether it was asked to stop.
const SLICE: Duration = Duration::from_millis(100);

/// Which domain.
#[derive(Debug, Args)]
pub struct Where {
    /// The domain [default: the only one that lives]
    #[arg(long, value_name = "NAME")]
    domain: Option<DomainName>,
}

impl Where {
    /// The domain that is meant.
    fn name(&self) -> anyhow::Result<DomainName> {
        if let Some(name) = &self.domain {
            return Ok(name.clone());
        }
        let mut living = DomainName::all_living()?;
        match living.len() {
            1 => Ok(living.remove(0)),
            0 => bail!("no domain lives: start a launch, or soleus-launch serve --domain NAME"),
            _ => {
                let names: Vec<String> = living.iter().map(ToString::to_string).collect();
                bail!("several domains live: say which with --domain: {}", names.join(", "))
            }
        }
    }

    /// Joins it to look on.
    fn observe(&self) -> anyhow::Result<Domain> {
        let name = self.name()?;
        Domain::observe(&name, OWNER_PATIENCE).with_context(|| format!("--domain {name}"))
    }
}

/// Names of topics as people type them, with or without the slash in front.
fn topic_name(given: &str) -> anyhow::Result<&'static str> {
    let wanted = given.trim_matches('/');
    let known = ROWS.iter().find(|row| row.name == wanted);
    known.map(|row| row.name).with_context(|| {
        let names: Vec<&str> = ROWS.iter().map(|row| row.name).collect();
        format!("`{given}` is no topic; there are {}", names.join(", "))
    })
}

/// What ends a look: the domain's end, or Ctrl-C.
struct Until {
    stop: Stop,
}

impl Until {
    fn signals() -> anyhow::Result<Self> {
        Ok(Self { stop: Stop::on_signals().context("catching signals")? })
    }

    fn over(&self, domain: &Domain) -> bool {
        self.stop.asked() || !domain.owner_is_alive()
    }
}

/// Whether writing failed because the reader has gone: no error, but the end.
fn reader_is_gone(error: &anyhow::Error) -> bool {
    error.downcast_ref::<std::io::Error>().is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
}

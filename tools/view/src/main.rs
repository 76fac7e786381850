//! A living domain in viewers: Foxglove, Lichtblick, PlotJuggler and whatever else opens a Foxglove websocket.
//!
//! It looks on: it takes nobody's place, gives way to everybody (`nice`), and shows the latest message only. A viewer that is slow
//! sees fewer of them; nobody waits for it. Viewers cannot say anything to the robot: the server has no such capability.
//!
//! | file | what |
//! |---|---|
//! | `feed.rs` | takes messages of the domain, makes what viewers show |
//! | `hub.rs` | the latest message of each topic, and who wants it |
//! | `server.rs` | listens, a thread per viewer |
//! | `protocol.rs` | what is said on the websocket |

mod feed;
mod hub;
mod protocol;
mod server;

use anyhow::Context;
use bus::DomainName;
use clap::Parser;
use feed::Feed;
use hub::Hub;
use node::{ExitCode, LogFormat, Stop};
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How nice it is: the last to get a processor.
const NICENESS: i32 = 19;
/// How often it looks for a domain that is not there.
const LOOK_AGAIN: Duration = Duration::from_millis(200);
/// How often it looks whether the domain is still there.
const LOOK_AROUND: Duration = Duration::from_millis(200);

/// Show a living domain in viewers: a Foxglove websocket server.
///
/// Open a connection to ws://127.0.0.1:8765 in Foxglove, Lichtblick or PlotJuggler. The server stays when a launch ends and shows
/// the next one of the same domain. In lock-step a walk is over in seconds.
#[derive(Debug, Parser)]
#[command(name = "soleus-view", version)]
struct Arguments {
    /// The domain.
    #[arg(long, value_name = "NAME", default_value = "default")]
    domain: DomainName,
    /// Folder of the robot, whose shape is drawn.
    #[arg(long, value_name = "FOLDER", default_value = "robots/hrp4")]
    robot: PathBuf,
    /// Messages of a topic a second, at most.
    #[arg(long, value_name = "HZ", default_value_t = 30.0, value_parser = rate)]
    rate: f64,
    /// Where viewers may come from: 127.0.0.1 is this computer only. There is no password: anybody who reaches another address
    /// can watch.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    listen: IpAddr,
    /// The port; 0 takes a free one and prints it.
    #[arg(long, default_value_t = 8765)]
    port: u16,
}

fn rate(text: &str) -> Result<f64, String> {
    let rate: f64 = text.parse().map_err(|_| format!("`{text}` is no number"))?;
    if (0.1..=200.0).contains(&rate) { Ok(rate) } else { Err("0.1 to 200 Hz".to_string()) }
}

fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let stop = Stop::on_signals().context("catching signals")?;
    if let Err(error) = rustix::process::nice(NICENESS) {
        tracing::warn!("cannot give way to others: {error}");
    }
    let robot =
        robot::Robot::load(&arguments.robot).with_context(|| format!("--robot {}", arguments.robot.display()))?;
    let viewer = recorder::viewer_settings(&robot).with_context(|| format!("--robot {}", arguments.robot.display()))?;
    let hub = Arc::new(Hub::new(feed::topics()));
    let mut feed = Feed::new(viewer, Arc::clone(&hub))?;
    let address = SocketAddr::new(arguments.listen, arguments.port);
    let listening = server::listen(address, Arc::clone(&hub))?;
    node::say(&format!("ws://{listening}\n")).context("writing to stdout")?;
    let period = Duration::from_secs_f64(1.0 / arguments.rate);
    tracing::info!("waiting for domain `{}`", arguments.domain);
    while !stop.asked() {
        let domain = match bus::Domain::observe(&arguments.domain, LOOK_AGAIN) {
            Ok(domain) => domain,
            Err(bus::JoinError::NoOwner { .. }) => continue,
            Err(error) => return Err(error).with_context(|| format!("--domain {}", arguments.domain)),
        };
        let mut ears = match feed::Ears::new(&domain) {
            Ok(ears) => ears,
            // It may be ending at this very moment.
            Err(_) if !domain.owner_is_alive() => continue,
            Err(error) => return Err(error),
        };
        tracing::info!("domain `{}` lives", arguments.domain);
        let mut looked = Instant::now();
        while !stop.asked() && (looked.elapsed() < LOOK_AROUND || domain.owner_is_alive()) {
            if looked.elapsed() >= LOOK_AROUND {
                looked = Instant::now();
            }
            feed.pass_on(&mut ears)?;
            std::thread::sleep(period);
        }
        tracing::info!("domain `{}` has ended", arguments.domain);
    }
    Ok(())
}

fn main() -> std::process::ExitCode {
    let arguments = Arguments::parse();
    node::start_diagnostics(LogFormat::Text);
    match run(&arguments) {
        Ok(()) => ExitCode::Done.code().into(),
        Err(error) => {
            tracing::error!("{error:#}");
            ExitCode::Configuration.code().into()
        }
    }
}

//! `soleus-inspect hz`.

use super::{Until, Where, reader_is_gone, topic_name};
use crate::door::Outcome;
use bus::{Domain, PatternSubscriber, Robot, Subscriber};
use clap::Args;
use messages::topic::{self, Element, Topic, Visitor};
use messages::{MAX_PHASES, Message};
use std::io::Write;
use std::time::{Duration, Instant};

/// Print how often messages come, and how evenly: a table for each window of time, until the domain ends or Ctrl-C.
///
/// In lock-step the rate is that of the computation; the ticks say how much of the walk went by.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Topics [default: all]
    #[arg(value_name = "TOPIC")]
    topics: Vec<String>,
    #[command(flatten)]
    place: Where,
    /// Length of a window (s).
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = window)]
    window: f64,
    /// How many windows [default: until the domain ends]
    #[arg(long, value_name = "N")]
    count: Option<u64>,
}

fn window(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("`{text}` is no number of seconds"))?;
    if (0.1..=3600.0).contains(&seconds) { Ok(seconds) } else { Err("0.1 to 3600 s".to_string()) }
}

/// Messages taken between two looks wait meanwhile: far fewer come in this time than a subscriber keeps (128).
const LOOK: Duration = Duration::from_millis(2);

/// Measures and prints.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let wanted = arguments.topics.iter().map(|name| topic_name(name)).collect::<anyhow::Result<Vec<_>>>()?;
    let until = Until::signals()?;
    let domain = arguments.place.observe()?;
    let mut meters = Meters { domain: &domain, wanted: &wanted, found: Vec::new() };
    topic::visit(&mut meters)?;
    let mut meters = meters.found;
    let window = Duration::from_secs_f64(arguments.window);
    let mut windows = 0;
    while arguments.count.is_none_or(|count| windows < count) {
        let start = Instant::now();
        let mut over = false;
        while start.elapsed() < window && !over {
            for meter in &mut meters {
                meter.look()?;
            }
            std::thread::sleep(LOOK);
            // Files are looked at for it: now and then.
            over = start.elapsed().as_millis() % 100 < 3 && until.over(&domain);
        }
        match table(&mut meters, start.elapsed()) {
            Err(error) if reader_is_gone(&error) => return Ok(Outcome::Solved),
            other => other?,
        }
        if over {
            break;
        }
        windows += 1;
    }
    Ok(Outcome::Solved)
}

fn table(meters: &mut [Box<dyn Meter>], elapsed: Duration) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "{:<20} {:>9} {:>10} {:>10} {:>10} {:>7} {:>10}",
        "topic", "Hz", "mean ms", "min ms", "max ms", "lost", "last tick"
    )?;
    for meter in meters {
        let name = meter.name();
        let seen = meter.take();
        if seen.messages == 0 {
            writeln!(out, "{name:<20} {:>9}", "-")?;
            continue;
        }
        let rate = seen.messages as f64 / elapsed.as_secs_f64();
        let ms = |duration: Option<Duration>| {
            duration.map_or("-".to_string(), |duration| format!("{:.2}", 1e3 * duration.as_secs_f64()))
        };
        let mean = (seen.gaps > 0).then(|| seen.gap_sum / u32::try_from(seen.gaps).unwrap_or(u32::MAX));
        writeln!(
            out,
            "{name:<20} {rate:>9.1} {:>10} {:>10} {:>10} {:>7} {:>10}",
            ms(mean),
            ms(seen.gap_min),
            ms(seen.gap_max),
            seen.lost,
            seen.tick
        )?;
    }
    writeln!(out)?;
    Ok(out.flush()?)
}

/// What came in a window.
#[derive(Debug, Clone, Copy, Default)]
struct Seen {
    messages: u64,
    gaps: u64,
    gap_sum: Duration,
    gap_min: Option<Duration>,
    gap_max: Option<Duration>,
    lost: u64,
    tick: i64,
}

/// Times of arrival.
#[derive(Default)]
struct Clock {
    seen: Seen,
    last: Option<Instant>,
    lost_before: u64,
}

impl Clock {
    /// A message came. Several found at one look share its time.
    fn came(&mut self, tick: i64, now: Instant) {
        self.seen.messages += 1;
        self.seen.tick = tick;
        if let Some(last) = self.last.replace(now) {
            let gap = now - last;
            self.seen.gaps += 1;
            self.seen.gap_sum += gap;
            self.seen.gap_min = Some(self.seen.gap_min.map_or(gap, |least| least.min(gap)));
            self.seen.gap_max = Some(self.seen.gap_max.map_or(gap, |most| most.max(gap)));
        }
    }

    fn take(&mut self, lost: u64) -> Seen {
        let seen = Seen { lost: lost - self.lost_before, ..self.seen };
        self.lost_before = lost;
        self.seen = Seen { tick: seen.tick, ..Seen::default() };
        seen
    }
}

trait Meter {
    fn name(&self) -> &'static str;
    fn look(&mut self) -> anyhow::Result<()>;
    fn take(&mut self) -> Seen;
}

struct OfMessages<T: Message>(Subscriber<T>, Clock);

impl<T: Message> Meter for OfMessages<T> {
    fn name(&self) -> &'static str {
        self.0.topic().name()
    }
    fn look(&mut self) -> anyhow::Result<()> {
        while let Some(message) = self.0.try_next()? {
            self.1.came(message.header().tick, Instant::now());
        }
        Ok(())
    }
    fn take(&mut self) -> Seen {
        self.1.take(self.0.counts().lost)
    }
}

struct OfPatterns(PatternSubscriber, Clock);

impl Meter for OfPatterns {
    fn name(&self) -> &'static str {
        topic::WALK_PATTERN.name()
    }
    fn look(&mut self) -> anyhow::Result<()> {
        while let Some(pattern) = self.0.latest()? {
            self.1.came(pattern.header.header.tick, Instant::now());
        }
        Ok(())
    }
    fn take(&mut self) -> Seen {
        self.1.take(self.0.counts().lost)
    }
}

/// Subscribes to what is wanted.
struct Meters<'a> {
    domain: &'a Domain,
    wanted: &'a [&'static str],
    found: Vec<Box<dyn Meter>>,
}

impl Meters<'_> {
    fn wants(&self, name: &str) -> bool {
        self.wanted.is_empty() || self.wanted.contains(&name)
    }
}

impl Visitor for Meters<'_> {
    type Error = anyhow::Error;

    fn message<T: Message>(&mut self, topic: Topic<T>) -> anyhow::Result<()> {
        if self.wants(topic.name()) {
            let subscriber = self.domain.subscriber(topic, Robot::Any, usize::MAX)?;
            self.found.push(Box::new(OfMessages(subscriber, Clock::default())));
        }
        Ok(())
    }

    fn slice<H: Message, E: Element>(&mut self, topic: Topic<H>) -> anyhow::Result<()> {
        if self.wants(topic.name()) {
            let subscriber = self.domain.pattern_subscriber(Robot::Any, MAX_PHASES)?;
            self.found.push(Box::new(OfPatterns(subscriber, Clock::default())));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_counts_its_own_messages_gaps_and_losses() {
        let (mut clock, start) = (Clock::default(), Instant::now());
        for (tick, ms) in [(1, 0), (2, 5), (3, 15)] {
            clock.came(tick, start + Duration::from_millis(ms));
        }
        let seen = clock.take(2);
        assert_eq!((seen.messages, seen.gaps, seen.lost, seen.tick), (3, 2, 2, 3));
        assert_eq!(seen.gap_sum, Duration::from_millis(15));
        assert_eq!((seen.gap_min, seen.gap_max), (Some(Duration::from_millis(5)), Some(Duration::from_millis(10))));
        // The gap across the border of two windows counts in the second.
        clock.came(4, start + Duration::from_millis(22));
        let seen = clock.take(2);
        assert_eq!((seen.messages, seen.gaps, seen.lost), (1, 1, 0));
        assert_eq!(seen.gap_max, Some(Duration::from_millis(7)));
    }
}

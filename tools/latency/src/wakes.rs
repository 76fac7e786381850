//! How quick a message wakes another thread, beside how quick anything can: blocks of both, one after the other.

use bus::{Domain, DomainName, Owner, Robot};
use lateness::{Lateness, PolicyWish, RightsSettings};
use messages::code::Process;
use messages::{CONTROL_PERIOD_NS, Header, RobotState, topic};
use node::{Rights, clock_monotonic_ns, sleep_until_ns};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// From sent to received (ns).
#[derive(Debug, Clone, Default)]
pub struct Wakes {
    /// A message over the bus: published, its event, received.
    pub event: Lateness,
    /// The same with both threads on one core: no interrupt has to go to another.
    pub event_on_one_core: Lateness,
    /// A thread that is unparked: a futex, the floor of what the system can do.
    pub futex: Lateness,
}

/// Wakes sent from one core to another, so many of each kind.
pub fn measure(cores: [u32; 2], priority: u32, count: u64, wakes: &mut Wakes) -> anyhow::Result<()> {
    wakes.event.add(&events(cores, priority, count)?);
    wakes.event_on_one_core.add(&events([cores[1]; 2], priority, count)?);
    wakes.futex.add(&futexes(cores, priority, count));
    Ok(())
}

fn enter(core: u32, priority: u32) {
    // What is refused was told before the campaign began.
    let _ = Rights::of_thread(&RightsSettings { policy: PolicyWish::Fifo, priority, core: Some(core) });
}

/// Longest wait for one wake-up, and for the other side to be there: only a broken bus meets it.
const PATIENCE: Duration = Duration::from_secs(10);

fn events([from, to]: [u32; 2], priority: u32, count: u64) -> anyhow::Result<Lateness> {
    let name: DomainName = format!("wakes-{}", std::process::id()).parse()?;
    let owner = Owner::claim(&name)?;
    let ready = Arc::new(AtomicBool::new(false));
    let (heard_name, heard_ready) = (name.clone(), Arc::clone(&ready));
    let receiver = std::thread::spawn(move || -> anyhow::Result<Lateness> {
        let domain = Domain::join(&heard_name, Process::Estimator, PATIENCE)?;
        let mut states = domain.subscriber(topic::ROBOT_STATE, Robot::Any, 8)?;
        enter(to, priority);
        heard_ready.store(true, Ordering::Release);
        let mut wakes = Lateness::default();
        while let Some(state) = states.wait(PATIENCE)? {
            if state.header.tick < 0 {
                continue;
            }
            wakes.record(clock_monotonic_ns().saturating_sub(state.header.clock_monotonic_ns));
            if state.header.tick as u64 + 1 >= count {
                break;
            }
        }
        Ok(wakes)
    });
    // Ports stay in the thread that made them, and its policy ends with it.
    let sender = std::thread::spawn(move || -> anyhow::Result<()> {
        let domain = Domain::join(&name, Process::Simulator, PATIENCE)?;
        let mut states = domain.publisher(topic::ROBOT_STATE)?;
        while !ready.load(Ordering::Acquire) && Arc::strong_count(&ready) > 1 {
            std::thread::sleep(Duration::from_millis(1));
        }
        enter(from, priority);
        let mut due_ns = clock_monotonic_ns() + CONTROL_PERIOD_NS;
        // The first publish makes connections: it is none of the counted ones.
        for tick in -1..count as i64 {
            sleep_until_ns(due_ns);
            let header = Header { clock_monotonic_ns: clock_monotonic_ns(), ..Header::new(tick, 1) };
            states.publish(&RobotState { header, ..RobotState::default() })?;
            due_ns += CONTROL_PERIOD_NS;
        }
        Ok(())
    });
    sender.join().expect("it only sends")?;
    let wakes = receiver.join().expect("it only receives")?;
    drop(owner);
    Ok(wakes)
}

fn futexes([from, to]: [u32; 2], priority: u32, count: u64) -> Lateness {
    let sent_ns = Arc::new(AtomicU64::new(0));
    let heard = Arc::clone(&sent_ns);
    let receiver = std::thread::spawn(move || {
        enter(to, priority);
        let mut wakes = Lateness::default();
        while wakes.count() < count {
            std::thread::park_timeout(PATIENCE);
            match heard.swap(0, Ordering::Acquire) {
                0 => {}
                u64::MAX => break,
                sent_ns => wakes.record(clock_monotonic_ns().saturating_sub(sent_ns)),
            }
        }
        wakes
    });
    let thread = receiver.thread().clone();
    let sender = std::thread::spawn(move || {
        enter(from, priority);
        let mut due_ns = clock_monotonic_ns() + CONTROL_PERIOD_NS;
        for _ in 0..count {
            sleep_until_ns(due_ns);
            sent_ns.store(clock_monotonic_ns(), Ordering::Release);
            thread.unpark();
            due_ns += CONTROL_PERIOD_NS;
        }
        // One that missed a wake-up would wait for it.
        sleep_until_ns(due_ns);
        sent_ns.store(u64::MAX, Ordering::Release);
        thread.unpark();
    });
    sender.join().expect("it only sends");
    receiver.join().expect("it only receives")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_wake_up_arrives_over_the_bus_and_over_a_futex() {
        let mut wakes = Wakes::default();
        measure([0, 0], 2, 40, &mut wakes).expect("a domain of its own");
        assert_eq!((wakes.event.count(), wakes.event_on_one_core.count()), (40, 40));
        // A thread that is slow to park may find two wake-ups as one.
        assert!((1..=40).contains(&wakes.futex.count()), "{}", wakes.futex.count());
    }
}

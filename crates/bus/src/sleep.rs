//! Sleeping until a message wakes, or a time has come.
//!
//! iceoryx2's own `Listener::timed_wait` sets the socket's `SO_RCVTIMEO`, which counts jiffies: asked for 1.5 ms it returns after 6 to
//! 12 ms on a kernel of 250 Hz. `ppoll` on the same descriptor keeps such a time to some ten microseconds, and costs no system calls that
//! switch blocking on and off.
#![allow(unsafe_code, reason = "the descriptor of a listener is lent as a number only")]

use crate::error::{PortError, ReceiveError};
use crate::service;
use iceoryx2::port::listener::{Listener, ListenerWaitError};
use iceoryx2::prelude::*;
use messages::Topic;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use std::os::fd::BorrowedFd;
use std::time::Duration;

/// How long one sleeps at most before one looks by oneself, in case a wake-up got lost.
pub(crate) const SLICE: Duration = Duration::from_millis(20);

pub(crate) fn listener<T>(
    node: &Node<ipc::Service>,
    topic: Topic<T>,
) -> Result<Option<Listener<ipc::Service>>, PortError> {
    let topic_name = topic.name();
    let Some(event) = service::open_event(node, &topic.row)? else { return Ok(None) };
    let create = || event.listener_builder().create();
    let listener = create().or_else(|_| {
        node.try_cleanup_dead_nodes();
        create()
    });
    listener.map(Some).map_err(|source| PortError::Listener { topic: topic_name, source })
}

/// Time of `CLOCK_MONOTONIC` (ns).
pub(crate) fn clock_monotonic_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

/// Sleeps until a notification or `longest` has passed; topics without wake-ups are looked at every millisecond.
pub(crate) fn sleep_until_woken(
    listener: Option<&Listener<ipc::Service>>,
    longest: Duration,
    topic: &'static str,
) -> Result<(), ReceiveError> {
    let Some(listener) = listener else {
        std::thread::sleep(longest.min(Duration::from_millis(1)));
        return Ok(());
    };
    // SAFETY: the listener owns the descriptor and outlives this call; nobody closes it meanwhile.
    let descriptor = unsafe { BorrowedFd::borrow_raw(listener.file_descriptor().native_handle()) };
    let timeout = Timespec { tv_sec: longest.as_secs() as i64, tv_nsec: longest.subsec_nanos().into() };
    match poll(&mut [PollFd::new(&descriptor, PollFlags::IN)], Some(&timeout)) {
        Ok(0) | Err(Errno::INTR) => Ok(()),
        // Whoever was woken takes what woke him: the next sleep is one again.
        Ok(_) => match listener.try_wait(|_| {}) {
            Ok(_) | Err(ListenerWaitError::InterruptSignal) => Ok(()),
            Err(_) => Err(ReceiveError::Wait { topic }),
        },
        Err(_) => Err(ReceiveError::Wait { topic }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Domain, Owner, Robot};
    use messages::code::Process;
    use messages::{Header, RobotState};
    use std::sync::mpsc;

    #[test]
    fn less_than_a_microsecond_is_not_for_ever() {
        // A thread that sleeps for ever must not keep the test from ending.
        let (done, woken) = mpsc::channel();
        let sleeper = std::thread::spawn(move || {
            let name = format!("bus-shortest-{}", std::process::id()).parse().expect("short and lower-case");
            let _owner = Owner::claim(&name).expect("a domain of its own");
            let domain = Domain::join(&name, Process::Estimator, Duration::from_secs(5)).expect("it has an owner");
            let listener = listener(&domain.node, messages::topic::ROBOT_STATE).expect("a topic").expect("that wakes");
            for nanoseconds in [0, 1, 999, 1000] {
                let result = sleep_until_woken(Some(&listener), Duration::from_nanos(nanoseconds), "test");
                done.send(result.is_ok()).expect("the test waits");
            }
        });
        for _ in 0..4 {
            assert_eq!(woken.recv_timeout(Duration::from_secs(120)), Ok(true));
        }
        sleeper.join().expect("it has done what it was to do");
    }

    #[test]
    fn a_deadline_ends_a_wait_and_what_has_come_is_taken_after_it() {
        let name = format!("bus-deadline-{}", std::process::id()).parse().expect("short and lower-case");
        let _owner = Owner::claim(&name).expect("a domain of its own");
        let domain = Domain::join(&name, Process::Simulator, Duration::from_secs(5)).expect("it has an owner");
        let topic = messages::topic::ROBOT_STATE;
        let mut publisher = domain.publisher(topic).expect("a topic");
        let mut subscriber = domain.subscriber(topic, Robot::Any, 4).expect("a topic");
        let deadline_ns = clock_monotonic_ns() + 1_500_000;
        assert!(subscriber.wait_until(deadline_ns).expect("works").is_none());
        assert!(clock_monotonic_ns() >= deadline_ns, "not before its time");
        for tick in 0..2 {
            let state = RobotState { header: Header::new(tick, 7), ..RobotState::default() };
            publisher.publish(&state).expect("there is room");
        }
        // The deadline is past, the messages are there; and a wake-up that was not waited for is none for the next wait.
        for tick in 0..2 {
            assert_eq!(subscriber.wait_until(0).expect("works").map(|state| state.header.tick), Some(tick));
        }
        assert!(subscriber.wait_until(clock_monotonic_ns() + 1_000_000).expect("works").is_none());
    }
}

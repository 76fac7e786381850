//! The operator's word to a robot that runs by the clock: walk, or stand.

use crate::door::Outcome;
use anyhow::Context;
use bus::{Domain, DomainName, Robot};
use messages::code::{Order, Process, Reason, State};
use messages::{Header, Health, WalkOrder, topic};
use std::time::{Duration, Instant};

/// How often the answer is looked for.
const ROUND: Duration = Duration::from_millis(20);
/// How long the owner of the domain is waited for.
const OWNER_PATIENCE: Duration = Duration::from_secs(5);

#[derive(clap::Args)]
pub struct Arguments {
    /// The domain in which the robot is.
    #[arg(long, value_name = "NAME", default_value = "default")]
    domain: DomainName,

    /// How long to wait until it is done (s): a robot walks off once it stands still, and stands once a step is completed.
    #[arg(long, value_name = "SECONDS", default_value_t = 15.0)]
    patience_s: f64,
}

/// Gives the order and waits until the controller says that it is done.
pub fn give(order: Order, arguments: &Arguments) -> anyhow::Result<Outcome> {
    let patience = Duration::try_from_secs_f64(arguments.patience_s).context("--patience-s")?;
    let domain = Domain::observe(&arguments.domain, OWNER_PATIENCE)?;
    let mut health = domain.subscriber(topic::health(Process::Controller), Robot::Any, 16)?;
    let mut publisher = domain.publisher(topic::WALK_ORDER)?;
    let begun = Instant::now();
    let mut last: Option<Health> = None;
    let mut given = false;
    while begun.elapsed() < patience {
        last = health.latest()?.or(last);
        if let Some(health) = last {
            if !given {
                let header = Header::new(-1, health.header.robot_fingerprint);
                publisher.publish(&WalkOrder { header, order: order.code(), ..WalkOrder::default() })?;
                given = true;
            } else if is_done(order, &health) {
                println!("{}", said(order, &health));
                return Ok(Outcome::Solved);
            }
        }
        publisher.serve_late_joiners()?;
        std::thread::sleep(ROUND);
    }
    match last {
        None => println!("no controller has spoken in domain `{}`: nobody was told to {order}", arguments.domain),
        Some(health) => println!("told to {order}; after {} s {}", arguments.patience_s, said(order, &health)),
    }
    Ok(Outcome::NotSolved)
}

fn is_done(order: Order, health: &Health) -> bool {
    match order {
        Order::Start => health.walk_time_s >= 0.0,
        Order::Stop => Reason::from_code(health.reason) == Some(Reason::Asked),
        Order::None => true,
    }
}

/// What the controller does.
fn said(order: Order, health: &Health) -> String {
    let (walk_s, duration_s) = (health.walk_time_s, health.walk_duration_s);
    match State::from_code(health.state) {
        Some(State::Holding) => {
            let why = Reason::from_code(health.reason).unwrap_or(Reason::None);
            format!("the robot is held {walk_s:.2} s into its walk ({why})")
        }
        _ if walk_s < 0.0 && order == Order::Stop => "the robot stands and will not walk off".to_string(),
        _ if walk_s < 0.0 => "the robot stands, not yet still enough to walk".to_string(),
        _ if walk_s > duration_s => "the robot stands at the end of its walk".to_string(),
        _ => format!("the robot walks, {walk_s:.2} of {duration_s:.1} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_controller_says_decides_when_an_order_is_done() {
        let mut health = Health::new(Process::Controller, State::Running, Reason::None);
        (health.walk_time_s, health.walk_duration_s) = (-0.005, 6.0);
        assert!(!is_done(Order::Start, &health) && !is_done(Order::Stop, &health));
        assert_eq!(said(Order::Start, &health), "the robot stands, not yet still enough to walk");
        health.walk_time_s = 1.25;
        assert!(is_done(Order::Start, &health) && !is_done(Order::Stop, &health));
        assert_eq!(said(Order::Start, &health), "the robot walks, 1.25 of 6.0 s");
        (health.state, health.reason) = (State::Holding.code(), Reason::InputMissing.code());
        assert!(!is_done(Order::Stop, &health), "it is held for another reason");
        health.reason = Reason::Asked.code();
        assert!(is_done(Order::Stop, &health));
        assert_eq!(said(Order::Stop, &health), "the robot is held 1.25 s into its walk (asked to stop)");
    }
}

//! What is wrong with the states of a driver, from the states alone.

use messages::{CONTROL_PERIOD_NS, MAX_JOINTS, Plain, RobotCommand, RobotState};
use robot::Robot;
use std::collections::BTreeMap;

/// How far a quaternion's length may be from one: what single precision leaves of it.
const UNIT_TOLERANCE: f64 = 1e-5;
/// Beyond its limits a joint may measure as much: calibration and backlash (rad).
const JOINT_TOLERANCE_RAD: f64 = 0.05;
/// Faster than any joint of a humanoid (rad/s).
const JOINT_RATE_MAX_RAD_PER_S: f64 = 50.0;
/// Less or more than a robot feels that is not falling or colliding (m/s^2); gravity is 9.81.
const ACCELERATION_M_PER_S2: std::ops::RangeInclusive<f64> = 2.0..=60.0;
/// More than a foot of a robot of a hundred kilograms carries in a hard step (N).
const FORCE_MAX_N: f64 = 5000.0;
/// A sole does not pull: less than a sensor's offset (N).
const PULL_MAX_N: f64 = 50.0;
/// A stamp this much older than its arrival: nobody uses such a state any more (ns).
const AGE_MAX_NS: u64 = CONTROL_PERIOD_NS;
/// A command that answers a state comes within so many ticks of it, if anybody answers at all.
const ANSWERED_TICKS: i64 = 10;

/// What the robot's folder says of its joints.
#[derive(Debug, Clone, Default)]
pub(super) struct Limits {
    fingerprint: u64,
    names: Vec<String>,
    /// Lower and upper (rad), in the order of the interface; infinite where the URDF has none.
    positions_rad: Vec<[f64; 2]>,
}

impl Limits {
    pub(super) fn of(robot: &Robot) -> anyhow::Result<Self> {
        let names = robot.description.joints.clone();
        let model = multibody::Model::from_urdf(&robot.urdf, &multibody::ModelOptions::default())?;
        let limits = |name: &String| {
            let joint = model.joints().iter().find(|joint| &joint.name == name && joint.limits.given);
            joint.map_or([f64::NEG_INFINITY, f64::INFINITY], |joint| [joint.limits.lower, joint.limits.upper])
        };
        let positions_rad = names.iter().map(limits).collect();
        Ok(Self { fingerprint: robot.fingerprint, names, positions_rad })
    }
}

/// Something that is wrong: how often, and when first.
#[derive(Debug, Clone, PartialEq)]
struct Finding {
    count: u64,
    first: String,
}

/// Gathers what is wrong.
#[derive(Debug, Default)]
pub(super) struct Manners {
    limits: Limits,
    states: u64,
    previous: Option<RobotState>,
    by_the_clock: bool,
    slips: u64,
    newest_command: Option<i64>,
    findings: BTreeMap<&'static str, Finding>,
    not_seen: u64,
}

impl Manners {
    pub(super) fn new(limits: Limits) -> Self {
        Self { limits, ..Self::default() }
    }

    /// How many states were looked at.
    pub(super) fn states(&self) -> u64 {
        self.states
    }

    /// A command of the controller.
    pub(super) fn command(&mut self, command: &RobotCommand) {
        self.newest_command = self.newest_command.max(Some(command.header.tick));
    }

    /// The driver's next state, and when it arrived (ns).
    pub(super) fn state(&mut self, state: &RobotState, now_ns: u64) {
        self.states += 1;
        self.order(state);
        self.stamps(state, now_ns);
        self.ranges(state);
        if let Some(newest) = self.newest_command
            && newest > state.header.tick + 1
        {
            self.wrong("order", state, format!("commands answer tick {newest} already"));
        }
        self.previous = Some(*state);
    }

    /// So many states did not reach us; they are nothing that the driver did.
    pub(super) fn not_seen(&mut self, lost: u64) {
        self.not_seen = lost;
    }

    /// Whether a living process holds the driver's place; messages of others on its topic; how often it began anew.
    pub(super) fn place(&mut self, holds_place: bool, strangers: u64, restarts: u64) {
        let mut told = |count: u64, what: &str| {
            if count > 0 {
                self.findings.insert("place", Finding { count, first: what.to_string() });
            }
        };
        told(
            u64::from(!holds_place),
            "no living process holds the simulator's place in the domain: take its lock (soleus-launch domain)",
        );
        told(strangers, "a second publisher speaks on robot/state while the first one lives");
        told(restarts, "the publisher of robot/state began anew while it was looked at");
    }

    fn wrong(&mut self, what: &'static str, state: &RobotState, how: String) {
        let first = format!("tick {}: {how}", state.header.tick);
        self.findings.entry(what).and_modify(|finding| finding.count += 1).or_insert(Finding { count: 1, first });
    }

    fn order(&mut self, state: &RobotState) {
        let Some(previous) = self.previous else {
            if state.header.tick < -1 {
                self.wrong("order", state, "ticks begin at -1 (not placed yet) or 0".to_string());
            }
            return;
        };
        let (before, now) = (previous.header.tick, state.header.tick);
        let sequence = state.header.sequence.wrapping_sub(previous.header.sequence);
        if now <= before {
            self.wrong("order", state, format!("came after tick {before}"));
        } else if (now - before) as u64 != sequence {
            // What we did not hear has its numbers in both, so the difference is the driver's.
            let skipped = (now - before) as u64;
            self.wrong("skips", state, format!("{skipped} ticks on with {sequence} messages since tick {before}"));
        }
    }

    fn stamps(&mut self, state: &RobotState, now_ns: u64) {
        let stamp_ns = state.header.clock_monotonic_ns;
        if stamp_ns == 0 {
            if self.by_the_clock {
                self.wrong("stamps", state, "no stamp, though there was one before".to_string());
            }
            return;
        }
        let began = !self.by_the_clock;
        self.by_the_clock = true;
        if stamp_ns > now_ns {
            let ahead_us = (stamp_ns - now_ns) / 1000;
            self.wrong("stamps", state, format!("{ahead_us} us in the future of CLOCK_MONOTONIC: another clock?"));
        } else if now_ns - stamp_ns > AGE_MAX_NS {
            let age_ms = (now_ns - stamp_ns) as f64 * 1e-6;
            self.wrong("stamps", state, format!("{age_ms:.2} ms old when it came"));
        }
        let Some(previous) = self.previous.filter(|previous| !began && previous.header.tick < state.header.tick) else {
            return;
        };
        let ticks = (state.header.tick - previous.header.tick) as u64;
        let passed_ns = stamp_ns.saturating_sub(previous.header.clock_monotonic_ns);
        if passed_ns < ticks * CONTROL_PERIOD_NS {
            let ms = passed_ns as f64 * 1e-6;
            self.wrong(
                "stamps",
                state,
                format!("{ms:.3} ms after the stamp of {ticks} ticks before: stamp the scheduled time"),
            );
        } else if passed_ns > ticks * CONTROL_PERIOD_NS {
            // A grid that moves by whole stalls slips; one that wanders by a little at every tick stamps when it woke.
            self.slips += 1;
        }
    }

    fn ranges(&mut self, state: &RobotState) {
        if state.header.robot_fingerprint != self.limits.fingerprint {
            let (found, expected) = (state.header.robot_fingerprint, self.limits.fingerprint);
            self.wrong("robot", state, format!("fingerprint {found:016x}, that of --robot is {expected:016x}"));
        }
        if !state.all_finite() {
            self.wrong("ranges", state, "a number that is none".to_string());
            return;
        }
        let count = self.limits.names.len();
        if state.joint_count as usize != count {
            self.wrong("ranges", state, format!("joint_count {}, the robot has {count} joints", state.joint_count));
        }
        if state.joint_position_rad[count.min(MAX_JOINTS)..].iter().any(|rest| *rest != 0.0) {
            self.wrong("ranges", state, "array elements beyond joint_count are not zero".to_string());
        }
        for joint in 0..count.min(MAX_JOINTS) {
            let [lower, upper] = self.limits.positions_rad[joint];
            let (position, rate) = (state.joint_position_rad[joint], state.joint_velocity_rad_per_s[joint]);
            let name = self.limits.names[joint].clone();
            if position < lower - JOINT_TOLERANCE_RAD || position > upper + JOINT_TOLERANCE_RAD {
                self.wrong(
                    "ranges",
                    state,
                    format!(
                        "{name} at {position:.3} rad, its limits are {lower:.3} and {upper:.3}: order, sign, degrees?"
                    ),
                );
            } else if rate.abs() > JOINT_RATE_MAX_RAD_PER_S {
                self.wrong("ranges", state, format!("{name} at {rate:.1} rad/s"));
            }
        }
        let norm = |numbers: &[f64]| numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
        let length = norm(&state.imu_orientation_xyzw);
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            self.wrong("ranges", state, format!("imu_orientation_xyzw has length {length:.6}"));
        }
        let acceleration = norm(&state.accelerometer_m_per_s2);
        if !ACCELERATION_M_PER_S2.contains(&acceleration) {
            let what = "acceleration minus gravity: about 9.8 at rest, upwards";
            self.wrong("ranges", state, format!("accelerometer {acceleration:.2} m/s^2 ({what})"));
        }
        for (wrench, side) in state.foot_wrench_n_nm.iter().zip(["left", "right"]) {
            let force = norm(&wrench[..3]);
            if force > FORCE_MAX_N {
                self.wrong("ranges", state, format!("{side} foot: {force:.0} N"));
            } else if wrench[2] < -PULL_MAX_N {
                self.wrong(
                    "ranges",
                    state,
                    format!("{side} foot pulls with {:.0} N: the force of the sole on the foot is upwards", -wrench[2]),
                );
            }
        }
        if state.fault_bits != 0 {
            self.wrong("faults", state, format!("fault bits {:b}", state.fault_bits));
        }
    }

    /// The lines, and whether nothing is wrong.
    pub(super) fn verdict(&mut self) -> (String, bool) {
        if self.states == 0 {
            let first = "no state came: does the driver run, in this domain, and does it wait for others?".to_string();
            self.findings.insert("silence", Finding { count: 1, first });
        }
        // Every tick later than it should be is no stall.
        if self.states > 10 && self.slips > self.states / 2 {
            let first = format!(
                "{} of {} periods are longer than 5 ms: stamp the scheduled time, not the time of waking",
                self.slips, self.states
            );
            self.findings.entry("stamps").or_insert(Finding { count: self.slips, first });
        }
        let last = self.previous.map_or(-1, |state| state.header.tick);
        if self.newest_command.is_some_and(|newest| newest + ANSWERED_TICKS < last) {
            let first = "nobody answers any more: is the controller alive?".to_string();
            self.findings.insert("answers", Finding { count: 1, first });
        }
        let pace = if self.by_the_clock { "by the clock" } else { "in lock-step" };
        let mut text = format!("{} states {pace}, {} slips of the grid", self.states, self.slips);
        if self.not_seen > 0 {
            text += &format!("; {} were not seen by this check, which is no fault of the driver", self.not_seen);
        }
        text.push('\n');
        for what in ["silence", "place", "robot", "order", "skips", "stamps", "ranges", "faults", "answers"] {
            match self.findings.get(what) {
                Some(Finding { count, first }) => text += &format!("{what:<8} WRONG, {count} times; {first}\n"),
                None => text += &format!("{what:<8} right\n"),
            }
        }
        (text, self.findings.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::Header;

    const T_NS: u64 = 1_000_000_000;

    fn manners() -> Manners {
        let names = vec!["hip".to_string(), "knee".to_string()];
        Manners::new(Limits { fingerprint: 7, names, positions_rad: vec![[-1.0, 1.0], [0.0, 2.0]] })
    }

    fn state(tick: i64) -> RobotState {
        let clock_monotonic_ns = T_NS + tick as u64 * CONTROL_PERIOD_NS;
        let header = Header { sequence: tick as u64, clock_monotonic_ns, ..Header::new(tick, 7) };
        let mut state = RobotState { header, joint_count: 2, ..RobotState::default() };
        state.imu_orientation_xyzw[3] = 1.0;
        state.accelerometer_m_per_s2[2] = 9.81;
        state
    }

    /// What is said of twenty states, one of which is changed.
    fn said(change: impl Fn(&mut RobotState)) -> (String, bool) {
        let mut manners = manners();
        for tick in 0..20 {
            let mut state = state(tick);
            if tick == 10 {
                change(&mut state);
            }
            manners.state(&state, T_NS + tick as u64 * CONTROL_PERIOD_NS + 60_000);
        }
        manners.place(true, 0, 0);
        manners.verdict()
    }

    #[test]
    fn a_driver_with_manners_has_nothing_wrong() {
        let (text, good) = said(|_| {});
        assert!(good && text.starts_with("20 states by the clock, 0 slips") && !text.contains("WRONG"), "{text}");
    }

    #[test]
    fn each_fault_is_found_and_named_with_its_tick() {
        type Change = fn(&mut RobotState);
        let faults: [(Change, &str); 14] = [
            (|state| state.header.tick = 9, "order    WRONG, 1 times; tick 9: came after tick 9"),
            (|state| state.header.tick = 12, "skips    WRONG"),
            (|state| state.header.clock_monotonic_ns += 3_000_000_000, "in the future of CLOCK_MONOTONIC"),
            (|state| state.header.clock_monotonic_ns -= 900_000_000, "ms old when it came"),
            (|state| state.header.clock_monotonic_ns -= 1_000, "stamp the scheduled time"),
            (|state| state.header.clock_monotonic_ns = 0, "no stamp, though there was one before"),
            (|state| state.header.robot_fingerprint = 8, "robot    WRONG"),
            (|state| state.joint_position_rad[1] = 90.0, "knee at 90.000 rad, its limits are 0.000 and 2.000"),
            (|state| state.joint_velocity_rad_per_s[0] = -80.0, "hip at -80.0 rad/s"),
            (|state| state.joint_count = 34, "joint_count 34, the robot has 2 joints"),
            (|state| state.joint_position_rad[5] = 0.1, "beyond joint_count are not zero"),
            (|state| state.imu_orientation_xyzw = [0.0; 4], "has length 0.0"),
            (|state| state.foot_wrench_n_nm[1][2] = -300.0, "right foot pulls with 300 N"),
            (|state| state.gyro_rad_per_s[0] = f64::NAN, "a number that is none"),
        ];
        for (change, told) in faults {
            let (text, good) = said(change);
            assert!(!good && text.contains(told), "{told}: {text}");
        }
        let (text, _) = said(|state| state.accelerometer_m_per_s2 = [0.0; 3]);
        assert!(text.contains("tick 10: accelerometer 0.00 m/s^2"), "{text}");
    }

    #[test]
    fn a_stall_slips_and_a_grid_of_wake_up_times_is_no_grid() {
        let mut stalled = manners();
        let mut wandering = manners();
        for tick in 0..20_i64 {
            let due_ns = T_NS + tick as u64 * CONTROL_PERIOD_NS;
            let mut state = state(tick);
            state.header.clock_monotonic_ns = due_ns + if tick >= 10 { 9_000_000 } else { 0 };
            stalled.state(&state, state.header.clock_monotonic_ns + 60_000);
            state.header.clock_monotonic_ns = due_ns + tick as u64 * 40_000;
            wandering.state(&state, state.header.clock_monotonic_ns + 60_000);
        }
        for manners in [&mut stalled, &mut wandering] {
            manners.place(true, 0, 0);
        }
        let (text, good) = stalled.verdict();
        assert!(good && text.contains("1 slips of the grid"), "{text}");
        let (text, good) = wandering.verdict();
        assert!(!good && text.contains("stamp the scheduled time, not the time of waking"), "{text}");
    }

    #[test]
    fn what_we_did_not_hear_is_no_skip() {
        let mut manners = manners();
        for tick in [0, 1, 5, 6] {
            manners.state(&state(tick), T_NS + tick as u64 * CONTROL_PERIOD_NS + 60_000);
        }
        manners.not_seen(3);
        manners.place(true, 0, 0);
        let (text, good) = manners.verdict();
        assert!(good && text.contains("3 were not seen by this check"), "{text}");
    }

    #[test]
    fn silence_a_place_that_is_not_held_and_a_second_publisher_are_told() {
        let mut silent = manners();
        silent.place(false, 0, 0);
        let (text, good) = silent.verdict();
        assert!(!good && text.contains("no state came") && text.contains("holds the simulator's place"), "{text}");
        let mut two = manners();
        two.state(&state(0), T_NS);
        two.place(true, 4, 0);
        assert!(two.verdict().0.contains("a second publisher speaks"), "{}", two.verdict().0);
    }

    #[test]
    fn commands_of_the_future_and_commands_that_stay_away_are_told() {
        let command = |tick| RobotCommand { header: Header::new(tick, 7), ..RobotCommand::default() };
        let mut manners = manners();
        manners.command(&command(90));
        manners.state(&state(3), T_NS + 4 * CONTROL_PERIOD_NS);
        assert!(manners.verdict().0.contains("commands answer tick 90 already"));
        let mut unanswered = Manners::new(manners.limits.clone());
        unanswered.command(&command(2));
        unanswered.state(&state(19), T_NS + 20 * CONTROL_PERIOD_NS);
        assert!(unanswered.verdict().0.contains("nobody answers any more"));
    }
}

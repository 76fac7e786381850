//! The figures of a walk.

use crate::limbs::JointTicks;
use crate::{Estimates, Verdict};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What a walk was like. Figures that need the simulator's truth are `None` in recordings of a real robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WalkFigures {
    /// How it is judged.
    pub verdict: Verdict,
    /// Why, in a sentence.
    pub verdict_reason: String,
    /// How far the middle of the feet has moved along the ground, as the crow flies (m).
    pub distance_m: Option<f64>,
    /// The same as the pattern has it (m); `None` without a pattern.
    pub planned_distance_m: Option<f64>,
    /// How far the body has turned to the left (rad), also beyond half a round.
    pub turned_rad: Option<f64>,
    /// Walk time that was reached (s), at most the pattern's.
    pub walked_s: f64,
    /// Duration of the pattern (s); zero: none came.
    pub walk_duration_s: f64,
    /// Whether the robot fell.
    pub fallen: Option<bool>,
    /// When it fell, in walk time (s).
    pub fall_time_s: Option<f64>,
    /// Why it counts as fallen.
    pub fall_cause: Option<String>,
    /// Root mean square of the horizontal distance between the centre of mass and its plan (m).
    pub com_error_rms_m: Option<f64>,
    /// The largest (m).
    pub com_error_max_m: Option<f64>,
    /// Root mean square of the distance between the zero-moment point and its plan (m).
    pub zmp_error_rms_m: Option<f64>,
    /// The largest (m).
    pub zmp_error_max_m: Option<f64>,
    /// When it was the largest, in walk time (s).
    pub zmp_error_max_time_s: Option<f64>,
    /// The largest that counts as the planned walk (m).
    pub zmp_error_allowed_m: f64,
    /// Root mean square of the distance between the computed zero-moment point and the pattern's (m).
    pub zmp_body_to_cart_rms_m: Option<f64>,
    /// The largest (m).
    pub zmp_body_to_cart_max_m: Option<f64>,
    /// Largest angle between the base's vertical axis and its plan (rad).
    pub base_tilt_max_rad: Option<f64>,
    /// Ticks that the errors are over.
    pub ticks_compared: u64,
    /// Ticks of the walk that no command was for.
    pub ticks_without_plan: u64,
    /// Work of the servos (J).
    pub servo_work_j: Option<f64>,
    /// Joints at or beyond the limits of their position, most often first.
    pub joints_at_limit: Vec<JointTicks>,
    /// Drives at the limit of their torque, most often first.
    pub drives_saturated: Vec<JointTicks>,
    /// Joints that the controller's step held back at a limit of speed or position, most often first.
    #[serde(default)]
    pub joints_held_back: Vec<JointTicks>,
    /// Joints whose torque it held at its limit, most often first.
    #[serde(default)]
    pub torques_held_back: Vec<JointTicks>,
    /// Control periods in which the plant did not reach its tolerance.
    pub periods_unconverged: u64,
    /// Commands that no robot could follow.
    pub commands_refused: u64,
    /// What the estimator's solver did.
    pub sole_estimates: Estimates,
    /// How the controller's steps were found; `None` if it made none.
    pub controller: Option<ControllerSteps>,
    /// How far the controller's model was from what it was drawn towards; `None` in open loop.
    pub feedback: Option<Feedback>,
    /// Times of each process, by its name.
    pub processes: BTreeMap<String, ProcessTimes>,
    /// Simulated time over real time.
    pub times_real_time: Option<f64>,
    /// Messages that the recorder could not store.
    pub messages_not_recorded: u64,
}

/// How the controller's steps were found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControllerSteps {
    /// All limits held.
    pub solved: u64,
    /// Limits were widened.
    pub relaxed: u64,
    /// No usable solution.
    pub held: u64,
    /// Those of all that the backup solver answered.
    pub by_backup: u64,
    /// The worst limit that gave way: kind; empty if none did.
    pub worst_limit: String,
    /// Which of its kind.
    pub worst_limit_index: u32,
    /// By how much, in its SI unit.
    pub worst_limit_amount: f64,
    /// Largest distance between a measured joint and its reference (rad).
    pub joint_distance_max_rad: f64,
    /// Robot states that were not used.
    pub states_refused: u64,
}

/// Feedback over a walk.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Feedback {
    /// Largest distance of the observed base from that of the model (m).
    pub base_distance_max_m: f64,
    /// The same of its orientation (rad).
    pub base_distance_max_rad: f64,
    /// Measurements that were not used.
    pub measurements_refused: u64,
}

/// Times of a process.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ProcessTimes {
    /// Cycles of the process.
    pub cycles: u64,
    /// Mean of their computing times (ms).
    pub mean_ms: f64,
    /// Median of those that are recorded (ms); `None` without a recording.
    pub median_ms: Option<f64>,
    /// What 99 of 100 recorded ones do not exceed (ms).
    pub p99_ms: Option<f64>,
    /// The longest (ms).
    pub max_ms: f64,
    /// Recorded cycles that computed longer than a control period.
    pub over_period: u64,
    /// Deadlines missed, in real time.
    pub misses: u64,
    /// Inputs that were missing or came too late.
    pub late: u64,
    /// How it kept the clock; `None` in lock-step.
    #[serde(default)]
    pub clock: Option<ClockTimes>,
}

/// How a process kept the clock, against the ticks' times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ClockTimes {
    /// From the tick's time to when its thread ran.
    pub woke: Lateness,
    /// To when its inputs were there.
    pub inputs: Lateness,
    /// To when its answer was out.
    pub published: Lateness,
    /// Time of the processor in a cycle.
    pub processor: Lateness,
    /// Wake-ups that were late.
    pub late_wakes: u64,
    /// Answers that were late.
    pub late_answers: u64,
    /// How often it moved the clock grid.
    pub slips: u64,
    /// Minor and major page faults of its thread since the clock began.
    pub page_faults: [u64; 2],
    /// Priority under SCHED_FIFO; zero: ordinary.
    pub priority: u32,
    /// The only core it may run on.
    pub core: Option<u32>,
    /// Whether its memory is locked.
    pub memory_locked: bool,
}

/// Percentiles of a time (ns); `None` where the cycles are too few.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Lateness {
    /// Cycles.
    pub count: u64,
    /// Median.
    pub p50_ns: Option<u64>,
    /// What 99 of 100 do not exceed.
    pub p99_ns: Option<u64>,
    /// What 999 of 1000 do not exceed.
    pub p999_ns: Option<u64>,
    /// The largest.
    pub max_ns: u64,
}

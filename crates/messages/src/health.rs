//! How a process is doing.

use crate::Header;
use crate::code::{Process, Reason, State};
use crate::plain::plain_struct;
use iceoryx2::prelude::ZeroCopySend;

plain_struct! {
    /// What the controller counts; all zero in the health of other processes.
    "soleus.ControllerFiguresV1", 112 bytes, ControllerFigures {
        /// Steps in which all limits held, so far.
        steps_solved: u64,
        /// Steps whose limits had to be widened, so far.
        steps_relaxed: u64,
        /// Steps without a usable solution, so far.
        steps_held: u64,
        /// Steps that the backup solver answered, so far.
        steps_by_backup: u64,
        /// Robot states that were not used, so far.
        states_refused: u64,
        /// Measurements that were not used for feedback, so far.
        measurements_refused: u64,
        /// Largest distance of a joint from its reference.
        joint_distance_max_rad: f64,
        /// Distance of the model's centre of mass from its plan.
        com_distance_m: f64,
        /// Smallest distance of a collision pair; infinite: none is near.
        collision_distance_m: f64,
        /// The worst limit that gave way so far: [`crate::code::Limit`].
        worst_limit: u32,
        /// Which of its kind: foot, joint of the model, collision pair.
        worst_limit_index: u32,
        /// By how much, in the unit of [`crate::code::Limit`].
        worst_limit_amount: f64,
        /// Distance of the observed base from that of the model; feedback only.
        base_distance_m: f64,
        /// The same of its orientation.
        base_distance_rad: f64,
        /// Distance between where the two standing feet place the base; feedback only.
        feet_disagreement_m: f64,
    }
}

plain_struct! {
    /// What the simulator keeps; all zero in the health of other processes.
    "soleus.SimulatorFiguresV1", 48 bytes, SimulatorFigures {
        /// How far the middle of the feet has moved along the ground.
        distance_m: f64,
        /// 1 once the robot has fallen.
        fallen: u32,
        /// Why it counts as fallen: [`crate::code::Fall`].
        fall_cause: u32,
        /// Control periods in which integration or contact did not reach its tolerance, so far.
        periods_unconverged: u64,
        /// Commands that no robot could follow, so far.
        commands_refused: u64,
        /// Joints at or beyond the limits of their position at any tick so far: bit *i* is joint *i*.
        joints_at_limit_bits: u64,
        /// Drives at the limit of their torque at any tick so far: bit *i* is joint *i*.
        drives_saturated_bits: u64,
    }
}

plain_struct! {
    /// What the recorder keeps; all zero in the health of other processes.
    "soleus.RecorderFiguresV1", 8 bytes, RecorderFigures {
        /// Last tick that is safely stored; -1 before the first.
        stored_tick: i64,
    }
}

plain_struct! {
    /// Times of many cycles (HdrHistogram, two digits). A percentile is zero while fewer than ten samples lie beyond it.
    "soleus.LatenessFiguresV1", 40 bytes, LatenessFigures {
        /// Number of cycles.
        count: u64,
        /// Median.
        p50_ns: u64,
        /// What 99 of 100 do not exceed.
        p99_ns: u64,
        /// What 999 of 1000 do not exceed.
        p999_ns: u64,
        /// The largest.
        max_ns: u64,
    }
}

plain_struct! {
    /// What a process's cycles so far were like, against the tick's time; brought up to date once a second.
    "soleus.TimingFiguresV1", 160 bytes, TimingFigures {
        /// From the tick's time to when the thread ran, in real time.
        woke: LatenessFigures,
        /// From the tick's time to when all inputs were there, in real time.
        inputs: LatenessFigures,
        /// From the tick's time to when the answer was published, in real time.
        published: LatenessFigures,
        /// Time of the processor that the thread used in a cycle.
        processor: LatenessFigures,
    }
}

plain_struct! {
    /// State, timing and solver figures of a process; the only message that holds wall-clock measurements.
    "soleus.HealthV2", 560 bytes, Health {
        /// Header; the tick is the last one the process has finished, -1 before the first.
        header: Header,
        /// Who: [`crate::code::Process`].
        process: u32,
        /// [`crate::code::State`].
        state: u32,
        /// Why it is in that state: [`crate::code::Reason`].
        reason: u32,
        /// Operating-system process id.
        process_id: u32,
        /// Time from the start of the cycle before to the start of this one.
        cycle_time_ns: u64,
        /// Time spent computing in this cycle, without waiting.
        compute_time_ns: u64,
        /// Longest computing time so far.
        compute_time_max_ns: u64,
        /// Sum of all computing times so far: divided by `cycles` their mean.
        compute_time_sum_ns: u64,
        /// Time of the processor that the thread used in this cycle; zero where it is not measured.
        processor_time_ns: u64,
        /// From the tick's time to the start of this cycle, in real time.
        wake_lateness_ns: u64,
        /// From the tick's time to when all inputs of this cycle were there, in real time.
        inputs_lateness_ns: u64,
        /// From the tick's time to when the answer was published, in real time.
        publish_lateness_ns: u64,
        /// Cycles so far.
        cycles: u64,
        /// Cycles that ended more than a control period after the tick's time, in real time.
        misses: u64,
        /// Cycles that began too late, in real time.
        late_wakes: u64,
        /// Answers that were published after their deadline, in real time.
        late_answers: u64,
        /// Inputs that were missing or came too late.
        late: u64,
        /// Messages lost (recorder: not stored).
        lost: u64,
        /// Outcome of the solver in this cycle: [`crate::code::Outcome`].
        solver_status: u32,
        /// Its iterations.
        solver_iterations: u32,
        /// Its residual.
        solver_residual: f64,
        /// Walk time; negative before time zero.
        walk_time_s: f64,
        /// Duration of the pattern; zero while unknown.
        walk_duration_s: f64,
        /// 1 if the process runs under a real-time scheduling policy.
        real_time_policy: u32,
        /// Its priority under SCHED_FIFO; zero under the ordinary policy.
        real_time_priority: u32,
        /// The only core it may run on, plus one; zero: any.
        core_plus_one: u32,
        /// 1 if all its memory is locked.
        memory_locked: u32,
        /// Minor page faults of the thread since its first tick with a time.
        minor_faults: u64,
        /// Major page faults of the thread since then.
        major_faults: u64,
        /// How often the clock grid was moved by the process that owns it, in real time.
        clock_slips: u64,
        /// The cycles so far.
        timing: TimingFigures,
        /// The controller's own.
        controller: ControllerFigures,
        /// The simulator's own.
        simulator: SimulatorFigures,
        /// The recorder's own.
        recorder: RecorderFigures,
    }
}

impl Health {
    /// Health of a process in a state.
    pub fn new(process: Process, state: State, reason: Reason) -> Self {
        Self { process: process.code(), state: state.code(), reason: reason.code(), ..Self::default() }
    }
}

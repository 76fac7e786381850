//! How a process is doing.

use crate::Header;
use crate::code::{Process, Reason, State};
use crate::plain::plain_struct;
use iceoryx2::prelude::ZeroCopySend;

plain_struct! {
    /// State, timing and solver figures of a process; the only message that holds wall-clock measurements.
    "soleus.HealthV1", 296 bytes, Health {
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
        /// Cycles so far.
        cycles: u64,
        /// Cycles that took longer than the control period, in real time.
        misses: u64,
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
        /// Distance walked (simulator only): how far the middle of the feet has moved along the ground.
        distance_m: f64,
        /// 1 once the robot has fallen (simulator only).
        fallen: u32,
        /// 1 if the process runs under a real-time scheduling policy.
        real_time_policy: u32,
        /// Last tick that is safely stored (recorder only).
        stored_tick: i64,
        /// Further figures, by process:
        ///
        /// | process | values |
        /// |---|---|
        /// | controller | 0 steps relaxed, 1 steps held, 2 states refused, 3 largest distance of a joint from its reference (rad), 4 distance of the model's centre of mass from its plan (m), 5 smallest distance of a collision pair (m, infinite: none near), 6 steps solved, 7 worst limit that gave way ([`crate::code::Limit`]), 8 which of its kind, 9 by how much, 10 steps that the reserve solver answered, 11 distance of the observed base from the own one (m), 12 the same of its orientation (rad), 13 distance between where the two standing feet place the base (m), 14 measurements not used for feedback (11 to 14 in feedback only) |
        /// | simulator | 0, 1 distance of the centre of mass from its plan (m; root mean square, largest), 2, 3 the same of the zero-moment point, 4 largest tilt of the base (rad), 5 control periods not solved to tolerance, 6 cause of the fall ([`crate::code::Fall`]), 7 commands refused |
        /// | the others | none |
        values: [f64; 16],
    }
}

impl Health {
    /// Health of a process in a state.
    pub fn new(process: Process, state: State, reason: Reason) -> Self {
        Self { process: process.code(), state: state.code(), reason: reason.code(), ..Self::default() }
    }
}

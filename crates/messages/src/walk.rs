//! The walking pattern and its start.

use crate::Header;
use crate::plain::plain_struct;
use iceoryx2::prelude::ZeroCopySend;

plain_struct! {
    /// What the phases of a walking pattern have in common. Travels as the user header of the slice of [`PatternPhase`]s.
    "soleus.PatternHeaderV1", 192 bytes, PatternHeader {
        /// Header; the tick is that of publication and has no meaning for the walk.
        header: Header,
        /// Hash of all other fields and phases: the pattern's identity in [`crate::WalkStart`], deformations and commands.
        pattern_hash: u64,
        /// Version of the meaning of the phases' fields.
        version: u32,
        /// Number of phases in the slice, at most [`crate::MAX_PHASES`].
        phase_count: u32,
        /// Mass the pattern was planned with.
        mass_kg: f64,
        /// Gravity.
        gravity_m_per_s2: f64,
        /// Constant height of the centre of mass above the ground.
        com_height_m: f64,
        /// Pendulum frequency sqrt(g / z).
        omega_rad_per_s: f64,
        /// Height of the ankle above the ground with an undeformed sole.
        ankle_height_m: f64,
        /// Duration of the whole pattern.
        duration_s: f64,
        /// Further numbers of the pattern, in the order of `convert.rs` of the planner; unused ones are zero.
        values: [f64; 12],
    }
}

plain_struct! {
    /// One phase of a walking pattern: numbers and codes in the order in which `convert.rs` of the planner lays them down.
    "soleus.PatternPhaseV1", 1088 bytes, PatternPhase {
        /// Real numbers.
        values: [f64; 128],
        /// Codes and counts.
        codes: [u32; 16],
    }
}

plain_struct! {
    /// Time zero of the walk, published once by the controller.
    "soleus.WalkStartV1", 48 bytes, WalkStart {
        /// Header; the tick is that at which the decision fell.
        header: Header,
        /// The pattern to be walked.
        pattern_hash: u64,
        /// Walk time = (tick - tick_zero) x control period; before it the pattern is held at its start.
        tick_zero: i64,
    }
}

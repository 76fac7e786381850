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
        /// Ankle in the sole frame, x and y (m), left and right foot.
        ankle_in_sole_m: [[f64; 2]; 2],
        /// Always zero.
        reserved: [f64; 8],
    }
}

plain_struct! {
    /// What one foot does during a phase.
    "soleus.PatternFootV1", 88 bytes, PatternFoot {
        /// Under the ankle, where it stands or will land: x, y (m), yaw (rad).
        ankle_foothold: [f64; 3],
        /// Walk time at which it came, or will come, into contact there.
        contact_since_s: f64,
        /// 1 while the foot is in the air, else 0 and the fields below are zero.
        in_the_air: u32,
        /// Always zero.
        reserved: u32,
        /// Under the ankle, where it left: x, y (m), yaw (rad).
        swing_from_foothold: [f64; 3],
        /// Walk time of take-off.
        swing_start_s: f64,
        /// Walk time of landing.
        swing_end_s: f64,
        /// Height of the highest point above the higher of the two ends.
        swing_apex_m: f64,
    }
}

plain_struct! {
    /// One phase of a walking pattern; the letters are those of the crate `pattern`. Polynomials are ascending coefficients
    /// in powers of the phase's local time (s).
    "soleus.PatternPhaseV2", 1104 bytes, PatternPhase {
        /// Start in walk time.
        start_s: f64,
        /// Duration.
        duration_s: f64,
        /// [`crate::code::PhaseKind`].
        kind: u32,
        /// The swing it carries out, prepares or follows, counted from 1.
        step: u32,
        /// Foot 1: 0 left, 1 right.
        foot_1: u32,
        /// Power of the local time cancelled in `share` and `excess`: 0 or 3.
        cancelled_power: u32,
        /// ZMP, x and y.
        zmp: [[f64; 6]; 2],
        /// Polynomial part of the COM, x and y.
        com_polynomial: [[f64; 6]; 2],
        /// Decaying exponential part of the COM (m), x and y.
        com_decaying: [f64; 2],
        /// Growing exponential part of the COM (m), x and y.
        com_growing: [f64; 2],
        /// Load share of foot 2, divided by the cancelled power.
        share: [f64; 6],
        /// ZMP of foot 1 minus ZMP, divided by the cancelled power, x and y.
        excess: [[f64; 6]; 2],
        /// ZMP of foot 1, x and y.
        zmp_1: [[f64; 6]; 2],
        /// The body's own ZMP from the planned one at equidistant knots: value (m), rate, acceleration; x and y.
        zmp_shift_m: [[[f64; 3]; 9]; 2],
        /// Left and right foot.
        feet: [PatternFoot; 2],
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

plain_struct! {
    /// What an operator wants; the controller obeys.
    "soleus.WalkOrderV1", 40 bytes, WalkOrder {
        /// Header; who gives an order knows no tick: -1.
        header: Header,
        /// [`crate::code::Order`].
        order: u32,
        /// Always zero.
        reserved: u32,
    }
}

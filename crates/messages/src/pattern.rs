//! The walking pattern to and from its message.

use pattern::{
    ComSolution, FootPhase, Foothold, Load, PATTERN_VERSION, Phase, PhaseKind, Quintic, Side, Swing, WalkPattern,
    ZmpShift,
};

use std::path::PathBuf;

use crate::{Header, MAX_PHASES, PatternFoot, PatternHeader, PatternPhase, code};

/// Why a pattern message cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PatternRefused {
    /// More phases than consumers have memory for: walk in parts.
    #[error("the pattern has {found} phases, at most {MAX_PHASES} are possible: plan fewer steps")]
    TooLong {
        /// Number of phases.
        found: usize,
    },
    /// Header and slice disagree.
    #[error("the pattern's header announces {announced} phases, {found} came")]
    Torn {
        /// In the header.
        announced: usize,
        /// In the slice.
        found: usize,
    },
    /// A code has no meaning here: the sender is another version.
    #[error("phase {phase}: {field} = {value} has no meaning")]
    Code {
        /// Index of the phase.
        phase: usize,
        /// Which field.
        field: &'static str,
        /// What it holds.
        value: u32,
    },
    /// The content is damaged.
    #[error("the pattern's content has hash {found:#018x}, its header says {announced:#018x}")]
    Hash {
        /// In the header.
        announced: u64,
        /// Of the content.
        found: u64,
    },
    /// It was planned for another sole: the ankles would step at touch-down. Remedy: the same `sole_file` for all processes.
    #[error(
        "the pattern was planned for another sole: its {field} = {found:.6}, but {} says {expected:.6}: give planner, estimator, controller \
         and simulator the same sole_file", .file.display()
    )]
    OtherSole {
        /// Which field of the header.
        field: &'static str,
        /// What it holds (m).
        found: f64,
        /// What this process's sole has there (m).
        expected: f64,
        /// The description of that sole.
        file: PathBuf,
    },
    /// The content is no walk.
    #[error(transparent)]
    Content(#[from] pattern::PatternError),
}

/// Lengths that agree to this are the same (m): figures in files have at most six digits.
const SAME_LENGTH_M: f64 = 1e-6;

/// The soles that a process which takes patterns was built with.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnSoles {
    /// Ankle in the sole frame (m), left and right.
    pub ankle_in_sole_m: [[f64; 3]; 2],
    /// Their description.
    pub file: PathBuf,
}

impl OwnSoles {
    /// Was the walk planned for them?
    ///
    /// # Errors
    /// [`PatternRefused::OtherSole`].
    pub fn check(&self, walk: &WalkPattern) -> Result<(), PatternRefused> {
        let [left, right] = self.ankle_in_sole_m;
        let pairs = [
            ("ankle_height_m", walk.ankle_height_m, left[2]),
            ("ankle_in_sole_m[0][0]", walk.ankle_in_sole_m[0][0], left[0]),
            ("ankle_in_sole_m[0][1]", walk.ankle_in_sole_m[0][1], left[1]),
            ("ankle_in_sole_m[1][0]", walk.ankle_in_sole_m[1][0], right[0]),
            ("ankle_in_sole_m[1][1]", walk.ankle_in_sole_m[1][1], right[1]),
        ];
        match pairs.into_iter().find(|(_, found, expected)| (found - expected).abs() > SAME_LENGTH_M) {
            Some((field, found, expected)) => {
                Err(PatternRefused::OtherSole { field, found, expected, file: self.file.clone() })
            }
            None => Ok(()),
        }
    }
}

/// The pattern as a message.
///
/// # Errors
/// [`PatternRefused::TooLong`], [`PatternRefused::Content`].
pub fn write_pattern(
    walk: &WalkPattern,
    robot_fingerprint: u64,
) -> Result<(PatternHeader, Vec<PatternPhase>), PatternRefused> {
    if walk.phases.len() > MAX_PHASES {
        return Err(PatternRefused::TooLong { found: walk.phases.len() });
    }
    walk.check()?;
    let header = PatternHeader {
        header: Header::new(-1, robot_fingerprint),
        pattern_hash: walk.content_hash(),
        version: walk.version,
        phase_count: walk.phases.len() as u32,
        mass_kg: walk.mass_kg,
        gravity_m_per_s2: walk.gravity_m_per_s2,
        com_height_m: walk.com_height_m,
        omega_rad_per_s: walk.omega(),
        ankle_height_m: walk.ankle_height_m,
        duration_s: walk.duration_s(),
        ankle_in_sole_m: walk.ankle_in_sole_m,
        reserved: [0.0; 8],
    };
    Ok((header, walk.phases.iter().map(phase_message).collect()))
}

/// The pattern in a message, checked: version, length, hash, and that it can be evaluated at all times.
///
/// # Errors
/// Any [`PatternRefused`].
pub fn read_pattern(header: &PatternHeader, phases: &[PatternPhase]) -> Result<WalkPattern, PatternRefused> {
    // Recordings may hold patterns of former versions.
    if !(1..=PATTERN_VERSION).contains(&header.version) {
        return Err(pattern::PatternError::Version { found: header.version }.into());
    }
    if phases.len() > MAX_PHASES {
        return Err(PatternRefused::TooLong { found: phases.len() });
    }
    if header.phase_count as usize != phases.len() {
        return Err(PatternRefused::Torn { announced: header.phase_count as usize, found: phases.len() });
    }
    let walk = WalkPattern {
        version: header.version,
        mass_kg: header.mass_kg,
        gravity_m_per_s2: header.gravity_m_per_s2,
        com_height_m: header.com_height_m,
        ankle_height_m: header.ankle_height_m,
        ankle_in_sole_m: header.ankle_in_sole_m,
        phases: phases.iter().enumerate().map(|(index, phase)| phase_data(index, phase)).collect::<Result<_, _>>()?,
    };
    walk.check()?;
    let found = walk.content_hash();
    if found != header.pattern_hash {
        return Err(PatternRefused::Hash { announced: header.pattern_hash, found });
    }
    Ok(walk)
}

fn phase_message(phase: &Phase) -> PatternPhase {
    let kind = match phase.kind {
        PhaseKind::Start => code::PhaseKind::Start,
        PhaseKind::SingleSupport => code::PhaseKind::SingleSupport,
        PhaseKind::DoubleSupport => code::PhaseKind::DoubleSupport,
        PhaseKind::Stop => code::PhaseKind::Stop,
    };
    PatternPhase {
        start_s: phase.start_s,
        duration_s: phase.duration_s,
        kind: kind.code(),
        step: phase.step,
        foot_1: phase.foot_1.index() as u32,
        cancelled_power: phase.load.cancelled_power,
        zmp: phase.zmp.map(|q| q.0),
        com_polynomial: phase.com.map(|c| c.polynomial.0),
        com_decaying: phase.com.map(|c| c.decaying),
        com_growing: phase.com.map(|c| c.growing),
        share: phase.load.share.0,
        excess: phase.load.excess.map(|q| q.0),
        zmp_1: phase.zmp_1.map(|q| q.0),
        zmp_shift_m: phase.zmp_shift.0,
        feet: phase.feet.map(|foot| foot_message(&foot)),
    }
}

fn foot_message(foot: &FootPhase) -> PatternFoot {
    let numbers = |foothold: Foothold| [foothold.x_m, foothold.y_m, foothold.yaw_rad];
    let mut out = PatternFoot {
        ankle_foothold: numbers(foot.ankle_foothold),
        contact_since_s: foot.contact_since_s,
        ..PatternFoot::default()
    };
    if let Some(swing) = foot.swing {
        out.in_the_air = 1;
        out.swing_from_foothold = numbers(swing.from_foothold);
        out.swing_start_s = swing.t_start_s;
        out.swing_end_s = swing.t_end_s;
        out.swing_apex_m = swing.apex_m;
    }
    out
}

fn phase_data(index: usize, message: &PatternPhase) -> Result<Phase, PatternRefused> {
    let refuse = |field, value| PatternRefused::Code { phase: index, field, value };
    let kind = match code::PhaseKind::from_code(message.kind).ok_or_else(|| refuse("kind", message.kind))? {
        code::PhaseKind::Start => PhaseKind::Start,
        code::PhaseKind::SingleSupport => PhaseKind::SingleSupport,
        code::PhaseKind::DoubleSupport => PhaseKind::DoubleSupport,
        code::PhaseKind::Stop => PhaseKind::Stop,
    };
    let foot_1 = *Side::BOTH.get(message.foot_1 as usize).ok_or_else(|| refuse("foot_1", message.foot_1))?;
    if ![0, 3].contains(&message.cancelled_power) {
        return Err(refuse("cancelled_power", message.cancelled_power));
    }
    if let Some(foot) = message.feet.iter().find(|foot| foot.in_the_air > 1) {
        return Err(refuse("in_the_air", foot.in_the_air));
    }
    Ok(Phase {
        start_s: message.start_s,
        duration_s: message.duration_s,
        kind,
        step: message.step,
        foot_1,
        zmp: message.zmp.map(Quintic),
        com: std::array::from_fn(|axis| ComSolution {
            polynomial: Quintic(message.com_polynomial[axis]),
            decaying: message.com_decaying[axis],
            growing: message.com_growing[axis],
        }),
        load: Load {
            cancelled_power: message.cancelled_power,
            share: Quintic(message.share),
            excess: message.excess.map(Quintic),
        },
        zmp_1: message.zmp_1.map(Quintic),
        zmp_shift: ZmpShift(message.zmp_shift_m),
        feet: message.feet.map(|foot| foot_data(&foot)),
    })
}

fn foot_data(message: &PatternFoot) -> FootPhase {
    let foothold = |[x_m, y_m, yaw_rad]: [f64; 3]| Foothold { x_m, y_m, yaw_rad };
    FootPhase {
        ankle_foothold: foothold(message.ankle_foothold),
        contact_since_s: message.contact_since_s,
        swing: (message.in_the_air == 1).then(|| Swing {
            from_foothold: foothold(message.swing_from_foothold),
            t_start_s: message.swing_start_s,
            t_end_s: message.swing_end_s,
            apex_m: message.swing_apex_m,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk() -> WalkPattern {
        let foot = |y_m, swing| FootPhase {
            ankle_foothold: Foothold { x_m: 0.1, y_m, yaw_rad: 0.2 },
            contact_since_s: 0.0,
            swing,
        };
        let swing = Swing { from_foothold: Foothold::default(), t_start_s: 0.0, t_end_s: 0.8, apex_m: 0.04 };
        let zmp = [Quintic([0.1, 0.02, 0.0, 0.3, -0.1, 0.01]), Quintic([0.05, 0.0, -0.2, 0.3, 0.0, 0.01])];
        let phase = Phase {
            start_s: 0.0,
            duration_s: 0.8,
            kind: PhaseKind::SingleSupport,
            step: 1,
            foot_1: Side::Right,
            zmp,
            com: zmp.map(|q| ComSolution::through(&q, 0.8, 3.5, 0.1, 0.2)),
            load: Load::single_support(),
            zmp_1: [Quintic::default(); 2],
            zmp_shift: ZmpShift([[[1e-3, -2e-3, 3e-3]; pattern::SHIFT_KNOTS]; 2]),
            feet: [foot(0.08, None), foot(-0.08, Some(swing))],
        };
        WalkPattern {
            version: PATTERN_VERSION,
            mass_kg: 39.0,
            gravity_m_per_s2: 9.81,
            com_height_m: 0.79,
            ankle_height_m: 0.103,
            ankle_in_sole_m: [[-0.015, -0.011], [-0.015, 0.011]],
            phases: vec![phase],
        }
    }

    #[test]
    fn a_pattern_survives_the_way_there_and_back() {
        let (header, phases) = write_pattern(&walk(), 7).unwrap();
        assert_eq!(read_pattern(&header, &phases).unwrap(), walk());
    }

    #[test]
    fn damaged_patterns_are_refused() {
        let (header, phases) = write_pattern(&walk(), 7).unwrap();
        let with_phase = |change: fn(&mut PatternPhase)| {
            let mut phases = phases.clone();
            change(&mut phases[0]);
            read_pattern(&header, &phases)
        };
        assert!(matches!(with_phase(|p| p.zmp[0][0] += 1e-12), Err(PatternRefused::Hash { .. })));
        assert!(matches!(with_phase(|p| p.kind = 9), Err(PatternRefused::Code { field: "kind", value: 9, .. })));
        assert!(matches!(with_phase(|p| p.duration_s = f64::NAN), Err(PatternRefused::Content(_))));
        assert!(matches!(read_pattern(&header, &[]), Err(PatternRefused::Torn { .. })));
        let other = PatternHeader { version: 99, ..header };
        assert!(matches!(read_pattern(&other, &phases), Err(PatternRefused::Content(_))));
        let mut long = walk();
        long.phases = (0..=MAX_PHASES).map(|i| Phase { start_s: i as f64 * 0.8, ..long.phases[0] }).collect();
        assert!(matches!(write_pattern(&long, 7), Err(PatternRefused::TooLong { found }) if found == MAX_PHASES + 1));
    }

    #[test]
    fn a_pattern_for_another_sole_is_refused_with_field_and_file() {
        let walk = walk();
        let [[x, left_y], [_, right_y]] = walk.ankle_in_sole_m;
        let z = walk.ankle_height_m;
        let check = |ankle_in_sole_m| OwnSoles { ankle_in_sole_m, file: "30mm.toml".into() }.check(&walk);
        assert_eq!(check([[x, left_y, z], [x, right_y, z]]), Ok(()));
        assert_eq!(check([[x, left_y, z + 0.9e-6], [x, right_y, z]]), Ok(()), "what rounding in a file does");
        for (own, expected) in [
            ([[x, left_y, z + 0.009], [x, right_y, z]], "ankle_height_m"),
            ([[x + 2e-6, left_y, z], [x, right_y, z]], "ankle_in_sole_m[0][0]"),
            ([[x, left_y + 2e-6, z], [x, right_y, z]], "ankle_in_sole_m[0][1]"),
            ([[x, left_y, z], [x - 2e-6, right_y, z]], "ankle_in_sole_m[1][0]"),
            ([[x, left_y, z], [x, left_y, z]], "ankle_in_sole_m[1][1]"),
        ] {
            let refused = check(own).expect_err("another sole");
            assert!(matches!(&refused, PatternRefused::OtherSole { field, .. } if *field == expected), "{refused}");
            assert!(refused.to_string().contains("30mm.toml"), "{refused}");
        }
    }
}

//! Messages as recordings of former versions hold them.
//!
//! A recording carries its own schema, and fields are known by name. What an older version called otherwise is listed here, what it did
//! not hold is derived here, so that whoever reads a recording meets today's types only.

use crate::code::Process;
use crate::{Health, RobotCommand, Truth};
use std::collections::BTreeMap;

/// An older version of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Older {
    /// Its name on the wire.
    pub wire_name: &'static str,
    /// For each struct in it: today's name, the name then, and today's and former names of the fields that were renamed.
    pub structs: &'static [(&'static str, &'static str, &'static [(&'static str, &'static str)])],
}

/// Numbers of fields of an older message that have no place any more, by name.
pub type Gone = BTreeMap<String, Vec<f64>>;

const PLAN_FOOT: (&str, &str, &[(&str, &str)]) =
    ("soleus.PlanFootV2", "soleus.PlanFootV1", &[("loaded", "in_contact"), ("wrench_n_nm", "wrench")]);

pub(crate) const ROBOT_STATE: [Older; 1] = [Older {
    wire_name: "soleus.RobotStateV1",
    structs: &[("soleus.RobotStateV2", "soleus.RobotStateV1", &[("foot_wrench_n_nm", "foot_wrench")])],
}];

pub(crate) const SOLE_DEFORMATION: [Older; 1] = [Older {
    wire_name: "soleus.SoleDeformationV1",
    structs: &[
        ("soleus.SoleDeformationV2", "soleus.SoleDeformationV1", &[]),
        (
            "soleus.FootDeformationV2",
            "soleus.FootDeformationV1",
            &[
                ("loaded", "in_contact"),
                ("ankle_twist_m_rad_per_s", "ankle_twist"),
                ("ankle_acceleration_m_rad_per_s2", "ankle_acceleration"),
                ("compliance_m_rad_per_n_nm", "compliance"),
                ("wrench_n_nm", "wrench"),
                ("sole_twist_m_rad_per_s", "sole_twist"),
            ],
        ),
    ],
}];

pub(crate) const ROBOT_COMMAND: [Older; 1] = [Older {
    wire_name: "soleus.RobotCommandV1",
    structs: &[
        ("soleus.RobotCommandV2", "soleus.RobotCommandV1", &[]),
        ("soleus.PlanV2", "soleus.PlanV1", &[]),
        PLAN_FOOT,
    ],
}];

pub(crate) const TRUTH: [Older; 1] = [Older {
    wire_name: "soleus.TruthV1",
    structs: &[(
        "soleus.TruthV2",
        "soleus.TruthV1",
        &[("base_twist_m_rad_per_s", "base_twist"), ("foot_wrench_n_nm", "foot_wrench")],
    )],
}];

pub(crate) const HEALTH: [Older; 1] =
    [Older { wire_name: "soleus.HealthV1", structs: &[("soleus.HealthV2", "soleus.HealthV1", &[])] }];

/// Nothing but names changed.
pub(crate) fn same<T>(_: &mut T, _: &Gone) {}

pub(crate) fn command(command: &mut RobotCommand, _: &Gone) {
    command.deformation_tick = command.header.tick - i64::from(command.deformation_age_ticks);
}

pub(crate) fn truth(truth: &mut Truth, gone: &Gone) {
    let momentum = numbers::<6>(gone, "momentum");
    truth.linear_momentum_kg_m_per_s.copy_from_slice(&momentum[..3]);
    truth.angular_momentum_kg_m2_per_s.copy_from_slice(&momentum[3..]);
    // That version knew lock-step only. At ticks 0 and 1 the placing command, of tick -1, is in force.
    truth.command_tick = (truth.header.tick - crate::timing::REACHED_TICKS).max(-1);
}

pub(crate) fn health(health: &mut Health, gone: &Gone) {
    let values = numbers::<16>(gone, "values");
    match Process::from_code(health.process) {
        Some(Process::Controller) => {
            let figures = &mut health.controller;
            let [relaxed, held, states, joint, com, collision, solved, kind, index, amount, backup, ..] = values;
            (figures.steps_relaxed, figures.steps_held) = (relaxed as u64, held as u64);
            (figures.states_refused, figures.joint_distance_max_rad) = (states as u64, joint);
            (figures.com_distance_m, figures.collision_distance_m) = (com, collision);
            (figures.steps_solved, figures.steps_by_backup) = (solved as u64, backup as u64);
            (figures.worst_limit, figures.worst_limit_index) = (kind as u32, index as u32);
            figures.worst_limit_amount = amount;
            let [.., base_m, base_rad, feet_m, refused, _] = values;
            (figures.base_distance_m, figures.base_distance_rad) = (base_m, base_rad);
            (figures.feet_disagreement_m, figures.measurements_refused) = (feet_m, refused as u64);
        }
        Some(Process::Simulator) => {
            let figures = &mut health.simulator;
            [figures.distance_m] = numbers(gone, "distance_m");
            let [fallen] = numbers::<1>(gone, "fallen");
            (figures.fallen, figures.fall_cause) = (fallen as u32, values[6] as u32);
            (figures.periods_unconverged, figures.commands_refused) = (values[5] as u64, values[7] as u64);
        }
        Some(Process::Recorder) => {
            let [stored] = numbers::<1>(gone, "stored_tick");
            health.recorder.stored_tick = stored as i64;
        }
        _ => {}
    }
}

/// So many numbers of a field; zeros at the end were not stored.
fn numbers<const N: usize>(gone: &Gone, name: &str) -> [f64; N] {
    let mut numbers = [0.0; N];
    if let Some(stored) = gone.get(name) {
        numbers.iter_mut().zip(stored).for_each(|(number, stored)| *number = *stored);
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::{Limit, Reason, State};

    #[test]
    fn values_by_position_find_their_names() {
        let values: Vec<f64> = (0..15).map(f64::from).collect();
        let gone = Gone::from([("values".to_string(), values), ("distance_m".to_string(), vec![0.5])]);
        let mut of_controller = Health::new(Process::Controller, State::Running, Reason::None);
        health(&mut of_controller, &gone);
        let found = of_controller.controller;
        assert_eq!((found.steps_relaxed, found.steps_held, found.steps_solved, found.steps_by_backup), (0, 1, 6, 10));
        assert_eq!((found.states_refused, found.joint_distance_max_rad, found.com_distance_m), (2, 3.0, 4.0));
        assert_eq!((found.collision_distance_m, found.worst_limit_index, found.worst_limit_amount), (5.0, 8, 9.0));
        assert_eq!(found.worst_limit, 7, "as it was sent, {:?} or not", Limit::from_code(7));
        assert_eq!((found.base_distance_m, found.base_distance_rad, found.feet_disagreement_m), (11.0, 12.0, 13.0));
        assert_eq!(found.measurements_refused, 14);
        let mut of_simulator = Health::new(Process::Simulator, State::Running, Reason::None);
        health(&mut of_simulator, &gone);
        let found = of_simulator.simulator;
        assert_eq!((found.distance_m, found.periods_unconverged, found.commands_refused), (0.5, 5, 7));
        assert_eq!((found.fall_cause, of_simulator.controller), (6, Default::default()));
    }

    #[test]
    fn ticks_that_were_not_told_follow_from_lock_step() {
        let mut of_tick = RobotCommand { deformation_age_ticks: 3, ..RobotCommand::default() };
        of_tick.header.tick = 10;
        command(&mut of_tick, &Gone::new());
        assert_eq!(of_tick.deformation_tick, 7);
        for (tick, expected) in [(0, -1), (1, -1), (2, 0), (10, 8)] {
            let mut of_tick = Truth::default();
            of_tick.header.tick = tick;
            truth(&mut of_tick, &Gone::from([("momentum".to_string(), vec![1.0, 2.0])]));
            assert_eq!(of_tick.command_tick, expected, "tick {tick}");
            assert_eq!(of_tick.linear_momentum_kg_m_per_s, [1.0, 2.0, 0.0]);
        }
    }
}

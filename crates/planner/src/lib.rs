//! Plans the walk and publishes the pattern (the paper's section 3, as a process).
//!
//! The configuration says where the feet go, how long the phases last and what is minimised; [`gait`] solves the quadratic
//! program. The finished pattern is measured once more on a 1 ms grid and refused if it breaks a constraint by more than
//! `constraint_violation_max_m`, if friction or ZMP are beyond the soles or the legs cannot follow (reach, joint limits); what was
//! measured is logged with every plan. Then [`stance::WalkOnSoles`], which the estimator will ask at every tick, is asked for all of them,
//! with the estimator's own settings. The pattern is refused if a sole cannot carry it, or would tilt or be pressed together too much:
//! with time, foot and amount. Planned once, before anything moves; the process stays to serve those who come later.
#![allow(non_snake_case)] // monogram notation, see the style guide

mod carried;
mod check;
mod findings;
mod reach;
mod rehearsed;
mod settings;
mod shift;
mod words;

pub use check::NotWalkable;
pub use reach::{LegsError, RobotLegs};
pub use settings::{PlannerError, PlannerSettings, RehearsalSettings};

use gait::{CheckReport, Plan};
use messages::CONTROL_PERIOD_S;
use messages::{MAX_PHASES, PatternHeader, PatternPhase, PatternRefused, write_pattern};
use rehearsal::Rehearsal;
use robot::Robot;
use soles::Store;
use stance::{Carried, WalkOnSoles};

/// A planned walk with its message.
#[derive(Debug, Clone)]
pub struct PlannerOutput {
    /// The plan and how it was found.
    pub plan: Plan,
    /// What the check on the fine grid found; in words: [`findings`](Self::findings).
    pub check: CheckReport,
    /// Friction that the plan may use.
    pub friction_available: f64,
    /// What the soles said; `None` if none were asked.
    pub soles: Option<Carried>,
    /// Names of the legs' joints, left and right, from the hip.
    pub leg_joints: [[String; 6]; 2],
    /// What the rehearsal found.
    pub rehearsal: Rehearsal,
    /// In words, what is left to the limits of travel, speed and torque where it is least.
    pub rooms: [String; 3],
    /// In words, which joints are as fast as they may be, if any.
    pub speeds: Option<String>,
    /// What the phases have in common.
    pub header: PatternHeader,
    /// The phases.
    pub phases: Vec<PatternPhase>,
}

/// Plans the walk.
///
/// # Errors
/// [`PlannerError`] names what is wrong: a setting, the step that cannot be made, the limit that is in the way.
pub fn plan(settings: &PlannerSettings) -> Result<PlannerOutput, PlannerError> {
    plan_with_store(settings, &mut Store::none())
}

/// The same with condensed soles that may have been kept.
///
/// # Errors
/// As [`plan`].
pub fn plan_with_store(settings: &PlannerSettings, store: &mut Store) -> Result<PlannerOutput, PlannerError> {
    let robot = Robot::load_on(&settings.robot, settings.sole_file.as_deref())?;
    settings.check(&robot)?;
    let gait = settings.gait_of(&robot).map_err(NotWalkable::Legs)?;
    if gait.phases() > MAX_PHASES {
        return Err(PatternRefused::TooLong { found: gait.phases() }.into());
    }
    let mut plan = gait::plan(&gait)?;
    let friction_available = check::friction_available(&robot, settings.estimator.sole.friction);
    let check = check::check(&plan, &gait, &robot, friction_available, settings.constraint_violation_max_m)?;
    let leg_joints = robot_model::leg_joints(&robot).map_err(LegsError::from).map_err(NotWalkable::Legs)?;
    let shift::Rehearsed { rehearsal, rooms, speeds } = shift::rehearse(&mut plan.pattern, &robot, settings)?;
    let estimator = &settings.estimator;
    let soles = estimator.soles(&robot, store)?;
    let soft = soles.iter().any(Option::is_some);
    let mut walk = WalkOnSoles::new(plan.pattern.clone(), soles, &estimator.stance(), CONTROL_PERIOD_S);
    let soles = soft.then(|| carried::check(&mut walk, settings)).transpose()?;
    let (header, phases) = write_pattern(&plan.pattern, robot.fingerprint)?;
    Ok(PlannerOutput { plan, check, friction_available, soles, leg_joints, rehearsal, rooms, speeds, header, phases })
}

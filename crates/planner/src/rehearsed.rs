//! What the rehearsal found, in words.

use crate::NotWalkable;
use rehearsal::{AtSpeed, Demand, LimitKind, NotRehearsed, Rehearsal};
use wholebody::{ConstraintId, WholeBody};

/// "travel", and its unit.
fn kind_and_unit(kind: LimitKind) -> (&'static str, &'static str) {
    match kind {
        LimitKind::Position => ("travel", "rad"),
        LimitKind::Speed => ("speed", "rad/s"),
        LimitKind::Torque => ("torque", "N m"),
    }
}

/// A walk that cannot be rehearsed, refused with joint, time, amount and remedy.
pub(crate) fn in_words(refused: NotRehearsed, body: &WholeBody) -> NotWalkable {
    match refused {
        NotRehearsed::Start(error) => NotWalkable::Start(error),
        NotRehearsed::AtLimit(Demand { joint, kind, time_s, limit, .. }) => {
            let ((word, unit), joint) = (kind_and_unit(kind), joint_name(body, joint));
            let remedy = match kind {
                LimitKind::Torque => "take a stronger drive, shorten the steps or walk with a lower gait.swing.apex_m",
                LimitKind::Position | LimitKind::Speed => {
                    "lower gait.body.com_height_m, shorten the steps or lower gait.swing.apex_m"
                }
            };
            NotWalkable::AtLimit { time_s, joint, kind: word, limit, unit, remedy }
        }
        NotRehearsed::Limit { time_s, gave_way } => {
            let what = gave_way.map_or("none alone".to_string(), |(id, amount)| match id {
                ConstraintId::JointMotion(joint) => {
                    format!("the motion of {}, by {amount:.1} rad/s^2", joint_name(body, joint))
                }
                ConstraintId::Torque(joint) => format!("the torque of {}, by {amount:.1} N m", joint_name(body, joint)),
                ConstraintId::Collision(pair) => {
                    format!(
                        "the distance of {}, by {amount:.1} m/s^2",
                        body.settings().collision.pairs[pair].join(" and ")
                    )
                }
                ConstraintId::Load { foot } => format!("the load of the {} foot, by {amount:.1} N", SIDES[foot]),
                ConstraintId::Contact { foot, .. } => {
                    format!("the contact of the {} foot, by {amount:.2} m/s^2 or rad/s^2", SIDES[foot])
                }
                ConstraintId::BaseDynamics(_) | ConstraintId::Intensity { .. } => "physics".to_string(),
            });
            NotWalkable::GivesWay { time_s, what }
        }
    }
}

const SIDES: [&str; 2] = ["left", "right"];

pub(crate) fn joint_name(body: &WholeBody, joint: usize) -> String {
    body.model().joints()[joint].name.clone()
}

/// "0.312 rad of travel (L_KNEE_P at 1.230 s)"
pub(crate) fn room(demand: &Demand, joint: &str) -> String {
    let (word, unit) = kind_and_unit(demand.kind);
    format!("{:.3} {unit} of {word} ({joint} at {:.3} s)", demand.room, demand.time_s)
}

/// "as fast as they may be: R_KNEE_P for 0.42 s in 6 spells, first at 1.234 s; a foot in the air is up to 0.03 mm off its path"; `None` if no
/// joint is.
pub(crate) fn speeds(rehearsal: &Rehearsal, body: &WholeBody) -> Option<String> {
    let joint = |at: &AtSpeed| {
        let AtSpeed { joint, lasting_s, times, first_s, .. } = *at;
        format!("{} for {lasting_s:.3} s in {times} spells, first at {first_s:.3} s", joint_name(body, joint))
    };
    let joints: Vec<String> = rehearsal.at_speed.iter().map(joint).collect();
    (!joints.is_empty()).then(|| {
        let off_mm = 1e3 * rehearsal.swing_error_m;
        format!("as fast as they may be: {}; a foot in the air is up to {off_mm:.2} mm off its path", joints.join(", "))
    })
}

#[cfg(test)]
mod tests {
    use crate::PlannerSettings;
    use crate::shift::{self, Rehearsed};
    use robot::Robot;
    use std::path::Path;

    /// What the rehearsal says of a walk; `knee_nm`: with knees of that torque.
    fn rehearsed(changes: &[&str], knee_nm: Option<&str>) -> Result<Rehearsed, String> {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/planner.toml");
        let changes: Vec<_> = changes.iter().map(|text| text.parse().expect("a setting")).collect();
        let settings: PlannerSettings = scenario::load(&file, &changes).expect("the configuration that ships is read");
        let mut robot = Robot::load(&settings.robot).expect("it ships");
        if let Some(knee_nm) = knee_nm {
            let weak = robot.urdf.replace(
                r#"velocity="2.6179939" effort="243""#,
                &format!(r#"velocity="2.6179939" effort="{knee_nm}""#),
            );
            assert_ne!(weak, robot.urdf);
            robot.urdf = weak;
        }
        let gait = settings.gait_of(&robot).expect("it has legs");
        let mut walk = gait::plan(&gait).expect("it can be planned").pattern;
        shift::rehearse(&mut walk, &robot, &settings).map_err(|refused| refused.to_string())
    }

    #[test]
    fn the_walk_that_ships_leaves_room() {
        let Rehearsed { rooms: [travel, speed, torque], .. } = rehearsed(&[], None).expect("it is walked");
        assert!(
            travel.contains("rad of travel") && speed.contains("rad/s of speed") && torque.contains("N m of torque")
        );
    }

    #[test]
    fn knees_that_are_as_fast_as_they_may_be_are_told_and_those_with_room_are_not() {
        // In each of the eleven swings a knee is; stretched less, and not so high, none is.
        let told = rehearsed(&[], None).expect("it is walked").speeds.expect("half of the knees' speed is needed");
        for knee in ["R_KNEE_P for ", "L_KNEE_P for ", " spells, first at ", " mm off its path"] {
            assert!(told.contains(knee), "no `{knee}` in {told}");
        }
        let slow = ["gait.timing.single_support_s=1.6", "gait.swing.apex_m=0.02", "gait.walk.swings=2"];
        assert_eq!(rehearsed(&slow, None).expect("it is walked").speeds, None);
    }

    #[test]
    fn a_knee_too_weak_is_refused_with_joint_and_time() {
        for knee_nm in ["25", "40"] {
            let refused = rehearsed(&["gait.walk.swings=2"], Some(knee_nm)).expect_err("it would fall");
            for part in ["_KNEE_P", "torque", "N m", " s ", "gait."] {
                assert!(refused.contains(part), "no `{part}` in {refused}");
            }
        }
    }

    #[test]
    fn a_knee_that_must_be_stretched_is_refused() {
        for height in ["0.82", "0.828"] {
            let height = format!("gait.body.com_height_m={height}");
            let refused = rehearsed(&[&height, "gait.walk.swings=2"], None).expect_err("its legs are too short");
            assert!(refused.contains("_KNEE_P") && refused.contains("com_height_m"), "{refused}");
        }
    }
}

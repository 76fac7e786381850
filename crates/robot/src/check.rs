//! What types cannot say: ranges, and names that must refer to something.

use crate::description::Shared;
use crate::error::nearest;
use crate::{FRICTION_MAX, Friction, RobotDescription, RobotError, SoleDescription};
use sole_mesh::{EXTENT_M, Mesh};
use std::ops::RangeInclusive;
use std::path::Path;

struct File<'a>(&'a Path);

impl File<'_> {
    fn range(&self, field: impl Into<String>, value: f64, expected: Range) -> Result<(), RobotError> {
        if (expected.holds)(value) {
            return Ok(());
        }
        Err(RobotError::OutOfRange { file: self.0.to_owned(), field: field.into(), value, expected: expected.words })
    }

    /// A file that is named here lies in the same folder or below: whoever hands on the folder hands on all that is
    /// read, and nothing else of a machine is.
    fn inside(&self, field: &'static str, name: &str) -> Result<(), RobotError> {
        if files::stays_inside(Path::new(name)) {
            return Ok(());
        }
        Err(RobotError::Outside { file: self.0.to_owned(), field, name: name.to_owned() })
    }

    fn known<'a>(
        &self,
        field: &str,
        name: &str,
        among: &'static str,
        known: impl Iterator<Item = &'a str> + Clone,
    ) -> Result<(), RobotError> {
        if known.clone().any(|candidate| candidate == name) {
            return Ok(());
        }
        let (file, field, nearest) = (self.0.to_owned(), field.to_owned(), nearest(name, known));
        Err(RobotError::UnknownName { file, field, name: name.to_owned(), among, nearest })
    }

    fn once<'a>(&self, field: &str, names: impl Iterator<Item = &'a str>) -> Result<(), RobotError> {
        let mut seen = std::collections::HashSet::new();
        for name in names {
            if !seen.insert(name) {
                return Err(RobotError::Twice {
                    file: self.0.to_owned(),
                    field: field.to_owned(),
                    name: name.to_owned(),
                });
            }
        }
        Ok(())
    }

    /// Every joint of the robot has exactly one value.
    fn every_joint<T: Shared>(
        &self,
        field: &'static str,
        robot: &RobotDescription,
        values: &[T],
    ) -> Result<(), RobotError> {
        for shared in values {
            self.joints_or_groups(field, robot, shared.of())?;
        }
        self.once(field, values.iter().flat_map(|shared| robot.members(shared.of())))?;
        match robot.joints.iter().find(|joint| robot.shared_by(values, joint).is_none()) {
            Some(joint) => Err(RobotError::Missing { file: self.0.to_owned(), field, joint: joint.clone() }),
            None => Ok(()),
        }
    }

    fn joints_or_groups(&self, field: &str, robot: &RobotDescription, names: &[String]) -> Result<(), RobotError> {
        let known = robot.joints.iter().chain(robot.groups.keys()).map(String::as_str);
        names.iter().try_for_each(|name| self.known(field, name, "the joints and groups", known.clone()))
    }
}

struct Range {
    holds: fn(f64) -> bool,
    words: &'static str,
}

const POSITIVE: Range = Range { holds: |x| x > 0.0 && x.is_finite(), words: "a positive number" };
const NOT_NEGATIVE: Range = Range { holds: |x| x >= 0.0 && x.is_finite(), words: "zero or a positive number" };
const RUBBER: Range = Range {
    holds: |x| (0.0..=FRICTION_MAX).contains(&x),
    words: "0 to 10: dry rubber has about 1; for a sole that never slides, a few are enough",
};
const FINITE: Range = Range { holds: f64::is_finite, words: "a finite number" };
const FRACTION: Range = Range { holds: |x| x > 0.0 && x <= 1.0, words: "more than 0, at most 1" };
const TURN: Range = Range { holds: |x| x.abs() <= 360.0, words: "an angle in degrees, at most one turn" };
/// Young's modulus of a sole that is believed (Pa): the softest foams have some kilopascals, rubbers up to 0.1 GPa, hard plastics some
/// gigapascals; what is stiffer is the level `rigid`. The foams and rubbers of soles (0.005 to 50 MPa) in megapascals or gigapascals fall out.
const YOUNG_MODULUS_PA: RangeInclusive<f64> = 1e3..=1e10;
const FOAM: Range = Range {
    holds: |x| YOUNG_MODULUS_PA.contains(&x),
    words: "pascals, between 1e3 (softest foam) and 1e10 (hard plastic): was it given in MPa?",
};
/// An ankle is no farther from the sole than the largest sole is long.
const BESIDE_THE_SOLE: Range = Range {
    holds: |x| x.abs() <= *EXTENT_M.end(),
    words: "metres, at most 1: was it given in millimetres or centimetres?",
};
const ABOVE_THE_GROUND: Range =
    Range { holds: |x| x > 0.0, words: "more than 0: the height of the ankle above the sole's bottom face, z upwards" };
const COMPRESSIBLE: Range =
    Range { holds: |x| x > -1.0 && x < 0.5, words: "more than -1 and less than 0.5 (a compressible solid)" };

pub(crate) fn robot(path: &Path, robot: &RobotDescription) -> Result<(), RobotError> {
    let file = File(path);
    file.inside("urdf", &robot.urdf)?;
    let joints = || robot.joints.iter().map(String::as_str);
    file.once("joints", joints())?;
    for (group, members) in &robot.groups {
        let field = format!("groups.{group}");
        members.iter().try_for_each(|joint| file.known(&field, joint, "the joints", joints()))?;
        file.once(&field, members.iter().map(String::as_str))?;
    }
    file.joints_or_groups("walking_locked", robot, &robot.walking_locked)?;
    for (joint, deg) in &robot.half_sitting_deg {
        file.known("half_sitting_deg", joint, "the joints", joints())?;
        file.range(format!("half_sitting_deg.{joint}"), *deg, TURN)?;
    }
    file.every_joint("servos", robot, &robot.servos)?;
    for (i, servo) in robot.servos.iter().enumerate() {
        file.range(format!("servos[{i}].kp_nm_per_rad"), servo.kp_nm_per_rad, POSITIVE)?;
        file.range(format!("servos[{i}].kd_nm_s_per_rad"), servo.kd_nm_s_per_rad, NOT_NEGATIVE)?;
        file.range(format!("servos[{i}].rotor_inertia_kg_m2"), servo.rotor_inertia_kg_m2, NOT_NEGATIVE)?;
        file.range(format!("servos[{i}].coulomb_friction_nm"), servo.coulomb_friction_nm, NOT_NEGATIVE)?;
        let viscous = servo.viscous_friction_nm_s_per_rad;
        file.range(format!("servos[{i}].viscous_friction_nm_s_per_rad"), viscous, NOT_NEGATIVE)?;
    }
    file.every_joint("energy", robot, &robot.energy)?;
    for (i, energy) in robot.energy.iter().enumerate() {
        file.range(format!("energy[{i}].torque_squared_w_per_nm2"), energy.torque_squared_w_per_nm2, NOT_NEGATIVE)?;
        file.range(format!("energy[{i}].power"), energy.power, FINITE)?;
        let speed = energy.speed_squared_w_s2_per_rad2;
        file.range(format!("energy[{i}].speed_squared_w_s2_per_rad2"), speed, NOT_NEGATIVE)?;
    }
    file.range("limits.position_margin_deg", robot.limits.position_margin_deg, NOT_NEGATIVE)?;
    file.range("limits.velocity_factor", robot.limits.velocity_factor, FRACTION)?;
    file.range("limits.torque_factor", robot.limits.torque_factor, FRACTION)?;
    let capsules = || robot.capsules.iter().map(|capsule| capsule.name.as_str());
    file.once("capsules", capsules())?;
    for capsule in &robot.capsules {
        let field = |key| format!("capsules.{}.{key}", capsule.name);
        file.range(field("radius_m"), capsule.radius_m, POSITIVE)?;
        capsule.from_m.iter().try_for_each(|x| file.range(field("from_m"), *x, FINITE))?;
        capsule.to_m.iter().try_for_each(|x| file.range(field("to_m"), *x, FINITE))?;
    }
    for pair in &robot.collision_pairs {
        pair.iter().try_for_each(|name| file.known("collision_pairs", name, "the capsules", capsules()))?;
        file.once("collision_pairs", pair.iter().map(String::as_str))?;
    }
    for pair in robot.collision_pairs_left_out.iter().flat_map(|left_out| &left_out.pairs) {
        pair.iter().try_for_each(|name| file.known("collision_pairs_left_out", name, "the capsules", capsules()))?;
    }
    Ok(())
}

pub(crate) fn sole(path: &Path, sole: &SoleDescription) -> Result<(), RobotError> {
    let file = File(path);
    match &sole.friction {
        Friction::Uniform(mu) => file.range("friction", *mu, RUBBER)?,
        Friction::PerPatch(list) => {
            list.iter().enumerate().try_for_each(|(i, mu)| file.range(format!("friction[{i}]"), *mu, RUBBER))?
        }
    }
    let mesh = &sole.mesh;
    let found = match (mesh.box_m.is_some(), mesh.cells.is_some(), mesh.file.is_some()) {
        (true, true, false) | (false, false, true) => None,
        (true, _, true) => Some("has both box_m and file"),
        (false, true, true) => Some("has cells beside file"),
        (true, false, false) => Some("has box_m without cells"),
        (false, true, false) => Some("has cells without box_m"),
        (false, false, false) => Some("has neither box_m nor file"),
    };
    if let Some(found) = found {
        return Err(RobotError::MeshChoice { file: path.to_owned(), found });
    }
    mesh.file.iter().try_for_each(|name| file.inside("mesh.file", name))?;
    mesh.box_m.iter().flatten().try_for_each(|edge| file.range("mesh.box_m", *edge, POSITIVE))?;
    mesh.cells.iter().flatten().try_for_each(|cells| file.range("mesh.cells", f64::from(*cells), POSITIVE))?;
    if let (Some(size_m), Some(cells)) = (mesh.box_m, mesh.cells) {
        Mesh::check_box(size_m, cells.map(|n| n as usize))
            .map_err(|source| RobotError::Block { file: path.to_owned(), source })?;
    }
    file.range("material.young_modulus_pa", sole.material.young_modulus_pa, FOAM)?;
    file.range("material.poisson_ratio", sole.material.poisson_ratio, COMPRESSIBLE)?;
    sole.foot.ankle_in_sole_m.iter().try_for_each(|x| file.range("foot.ankle_in_sole_m", *x, BESIDE_THE_SOLE))?;
    file.range("foot.ankle_in_sole_m[2]", sole.foot.ankle_in_sole_m[2], ABOVE_THE_GROUND)
}

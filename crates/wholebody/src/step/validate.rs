//! What each number of the settings may be. Keys are those of the settings' tables, and for what is the robot's those of its folder.

use crate::settings::{Gains, MomentumSettings, SolverSettings, WholeBodySettings};
use ranges::{OutOfRange, Range};

/// Ratios of weights beyond this leave nothing of the lighter task in 53 bits.
const WEIGHT: Range = Range::above_zero_to(1e9);
/// The weight of an objective that may be left out.
const OPTIONAL_WEIGHT: Range = Range::between(0.0, 1e9);
/// At a period of 0.5 ms a stiffness of 1e6 is all that sampling allows.
const STIFFNESS: Range = Range::above_zero_to(1e6);
/// A part of something.
const FRACTION: Range = Range::above_zero_to(1.0);
/// No humanoid's body is longer (m).
const LENGTH: Range = Range::above_zero_to(10.0);
/// Any coordinate in a body (m).
const COORDINATE: Range = Range::within(10.0);
/// Generators of a linearised cone: multiples of four, so that left is as right and front as back.
const GENERATORS: [usize; 3] = [4, 8, 16];

const WEIGHT_REMEDY: &str = "ratios of weights matter; the shipped configuration shows usual ones";
const STIFFNESS_REMEDY: &str = "useful is up to about 0.1 / period^2";
const ROBOT_REMEDY: &str = "correct it in the robot's folder";

/// Settings that the equations cannot take.
pub(super) fn check(settings: &WholeBodySettings) -> Result<(), OutOfRange> {
    check_tasks(settings)?;
    check_constraints(settings)?;
    check_collision(settings)?;
    check_relaxation(settings)?;
    check_solver(&settings.solver)?;
    check_robot(settings)
}

fn check_tasks(settings: &WholeBodySettings) -> Result<(), OutOfRange> {
    let tasks = &settings.tasks;
    for (name, Gains { weight, stiffness_per_s2 }) in [
        ("swing_position", tasks.swing_position),
        ("swing_orientation", tasks.swing_orientation),
        ("com", tasks.com),
        ("torso", tasks.torso),
        ("posture", tasks.posture),
        ("leg_posture", tasks.leg_posture),
    ] {
        WEIGHT.demand(format!("tasks.{name}.weight"), weight, WEIGHT_REMEDY)?;
        STIFFNESS.demand(format!("tasks.{name}.stiffness_per_s2"), stiffness_per_s2, STIFFNESS_REMEDY)?;
    }
    Range::above_zero_to(1e3).demand("tasks.com_height_factor", tasks.com_height_factor, "0.1 is usual")?;
    OPTIONAL_WEIGHT.demand("tasks.wrench_weight", tasks.wrench_weight, "0 leaves the sharing to the damping")?;
    LENGTH.demand("tasks.wrench_lever_m", tasks.wrench_lever_m, "about half of the foot's width")?;
    let damping_remedy = "below 1e-5 an intensity is known only to some newtons";
    Range::between(1e-5, 1.0).demand("tasks.intensity_damping", tasks.intensity_damping, damping_remedy)?;
    let MomentumSettings { weight, rate_per_s } = tasks.angular_momentum;
    OPTIONAL_WEIGHT.demand("tasks.angular_momentum.weight", weight, "0 is off, from 10 on it shows")?;
    Range::above_zero_to(1e4).demand("tasks.angular_momentum.rate_per_s", rate_per_s, "1 to 20 is useful")?;
    OPTIONAL_WEIGHT.demand("tasks.torque_weight", tasks.torque_weight, "0 is off, from 1e-3 on torques fall")
}

fn check_constraints(settings: &WholeBodySettings) -> Result<(), OutOfRange> {
    let constraints = &settings.constraints;
    for (key, stiffness) in [
        ("constraints.contact_position_stiffness_per_s2", constraints.contact_position_stiffness_per_s2),
        ("constraints.contact_orientation_stiffness_per_s2", constraints.contact_orientation_stiffness_per_s2),
    ] {
        STIFFNESS.demand(key, stiffness, STIFFNESS_REMEDY)?;
    }
    let friction_remedy = "the friction between sole and ground, or a little less";
    Range::above_zero_to(10.0).demand("constraints.friction", settings.friction(), friction_remedy)?;
    let generators = constraints.generators_per_point;
    if !GENERATORS.contains(&generators) {
        let remedy = "4 is fastest; more buy at most a few per cent of friction";
        return Err(OutOfRange::new("constraints.generators_per_point", generators, "4, 8 or 16", remedy));
    }
    let load_remedy = "the share of the weight a foot may carry beyond its plan; 0.1 to 0.3 is useful";
    Range::between(0.0, 1.0).demand("constraints.load_margin", constraints.load_margin, load_remedy)?;
    let braking_remedy = "the deceleration that joints can count on; 20 to 200 is useful";
    let braking = constraints.braking_rad_per_s2;
    Range::above_zero_to(1e5).demand("constraints.braking_rad_per_s2", braking, braking_remedy)?;
    let most = constraints.acceleration_max_rad_per_s2;
    let acceleration = Range::above_zero_to(1e6);
    acceleration.demand("constraints.acceleration_max_rad_per_s2", most, "1000 hardly ever binds")?;
    FRACTION.demand("limits.torque_factor", constraints.torque_factor, "a part of the motors' torque limits")?;
    FRACTION.demand("limits.velocity_factor", constraints.velocity_factor, "a part of the joints' speed limits")?;
    let margin_deg = constraints.position_margin_rad.to_degrees();
    Range::between(0.0, 90.0).demand("limits.position_margin_deg", margin_deg, "a degree or less is usual")
}

fn check_collision(settings: &WholeBodySettings) -> Result<(), OutOfRange> {
    let collision = &settings.collision;
    LENGTH.demand("collision.interaction_m", collision.interaction_m, "0.1 is usual")?;
    Range::between(0.0, 10.0).demand("collision.safety_m", collision.safety_m, "0.01 is usual")?;
    if collision.safety_m >= collision.interaction_m {
        let expected = format!("less than collision.interaction_m = {}", collision.interaction_m);
        return Err(OutOfRange::new(
            "collision.safety_m",
            collision.safety_m,
            expected,
            "the damper acts between the two",
        ));
    }
    Range::above_zero_to(100.0).demand("collision.damping_m_per_s", collision.damping_m_per_s, "0.5 is usual")
}

fn check_relaxation(settings: &WholeBodySettings) -> Result<(), OutOfRange> {
    let relaxation = &settings.relaxation;
    for (key, allowance) in [
        ("relaxation.load_n", relaxation.load_n),
        ("relaxation.collision_m_per_s2", relaxation.collision_m_per_s2),
        ("relaxation.joint_motion_rad_per_s2", relaxation.joint_motion_rad_per_s2),
        ("relaxation.contact_m_per_s2", relaxation.contact_m_per_s2),
    ] {
        Range::between(0.0, 1e6).demand(key, allowance, "0 keeps the limit whatever comes")?;
    }
    let torque_remedy = "a part of the motors' limits; 0 keeps the controller's limit whatever comes";
    Range::between(0.0, 1.0).demand("relaxation.torque_factor", relaxation.torque_factor, torque_remedy)?;
    let order = &relaxation.order;
    match order.iter().enumerate().find(|(i, limit)| order[..*i].contains(limit)) {
        Some((_, twice)) => {
            let found = format!("a list with {twice} twice");
            Err(OutOfRange::new(
                "relaxation.order",
                found,
                "one in which each kind stands at most once",
                "keep the first",
            ))
        }
        None => Ok(()),
    }
}

fn check_solver(solver: &SolverSettings) -> Result<(), OutOfRange> {
    let tolerance = Range::between(1e-13, 1e-3);
    tolerance.demand("solver.interior_tolerance", solver.interior_tolerance, "1e-6 to 1e-10 is useful")?;
    let most = solver.iterations_max as f64;
    Range::between(1.0, 1e6).demand("solver.iterations_max", most, "a walk needs up to some tens; 300 is usual")
}

/// What comes from the robot's folder.
fn check_robot(settings: &WholeBodySettings) -> Result<(), OutOfRange> {
    LENGTH.demand("sole.length_m", settings.sole.length_m, ROBOT_REMEDY)?;
    LENGTH.demand("sole.width_m", settings.sole.width_m, ROBOT_REMEDY)?;
    for foot in &settings.feet {
        COORDINATE.demand_each("foot.ankle_in_sole_m", foot.ankle_in_sole_m.as_slice(), ROBOT_REMEDY)?;
    }
    for target in &settings.posture {
        let key = format!("half_sitting_deg.{}", target.joint);
        Range::within(360.0).demand(key, target.position_rad.to_degrees(), ROBOT_REMEDY)?;
    }
    for capsule in &settings.collision.capsules {
        let key = |key: &str| format!("capsules.{}.{key}", capsule.name);
        LENGTH.demand(key("radius_m"), capsule.radius_m, ROBOT_REMEDY)?;
        COORDINATE.demand_each(&key("from_m"), capsule.from_m.as_slice(), ROBOT_REMEDY)?;
        COORDINATE.demand_each(&key("to_m"), capsule.to_m.as_slice(), ROBOT_REMEDY)?;
    }
    Ok(())
}

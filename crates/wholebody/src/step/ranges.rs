//! What each number of the settings may be. Every key is spelled as in `controller.toml` and `robot.toml`.

use crate::error::WholeBodyError;
use crate::settings::{Backend, Gains, WholeBodySettings};

/// Numbers from `least` on (or above it) up to `most`.
#[derive(Debug, Clone, Copy)]
struct Range {
    least: f64,
    least_itself: bool,
    most: f64,
}

impl Range {
    const fn above_zero_to(most: f64) -> Self {
        Self { least: 0.0, least_itself: false, most }
    }

    const fn between(least: f64, most: f64) -> Self {
        Self { least, least_itself: true, most }
    }

    /// False for what is not a number.
    fn contains(&self, x: f64) -> bool {
        x <= self.most && (x > self.least || (self.least_itself && x == self.least))
    }
}

/// Ratios of weights beyond this leave nothing of the lighter task in 53 bits.
const WEIGHT: Range = Range::above_zero_to(1e9);
/// A weight that may be left out.
const OPTIONAL_WEIGHT: Range = Range::between(0.0, 1e9);
/// At a period of 0.5 ms a stiffness of 1e6 is all that sampling allows.
const STIFFNESS: Range = Range::above_zero_to(1e6);
/// A part of something.
const FRACTION: Range = Range::above_zero_to(1.0);
/// No humanoid's body is longer (m).
const LENGTH: Range = Range::above_zero_to(10.0);
/// Any coordinate in a body (m).
const COORDINATE: Range = Range::between(-10.0, 10.0);
/// Generators of a linearised cone: multiples of four, so that left is as right and front as back.
const GENERATORS: [usize; 3] = [4, 8, 16];

const WEIGHT_REMEDY: &str = "ratios of weights matter; the shipped configuration shows usual ones";
const STIFFNESS_REMEDY: &str = "useful is up to about 0.1 / period^2";
const ROBOT_REMEDY: &str = "correct it in the robot's folder";

/// Settings that the equations cannot take.
pub(super) fn check(settings: &WholeBodySettings) -> Result<(), WholeBodyError> {
    check_tasks(settings)?;
    check_constraints(settings)?;
    check_collision(settings)?;
    check_relaxation(settings)?;
    check_solver(settings)?;
    check_robot(settings)
}

fn demand(setting: &str, found: f64, range: Range, remedy: &'static str) -> Result<(), WholeBodyError> {
    if range.contains(found) {
        return Ok(());
    }
    let Range { least, least_itself, most } = range;
    let from = if least_itself { "at least" } else { "more than" };
    let expected = format!("{from} {} and at most {}", plain(least), plain(most));
    Err(WholeBodyError::Setting { setting: setting.to_owned(), found, expected, remedy })
}

/// Short whatever the size.
fn plain(x: f64) -> String {
    if x == 0.0 || (1e-3..1e4).contains(&x.abs()) { format!("{x}") } else { format!("{x:e}") }
}

fn check_tasks(settings: &WholeBodySettings) -> Result<(), WholeBodyError> {
    let tasks = &settings.tasks;
    let gains = |name: &str, Gains { weight, stiffness }: Gains| {
        demand(&format!("tasks.{name}.weight"), weight, WEIGHT, WEIGHT_REMEDY)?;
        demand(&format!("tasks.{name}.stiffness_per_s2"), stiffness, STIFFNESS, STIFFNESS_REMEDY)
    };
    gains("swing_position", tasks.swing_position)?;
    gains("swing_orientation", tasks.swing_orientation)?;
    gains("com", tasks.com)?;
    gains("torso", tasks.torso)?;
    gains("posture", tasks.posture)?;
    gains("leg_posture", tasks.leg_posture)?;
    demand("tasks.com_height_factor", tasks.com_height_factor, Range::above_zero_to(1e3), "0.1 is usual")?;
    demand("tasks.wrench_weight", tasks.wrench_weight, OPTIONAL_WEIGHT, "0 leaves the sharing to the damping")?;
    let lever_remedy = "about half of the foot's width";
    demand("tasks.wrench_lever_m", tasks.wrench_lever_m, LENGTH, lever_remedy)?;
    let damping_remedy = "below 1e-5 an intensity is known only to some newtons";
    demand("tasks.intensity_damping", tasks.intensity_damping, Range::between(1e-5, 1.0), damping_remedy)?;
    if let Some(Gains { weight, stiffness }) = tasks.angular_momentum {
        demand("tasks.angular_momentum.weight", weight, WEIGHT, WEIGHT_REMEDY)?;
        demand("tasks.angular_momentum.rate_per_s", stiffness, Range::above_zero_to(1e4), "1 to 20 is useful")?;
    }
    tasks.torque_weight.map_or(Ok(()), |weight| demand("tasks.torque_weight", weight, WEIGHT, WEIGHT_REMEDY))
}

fn check_constraints(settings: &WholeBodySettings) -> Result<(), WholeBodyError> {
    let constraints = &settings.constraints;
    for (setting, stiffness) in [
        ("constraints.contact_position_stiffness_per_s2", constraints.contact_position_stiffness),
        ("constraints.contact_orientation_stiffness_per_s2", constraints.contact_orientation_stiffness),
    ] {
        demand(setting, stiffness, STIFFNESS, STIFFNESS_REMEDY)?;
    }
    let friction_remedy = "the friction between sole and ground, or a little less";
    demand("constraints.friction", constraints.friction, Range::above_zero_to(10.0), friction_remedy)?;
    if !GENERATORS.contains(&constraints.generators_per_point) {
        return Err(WholeBodyError::Setting {
            setting: "constraints.generators_per_point".to_owned(),
            found: constraints.generators_per_point as f64,
            expected: "4, 8 or 16".to_owned(),
            remedy: "4 is fastest; more buy at most a few per cent of friction",
        });
    }
    let load_remedy = "the share of the weight a foot may carry beyond its plan; 0.1 to 0.3 is useful";
    demand("constraints.load_margin", constraints.load_margin, Range::between(0.0, 1.0), load_remedy)?;
    let braking_remedy = "the deceleration that joints can count on; 20 to 200 is useful";
    demand(
        "constraints.braking_rad_per_s2",
        constraints.braking_rad_per_s2,
        Range::above_zero_to(1e5),
        braking_remedy,
    )?;
    let most = constraints.acceleration_max_rad_per_s2;
    demand("constraints.acceleration_max_rad_per_s2", most, Range::above_zero_to(1e6), "1000 hardly ever binds")?;
    demand("limits.torque_factor", constraints.torque_fraction, FRACTION, "a part of the motors' torque limits")?;
    demand("limits.velocity_factor", constraints.velocity_fraction, FRACTION, "a part of the joints' speed limits")?;
    let margin_deg = constraints.position_margin_rad.to_degrees();
    demand("limits.position_margin_deg", margin_deg, Range::between(0.0, 90.0), "a degree or less is usual")
}

fn check_collision(settings: &WholeBodySettings) -> Result<(), WholeBodyError> {
    let collision = &settings.collision;
    demand("collision.interaction_m", collision.interaction_m, LENGTH, "0.1 is usual")?;
    demand("collision.safety_m", collision.safety_m, Range::between(0.0, 10.0), "0.01 is usual")?;
    if collision.safety_m >= collision.interaction_m {
        return Err(WholeBodyError::Setting {
            setting: "collision.safety_m".to_owned(),
            found: collision.safety_m,
            expected: format!("less than collision.interaction_m = {}", collision.interaction_m),
            remedy: "the damper acts between the two",
        });
    }
    demand("collision.damping_m_per_s", collision.damping_m_per_s, Range::above_zero_to(100.0), "0.5 is usual")
}

fn check_relaxation(settings: &WholeBodySettings) -> Result<(), WholeBodyError> {
    let relaxation = &settings.relaxation;
    for (setting, allowance) in [
        ("relaxation.load_n", relaxation.load_n),
        ("relaxation.collision_m_per_s2", relaxation.collision_m_per_s2),
        ("relaxation.joint_motion_rad_per_s2", relaxation.joint_motion_rad_per_s2),
        ("relaxation.contact_m_per_s2", relaxation.contact_m_per_s2),
    ] {
        demand(setting, allowance, Range::between(0.0, 1e6), "0 keeps the limit whatever comes")?;
    }
    let torque_remedy = "a part of the motors' limits; 0 keeps the controller's limit whatever comes";
    demand("relaxation.torque_factor", relaxation.torque_factor, Range::between(0.0, 1.0), torque_remedy)?;
    let order = &relaxation.order;
    match order.iter().enumerate().find(|(i, limit)| order[..*i].contains(limit)) {
        Some((_, twice)) => Err(WholeBodyError::ListedTwice { limit: *twice }),
        None => Ok(()),
    }
}

fn check_solver(settings: &WholeBodySettings) -> Result<(), WholeBodyError> {
    for backend in [Some(settings.backend), settings.reserve].into_iter().flatten() {
        if let Backend::Interior { tolerance } = backend {
            demand("solver.interior_tolerance", tolerance, Range::between(1e-13, 1e-3), "1e-6 to 1e-10 is useful")?;
        }
    }
    let most = settings.iterations_max as f64;
    demand("solver.iterations_max", most, Range::between(1.0, 1e6), "a walk needs up to some tens; 300 is usual")
}

/// What comes from the robot's folder.
fn check_robot(settings: &WholeBodySettings) -> Result<(), WholeBodyError> {
    demand("sole.length_m", settings.sole.length_m, LENGTH, ROBOT_REMEDY)?;
    demand("sole.width_m", settings.sole.width_m, LENGTH, ROBOT_REMEDY)?;
    for foot in &settings.feet {
        let at = foot.ankle_in_sole_m;
        at.iter().try_for_each(|x| demand("foot.ankle_in_sole_m", *x, COORDINATE, ROBOT_REMEDY))?;
    }
    for target in &settings.posture {
        let setting = format!("half_sitting_deg.{}", target.joint);
        demand(&setting, target.position_rad.to_degrees(), Range::between(-360.0, 360.0), ROBOT_REMEDY)?;
    }
    for capsule in &settings.collision.capsules {
        let key = |key: &str| format!("capsules.{}.{key}", capsule.name);
        demand(&key("radius_m"), capsule.radius_m, LENGTH, ROBOT_REMEDY)?;
        for (end, at) in [("from_m", capsule.from_m), ("to_m", capsule.to_m)] {
            at.iter().try_for_each(|x| demand(&key(end), *x, COORDINATE, ROBOT_REMEDY))?;
        }
    }
    Ok(())
}

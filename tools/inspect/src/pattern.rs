//! `soleus-inspect pattern`: plan a walk, print everything about it, draw it.

mod picture;

use crate::door::{self, Outcome};
use anyhow::Context;
use gait::{CheckReport, CostTerms, GaitError, GaitSettings, PatternProblem, Plan, PlanReport, Quantity, Worst};
use pattern::{Foothold, Planar, Reference, Side, WalkPattern};
use serde::{Deserialize, Serialize};
use spatial::so3;
use std::path::PathBuf;
use std::time::Instant;

/// Plan a walk from a gait configuration and print it: phases with their polynomials, samples, cost by term, violations
/// between the samples of the problem, sizes, times.
///
/// The configuration is TOML; a table [gait] in it is used if there is one (as in config/planner.toml), else the whole file.
/// --example prints one. Polynomials are in powers of the time since their phase began; see the crate `pattern` for how ZMP,
/// COM and each foot's ZMP follow from them.
#[derive(clap::Args)]
pub struct Arguments {
    /// Gait configuration; without it, the defaults.
    #[arg(long)]
    config: Option<PathBuf>,
    /// Overrides a value, as in `--set cost.lambda=0.8` or `--set gait.cost.lambda=0.8`; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Rate of the samples.
    #[arg(long, default_value_t = 200.0)]
    rate_hz: f64,
    /// Draws the paths of ZMP, COM and feet, each foot's ZMP in double support, and one step under the foot.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Prints a complete configuration and ends.
    #[arg(long)]
    example: bool,
}

/// Samples that are printed; each takes about a kilobyte.
const SAMPLES_MAX: f64 = 1e6;

/// Everything that is printed.
#[derive(Serialize)]
struct Answer {
    status: &'static str,
    message: Option<String>,
    #[serde(flatten)]
    solution: Option<Solution>,
}

#[derive(Serialize)]
struct Solution {
    omega_per_s: f64,
    duration_s: f64,
    pattern: WalkPattern,
    landings: Vec<Landing>,
    samples: Vec<Sample>,
    cost: Cost,
    check: Vec<Finding>,
    largest_violation: Option<Finding>,
    sizes: Sizes,
    times_us: Times,
}

#[derive(Serialize)]
struct Landing {
    foot: Side,
    ankle: Foothold,
}

#[derive(Serialize)]
struct Sample {
    t_s: f64,
    phase: usize,
    zmp: Motion,
    com: ComMotion,
    feet: [Foot; 2],
}

#[derive(Serialize)]
struct Motion {
    position: [f64; 2],
    velocity: [f64; 2],
    acceleration: [f64; 2],
}

#[derive(Serialize)]
struct ComMotion {
    position: [f64; 3],
    velocity: [f64; 3],
    acceleration: [f64; 3],
}

#[derive(Serialize)]
struct Foot {
    in_contact: bool,
    load_share: f64,
    force: [f64; 3],
    zmp: Motion,
    ankle: Pose,
}

#[derive(Serialize)]
struct Pose {
    position: [f64; 3],
    rotation: Vec<Vec<f64>>,
    roll_pitch_yaw: [f64; 3],
}

#[derive(Serialize)]
struct Cost {
    objective: f64,
    raw: Terms,
    weighted: Terms,
}

#[derive(Serialize)]
struct Terms {
    com_force: f64,
    ankle_torque_single: f64,
    ankle_torque_double: f64,
    zmp_acceleration: f64,
}

#[derive(Serialize)]
struct Finding {
    quantity: String,
    value: f64,
    phase: usize,
    kind: pattern::PhaseKind,
    step: u32,
    time_s: f64,
    foot: Option<Side>,
}

#[derive(Serialize)]
struct Sizes {
    phases: usize,
    programs: Vec<Program>,
}

#[derive(Serialize)]
struct Program {
    variables: usize,
    equalities: usize,
    inequalities: usize,
    hessian_entries: usize,
    constraint_entries: usize,
    status: String,
    iterations: u32,
    kkt_stationarity: f64,
    kkt_feasibility: f64,
    kkt_complementarity: f64,
}

#[derive(Serialize)]
struct Times {
    build: f64,
    solve: f64,
    check: f64,
}

/// Plans, prints, draws.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if arguments.example {
        print!("{}", toml::to_string(&GaitSettings::default()).context("writing the example")?);
        return Ok(Outcome::Solved);
    }
    anyhow::ensure!(
        arguments.rate_hz > 0.0 && arguments.rate_hz <= 1e6,
        "--rate-hz {}: give a positive rate up to 1e6",
        arguments.rate_hz
    );
    let settings = read(arguments)?;
    let start = Instant::now();
    let problem = match PatternProblem::build(&settings) {
        Ok(problem) => problem,
        Err(error) => return refuse(&error),
    };
    let built = Instant::now();
    let plan = match problem.solve() {
        Ok(plan) => plan,
        Err(error) => return refuse(&error),
    };
    let solved = Instant::now();
    let samples = plan.pattern.duration_s() * arguments.rate_hz;
    anyhow::ensure!(
        samples <= SAMPLES_MAX,
        "--rate-hz {}: {samples:.0} samples, at most {SAMPLES_MAX} are printed: give a lower rate",
        arguments.rate_hz
    );
    let check = gait::check(&plan, &settings, 1e-3, None);
    let checked = Instant::now();
    let microseconds = |from: Instant, to: Instant| (to - from).as_secs_f64() * 1e6;
    let times_us = Times {
        build: microseconds(start, built),
        solve: microseconds(built, solved),
        check: microseconds(solved, checked),
    };
    if let Some(path) = &arguments.svg {
        let svg = picture::draw(&plan, &settings)?;
        std::fs::write(path, svg).with_context(|| format!("writing {}", path.display()))?;
    }
    let solution = solution(plan, &check, arguments.rate_hz, times_us);
    door::write(&Answer { status: "solved", message: None, solution: Some(solution) })?;
    Ok(Outcome::Solved)
}

/// What cannot be walked is an answer; what cannot be understood is an error.
fn refuse(error: &GaitError) -> anyhow::Result<Outcome> {
    let status = match error {
        GaitError::Infeasible { .. } | GaitError::Step { .. } => "infeasible",
        GaitError::NotSolved { .. } => "not_solved",
        other => return Err(anyhow::Error::new(other.clone())),
    };
    door::write(&Answer { status, message: Some(error.to_string()), solution: None })?;
    Ok(Outcome::NotSolved)
}

fn read(arguments: &Arguments) -> anyhow::Result<GaitSettings> {
    let mut table = toml::Table::try_from(GaitSettings::default()).context("writing the defaults")?;
    let mut name = "the defaults".to_string();
    if let Some(path) = &arguments.config {
        name = path.display().to_string();
        let text = files::read_text(path, files::CONFIG_MAX_BYTES).with_context(|| format!("reading {name}"))?;
        table = text.parse().with_context(|| format!("{name} is not TOML"))?;
        if let Some(gait) = table.remove("gait") {
            table = gait.try_into().with_context(|| format!("{name}: gait is not a table"))?;
        }
    }
    let read = |table: toml::Table, name: &str| {
        let wrong = || format!("{name} is no gait configuration (--example prints one)");
        GaitSettings::deserialize(table).with_context(wrong)
    };
    let mut changed = table.clone();
    for assignment in &arguments.set {
        set(&mut changed, assignment)?;
    }
    let all: String = arguments.set.iter().map(|assignment| format!(" --set {assignment}")).collect();
    // What is wrong without them is not theirs, unless they mend it.
    read(changed, &format!("{name} with{all}")).or_else(|error| read(table, &name).and(Err(error)))
}

/// `a.b=value`, the value in TOML's own syntax. A key may begin with `gait.`, as in a planner's configuration.
fn set(table: &mut toml::Table, assignment: &str) -> anyhow::Result<()> {
    let (key, value) = assignment.split_once('=').with_context(|| format!("--set {assignment}: expected KEY=VALUE"))?;
    let key = key.strip_prefix("gait.").unwrap_or(key);
    let parsed: toml::Table =
        format!("value = {value}").parse().with_context(|| format!("--set {assignment}: {value} is no TOML value"))?;
    let mut parts: Vec<_> = key.split('.').collect();
    let last = parts.pop().unwrap_or_default();
    let mut here = table;
    for part in parts {
        let entry = here.entry(part).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        here = entry.as_table_mut().with_context(|| format!("--set {assignment}: {part} is not a table"))?;
    }
    here.insert(last.to_string(), parsed["value"].clone());
    Ok(())
}

fn solution(plan: Plan, check: &CheckReport, rate_hz: f64, times_us: Times) -> Solution {
    let Plan { pattern, landings, report } = plan;
    // The duration is a sum: its rounding must not add a sample that repeats the end.
    let count = (pattern.duration_s() * rate_hz * (1.0 - 1e-12)).ceil() as u64;
    let samples = (0..=count).map(|i| sample(&pattern, &pattern.evaluate(i as f64 / rate_hz))).collect();
    Solution {
        omega_per_s: pattern.omega(),
        duration_s: pattern.duration_s(),
        landings: landings.into_iter().map(|(foot, ankle)| Landing { foot, ankle }).collect(),
        samples,
        cost: Cost { objective: report.objective, raw: terms(&report.terms), weighted: terms(&report.weighted_terms) },
        check: check.worst.iter().map(finding).collect(),
        largest_violation: check.largest_violation().map(finding),
        sizes: sizes(&report),
        times_us,
        pattern,
    }
}

fn sample(pattern: &WalkPattern, r: &Reference) -> Sample {
    Sample {
        t_s: r.t_s,
        phase: r.phase_index,
        zmp: motion(&r.zmp),
        com: ComMotion {
            position: r.com_position().into(),
            velocity: r.com_velocity().into(),
            acceleration: r.com_acceleration().into(),
        },
        feet: r.feet.map(|foot| {
            let pose = gait::ankle_pose(pattern, &foot, r.t_s);
            Foot {
                in_contact: foot.in_contact,
                load_share: foot.share.value,
                force: foot.force.into(),
                zmp: motion(&foot.zmp),
                ankle: Pose {
                    position: pose.translation.into(),
                    rotation: door::rows(&pose.rotation),
                    roll_pitch_yaw: so3::roll_pitch_yaw(&pose.rotation).into(),
                },
            }
        }),
    }
}

fn motion(planar: &Planar) -> Motion {
    Motion {
        position: planar.position.into(),
        velocity: planar.velocity.into(),
        acceleration: planar.acceleration.into(),
    }
}

fn terms(terms: &CostTerms) -> Terms {
    let [com_force, ankle_torque_single, ankle_torque_double, zmp_acceleration] = terms.to_array();
    Terms { com_force, ankle_torque_single, ankle_torque_double, zmp_acceleration }
}

fn finding(worst: &Worst) -> Finding {
    let quantity = match worst.quantity {
        Quantity::ZmpOutsidePolygon => "zmp_outside_polygon_m",
        Quantity::StepTooLong => "step_too_long_m",
        Quantity::StepTooWide => "step_too_wide_m",
        Quantity::FeetTooClose => "feet_too_close_m",
        Quantity::ComEquation => "com_equation_m_per_s2",
        Quantity::LoadBalance => "load_balance_m",
        Quantity::ZmpJump => "zmp_jump_m",
        Quantity::ZmpVelocityJump => "zmp_velocity_jump_m_per_s",
        Quantity::ZmpAccelerationJump => "zmp_acceleration_jump_m_per_s2",
        Quantity::FootZmpJump => "foot_zmp_jump_m",
        Quantity::FootZmpVelocityJump => "foot_zmp_velocity_jump_m_per_s",
        Quantity::FootZmpAccelerationJump => "foot_zmp_acceleration_jump_m_per_s2",
        Quantity::ComJump => "com_jump_m",
        Quantity::ComVelocityJump => "com_velocity_jump_m_per_s",
        Quantity::SpeedAtEnds => "speed_at_ends_m_per_s",
        Quantity::FrictionDemand => "friction_demand",
        Quantity::NegativeZmpMargin => "negative_zmp_margin_m",
    };
    Finding {
        quantity: quantity.to_string(),
        value: worst.value,
        phase: worst.phase,
        kind: worst.kind,
        step: worst.step,
        time_s: worst.time_s,
        foot: worst.foot,
    }
}

fn sizes(report: &PlanReport) -> Sizes {
    let programs = report.programs.iter().map(|p| Program {
        variables: p.variables,
        equalities: p.equalities,
        inequalities: p.inequalities,
        hessian_entries: p.hessian_entries,
        constraint_entries: p.constraint_entries,
        status: format!("{:?}", p.status),
        iterations: p.iterations,
        kkt_stationarity: p.residuals.stationarity,
        kkt_feasibility: p.residuals.feasibility,
        kkt_complementarity: p.residuals.complementarity,
    });
    Sizes { phases: report.phases, programs: programs.collect() }
}

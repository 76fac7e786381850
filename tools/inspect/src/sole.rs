//! `soleus-inspect sole`: a sequence of loads or poses on any soft sole.

use crate::door::{self, Outcome};
use ::sole::{
    ContactReport, ContactStatus, ElementQuality, EstimatorSettings, Foothold, Level, Material, Mesh, MeshQuality,
    MeshSource, NodeState, Plane, PoseDrivenContact, PoseDrivenSettings, SoleModel, SoleSettings, StanceEstimator,
    StanceReference, StanceReport, Status,
};
use anyhow::Context;
use nalgebra::{Matrix3, Vector2};
use robot::{ContactSet, Friction, SoleDescription, SoleLevel};
use serde::{Deserialize, Serialize};
use spatial::{Transform, Vec3, so3};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

const HELP: &str = r#"INPUT, one JSON document on stdin (--example prints a complete one):
  {"first_tick": {"position_xy": [x, y], "yaw": psi},      where the foot landed (m, rad); default 0
   "ticks": [ {"force": [x, y, z], "zmp": [x, y],          force-driven: what the ground must do (N; m, world)
               "force_rate": [3], "force_acceleration": [3], "zmp_rate": [2], "zmp_acceleration": [2]},   optional; default 0
              {"pose": {"position": [3], "rotation": [[3 x 3]]}},    pose-driven: sole frame in the world
              {"lift_off": true} ]}                        the foot leaves the ground; the next tick lands at first_tick
  Force-driven and pose-driven ticks may not be mixed in one sequence: they keep different histories.

OUTPUT: "sole": {"nodes", "tetrahedra", "degrees_of_freedom", "contact_points", "quality", "compliance_condition", "build_time_s"};
     "quality"   of the mesh's elements, 1 for a regular tetrahedron, 0 for a flat one: how many are "below_0.01", "below_0.1", "below_0.3", and
                 the "worst" five with "element" (from 0, in the mesh's order), "quality" and "centre"
  "ticks": per tick
     "pose"      {"position", "rotation", "roll_pitch_yaw"} of the sole frame (R = Rz(yaw) Ry(pitch) Rx(roll))
     "ankle"     the same of the ankle
     "velocity", "acceleration"    of the sole's origin and angular (six numbers), force-driven only
     "force", "zmp", "moment_z"    on the sole; the ZMP on the ground; vertical moment about the ZMP
     "node_positions", "node_forces", "node_states"    world; "free", "stick", "slip"
     "tangent"   6 x 6: wrench about the sole's origin per translation and rotation vector, world axes, at frozen node states
     "residual", "law_violation_n", "iterations", "time_us"
     "status"    "converged", "doubtful-tilt", "doubtful-compression", "indeterminate", "no-load", "outside-friction-cone", "zmp-outside-sole", "fold", "not-converged",
                 "invalid-input", "in-air", "solved", "no-contact"; "detail" says it in words. A tick that is not solved repeats the last pose.
  Exit code 0 only when every tick was solved."#;

/// Which sole.
#[derive(clap::Args)]
#[command(after_long_help = HELP)]
pub struct Arguments {
    /// `sole.toml`, as in `robots/`.
    #[arg(long, required_unless_present = "example")]
    sole: Option<PathBuf>,
    /// Gmsh mesh (2.2 or 4.1, ASCII, metres) instead of the one the file names.
    #[arg(long)]
    mesh: Option<PathBuf>,
    /// Instead of the file's level: rigid, lumped, winkler, fem, quadratic or patches.
    #[arg(long)]
    level: Option<String>,
    /// Cells along x and y for the levels winkler and patches.
    #[arg(long, num_args = 2, value_names = ["NX", "NY"], default_values_t = [6, 5])]
    grid: Vec<usize>,
    /// Scaled residual instead of the file's.
    #[arg(long)]
    tolerance: Option<f64>,
    /// Largest part of the friction cone that a force may use.
    #[arg(long, default_value_t = EstimatorSettings::default().friction_use_max)]
    friction_use_max: f64,
    /// Period of pose-driven ticks (s); matters with --viscosity.
    #[arg(long, default_value_t = 0.005)]
    period: f64,
    /// Kelvin-Voigt time of pose-driven ticks (s).
    #[arg(long, default_value_t = 0.0)]
    viscosity: f64,
    /// The right foot's sole: the mirror image.
    #[arg(long)]
    mirrored: bool,
    /// Write the deformed sole of the last tick as legacy VTK.
    #[arg(long, value_name = "F.vtk")]
    vtk: Option<PathBuf>,
    /// Print a complete input to start from, and stop.
    #[arg(long)]
    example: bool,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Input {
    #[serde(default)]
    first_tick: Landing,
    ticks: Vec<Tick>,
}

#[derive(Clone, Copy, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Landing {
    position_xy: [f64; 2],
    yaw: f64,
}

#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Tick {
    #[serde(skip_serializing_if = "Option::is_none")]
    force: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    zmp: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force_rate: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force_acceleration: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    zmp_rate: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    zmp_acceleration: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pose: Option<PoseInput>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lift_off: Option<bool>,
}

#[derive(Serialize, Deserialize)]
struct PoseInput {
    position: [f64; 3],
    rotation: [[f64; 3]; 3],
    /// Accepted so that an output can be an input; not used.
    #[serde(default, skip_serializing)]
    #[allow(dead_code)]
    roll_pitch_yaw: Option<[f64; 3]>,
}

#[derive(Serialize)]
struct PoseOutput {
    position: [f64; 3],
    rotation: Vec<Vec<f64>>,
    roll_pitch_yaw: [f64; 3],
}

#[derive(Serialize)]
struct Output {
    sole: SoleOutput,
    ticks: Vec<TickOutput>,
}

#[derive(Serialize)]
struct SoleOutput {
    nodes: usize,
    tetrahedra: usize,
    degrees_of_freedom: usize,
    contact_points: usize,
    quality: Option<QualityOutput>,
    compliance_condition: f64,
    build_time_s: f64,
}

#[derive(Serialize)]
struct QualityOutput {
    #[serde(rename = "below_0.01")]
    below_0_01: usize,
    #[serde(rename = "below_0.1")]
    below_0_1: usize,
    #[serde(rename = "below_0.3")]
    below_0_3: usize,
    worst: Vec<ElementOutput>,
}

#[derive(Serialize)]
struct ElementOutput {
    element: usize,
    quality: f64,
    centre: [f64; 3],
}

impl From<&MeshQuality> for QualityOutput {
    fn from(quality: &MeshQuality) -> Self {
        let [below_0_01, below_0_1, below_0_3] = quality.below;
        let output =
            |e: &ElementQuality| ElementOutput { element: e.element, quality: e.quality, centre: e.centre_m.into() };
        Self { below_0_01, below_0_1, below_0_3, worst: quality.worst.iter().map(output).collect() }
    }
}

#[derive(Serialize)]
struct TickOutput {
    pose: PoseOutput,
    ankle: PoseOutput,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocity: Option<[f64; 6]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    acceleration: Option<[f64; 6]>,
    force: [f64; 3],
    zmp: Option<[f64; 2]>,
    moment_z: f64,
    node_positions: Vec<[f64; 3]>,
    node_forces: Vec<[f64; 3]>,
    node_states: Vec<&'static str>,
    tangent: Vec<Vec<f64>>,
    residual: f64,
    law_violation_n: Option<f64>,
    iterations: usize,
    time_us: f64,
    status: &'static str,
    detail: String,
}

// What the output calls below_0.01 and so on.
const _: () = assert!(matches!(MeshQuality::LIMITS, [0.01, 0.1, 0.3]));

/// Reads a sequence, writes what the sole does.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let (Some(path), false) = (&arguments.sole, arguments.example) else {
        door::write(&example())?;
        return Ok(Outcome::Solved);
    };
    let description = SoleDescription::load(path)?;
    let settings = settings(arguments, &description, path)?;
    let start = Instant::now();
    let mut model = SoleModel::build(&settings)?;
    let build_time_s = start.elapsed().as_secs_f64();
    if let Friction::PerPatch(values) = &description.friction {
        model = model.with_friction(values.clone()).context("friction")?;
    }
    if arguments.mirrored {
        model = model.mirrored();
    }
    let statistics = model.statistics();
    let quality = model.mesh().map(Mesh::quality_report);
    // Poor elements cost accuracy near them.
    if let Some(quality) = quality.as_ref().filter(|quality| quality.below[1] > 0) {
        let worst = &quality.worst[0];
        let [x, y, z]: [f64; 3] = worst.centre_m.into();
        eprintln!(
            "soleus-inspect: warning: {} of {} tetrahedra have a quality below {} (1 is regular); the worst is element {} \
             with {:.2e} at ({x:.4}, {y:.4}, {z:.4}) m",
            quality.below[1],
            statistics.tetrahedra,
            MeshQuality::LIMITS[1],
            worst.element,
            worst.quality
        );
    }
    let model = Arc::new(model);
    let input: Input = door::read()?;
    let tolerance = arguments.tolerance.unwrap_or(description.solver.tolerance);
    anyhow::ensure!(tolerance > 0.0, "tolerance: a positive number expected, {tolerance} found");
    let posed = input.ticks.iter().any(|tick| tick.pose.is_some());
    let forced = input.ticks.iter().any(|tick| tick.force.is_some() || tick.zmp.is_some());
    anyhow::ensure!(!(posed && forced), "ticks: force-driven and pose-driven ticks may not be mixed");
    let ticks = if posed {
        pose_driven(arguments, &input, &model, tolerance)?
    } else {
        force_driven(arguments, &input, &model, tolerance)?
    };
    let solved = |tick: &TickOutput| {
        matches!(
            tick.status,
            "converged" | "doubtful-tilt" | "doubtful-compression" | "solved" | "no-contact" | "in-air"
        )
    };
    let outcome = if ticks.iter().all(solved) { Outcome::Solved } else { Outcome::NotSolved };
    if let (Some(target), Some(last)) = (&arguments.vtk, ticks.last()) {
        write_vtk(target, &model, &settings.material, last)?;
    }
    let sole = SoleOutput {
        nodes: statistics.nodes,
        tetrahedra: statistics.tetrahedra,
        degrees_of_freedom: statistics.degrees_of_freedom,
        contact_points: model.contact_points().len(),
        quality: quality.as_ref().map(QualityOutput::from),
        compliance_condition: model.compliance_condition(),
        build_time_s,
    };
    door::write(&Output { sole, ticks })?;
    Ok(outcome)
}

fn settings(arguments: &Arguments, description: &SoleDescription, path: &Path) -> anyhow::Result<SoleSettings> {
    let mesh = match arguments.mesh.clone().or_else(|| description.mesh_file(path)) {
        Some(file) => MeshSource::Mesh(robot::read_mesh(&file)?),
        None => MeshSource::Box {
            size_m: description.mesh.box_m.context("[mesh]: box_m and cells, or file, expected")?,
            cells: description.mesh.cells.context("[mesh]: box_m and cells, or file, expected")?.map(|n| n as usize),
        },
    };
    let cells = [arguments.grid[0], arguments.grid[1]];
    let level = match (arguments.level.as_deref(), description.solver.level) {
        (Some("rigid"), _) | (None, SoleLevel::Rigid) => Level::Rigid,
        (Some("lumped"), _) | (None, SoleLevel::Lumped) => Level::Lumped,
        (Some("winkler"), _) | (None, SoleLevel::Winkler) => Level::Winkler { cells },
        (Some("fem"), _) | (None, SoleLevel::Fem) => Level::Fem,
        (Some("quadratic"), _) | (None, SoleLevel::QuadraticFem) => Level::QuadraticFem,
        (Some("patches"), _) | (None, SoleLevel::Patches) => Level::Patches { cells },
        (Some(other), _) => {
            anyhow::bail!("--level {other}: rigid, lumped, winkler, fem, quadratic or patches expected")
        }
    };
    Ok(SoleSettings {
        mesh,
        material: Material {
            young_modulus_pa: description.material.young_modulus_pa,
            poisson_ratio: description.material.poisson_ratio,
        },
        friction: match &description.friction {
            Friction::Uniform(mu) => *mu,
            Friction::PerPatch(_) => 0.0,
        },
        contact: match description.contact {
            ContactSet::Bottom => ::sole::ContactSet::Bottom,
            ContactSet::All => ::sole::ContactSet::All,
        },
        ankle_in_sole_m: description.foot.ankle_in_sole_m.into(),
        level,
    })
}

fn force_driven(
    arguments: &Arguments,
    input: &Input,
    model: &Arc<SoleModel>,
    tolerance: f64,
) -> anyhow::Result<Vec<TickOutput>> {
    let settings =
        EstimatorSettings { tolerance, friction_use_max: arguments.friction_use_max, ..EstimatorSettings::default() };
    let mut estimator = StanceEstimator::new(Arc::clone(model), settings);
    let [x_m, y_m] = input.first_tick.position_xy;
    let foothold = Foothold { x_m, y_m, yaw_rad: input.first_tick.yaw };
    let mut in_stance = false;
    let mut outputs = Vec::with_capacity(input.ticks.len());
    for (k, tick) in input.ticks.iter().enumerate() {
        let start = Instant::now();
        if tick.lift_off == Some(true) {
            estimator.lift_off();
            in_stance = false;
        } else {
            if !in_stance {
                estimator.touch_down(foothold);
                in_stance = true;
            }
            let force = tick.force.with_context(|| format!("ticks[{k}]: force and zmp, or pose, expected"))?;
            let zmp = tick.zmp.with_context(|| format!("ticks[{k}]: zmp expected"))?;
            let flat = |v: Option<[f64; 2]>| Vector2::from(v.unwrap_or_default());
            estimator.step(&StanceReference {
                force: force.into(),
                force_rate: tick.force_rate.unwrap_or_default().into(),
                force_acceleration: tick.force_acceleration.unwrap_or_default().into(),
                zmp: [Vector2::from(zmp), flat(tick.zmp_rate), flat(tick.zmp_acceleration)],
            });
        }
        let time_us = start.elapsed().as_secs_f64() * 1e6;
        outputs.push(stance(estimator.report(), time_us));
    }
    Ok(outputs)
}

fn pose_driven(
    arguments: &Arguments,
    input: &Input,
    model: &Arc<SoleModel>,
    tolerance: f64,
) -> anyhow::Result<Vec<TickOutput>> {
    let settings =
        PoseDrivenSettings { tolerance, viscosity_time_s: arguments.viscosity, ..PoseDrivenSettings::default() };
    let mut contact = PoseDrivenContact::new(Arc::clone(model), settings);
    let mut outputs = Vec::with_capacity(input.ticks.len());
    for (k, tick) in input.ticks.iter().enumerate() {
        if tick.lift_off == Some(true) {
            contact.reset();
            continue;
        }
        let pose = tick.pose.as_ref().with_context(|| format!("ticks[{k}]: pose expected"))?;
        let rotation = Matrix3::from_fn(|i, j| pose.rotation[i][j]);
        let defect = (rotation.transpose() * rotation - Matrix3::identity()).norm();
        anyhow::ensure!(defect < 1e-6, "ticks[{k}]: rotation is not one (R'R differs from 1 by {defect:e})");
        let x = Transform::new(so3::orthonormalised(&rotation), pose.position.into());
        let start = Instant::now();
        contact.evaluate(&x, &Plane, arguments.period);
        let time_us = start.elapsed().as_secs_f64() * 1e6;
        outputs.push(contact_output(contact.report(), &x, model, time_us));
        contact.commit();
    }
    Ok(outputs)
}

fn pose_output(pose: &Transform) -> PoseOutput {
    PoseOutput {
        position: pose.translation.into(),
        rotation: door::rows(&pose.rotation),
        roll_pitch_yaw: so3::roll_pitch_yaw(&pose.rotation).into(),
    }
}

fn triples(vectors: &[Vec3]) -> Vec<[f64; 3]> {
    vectors.iter().map(|v| (*v).into()).collect()
}

fn state_names(states: &[NodeState]) -> Vec<&'static str> {
    let name = |state: &NodeState| match state {
        NodeState::Free => "free",
        NodeState::Stick => "stick",
        NodeState::Slip => "slip",
    };
    states.iter().map(name).collect()
}

fn stance(report: &StanceReport, time_us: f64) -> TickOutput {
    let status = match report.status {
        Status::InAir => "in-air",
        Status::Converged => "converged",
        Status::DoubtfulTilt { .. } => "doubtful-tilt",
        Status::DoubtfulCompression { .. } => "doubtful-compression",
        Status::Indeterminate => "indeterminate",
        Status::NoLoad { .. } => "no-load",
        Status::OutsideFrictionCone { .. } => "outside-friction-cone",
        Status::ZmpOutsideSole { .. } => "zmp-outside-sole",
        Status::Fold { .. } => "fold",
        Status::NotConverged => "not-converged",
        Status::InvalidInput => "invalid-input",
    };
    TickOutput {
        pose: pose_output(&report.sole_pose),
        ankle: pose_output(&report.ankle_pose),
        velocity: Some(report.twist.to_vector().into()),
        acceleration: Some(report.acceleration.to_vector().into()),
        force: report.wrench.force.into(),
        zmp: Some(report.zmp.into()),
        moment_z: report.moment_z_nm,
        node_positions: triples(&report.node_positions),
        node_forces: triples(&report.node_forces),
        node_states: state_names(&report.node_states),
        tangent: door::rows(&report.tangent),
        residual: report.residual,
        law_violation_n: Some(report.law_violation_n),
        iterations: report.iterations,
        time_us,
        status,
        detail: format!("{:?}", report.status),
    }
}

fn contact_output(report: &ContactReport, pose: &Transform, model: &SoleModel, time_us: f64) -> TickOutput {
    let status = match report.status {
        ContactStatus::NoContact => "no-contact",
        ContactStatus::Solved => "solved",
        ContactStatus::NotConverged => "not-converged",
        ContactStatus::InvalidInput => "invalid-input",
    };
    let o = pose.translation;
    let (force, moment) = (report.wrench.force, report.wrench.moment);
    let about = moment + Vec3::new(0.0, 0.0, o.z).cross(&force);
    let zmp = (force.z > 0.0).then(|| [o.x - about.y / force.z, o.y + about.x / force.z]);
    let moment_z = zmp.map_or(0.0, |[x, y]| about.z - (x - o.x) * force.y + (y - o.y) * force.x);
    let ankle = *pose * Transform::from_translation(model.ankle_in_sole_m());
    TickOutput {
        pose: pose_output(pose),
        ankle: pose_output(&ankle),
        velocity: None,
        acceleration: None,
        force: force.into(),
        zmp,
        moment_z,
        node_positions: triples(&report.node_positions),
        node_forces: triples(&report.node_forces),
        node_states: state_names(&report.node_states),
        tangent: door::rows(&report.tangent),
        residual: report.residual,
        law_violation_n: None,
        iterations: report.iterations,
        time_us,
        status,
        detail: format!("{:?}", report.status),
    }
}

fn write_vtk(target: &Path, model: &SoleModel, material: &Material, tick: &TickOutput) -> anyhow::Result<()> {
    let mesh = model.mesh().context("--vtk: the sole has no mesh")?;
    let rotation = Matrix3::from_fn(|i, j| tick.pose.rotation[i][j]);
    let pose = Transform::new(rotation, tick.pose.position.into());
    let forces: Vec<Vec3> = tick.node_forces.iter().map(|f| (*f).into()).collect();
    let text = ::sole::deformed_sole_vtk(mesh, material, &pose, &forces).context("--vtk (level fem only)")?;
    std::fs::write(target, text).with_context(|| format!("{}: cannot be written", target.display()))
}

/// A flat load, then forward and sideways.
fn example() -> Input {
    let tick = |force: [f64; 3], zmp: [f64; 2]| Tick { force: Some(force), zmp: Some(zmp), ..Tick::default() };
    Input {
        first_tick: Landing::default(),
        ticks: vec![
            tick([0.0, 0.0, 50.0], [0.0, 0.0]),
            tick([5.0, 0.0, 383.0], [0.02, 0.005]),
            tick([15.0, -20.0, 383.0], [0.06, 0.01]),
        ],
    }
}

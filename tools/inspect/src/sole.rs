//! `soleus-inspect sole`: a sequence of loads or poses on any soft sole.

mod input;
mod output;

use crate::door::{self, Outcome};
use ::sole::{
    EstimatorSettings, Foothold, Level, Material, Mesh, MeshQuality, MeshSource, Plane, PoseDrivenContact,
    PoseDrivenSettings, SoleModel, SoleSettings, StanceEstimator, StanceReference,
};
use anyhow::{Context, bail};
use input::{Input, Sequence};
use nalgebra::Matrix3;
use output::{Output, QualityOutput, SoleOutput, TickOutput};
use robot::{ContactSet, Friction, SoleDescription, SoleLevel};
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::Error as ValueError;
use spatial::{Transform, Vec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

const HELP: &str = r#"INPUT, one JSON document on stdin (--example prints a complete one):
  {"first_tick": {"position_xy": [x, y], "yaw": psi},      where the foot landed (m, rad); default 0
   "ticks": [ {"force": [x, y, z], "zmp": [x, y],          force-driven: what the ground must do (N; m, world)
               "force_rate": [3], "force_acceleration": [3], "zmp_rate": [2], "zmp_acceleration": [2]},   optional; default 0
              {"pose": {"position": [3], "rotation": [[3 x 3]]}},    pose-driven: sole frame in the world; roll_pitch_yaw may stand
                                                           beside the rotation and must agree with it
              {"lift_off": true} ]}                        the foot leaves the ground; the next load lands at first_tick
  Force-driven and pose-driven ticks may not be mixed in one sequence: they keep different histories. A pose-driven one has no
  first_tick and begins with a pose.

OUTPUT: "sole": {"nodes", "tetrahedra", "degrees_of_freedom", "contact_points", "quality", "compliance_condition", "build_time_s"};
     "quality"   of the mesh's elements, 1 for a regular tetrahedron, 0 for a flat one: how many are "below_0.01", "below_0.1", "below_0.3", and
                 the "worst" five with "element" (from 0, in the mesh's order), "quality" and "centre"
  "ticks": one per tick of the input
     "pose"      {"position", "rotation", "roll_pitch_yaw"} of the sole frame (R = Rz(yaw) Ry(pitch) Rx(roll))
     "ankle"     the same of the ankle
     "velocity", "acceleration"    of the sole's origin and angular (six numbers), force-driven only
     "force", "zmp", "moment_z"    on the sole; the ZMP on the ground; vertical moment about the ZMP
     "node_positions", "node_forces", "node_states"    world; "open", "stick", "slip"
     "tangent"   6 x 6: wrench about the sole's origin per translation and rotation vector, world axes, at frozen node states
     "residual", "law_violation_n", "iterations", "multiplications" (work, force-driven only), "time_us"
     "status"    "converged", "doubtful-tilt", "doubtful-compression", "indeterminate", "no-load", "too-light",
                 "outside-friction-cone", "zmp-outside-sole", "fold" (shown: there is no pose on the way from the last load), "not-found" (there
                 may be one; force-driven), "not-converged" (pose-driven), "invalid-input", "in-air", "solved", "no-contact"; "detail" says it in words. A load that is not solved, and a foot in
                 the air, repeat the last pose.
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
    /// Instead of the file's level: rigid, lumped, winkler, fem, quadratic-fem (or quadratic), patches or quadratic-patches.
    #[arg(long, value_parser = level)]
    level: Option<SoleLevel>,
    /// Cells along x and y for the levels winkler, patches and quadratic-patches.
    #[arg(long, num_args = 2, value_names = ["NX", "NY"], default_values_t = [6, 5])]
    grid: Vec<usize>,
    /// Scaled residual at which a solution is accepted.
    #[arg(long, value_parser = positive, default_value_t = 1e-10)]
    tolerance: f64,
    /// Largest part of the friction cone that a force may use.
    #[arg(long, value_parser = fraction, default_value_t = EstimatorSettings::default().friction_use_max)]
    friction_use_max: f64,
    /// Period of pose-driven ticks (s); matters with --viscosity.
    #[arg(long, value_parser = positive, default_value_t = 0.005)]
    period: f64,
    /// Kelvin-Voigt time of pose-driven ticks (s).
    #[arg(long, value_parser = not_negative, default_value_t = 0.0)]
    viscosity: f64,
    /// The right foot's sole: the mirror image.
    #[arg(long)]
    mirrored: bool,
    /// Write the deformed sole of the last tick as legacy VTK; level fem only.
    #[arg(long, value_name = "F.vtk")]
    vtk: Option<PathBuf>,
    /// Print a complete input to start from, and stop.
    #[arg(long)]
    example: bool,
}

/// As `sole.toml` spells it, and the short name that this door had first.
fn level(text: &str) -> Result<SoleLevel, ValueError> {
    let name = if text == "quadratic" { "quadratic-fem" } else { text };
    SoleLevel::deserialize(name.into_deserializer())
}

fn number(text: &str, holds: fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x| holds(*x)).ok_or_else(|| format!("{expected} expected"))
}

fn positive(text: &str) -> Result<f64, String> {
    number(text, |x| x > 0.0 && x.is_finite(), "a positive number")
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |x| x >= 0.0 && x.is_finite(), "zero or a positive number")
}

fn fraction(text: &str) -> Result<f64, String> {
    number(text, |x| x > 0.0 && x <= 1.0, "a number above 0, at most 1,")
}

/// Reads a sequence, writes what the sole does.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let (Some(path), false) = (&arguments.sole, arguments.example) else {
        door::write(&input::example())?;
        return Ok(Outcome::Solved);
    };
    let description = SoleDescription::load(path)?;
    let tolerance = arguments.tolerance;
    let settings = settings(arguments, &description, path)?;
    if arguments.vtk.is_some() && settings.level != Level::Fem {
        bail!("--vtk: only the level fem has contact points that are nodes of the mesh");
    }
    let start = Instant::now();
    let file = || path.display().to_string();
    let mut model = SoleModel::build(&settings).with_context(file)?;
    let build_time_s = start.elapsed().as_secs_f64();
    if let Friction::PerPatch(values) = &description.friction {
        model = model.with_friction(values.clone()).context("friction").with_context(file)?;
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
    let sequence: Sequence = door::read::<Input>()?.try_into()?;
    if arguments.vtk.is_some() && sequence.is_empty() {
        bail!("--vtk: there is no tick to draw");
    }
    let ticks = match &sequence {
        Sequence::Loads(foothold, loads) => {
            let friction_use_max = arguments.friction_use_max;
            let settings = EstimatorSettings { tolerance, friction_use_max, ..EstimatorSettings::default() };
            force_driven(&model, settings, *foothold, loads)
        }
        Sequence::Poses(poses) => {
            let viscosity_time_s = arguments.viscosity;
            let settings = PoseDrivenSettings { tolerance, viscosity_time_s, ..PoseDrivenSettings::default() };
            pose_driven(&model, settings, arguments.period, poses)
        }
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
    let level = match arguments.level.unwrap_or(description.solver.level) {
        SoleLevel::Rigid => Level::Rigid,
        SoleLevel::Lumped => Level::Lumped,
        SoleLevel::Winkler => Level::Winkler { cells },
        SoleLevel::Fem => Level::Fem,
        SoleLevel::QuadraticFem => Level::QuadraticFem,
        SoleLevel::Patches => Level::Patches { cells },
        SoleLevel::QuadraticPatches => Level::QuadraticPatches { cells },
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
    model: &Arc<SoleModel>,
    settings: EstimatorSettings,
    foothold: Foothold,
    loads: &[Option<StanceReference>],
) -> Vec<TickOutput> {
    let mut estimator = StanceEstimator::new(Arc::clone(model), settings);
    estimator.touch_down(foothold);
    let mut in_stance = true;
    let tick = |load: &Option<StanceReference>| {
        let start = Instant::now();
        match load {
            None => estimator.lift_off(),
            Some(reference) => {
                if !in_stance {
                    estimator.touch_down(foothold);
                }
                estimator.step(reference);
            }
        }
        in_stance = load.is_some();
        output::stance(estimator.report(), start.elapsed().as_secs_f64() * 1e6)
    };
    loads.iter().map(tick).collect()
}

fn pose_driven(
    model: &Arc<SoleModel>,
    settings: PoseDrivenSettings,
    period_s: f64,
    poses: &[Option<Transform>],
) -> Vec<TickOutput> {
    let mut contact = PoseDrivenContact::new(Arc::clone(model), settings);
    let mut last = Transform::identity();
    let tick = |pose: &Option<Transform>| {
        let start = Instant::now();
        let time_us = |start: Instant| start.elapsed().as_secs_f64() * 1e6;
        let Some(x) = pose else {
            contact.reset();
            return output::in_air(&last, model, time_us(start));
        };
        contact.evaluate(x, &Plane, period_s);
        let time_us = time_us(start);
        contact.commit();
        last = *x;
        output::contact(contact.report(), x, model, time_us)
    };
    poses.iter().map(tick).collect()
}

fn write_vtk(target: &Path, model: &SoleModel, material: &Material, tick: &TickOutput) -> anyhow::Result<()> {
    let rotation = Matrix3::from_fn(|i, j| tick.pose.rotation[i][j]);
    let pose = Transform::new(rotation, tick.pose.position.into());
    let vectors = |rows: &[[f64; 3]]| rows.iter().map(|v| Vec3::from(*v)).collect::<Vec<_>>();
    let (positions, forces) = (vectors(&tick.node_positions), vectors(&tick.node_forces));
    let text = ::sole::deformed_sole_vtk(model, material, &pose, &positions, &forces).context("--vtk")?;
    std::fs::write(target, text).with_context(|| format!("{}: cannot be written", target.display()))
}

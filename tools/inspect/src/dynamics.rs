//! `soleus-inspect dynamics`: all of `multibody` for any URDF.

use crate::door::{self, Outcome};
use anyhow::Context;
use multibody::{
    Base, Configuration, FrameIndex, InertiaCheck, Model, ModelOptions, WholeBodyTerms, Workspace, aba, aba_refined,
    gravity_forces, rnea, whole_body_terms,
};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use spatial::{Transform, Vec3, so3};
use std::collections::BTreeMap;
use std::path::PathBuf;

const HELP: &str = r#"INPUT, one JSON document on stdin (--example prints a complete one):
  {"states": [{
     "base_position": [x, y, z],               m, world; default 0
     "base_quaternion_xyzw": [x, y, z, w],     need not be normalised; default 0 0 0 1
     "joint_angles": {"NAME": value, ...},     rad (m if prismatic); joints not named are at 0
     "v": [...], "a": [...], "tau": [...]      length nv; default 0
  }]}
  v = base linear, base angular (both in the base frame), joint rates in the order that --joints prints; a is its time
  derivative, tau the generalised force. With --fixed-base the six base entries are absent.
  Joints with <mimic> follow their leader: they have no entry in v, a and tau and no angle ("followers" of the output lists them),
  and all results are those of the coupled robot. --lock on the leader locks them as well.

OUTPUT, one JSON document on stdout:
  "robot", "nv", "mass", "joints"; "followers": "name", the "joint" that it follows, "multiplier", "offset";
  "states": one object per state:
     "M"          nv x nv mass matrix
     "nle"        h(q, v): Coriolis, centrifugal and gravity forces
     "gravity"    h(q, 0)
     "rnea"       M a + h(q, v)
     "aba"        M^-1 (tau - h(q, v)); null where M is singular: exit code 1, and if a joint moves nothing "singular_joint" names it
     "aba_error"  estimate of its relative error: what one step of iterative refinement changes; absent with "aba" null
     "com", "Jcom", "com_drift"      centre of mass in the world, its Jacobian (3 x nv), its acceleration when a = 0
     "hg", "Ag", "hg_drift"          momentum about the centre of mass (world axes, linear first), its matrix (6 x nv), its rate
                                     when a = 0
     "frames"     for every --frames NAME: "placement" (4 x 4, in the world), "J" (6 x nv, at the frame's origin, world axes,
                  linear first), "drift" (J's rate times v)
  Matrices are row-major nested lists; SI units."#;

/// What to compute.
#[derive(clap::Args)]
#[command(after_long_help = HELP)]
pub struct Arguments {
    /// URDF of the robot.
    #[arg(long, required_unless_present = "example")]
    robot: Option<PathBuf>,
    /// The root link is attached to the world.
    #[arg(long)]
    fixed_base: bool,
    /// Frames (URDF links) to report.
    #[arg(long, num_args = 1.., value_name = "NAME")]
    frames: Vec<String>,
    /// Acceleration of free fall (m/s^2), world axes.
    #[arg(long, num_args = 3, allow_negative_numbers = true, value_names = ["X", "Y", "Z"], default_values_t = [0.0, 0.0, -9.81])]
    gravity: Vec<f64>,
    /// Joints to lock, with the position (rad, m) at which they are merged into their parents.
    #[arg(long, num_args = 1.., value_name = "NAME=VALUE", value_parser = lock)]
    lock: Vec<(String, f64)>,
    /// Refuse robots with links that no real body can be, instead of naming them on stderr.
    #[arg(long)]
    strict: bool,
    /// Print the names of the joints in the order of v, as a JSON list, and stop.
    #[arg(long)]
    joints: bool,
    /// Print a complete input to start from, and stop.
    #[arg(long)]
    example: bool,
}

fn lock(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("NAME=VALUE expected")?;
    let value = value.parse().map_err(|_| format!("`{value}` is not a number"))?;
    Ok((name.to_owned(), value))
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Input {
    states: Vec<State>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct State {
    #[serde(default)]
    base_position: [f64; 3],
    #[serde(default = "no_rotation")]
    base_quaternion_xyzw: [f64; 4],
    #[serde(default)]
    joint_angles: BTreeMap<String, f64>,
    v: Option<Vec<f64>>,
    a: Option<Vec<f64>>,
    tau: Option<Vec<f64>>,
}

fn no_rotation() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

#[derive(Serialize)]
struct Output<'a> {
    robot: &'a str,
    nv: usize,
    mass: f64,
    joints: Vec<&'a str>,
    followers: Vec<FollowerOutput<'a>>,
    states: Vec<Terms>,
}

#[derive(Serialize)]
struct FollowerOutput<'a> {
    name: &'a str,
    joint: &'a str,
    multiplier: f64,
    offset: f64,
}

#[derive(Serialize)]
#[allow(non_snake_case)] // names of the literature
struct Terms {
    M: Vec<Vec<f64>>,
    nle: Vec<f64>,
    gravity: Vec<f64>,
    rnea: Vec<f64>,
    aba: Option<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    aba_error: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    singular_joint: Option<String>,
    com: [f64; 3],
    Jcom: Vec<Vec<f64>>,
    com_drift: [f64; 3],
    hg: [f64; 6],
    Ag: Vec<Vec<f64>>,
    hg_drift: [f64; 6],
    frames: BTreeMap<String, FrameOutput>,
}

#[derive(Serialize)]
#[allow(non_snake_case)] // names of the literature
struct FrameOutput {
    placement: Vec<Vec<f64>>,
    J: Vec<Vec<f64>>,
    drift: [f64; 6],
}

/// Reads states, writes terms.
pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let Some(path) = &arguments.robot else {
        door::write(&example(&["joint"], 7))?;
        return Ok(Outcome::Solved);
    };
    anyhow::ensure!(
        arguments.gravity.iter().all(|g| g.is_finite()),
        "--gravity {:?}: finite numbers expected",
        arguments.gravity
    );
    let text =
        files::read_text(path, files::URDF_MAX_BYTES).with_context(|| format!("{}: cannot be read", path.display()))?;
    let options = ModelOptions {
        base: if arguments.fixed_base { Base::Fixed } else { Base::Floating },
        locked_joints: arguments.lock.clone(),
        gravity: Vec3::from_column_slice(&arguments.gravity),
        inertia: if arguments.strict { InertiaCheck::Strict } else { InertiaCheck::Tolerant },
    };
    let model = Model::from_urdf(&text, &options).with_context(|| path.display().to_string())?;
    for (link, cause) in model.impossible_links() {
        eprintln!("soleus-inspect: warning: link `{link}` cannot exist: {cause}");
    }
    let joints: Vec<&str> = model.joints().iter().map(|joint| joint.name.as_str()).collect();
    if arguments.joints {
        door::write(&joints)?;
        return Ok(Outcome::Solved);
    }
    if arguments.example {
        door::write(&example(&joints, model.nv()))?;
        return Ok(Outcome::Solved);
    }
    let frames = arguments.frames.iter().map(|name| Ok(model.frame(name)?)).collect::<anyhow::Result<Vec<_>>>()?;
    let input: Input = door::read()?;
    let mut evaluator = Evaluator::new(&model, &frames);
    let states = input.states.iter().enumerate();
    let states: Vec<Terms> = states
        .map(|(k, state)| evaluator.terms(state).with_context(|| format!("states[{k}]")))
        .collect::<anyhow::Result<_>>()?;
    let solved = states.iter().all(|terms| terms.aba.is_some());
    let outcome = if solved { Outcome::Solved } else { Outcome::NotSolved };
    let (followers, mass) = (followers(&model), model.total_mass_kg());
    door::write(&Output { robot: model.name(), nv: model.nv(), mass, joints, followers, states })?;
    Ok(outcome)
}

fn followers(model: &Model) -> Vec<FollowerOutput<'_>> {
    let joints = model.joints();
    let followers = model.followers().iter().map(|follower| FollowerOutput {
        name: &follower.name,
        joint: &joints[follower.joint.0].name,
        multiplier: follower.multiplier,
        offset: follower.offset,
    });
    followers.collect()
}

struct Evaluator<'a> {
    model: &'a Model,
    workspace: Workspace,
    terms: WholeBodyTerms,
}

impl<'a> Evaluator<'a> {
    fn new(model: &'a Model, frames: &[FrameIndex]) -> Self {
        Self { model, workspace: Workspace::new(model), terms: WholeBodyTerms::new(model, frames) }
    }

    fn terms(&mut self, state: &State) -> anyhow::Result<Terms> {
        let (model, ws) = (self.model, &mut self.workspace);
        let q = configuration(model, state)?;
        let read = |name: &str, list: &Option<Vec<f64>>| match list {
            Some(list) => door::vector(name, list, model.nv()),
            None => Ok(DVector::zeros(model.nv())),
        };
        let (v, a, tau) = (read("v", &state.v)?, read("a", &state.a)?, read("tau", &state.tau)?);
        let [mut held, mut forces, mut accelerations, mut refined] = [(); 4].map(|()| DVector::zeros(model.nv()));
        gravity_forces(model, ws, &q, &mut held);
        rnea(model, ws, &q, &v, &a, &mut forces);
        let singular = model.massless_joint();
        let mut aba_error = singular.is_none().then(|| {
            aba(model, ws, &q, &v, &tau, &mut accelerations);
            aba_refined(model, ws, &q, &v, &tau, &mut refined)
        });
        // M of coupled joints may be singular without any massless joint.
        aba_error = aba_error.filter(|error| error.is_finite() && accelerations.iter().all(|a| a.is_finite()));
        whole_body_terms(model, ws, &q, &v, &mut self.terms);
        let sweep = &self.terms;
        let terms = Terms {
            M: door::rows(&sweep.mass_matrix),
            nle: door::list(&sweep.bias),
            gravity: door::list(&held),
            rnea: door::list(&forces),
            aba: aba_error.map(|_| door::list(&accelerations)),
            aba_error,
            singular_joint: singular.map(|joint| model.joints()[joint.0].name.clone()),
            com: sweep.com.into(),
            Jcom: door::rows(&sweep.com_jacobian),
            com_drift: sweep.com_drift.into(),
            hg: sweep.momentum.into(),
            Ag: door::rows(&sweep.centroidal_matrix),
            hg_drift: sweep.centroidal_drift.into(),
            frames: sweep
                .frames
                .iter()
                .map(|frame| {
                    let output = FrameOutput {
                        placement: homogeneous(&frame.placement),
                        J: door::rows(&frame.jacobian),
                        drift: frame.drift.into(),
                    };
                    (model.frames()[frame.frame.0].name.clone(), output)
                })
                .collect(),
        };
        if let Some(quantity) = terms.overflow() {
            anyhow::bail!(
                "`{quantity}` is beyond what a number can hold: use smaller positions, velocities or accelerations"
            );
        }
        Ok(terms)
    }
}

impl Terms {
    /// The first quantity with an entry that is not finite; `aba` says itself where it is not.
    fn overflow(&self) -> Option<&'static str> {
        let rows = |rows: &[Vec<f64>]| rows.iter().flatten().all(|x| x.is_finite());
        let list = |list: &[f64]| list.iter().all(|x| x.is_finite());
        let frames = |frame: &FrameOutput| rows(&frame.placement) && rows(&frame.J) && list(&frame.drift);
        let finite = [
            ("M", rows(&self.M)),
            ("nle", list(&self.nle)),
            ("gravity", list(&self.gravity)),
            ("rnea", list(&self.rnea)),
            ("com", list(&self.com)),
            ("Jcom", rows(&self.Jcom)),
            ("com_drift", list(&self.com_drift)),
            ("hg", list(&self.hg)),
            ("Ag", rows(&self.Ag)),
            ("hg_drift", list(&self.hg_drift)),
            ("frames", self.frames.values().all(frames)),
        ];
        finite.into_iter().find(|(_, finite)| !finite).map(|(name, _)| name)
    }
}

fn configuration(model: &Model, state: &State) -> anyhow::Result<Configuration> {
    let [x, y, z, w] = state.base_quaternion_xyzw;
    let norm = (x * x + y * y + z * z + w * w).sqrt();
    anyhow::ensure!(norm.is_normal(), "base_quaternion_xyzw: {:?} is not a rotation", state.base_quaternion_xyzw);
    let mut q = model.neutral();
    q.base = Transform::new(so3::from_quaternion(w, &Vec3::new(x, y, z)), Vec3::from(state.base_position));
    for (name, position) in &state.joint_angles {
        q.joints[model.joint(name).context("joint_angles")?.0] = *position;
    }
    Ok(q)
}

fn homogeneous(pose: &Transform) -> Vec<Vec<f64>> {
    let (r, p) = (&pose.rotation, &pose.translation);
    let mut rows: Vec<Vec<f64>> = (0..3).map(|i| vec![r[(i, 0)], r[(i, 1)], r[(i, 2)], p[i]]).collect();
    rows.push(vec![0.0, 0.0, 0.0, 1.0]);
    rows
}

/// A state in which nothing is zero.
fn example(joints: &[&str], nv: usize) -> Input {
    let list = |scale: f64| Some((0..nv).map(|i| scale * (1.0 + i as f64 / 8.0)).collect());
    Input {
        states: vec![State {
            base_position: [0.1, -0.2, 0.8],
            base_quaternion_xyzw: [0.1, 0.2, 0.3, 0.9],
            joint_angles: joints
                .iter()
                .enumerate()
                .map(|(i, name)| ((*name).to_owned(), 0.125 * (1.0 + i as f64)))
                .collect(),
            v: list(0.25),
            a: list(-0.5),
            tau: list(1.0),
        }],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PENDULUM: &str = r#"<robot name="pendulum"><link name="base"/>
        <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
          <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="swing" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/></joint></robot>"#;

    fn terms(state: &str) -> anyhow::Result<Terms> {
        let model = Model::from_urdf(PENDULUM, &ModelOptions { base: Base::Fixed, ..Default::default() })?;
        let frame = model.frame("rod")?;
        Evaluator::new(&model, &[frame]).terms(&door::parse(state)?)
    }

    #[test]
    fn a_pendulum_is_computed_as_on_paper() {
        let terms = terms(r#"{"joint_angles": {"swing": 1.5707963267948966}, "v": [3.0], "tau": [1.0]}"#).unwrap();
        // About the hinge: 0.1 + 2 * 0.25; horizontal: the weight's full lever; centripetal acceleration 0.5 * 9.
        assert!((terms.M[0][0] - 0.6).abs() < 1e-15);
        assert!((terms.gravity[0] - 2.0 * 9.81 * 0.5).abs() < 1e-12);
        assert!((terms.aba.unwrap()[0] - (1.0 - terms.nle[0]) / 0.6).abs() < 1e-12);
        assert!(terms.aba_error.unwrap() < 1e-14);
        assert!(
            (terms.com_drift[0] - 4.5).abs() < 1e-12,
            "towards the hinge, which is at +x of the rod: {:?}",
            terms.com_drift
        );
        assert!((terms.com[0] + 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_follower_has_no_entry_and_is_listed() {
        // A second rod on the same hinge, which turns twice as far: 0.6 (1 + 2 * 2).
        let second = r#"<link name="other"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
              <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="echo" type="continuous"><parent link="base"/><child link="other"/><axis xyz="0 1 0"/>
              <mimic joint="swing" multiplier="2" offset="0.5"/></joint></robot>"#;
        let text = PENDULUM.replace("</robot>", second);
        let model = Model::from_urdf(&text, &ModelOptions { base: Base::Fixed, ..Default::default() }).unwrap();
        let listed = serde_json::to_value(followers(&model)).unwrap();
        let expected = serde_json::json!([{"name": "echo", "joint": "swing", "multiplier": 2.0, "offset": 0.5}]);
        assert_eq!(listed, expected);
        let mut evaluator = Evaluator::new(&model, &[]);
        let terms = evaluator.terms(&door::parse(r#"{"joint_angles": {"swing": 0.1}}"#).unwrap()).unwrap();
        assert!((terms.M[0][0] - 3.0).abs() < 1e-15);
        let named =
            evaluator.terms(&door::parse(r#"{"joint_angles": {"echo": 0.1}}"#).unwrap()).err().expect("refused");
        assert!(format!("{named:#}").contains("joint `echo` follows joint `swing`"), "{named:#}");
    }

    #[test]
    fn wrong_input_is_named() {
        let message = |state: &str| format!("{:#}", terms(state).err().expect("wrong"));
        assert!(message(r#"{"v": [1, 2]}"#).contains("v: 1 numbers expected, 2 found"));
        assert!(message(r#"{"joint_angles": {"swimg": 1}}"#).contains("did you mean `swing`"));
        assert!(message(r#"{"base_quaternion_xyzw": [0, 0, 0, 0]}"#).contains("not a rotation"));
        assert!(message(r#"{"angles": {}}"#).contains("unknown field `angles`"));
    }

    #[test]
    fn the_example_is_a_valid_input() {
        let model = Model::from_urdf(PENDULUM, &ModelOptions::default()).unwrap();
        let text = serde_json::to_string(&example(&["swing"], model.nv())).unwrap();
        let input: Input = door::parse(&text).unwrap();
        Evaluator::new(&model, &[]).terms(&input.states[0]).unwrap();
    }
}

//! `soleus-inspect robot`: the draft of a robot's folder.

use crate::door::Outcome;
use anyhow::{Context, bail};
use robot_model::{Draft, MODEL_MASS_KG, draft};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

/// Drafts `robot.toml`, `sole.toml`, `ORIGIN.md` and a walk from a URDF, into a folder that does not exist yet.
///
/// The legs are the two lowest chains of six joints. Whatever the file does not say is assumed, and listed in `ORIGIN.md`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The robot; its root is the floating base.
    #[arg(value_name = "URDF")]
    urdf: PathBuf,
    /// The folder to make, beside `robots/hrp4` for the walk to find its configurations.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

/// Largest URDF that is read (bytes): public ones have up to one megabyte.
const URDF_MAX_BYTES: u64 = 64 << 20;

pub fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let (urdf, out) = (&arguments.urdf, &arguments.out);
    let content = files::read(urdf, URDF_MAX_BYTES).with_context(|| urdf.display().to_string())?;
    let text = String::from_utf8(content).with_context(|| urdf.display().to_string())?;
    let name = urdf.file_name().context("the URDF has no name")?.to_string_lossy().into_owned();
    let draft = draft(&text, &name, &boxes(&text)).with_context(|| urdf.display().to_string())?;
    if out.exists() {
        bail!("{}: it exists; name a folder that does not", out.display());
    }
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    let write = |name: &str, content: &str| {
        let path = out.join(name);
        std::fs::write(&path, content).with_context(|| path.display().to_string())
    };
    write(&name, &text)?;
    write("robot.toml", &format!("{ROBOT_HEAD}{}", toml::to_string(&draft.description)?))?;
    write("sole.toml", &format!("{SOLE_HEAD}{}", toml::to_string(&draft.sole)?))?;
    write("ORIGIN.md", &origin(&draft, &name))?;
    write("walk.toml", &walk(&draft))?;
    // The draft is a robot, or this is a bug.
    robot::Robot::load(out).context("the draft is no robot")?;
    println!("{}: {} of {} joints walk", out.display(), walking(&draft), draft.description.joints.len());
    draft.notes.iter().for_each(|note| println!("- {note}"));
    println!("To try it: cargo walk {}", out.join("walk.toml").display());
    Ok(Outcome::Solved)
}

const ROBOT_HEAD: &str =
    "# A draft by `soleus-inspect robot`; ORIGIN.md lists what is assumed. Every key: robots/hrp4/robot.toml.\n\n";
const SOLE_HEAD: &str =
    "# A draft by `soleus-inspect robot`: a block of foam under the left foot; the right one is its mirror image.\n\n";

fn walking(draft: &Draft) -> usize {
    let locked = draft.description.members(&draft.description.walking_locked).len();
    draft.description.joints.len() - locked
}

/// Where the figures come from.
fn origin(draft: &Draft, name: &str) -> String {
    let mut text =
        format!("# {}\n\nDrafted from `{name}`. Assumed, to be replaced by what is known:\n\n", draft.description.name);
    for note in &draft.notes {
        writeln!(text, "- {note}").expect("a string takes everything");
    }
    text
}

/// A short walk with the configurations of `config/`.
fn walk(draft: &Draft) -> String {
    let mut text = format!(
        "# {} takes five short steps.\ntitle = \"{} tries to walk\"\nrobot = \".\"\n",
        draft.description.name, draft.description.name
    );
    let planner = format!(
        "gait.body.com_height_m = {}\ngait.start.ankle_distance_m = {}\ngait.walk.swings = 5\n",
        draft.com_height_m, draft.ankle_distance_m
    );
    // A stabiliser yields to the moments of its robot's weight.
    let scale = draft.mass_kg / MODEL_MASS_KG;
    let simulator = format!(
        "plant.stabiliser.roll_damping_nm_s_per_rad = {:.1}\nplant.stabiliser.pitch_damping_nm_s_per_rad = {:.1}\n\
         plant.stabiliser.vertical_damping_n_s_per_m = {:.0}.0\n",
        30.0 * scale,
        90.0 * scale,
        2.5e4 * scale
    );
    let keys =
        [("planner", planner.as_str()), ("estimator", ""), ("controller", ""), ("simulator", simulator.as_str())];
    for (process, keys) in keys.into_iter().chain([("recorder", "")]) {
        write!(text, "\n[{process}]\nconfig = \"../../config/{process}.toml\"\n{keys}")
            .expect("a string takes everything");
    }
    text
}

/// Collision boxes of links: size and centre in the link. What cannot be read has none.
fn boxes(text: &str) -> BTreeMap<String, [[f64; 3]; 2]> {
    let Ok(robot) = urdf_rs::read_from_string(text) else { return BTreeMap::new() };
    let of_link = |link: &urdf_rs::Link| {
        link.collision.iter().find_map(|collision| match &collision.geometry {
            urdf_rs::Geometry::Box { size } => Some([**size, *collision.origin.xyz]),
            _ => None,
        })
    };
    robot.links.iter().filter_map(|link| Some((link.name.clone(), of_link(link)?))).collect()
}

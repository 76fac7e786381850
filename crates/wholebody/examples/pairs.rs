//! Which pairs of a robot's capsules should be watched.
//!
//! ```text
//! cargo run -p wholebody --example pairs -- robots/hrp4
//! ```
//!
//! prints, for the joints that walking moves, a `collision_pairs` to copy into `robot.toml`, and every other pair with the
//! reason why it is not in it.
#![allow(clippy::print_stdout)]

use multibody::{Model, ModelOptions};
use robot::Robot;
use spatial::Vec3;
use std::error::Error;
use std::path::Path;
use wholebody::{LinkCapsule, ProposalSettings, Verdict, propose_pairs};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("which robot? give its folder, as robots/hrp4")?;
    let robot = Robot::load(Path::new(&folder))?;
    let options = ModelOptions { locked_joints: robot.description.walking_locked_joints(), ..ModelOptions::default() };
    let model = Model::from_urdf(&robot.urdf, &options)?;
    let capsules: Vec<LinkCapsule> = (robot.description.capsules.iter())
        .map(|capsule| LinkCapsule {
            name: capsule.name.clone(),
            link: capsule.link.clone(),
            from_m: Vec3::from(capsule.from_m),
            to_m: Vec3::from(capsule.to_m),
            radius_m: capsule.radius_m,
        })
        .collect();
    let settings = ProposalSettings::default();
    let mut standing = model.neutral();
    for (position, joint) in standing.joints.iter_mut().zip(model.joints()) {
        *position = robot.description.half_sitting_rad(&joint.name);
    }
    let proposals = propose_pairs(&model, &capsules, &standing, &settings)?;
    let of = |verdict: Verdict| proposals.iter().filter(move |proposal| proposal.verdict == verdict);
    println!("# {} postures, seed {}; near is {} m", settings.samples, settings.seed, settings.near_m);
    println!("collision_pairs = [");
    for proposal in of(Verdict::Proposed) {
        let [a, b] = &proposal.pair;
        let (touching, nearest) = (100.0 * proposal.touching, proposal.distance_min_m);
        println!("    [\"{a}\", \"{b}\"], # touching in {touching:.2} % of the postures, nearest {nearest:.3} m");
    }
    println!("]");
    for verdict in [Verdict::Adjacent, Verdict::AlwaysTouching, Verdict::TouchingStanding, Verdict::NeverNear] {
        for proposal in of(verdict) {
            let [a, b] = &proposal.pair;
            println!("# {verdict:?}: {a}, {b} (nearest {:.3} m)", proposal.distance_min_m);
        }
    }
    Ok(())
}

//! Who may use whom.
//!
//! The table is the architecture: libraries of one subject each, the mathematics behind a fence, processes that know no other
//! process. It is checked against what cargo really builds.

use crate::metadata::Metadata;

/// Each package of the workspace and those it may use directly.
const MAY_USE: &[(&str, &[&str])] = &[
    // Vocabulary and numerics.
    ("spatial", &[]),
    ("qp", &[]),
    ("friction", &[]),
    ("ranges", &[]),
    // Times against the tick's, and how they are judged: told by processes, by the latency test.
    ("lateness", &["ranges"]),
    // Models.
    ("multibody", &["spatial"]),
    ("sole_mesh", &["spatial"]),
    ("sole", &["friction", "sole_mesh", "spatial"]),
    // Behaviour.
    ("pattern", &["spatial"]),
    ("gait", &["pattern", "qp", "ranges", "spatial"]),
    ("wholebody", &["multibody", "qp", "ranges", "spatial"]),
    // What the robot measures becomes the state from which a step starts: it needs the step's types, and nothing of messages.
    ("state", &["multibody", "ranges", "spatial", "wholebody"]),
    // Built into a robot, or its controller's: where it runs is a setting.
    ("stabiliser", &["multibody", "ranges", "spatial"]),
    ("plant", &["multibody", "ranges", "sole", "spatial", "stabiliser"]),
    // The fence: nothing above knows of files, clocks, threads or other processes.
    ("files", &[]),
    ("robot", &["files", "sole_mesh"]),
    ("robot_model", &["multibody", "robot", "spatial"]),
    ("scenario", &["files"]),
    ("soles", &["files", "ranges", "robot", "sole", "spatial"]),
    // The controller tracks by it, and the planner's rehearsal: one function.
    ("tracking", &["multibody", "pattern", "spatial", "wholebody"]),
    // Before anybody walks: what the body adds to the cart-table, what joints and drives need.
    ("rehearsal", &["pattern", "spatial", "stance", "tracking", "wholebody"]),
    // The estimator walks by it, and the planner certifies with it: one function.
    ("stance", &["lateness", "pattern", "ranges", "robot", "sole", "soles", "spatial"]),
    ("messages", &["pattern", "spatial"]),
    ("bus", &["messages"]),
    // What viewers draw turns as everything else does.
    ("recording", &["files", "messages", "spatial"]),
    ("node", &["bus", "lateness", "messages", "scenario"]),
    // Processes.
    (
        "soleus-planner",
        &[
            "bus",
            "gait",
            "messages",
            "multibody",
            "node",
            "pattern",
            "ranges",
            "rehearsal",
            "robot",
            "robot_model",
            "scenario",
            // Whose step and settings the rehearsal has: a copy of them would certify another walk.
            "soleus-controller",
            "sole",
            "soles",
            "spatial",
            "stance",
            "wholebody",
        ],
    ),
    (
        "soleus-estimator",
        &[
            "bus", "lateness", "messages", "node", "pattern", "ranges", "robot", "scenario", "sole", "soles",
            "spatial", "stance",
        ],
    ),
    (
        "soleus-controller",
        &[
            "bus",
            "lateness",
            "messages",
            "multibody",
            "node",
            "pattern",
            "ranges",
            "robot",
            "robot_model",
            "scenario",
            "spatial",
            // For robots whose driver has none.
            "stabiliser",
            "state",
            "tracking",
            "wholebody",
        ],
    ),
    (
        "soleus-simulator",
        &[
            "bus",
            "lateness",
            "messages",
            "multibody",
            "node",
            "pattern",
            "plant",
            "ranges",
            "robot",
            "robot_model",
            "scenario",
            "sole",
            "soles",
            "spatial",
        ],
    ),
    (
        "soleus-recorder",
        &["bus", "files", "lateness", "messages", "node", "ranges", "recording", "robot", "robot_model", "scenario"],
    ),
    (
        "soleus-replayer",
        &[
            "files",
            "messages",
            "node",
            "recording",
            "scenario",
            "soles",
            "soleus-controller",
            "soleus-estimator",
            "soleus-planner",
            "soleus-simulator",
        ],
    ),
    // Compositions.
    (
        "closed_loop",
        &[
            "messages",
            "pattern",
            "ranges",
            "report",
            "robot",
            "scenario",
            "soles",
            "soleus-controller",
            "soleus-estimator",
            "soleus-planner",
            "soleus-recorder",
            "soleus-simulator",
        ],
    ),
    ("report", &["messages", "ranges", "recording", "spatial"]),
    // Tools.
    ("soleus-launch", &["bus", "files", "messages", "node", "recording", "report", "scenario"]),
    (
        "soleus-inspect",
        &[
            // Looking on while a system runs (`list`, `hz`, `echo`, `driver-check`), and an operator's word.
            "bus",
            "files",
            "friction",
            "gait",
            "messages",
            "multibody",
            "node",
            "pattern",
            "qp",
            "recording",
            "report",
            "robot",
            // Drafts a robot's folder.
            "robot_model",
            "scenario",
            "sole",
            "soles",
            "spatial",
        ],
    ),
    ("soleus-latency", &["bus", "lateness", "messages", "node", "recording", "report", "scenario"]),
    // An example to copy: what a driver needs, and no more.
    ("soleus-driver", &["lateness", "messages", "node", "robot"]),
    // Shows what the recorder would record, of the robot that it would draw.
    ("soleus-view", &["bus", "messages", "node", "recording", "robot", "soleus-recorder"]),
    ("xtask", &[]),
    ("mutation", &[]),
    // Tests: what the harness uses; the cases may use everything.
    ("system", &["bus", "messages", "node", "recording"]),
];

/// What must not be reachable from a package, however indirectly: the 200 Hz processes stay small, the mathematics pure.
const MUST_NOT_REACH: &[(&str, &[&str])] = &[
    ("soleus-controller", &["sole", "faer", "gait", "mcap", "recording"]),
    ("soleus-estimator", &["gait", "qp", "clarabel", "multibody", "wholebody", "mcap", "recording"]),
    ("soleus-simulator", &["gait", "wholebody", "mcap", "recording"]),
    ("soleus-planner", &["plant", "mcap", "recording"]),
    ("plant", OUTSIDE),
    ("sole", OUTSIDE),
    ("gait", OUTSIDE),
    ("wholebody", OUTSIDE),
    ("state", OUTSIDE),
    ("friction", OUTSIDE),
    ("multibody", OUTSIDE),
    ("qp", OUTSIDE),
    ("pattern", OUTSIDE),
    ("spatial", OUTSIDE),
    ("lateness", OUTSIDE),
];

/// What mathematics has nothing to do with: other processes, files of recordings, terminals, diagnostics.
const OUTSIDE: &[&str] = &["iceoryx2", "bus", "messages", "node", "mcap", "clap", "tracing", "toml"];

/// Every way in which the rules are broken.
pub fn violations(metadata: &Metadata) -> Vec<String> {
    let mut violations = Vec::new();
    for package in metadata.packages.values().filter(|package| package.ours) {
        let Some((_, allowed)) = MAY_USE.iter().find(|(name, _)| *name == package.name) else {
            violations.push(format!("`{}` is not in the table of tools/xtask/src/rules.rs", package.name));
            continue;
        };
        for used in &package.uses {
            let ours = metadata.packages.get(used).is_some_and(|used| used.ours);
            if ours && !allowed.contains(&used.as_str()) {
                violations.push(format!("`{}` must not use `{used}`", package.name));
            }
        }
    }
    for (name, forbidden) in MUST_NOT_REACH.iter().copied() {
        let uses = metadata.all_uses(name);
        for forbidden in forbidden.iter().filter(|forbidden| uses.contains(**forbidden)) {
            violations
                .push(format!("`{name}` must not reach `{forbidden}`: see `cargo tree -p {name} -i {forbidden}`"));
        }
    }
    violations
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::Package;

    fn package(name: &str, uses: &[&str]) -> (String, Package) {
        let uses = uses.iter().map(|name| (*name).to_string()).collect();
        (name.to_string(), Package { name: name.to_string(), ours: true, uses, license: None })
    }

    #[test]
    fn the_rules_hold() {
        let metadata = Metadata::read().expect("cargo knows this workspace");
        assert_eq!(violations(&metadata), [] as [String; 0]);
    }

    #[test]
    fn each_kind_of_violation_is_found() {
        let packages = [
            package("spatial", &["pattern"]),
            package("pattern", &[]),
            package("news", &[]),
            package("soleus-controller", &["node"]),
            package("node", &["recording"]),
            package("recording", &[]),
        ];
        let metadata = Metadata { packages: packages.into(), ..Metadata::default() };
        let found = violations(&metadata);
        assert!(found.contains(&"`spatial` must not use `pattern`".to_string()), "{found:?}");
        assert!(found.iter().any(|violation| violation.starts_with("`news` is not in the table")), "{found:?}");
        assert!(found.iter().any(|violation| violation.starts_with("`soleus-controller` must not reach `recording`")));
    }
}

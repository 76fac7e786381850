//! Which figures the page has, with their curves, units and captions.

use super::walk::{Column, Walk};

/// A figure.
#[derive(Debug, Clone, Default)]
pub(super) struct Plot {
    pub id: &'static str,
    pub title: &'static str,
    /// Label of the vertical axis.
    pub axis: &'static str,
    pub caption: String,
    pub unit: &'static str,
    pub digits: u32,
    pub logarithmic: Option<[f64; 2]>,
    /// A dashed line: value and what it is.
    pub line: Option<(f64, &'static str)>,
    /// Lower and upper edge of a band: indices of curves.
    pub band: Option<[usize; 2]>,
    pub curves: Vec<Curve>,
}

/// A curve.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    pub label: String,
    /// One of the palette: `a` to `g`, `k` for the text's colour.
    pub color: char,
    pub dashed: bool,
    pub width: f64,
    pub step: f64,
    pub values: Vec<f64>,
    /// Index of a joint for each value, whose name is told beside it.
    pub joints: Option<Vec<f64>>,
}

fn curve(label: &str, color: char, column: &Column) -> Curve {
    Curve {
        label: label.to_string(),
        color,
        dashed: false,
        width: 1.5,
        step: 0.01,
        values: column.0.clone(),
        joints: None,
    }
}

/// Those that a walk can fill.
pub(super) fn plots(walk: &Walk) -> Vec<Plot> {
    let mut plots = vec![com(walk), zmp(walk, "y"), zmp(walk, "x"), force(walk)];
    plots.push(sole(
        walk,
        "roll",
        "Sole roll",
        "roll (mrad)",
        "Tilt of the sole about its own length while it carries load.",
    ));
    plots.push(sole(
        walk,
        "pitch",
        "Sole pitch",
        "pitch (mrad)",
        "Tilt of the sole about its own width while it carries load.",
    ));
    plots.push(sole(
        walk,
        "sink",
        "Sinking",
        "sinking (mm)",
        "How far the sole's frame is below where an undeformed sole would stand on flat ground.",
    ));
    plots.extend([joint_error(walk), torque(walk), ticks(walk), iterations(walk), residual(walk)]);
    plots.extend([base_distance(walk), refused(walk)]);
    plots.retain(|plot| !plot.curves.is_empty());
    plots
}

fn com(walk: &Walk) -> Plot {
    let mut curves = Vec::new();
    for (axis, color) in ["x", "y", "z"].into_iter().zip(['a', 'b', 'c']) {
        if let (Some(real), Some(plan)) =
            (walk.column(&format!("com_{axis}")), walk.column(&format!("com_plan_{axis}")))
        {
            let values = (0..real.0.len()).map(|i| real.at(i) - plan.at(i)).collect();
            curves.push(Curve { values, ..curve(axis, color, real) });
        }
    }
    Plot {
        id: "com",
        title: "Centre of mass: real less planned",
        axis: "COM error (mm)",
        caption: "World axes; against the plan that the drives have reached.".to_string(),
        unit: "mm",
        digits: 2,
        curves,
        ..Plot::default()
    }
}

fn zmp(walk: &Walk, axis: &'static str) -> Plot {
    let sideways = axis == "y";
    let mut curves = Vec::new();
    let mut band = None;
    if let (Some(low), Some(high)) =
        (walk.column(&format!("edge_{axis}_min")), walk.column(&format!("edge_{axis}_max")))
    {
        band = Some([0, 1]);
        curves.push(Curve { width: 0.0, ..curve("soles from", 'g', low) });
        curves.push(Curve { width: 0.0, ..curve("soles to", 'g', high) });
    }
    let names = [("real", 'b', "zmp"), ("left foot", 'a', "zmp_l"), ("right foot", 'c', "zmp_r")];
    for (label, color, name) in names {
        if let Some(column) = walk.column(&format!("{name}_{axis}")) {
            let width = if label == "real" { 1.5 } else { 1.0 };
            curves.push(Curve { width, ..curve(label, color, column) });
        }
    }
    if let Some(column) = walk.column(&format!("zmp_plan_{axis}")) {
        curves.push(Curve { dashed: true, ..curve("planned", 'k', column) });
    }
    Plot {
        id: if sideways { "zmp-y" } else { "zmp-x" },
        title: if sideways { "Zero-moment point sideways" } else { "Zero-moment point forwards" },
        axis: if sideways { "ZMP y (mm)" } else { "ZMP x (mm)" },
        caption: format!(
            "World {axis}. Each foot's is where its own force acts. Grey: from edge to edge of the soles that carry."
        ),
        unit: "mm",
        digits: 1,
        band,
        curves,
        ..Plot::default()
    }
}

/// A pair of curves per foot.
fn per_foot(walk: &Walk, real: &str, planned: &str, words: [&str; 2]) -> Vec<Curve> {
    let mut curves = Vec::new();
    for (foot, side, color) in [("left", "l", 'a'), ("right", "r", 'b')] {
        if let Some(column) = walk.column(&format!("{real}_{side}")) {
            curves.push(curve(&format!("{foot} {}", words[0]), color, column));
        }
        if let Some(column) = walk.column(&format!("{planned}_{side}")) {
            curves.push(Curve { dashed: true, ..curve(&format!("{foot} {}", words[1]), color, column) });
        }
    }
    curves
}

fn force(walk: &Walk) -> Plot {
    let real = if walk.has_truth { "real" } else { "measured" };
    let mut curves = per_foot(walk, "force", "force_plan", [real, "planned"]);
    curves.iter_mut().for_each(|curve| curve.step = 0.1);
    Plot {
        id: "force",
        title: "Normal force",
        axis: "force (N)",
        caption: "Of the ground on each sole. Dashed: what the estimator is given.".to_string(),
        unit: "N",
        digits: 1,
        curves,
        ..Plot::default()
    }
}

fn sole(walk: &Walk, name: &'static str, title: &'static str, axis: &'static str, caption: &str) -> Plot {
    Plot {
        id: name,
        title,
        axis,
        caption: caption.to_string(),
        unit: if name == "sink" { "mm" } else { "mrad" },
        digits: 2,
        curves: per_foot(walk, name, &format!("{name}_est"), ["real", "estimated"]),
        ..Plot::default()
    }
}

fn joint_error(walk: &Walk) -> Plot {
    let joints = walk.column("joint_error_joint").map(|column| column.0.clone());
    let curves = walk.column("joint_error").map(|column| Curve { joints, ..curve("largest", 'a', column) });
    Plot {
        id: "joint-error",
        title: "Joints: largest distance from the reference",
        axis: "error (mrad)",
        caption: "Over all joints; the cursor names the joint.".to_string(),
        unit: "mrad",
        digits: 2,
        curves: curves.into_iter().collect(),
        ..Plot::default()
    }
}

fn torque(walk: &Walk) -> Plot {
    let joints = walk.column("torque_joint").map(|column| column.0.clone());
    let curves = walk.column("torque_use").map(|column| Curve { joints, step: 0.1, ..curve("largest", 'b', column) });
    Plot {
        id: "torque",
        title: "Joints: largest share of the torque limit",
        axis: "torque (% of its limit)",
        caption: "Over all joints, by the URDF's limits; the cursor names the joint.".to_string(),
        unit: "%",
        digits: 1,
        line: Some((100.0, "limit")),
        curves: curves.into_iter().collect(),
        ..Plot::default()
    }
}

fn ticks(walk: &Walk) -> Plot {
    let mut curves = Vec::new();
    for (process, color) in [("simulator", 'c'), ("estimator", 'a'), ("controller", 'b'), ("recorder", 'd')] {
        if let Some(column) = walk.column(&format!("tick_{process}")) {
            curves.push(Curve { width: 1.0, step: 0.001, ..curve(process, color, column) });
        }
    }
    Plot {
        id: "tick",
        title: "Computing time per tick",
        axis: "time (ms)",
        caption: "Logarithmic. Dashed: the control period, 5 ms.".to_string(),
        unit: "ms",
        digits: 3,
        logarithmic: Some([0.005, 100.0]),
        line: Some((5.0, "control period")),
        curves,
        ..Plot::default()
    }
}

fn iterations(walk: &Walk) -> Plot {
    let mut curves = Vec::new();
    for (label, process, color) in [
        ("estimator (Newton)", "estimator", 'a'),
        ("controller (QP)", "controller", 'b'),
        ("simulator (Newton)", "simulator", 'c'),
    ] {
        if let Some(column) = walk.column(&format!("iterations_{process}")) {
            curves.push(Curve { width: 1.0, step: 1.0, ..curve(label, color, column) });
        }
    }
    Plot {
        id: "iterations",
        title: "Iterations of the solvers",
        axis: "count",
        caption: "Per tick; the estimator's are the larger of both feet.".to_string(),
        digits: 0,
        curves,
        ..Plot::default()
    }
}

fn residual(walk: &Walk) -> Plot {
    // As a logarithm: steps of a hundredth of a decade hold from 1e-20 to 1.
    let column = walk.column("residual_controller");
    let curves = column.map(|column| {
        let values = column.0.iter().map(|value| if *value > 0.0 { value.log10() } else { f64::NAN }).collect();
        Curve { values, width: 1.0, ..curve("controller (QP)", 'b', column) }
    });
    Plot {
        id: "residual",
        title: "Residual of the solver",
        axis: "log10 of the KKT residual",
        caption: "A gap is a residual of zero.".to_string(),
        digits: 1,
        curves: curves.into_iter().collect(),
        ..Plot::default()
    }
}

fn base_distance(walk: &Walk) -> Plot {
    let mut curves = Vec::new();
    for (label, name, color) in
        [("position (mm)", "base_distance_m", 'a'), ("orientation (mrad)", "base_distance_rad", 'b')]
    {
        if let Some(column) = walk.column(name) {
            curves.push(curve(label, color, column));
        }
    }
    Plot {
        id: "feedback",
        title: "Feedback: observed base from the model's",
        axis: "distance (mm, mrad)",
        caption: "What the observer draws the model towards.".to_string(),
        digits: 2,
        curves,
        ..Plot::default()
    }
}

fn refused(walk: &Walk) -> Plot {
    let is_any =
        walk.columns.get("measurements_refused").is_some_and(|column| column.0.iter().any(|count| *count > 0.0));
    let column = walk.column("measurements_refused").filter(|_| is_any);
    let curves = column.map(|column| Curve { step: 1.0, ..curve("refused so far", 'b', column) });
    Plot {
        id: "refused",
        title: "Feedback: measurements not used",
        axis: "count",
        caption: "Counted from the start.".to_string(),
        digits: 0,
        curves: curves.into_iter().collect(),
        ..Plot::default()
    }
}

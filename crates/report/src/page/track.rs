//! The ground track as SVG: soles where they stood, centre of mass, zero-moment point. Visible without JavaScript.

use super::walk::{Column, Walk};
use messages::row_major;
use spatial::{Vec3, so3};
use std::fmt::Write;

/// Room around everything that is drawn (m).
const MARGIN_M: f64 = 0.06;
/// Room below for the scale (m).
const SCALE_M: f64 = 0.07;
/// Points of a curve.
const POINTS_MAX: usize = 900;

/// The picture; `None` if nobody says where feet or points were.
pub(super) fn track(walk: &Walk, other: Option<&Walk>) -> Option<String> {
    let mut area = Area::default();
    let walks: Vec<&Walk> = std::iter::once(walk).chain(other).collect();
    let soles: Vec<Vec<Sole>> = walks.iter().map(|walk| stances(walk)).collect();
    soles.iter().flatten().flat_map(|sole| sole.corners).for_each(|point| area.take(point));
    let paths = |walk: &Walk| -> Vec<(&'static str, Vec<[f64; 2]>)> {
        [("com", "com"), ("zmp", "zmp"), ("plan", "zmp_plan")]
            .into_iter()
            .map(|(class, name)| (class, points(walk, name)))
            .filter(|(_, points)| points.len() > 1)
            .collect()
    };
    let paths: Vec<_> = walks.iter().map(|walk| paths(walk)).collect();
    paths.iter().flatten().flat_map(|(_, points)| points).for_each(|point| area.take(*point));
    let [x0, x1, y0, y1] = area.with_margin()?;
    let (width, height) = (x1 - x0, y1 - y0 + SCALE_M);
    let mut svg = format!(
        "<svg class=\"track\" role=\"img\" aria-labelledby=\"h-track\" viewBox=\"{x0:.4} {:.4} {width:.4} {height:.4}\" \
         style=\"aspect-ratio:{:.4}\">",
        -y1,
        width / height
    );
    // Writing to a string cannot fail.
    for (index, soles) in soles.iter().enumerate() {
        for sole in soles {
            let corners = sole.corners.map(|[x, y]| format!("{x:.4},{:.4}", -y)).join(" ");
            let _ =
                write!(svg, "<polygon class=\"{} run{index}\" points=\"{corners}\"/>", ["left", "right"][sole.foot]);
        }
    }
    for (index, paths) in paths.iter().enumerate() {
        for (class, points) in paths {
            let mut path = String::new();
            for [x, y] in points {
                let _ = write!(path, "{}{x:.4} {:.4}", if path.is_empty() { "M" } else { "L" }, -y);
            }
            let _ = write!(svg, "<path class=\"{class} run{index}\" d=\"{path}\"/>");
        }
    }
    let step = if width > 4.0 {
        1.0
    } else if width > 1.6 {
        0.5
    } else {
        0.1
    };
    let decimals = if step < 0.2 || step == 0.5 { 1 } else { 0 };
    let mut tick = (x0 / step).ceil();
    while tick * step <= x1 {
        let (x, y) = (tick * step + 0.0, -y0);
        let _ = write!(svg, "<path class=\"scale\" d=\"M{x:.4} {y:.4}v0.012\"/>");
        let _ = write!(svg, "<text x=\"{x:.4}\" y=\"{:.4}\">{:.decimals$}</text>", y + 0.04, tick * step);
        tick += 1.0;
    }
    svg.push_str("</svg>");
    Some(svg)
}

struct Sole {
    foot: usize,
    corners: [[f64; 2]; 4],
}

/// Where each foot stood: its sole in the middle of every time in which it carried.
fn stances(walk: &Walk) -> Vec<Sole> {
    const CARRIES_N: f64 = 20.0;
    let mut soles = Vec::new();
    for (foot, side) in ["l", "r"].into_iter().enumerate() {
        let Some(force) = walk.column(&format!("force_{side}")).or(walk.column(&format!("force_plan_{side}"))) else {
            continue;
        };
        let mut since = None;
        for index in 0..=force.0.len() {
            let carries = force.at(index) > CARRIES_N;
            match (since, carries) {
                (None, true) => since = Some(index),
                (Some(start), false) => {
                    since = None;
                    let middle = (start + index) / 2;
                    let pose: Vec<f64> = (0..7)
                        .map(|i| {
                            walk.columns.get(&format!("sole_{side}{i}")).map_or(f64::NAN, |column| column.at(middle))
                        })
                        .collect();
                    // Shorter than 30 ms is a foot that bounces.
                    if index - start > 6 && pose.iter().all(|value| value.is_finite()) {
                        let corners = walk.body.sole_corners(&[pose[0], pose[1], pose[2]], &rotation(&pose[3..]));
                        soles.push(Sole { foot, corners });
                    }
                }
                _ => {}
            }
        }
    }
    soles
}

/// Rotation matrix, row-major, of a quaternion x, y, z, w.
fn rotation(q: &[f64]) -> [f64; 9] {
    row_major(&so3::from_quaternion(q[3], &Vec3::new(q[0], q[1], q[2])))
}

fn points(walk: &Walk, name: &str) -> Vec<[f64; 2]> {
    let gone = Column::default();
    let [x, y] = ["x", "y"].map(|axis| walk.column(&format!("{name}_{axis}")).unwrap_or(&gone));
    let stride = (x.0.len() / POINTS_MAX).max(1);
    let points = (0..x.0.len()).step_by(stride).map(|i| [1e-3 * x.at(i), 1e-3 * y.at(i)]);
    // Beyond 100 km nothing walks; a foreign file may say so.
    points.filter(|point| point.iter().all(|value| value.abs() < 1e5)).collect()
}

#[derive(Default)]
struct Area(Option<[f64; 4]>);

impl Area {
    fn take(&mut self, [x, y]: [f64; 2]) {
        let [x0, x1, y0, y1] = self.0.unwrap_or([x, x, y, y]);
        self.0 = Some([x0.min(x), x1.max(x), y0.min(y), y1.max(y)]);
    }

    fn with_margin(&self) -> Option<[f64; 4]> {
        let [x0, x1, y0, y1] = self.0?;
        Some([x0 - MARGIN_M, x1 + MARGIN_M, y0 - MARGIN_M, y1 + MARGIN_M])
    }
}

//! The floor the robot stands on.

use nalgebra::Vector2;
use ranges::{OutOfRange, Range};
use serde::{Deserialize, Serialize};
use sole::Ground;
use spatial::Vec3;

/// The floor: its shape, and places with other friction.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GroundSettings {
    /// Heights.
    pub shape: GroundShape,
    /// Rectangles with other friction; where they overlap the last one counts.
    pub friction_patches: Vec<FrictionPatch>,
}

/// A rectangle of the floor with other friction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionPatch {
    /// Smallest (x, y) (m).
    pub lower_m: [f64; 2],
    /// Largest (x, y) (m).
    pub upper_m: [f64; 2],
    /// Factor on the sole's friction coefficient.
    pub factor: f64,
}

/// Shape of the floor. Heights are world z at a point (x, y).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, tag = "kind", rename_all = "kebab-case")]
pub enum GroundShape {
    /// z = 0.
    #[default]
    Flat,
    /// A plane through the world's origin: z = `rise_x` x + `rise_y` y.
    Slope {
        /// dz/dx.
        rise_x: f64,
        /// dz/dy.
        rise_y: f64,
    },
    /// Stairs along x, level treads: the first rise is at `start_x_m`.
    Steps {
        /// Where the first step begins (m).
        start_x_m: f64,
        /// Depth of a step (m).
        tread_m: f64,
        /// Height of a step (m); negative leads down.
        rise_m: f64,
        /// Number of steps; level after the last.
        count: u32,
    },
    /// Smooth bumps: z = height/2 sin(2 pi x / length) sin(2 pi y / length).
    Bumps {
        /// From valley to crest (m).
        height_m: f64,
        /// Distance from crest to crest along one axis (m).
        length_m: f64,
    },
    /// A table of heights, bilinear between its points and level beyond its border.
    HeightField {
        /// World (x, y) of the first value (m).
        origin_m: [f64; 2],
        /// Distance of neighbouring points (m).
        spacing_m: f64,
        /// Number of points along x.
        columns: usize,
        /// Row by row: x runs first (m).
        heights_m: Vec<f64>,
    },
}

/// Farthest place of a floor (m): soft soles are computed up to there.
const PLACE_M: Range = Range::within(1e5);
/// Height of anything on a floor that is walked on (m).
const HEIGHT_M: Range = Range::within(10.0);
/// Steeper than a tangent of two nothing stands.
const RISE: Range = Range::within(2.0);
const LENGTH_M: Range = Range::between(1e-3, 1e4);

impl GroundSettings {
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        for (i, patch) in self.friction_patches.iter().enumerate() {
            let key = |name: &str| format!("ground.friction_patches[{i}].{name}");
            Range::between(0.0, 100.0).demand(key("factor"), patch.factor, "a factor on the sole's friction")?;
            PLACE_M.demand_each(&key("lower_m"), &patch.lower_m, PLACE_REMEDY)?;
            PLACE_M.demand_each(&key("upper_m"), &patch.upper_m, PLACE_REMEDY)?;
        }
        self.shape.check()
    }
}

const PLACE_REMEDY: &str = "a place near the walk, in metres";
const HEIGHT_REMEDY: &str = "millimetres to centimetres are usual";

impl GroundShape {
    fn check(&self) -> Result<(), OutOfRange> {
        match self {
            Self::Flat => Ok(()),
            Self::Slope { rise_x, rise_y } => {
                RISE.demand("ground.shape.rise_x", *rise_x, "dz/dx; 0.1 is steep")?;
                RISE.demand("ground.shape.rise_y", *rise_y, "dz/dy; 0.1 is steep")
            }
            Self::Steps { start_x_m, tread_m, rise_m, .. } => {
                PLACE_M.demand("ground.shape.start_x_m", *start_x_m, PLACE_REMEDY)?;
                HEIGHT_M.demand("ground.shape.rise_m", *rise_m, HEIGHT_REMEDY)?;
                LENGTH_M.demand("ground.shape.tread_m", *tread_m, "the depth of a step")
            }
            Self::Bumps { height_m, length_m } => {
                HEIGHT_M.demand("ground.shape.height_m", *height_m, HEIGHT_REMEDY)?;
                LENGTH_M.demand("ground.shape.length_m", *length_m, "the distance from crest to crest")
            }
            Self::HeightField { origin_m, spacing_m, columns, heights_m } => {
                PLACE_M.demand_each("ground.shape.origin_m", origin_m, PLACE_REMEDY)?;
                HEIGHT_M.demand_each("ground.shape.heights_m", heights_m, HEIGHT_REMEDY)?;
                LENGTH_M.demand("ground.shape.spacing_m", *spacing_m, "the distance of neighbouring points")?;
                if *columns == 0 || heights_m.is_empty() || heights_m.len() % columns != 0 {
                    let (found, expected) =
                        (format!("a list of {}", heights_m.len()), format!("rows of {columns} each"));
                    return Err(OutOfRange::new("ground.shape.heights_m", found, expected, "x runs first, row by row"));
                }
                Ok(())
            }
        }
    }

    /// Height (m) and its derivatives along x and y.
    fn height_and_rise(&self, x: f64, y: f64) -> (f64, Vector2<f64>) {
        match self {
            Self::Flat => (0.0, Vector2::zeros()),
            Self::Slope { rise_x, rise_y } => (rise_x * x + rise_y * y, Vector2::new(*rise_x, *rise_y)),
            Self::Steps { start_x_m, tread_m, rise_m, count } => {
                let climbed = (((x - start_x_m) / tread_m).floor() + 1.0).clamp(0.0, f64::from(*count));
                (climbed * rise_m, Vector2::zeros())
            }
            Self::Bumps { height_m, length_m } => {
                let k = std::f64::consts::TAU / length_m;
                let ((sx, cx), (sy, cy)) = ((k * x).sin_cos(), (k * y).sin_cos());
                let a = 0.5 * height_m;
                (a * sx * sy, Vector2::new(a * k * cx * sy, a * k * sx * cy))
            }
            Self::HeightField { origin_m, spacing_m, columns, heights_m } => {
                let rows = heights_m.len() / columns;
                let (i, s, slope_x) = cell((x - origin_m[0]) / spacing_m, *columns);
                let (j, t, slope_y) = cell((y - origin_m[1]) / spacing_m, rows);
                let at = |i: usize, j: usize| heights_m[j.min(rows - 1) * columns + i.min(columns - 1)];
                let (z00, z10, z01, z11) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
                let height = (1.0 - t) * ((1.0 - s) * z00 + s * z10) + t * ((1.0 - s) * z01 + s * z11);
                let rise_x = ((1.0 - t) * (z10 - z00) + t * (z11 - z01)) * slope_x / spacing_m;
                let rise_y = ((1.0 - s) * (z01 - z00) + s * (z11 - z10)) * slope_y / spacing_m;
                (height, Vector2::new(rise_x, rise_y))
            }
        }
    }
}

/// Cell and place in it of a coordinate in units of the spacing; slope 0 beyond the border.
fn cell(u: f64, points: usize) -> (usize, f64, f64) {
    let last = (points - 1) as f64;
    let inside = u.clamp(0.0, last);
    let i = inside.floor().min((last - 1.0).max(0.0));
    (i as usize, inside - i, if u == inside { 1.0 } else { 0.0 })
}

impl Ground for GroundSettings {
    fn height_and_normal(&self, x: f64, y: f64) -> (f64, Vec3) {
        if self.shape == GroundShape::Flat {
            return (0.0, Vec3::z());
        }
        let (height, rise) = self.shape.height_and_rise(x, y);
        (height, Vec3::new(-rise.x, -rise.y, 1.0).normalize())
    }

    fn is_plane(&self) -> bool {
        matches!(self.shape, GroundShape::Flat | GroundShape::Slope { .. })
    }

    fn friction_factor(&self, x: f64, y: f64) -> f64 {
        let inside = |p: &&FrictionPatch| {
            (p.lower_m[0]..=p.upper_m[0]).contains(&x) && (p.lower_m[1]..=p.upper_m[1]).contains(&y)
        };
        self.friction_patches.iter().rev().find(inside).map_or(1.0, |patch| patch.factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floors() -> [GroundSettings; 5] {
        shapes().map(|shape| GroundSettings { shape, friction_patches: Vec::new() })
    }

    fn shapes() -> [GroundShape; 5] {
        let heights_m = (0..12).map(|i| 0.01 * f64::from((i * 7) % 5)).collect();
        [
            GroundShape::Flat,
            GroundShape::Slope { rise_x: 0.05, rise_y: -0.02 },
            GroundShape::Bumps { height_m: 0.01, length_m: 0.11 },
            GroundShape::Steps { start_x_m: 0.1, tread_m: 0.25, rise_m: 0.02, count: 3 },
            GroundShape::HeightField { origin_m: [-0.1, -0.1], spacing_m: 0.1, columns: 4, heights_m },
        ]
    }

    #[test]
    fn normals_are_perpendicular_to_the_surface() {
        let step = 1e-6;
        for floor in floors() {
            for (x, y) in [(0.013, 0.027), (0.155, 0.031), (-0.071, 0.012), (3.0, 0.05), (-2.0, -2.0)] {
                let height = |x: f64, y: f64| floor.height_and_normal(x, y).0;
                let normal = floor.height_and_normal(x, y).1;
                let along_x = Vec3::new(2.0 * step, 0.0, height(x + step, y) - height(x - step, y)).normalize();
                let along_y = Vec3::new(0.0, 2.0 * step, height(x, y + step) - height(x, y - step)).normalize();
                assert!((normal.norm() - 1.0).abs() < 1e-15);
                assert!(normal.dot(&along_x).abs() < 1e-8 && normal.dot(&along_y).abs() < 1e-8, "{floor:?} at {x} {y}");
            }
        }
    }

    #[test]
    fn a_height_field_meets_its_values() {
        let floor = &floors()[4];
        for j in 0..3u32 {
            for i in 0..4u32 {
                let (x, y) = (-0.1 + 0.1 * f64::from(i), -0.1 + 0.1 * f64::from(j));
                let wanted = 0.01 * f64::from(((j * 4 + i) * 7) % 5);
                assert!((floor.height_and_normal(x, y).0 - wanted).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn stairs_climb_by_their_rise_and_end() {
        let heights = [0.0, 0.099, 0.101, 0.349, 0.351, 0.7, 9.0].map(|x| floors()[3].height_and_normal(x, 0.3).0);
        for (found, wanted) in heights.into_iter().zip([0.0, 0.0, 0.02, 0.02, 0.04, 0.06, 0.06]) {
            assert!((found - wanted).abs() < 1e-15, "{heights:?}");
        }
    }

    #[test]
    fn the_last_friction_patch_counts() {
        let patch = |lower_m, upper_m, factor| FrictionPatch { lower_m, upper_m, factor };
        let friction_patches = vec![patch([0.0, 0.0], [1.0, 1.0], 0.5), patch([0.5, 0.0], [1.0, 1.0], 0.1)];
        let floor = GroundSettings { friction_patches, ..Default::default() };
        let factors = [(0.2, 0.2), (0.7, 0.2), (1.2, 0.2)].map(|(x, y)| floor.friction_factor(x, y));
        assert_eq!(factors, [0.5, 0.1, 1.0]);
    }
}

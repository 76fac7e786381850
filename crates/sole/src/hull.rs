//! Where a point lies against the convex hull of the contact points.

use nalgebra::Vector2;

/// How far (m) a point lies outside, negative inside: beyond an edge of a counter-clockwise polygon *and* beyond all `points` in
/// that edge's outward direction, so that points which have moved out over the polygon's edge count.
pub(crate) fn distance_outside(
    polygon: impl Iterator<Item = Vector2<f64>> + Clone,
    points: impl Iterator<Item = Vector2<f64>> + Clone,
    p: &Vector2<f64>,
) -> f64 {
    let next = polygon.clone().cycle().skip(1);
    polygon.zip(next).fold(f64::NEG_INFINITY, |worst: f64, (a, b)| {
        let along = (b - a) / (b - a).norm().max(f64::MIN_POSITIVE);
        let outward = Vector2::new(along.y, -along.x);
        let beyond = outward.dot(&(p - a));
        if beyond <= worst {
            return worst;
        }
        worst.max(points.clone().fold(beyond, |least, point| least.min(outward.dot(&(p - point)))))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sole_mesh::convex_hull;

    #[test]
    fn a_square_with_points_inside_has_four_corners() {
        let points = [(0.0, 0.0), (1.0, 0.0), (0.5, 0.5), (1.0, 1.0), (0.5, 0.0), (0.0, 1.0), (0.0, 0.0)];
        let hull = convex_hull(points.iter().map(|(x, y)| Vector2::new(*x, *y)));
        assert_eq!(hull.len(), 4);
        let outside = |points: &[Vector2<f64>], x: f64| {
            distance_outside(hull.iter().copied(), points.iter().copied(), &Vector2::new(x, 0.2))
        };
        assert!((outside(&hull, 0.9) + 0.1).abs() < 1e-15);
        assert!((outside(&hull, 0.3) + 0.2).abs() < 1e-15, "the edge below is nearer");
        assert!((outside(&hull, 1.25) - 0.25).abs() < 1e-15);
        let moved = [Vector2::new(1.2, 0.9)];
        assert!((outside(&moved, 1.25) - 0.05).abs() < 1e-15);
        assert!((outside(&moved, 1.15) + 0.05).abs() < 1e-15);
    }
}

//! Convex polygons of the ground plane: what contact points span, where a zero-moment point may be.

use nalgebra::Vector2;

/// Most corners that two rectangles can span.
const CORNERS_MAX: usize = 8;

/// Corners of the convex hull of points (m), counter-clockwise.
#[must_use]
pub fn convex_hull(points: impl Iterator<Item = Vector2<f64>>) -> Vec<Vector2<f64>> {
    let mut points: Vec<_> = points.collect();
    let mut chain = vec![Vector2::zeros(); 2 * points.len()];
    let count = monotone_chain(&mut points, &mut chain);
    chain.truncate(count);
    chain
}

/// A convex polygon, corners counter-clockwise; memory on the stack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConvexPolygon {
    corners: [Vector2<f64>; CORNERS_MAX],
    count: usize,
}

impl ConvexPolygon {
    /// Convex hull of at most eight points.
    ///
    /// # Panics
    /// With more than eight points.
    #[must_use]
    pub fn hull(points: &[Vector2<f64>]) -> Self {
        assert!(points.len() <= CORNERS_MAX, "{} points, at most {CORNERS_MAX}", points.len());
        let mut sorted = [Vector2::zeros(); CORNERS_MAX];
        let sorted = &mut sorted[..points.len()];
        sorted.copy_from_slice(points);
        let mut chain = [Vector2::zeros(); 2 * CORNERS_MAX];
        let count = monotone_chain(sorted, &mut chain);
        let mut corners = [Vector2::zeros(); CORNERS_MAX];
        corners[..count].copy_from_slice(&chain[..count]);
        Self { corners, count }
    }

    /// The corners, counter-clockwise.
    #[must_use]
    pub fn corners(&self) -> &[Vector2<f64>] {
        &self.corners[..self.count]
    }

    /// The nearest point that is not outside.
    #[must_use]
    pub fn nearest(&self, p: &Vector2<f64>) -> Vector2<f64> {
        let corners = self.corners();
        let edges = || corners.iter().zip(corners.iter().cycle().skip(1));
        if corners.len() >= 3 && edges().all(|(a, b)| (b - a).perp(&(p - a)) >= 0.0) {
            return *p;
        }
        let on_edge = |(a, b): (&Vector2<f64>, &Vector2<f64>)| {
            let e = b - a;
            let length_squared = e.norm_squared();
            if length_squared == 0.0 { *a } else { a + e * ((p - a).dot(&e) / length_squared).clamp(0.0, 1.0) }
        };
        edges().map(on_edge).min_by(|a, b| (a - p).norm_squared().total_cmp(&(b - p).norm_squared())).unwrap_or(*p)
    }
}

/// How far (m) a point lies outside, negative inside: beyond an edge of a counter-clockwise polygon *and* beyond all `points` in
/// that edge's outward direction, so that points which have moved out over the polygon's edge count.
#[must_use]
pub fn distance_outside(
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

/// Andrew's monotone chain: sorts the points and writes the corners of their hull to the front of `chain`, which has room
/// for twice as many. Returns how many corners there are.
fn monotone_chain(points: &mut [Vector2<f64>], chain: &mut [Vector2<f64>]) -> usize {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    match points {
        [] => return 0,
        [first, .., last] if first != last => {}
        [only, ..] => {
            chain[0] = *only;
            return 1;
        }
    }
    let mut count = 0;
    // One chain per side; they share their ends.
    let mut extend = |side: &mut dyn Iterator<Item = &Vector2<f64>>| {
        let start = count;
        for p in side {
            while count >= start + 2 && (chain[count - 1] - chain[count - 2]).perp(&(p - chain[count - 2])) <= 0.0 {
                count -= 1;
            }
            chain[count] = *p;
            count += 1;
        }
        // The last point starts the other chain.
        count -= 1;
    };
    extend(&mut points.iter());
    extend(&mut points.iter().rev());
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(x: f64, y: f64) -> [Vector2<f64>; 4] {
        [(-1.0, -0.5), (1.0, -0.5), (1.0, 0.5), (-1.0, 0.5)].map(|(a, b)| Vector2::new(x + a, y + b))
    }

    #[test]
    fn hull_of_two_rectangles_has_their_outer_corners() {
        let points: Vec<_> = rectangle(0.0, 0.0).into_iter().chain(rectangle(0.7, 2.0)).collect();
        let hull = ConvexPolygon::hull(&points);
        assert_eq!(hull.corners().len(), 6);
        assert_eq!(ConvexPolygon::hull(&rectangle(0.0, 0.0)).corners().len(), 4);
    }

    #[test]
    fn nearest_point_satisfies_the_variational_inequality() {
        let points: Vec<_> = rectangle(0.0, 0.0).into_iter().chain(rectangle(0.7, 2.0)).collect();
        let hull = ConvexPolygon::hull(&points);
        for k in 0..1000 {
            // Evenly over a square about it.
            let (x, y) = ((f64::from(k) * 0.618_034).fract(), (f64::from(k) * 0.754_878).fract());
            let p = Vector2::new(x - 0.5, y - 0.5) * 12.0;
            let nearest = hull.nearest(&p);
            for corner in hull.corners() {
                assert!((p - nearest).dot(&(corner - nearest)) <= 1e-12);
            }
        }
    }

    #[test]
    fn degenerate_hulls_are_points_and_segments() {
        assert_eq!(convex_hull([Vector2::zeros(); 3].into_iter()), [Vector2::zeros()]);
        let p = Vector2::new(0.3, 0.4);
        assert_eq!(ConvexPolygon::hull(&[p]).nearest(&Vector2::new(5.0, 5.0)), p);
        assert_eq!(ConvexPolygon::hull(&[]).nearest(&p), p);
        let segment = ConvexPolygon::hull(&[Vector2::zeros(), Vector2::new(1.0, 0.0), Vector2::new(0.5, 0.0)]);
        assert_eq!(segment.corners().len(), 2);
        assert_eq!(segment.nearest(&p), Vector2::new(0.3, 0.0));
    }

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

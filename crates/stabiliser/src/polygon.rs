//! Convex polygons of the ground plane: where a zero-moment point may be.

use nalgebra::Vector2;

/// Most corners that two rectangles can span.
const CORNERS_MAX: usize = 8;

/// A convex polygon, corners counter-clockwise; memory on the stack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConvexPolygon {
    corners: [Vector2<f64>; CORNERS_MAX],
    count: usize,
}

impl ConvexPolygon {
    /// Convex hull (Andrew's monotone chain) of at most eight points.
    ///
    /// # Panics
    /// With more than eight points.
    #[must_use]
    pub fn hull(points: &[Vector2<f64>]) -> Self {
        assert!(points.len() <= CORNERS_MAX, "{} points, at most {CORNERS_MAX}", points.len());
        let mut sorted = [Vector2::zeros(); CORNERS_MAX];
        let sorted = &mut sorted[..points.len()];
        sorted.copy_from_slice(points);
        sorted.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
        if points.len() < 2 {
            let mut corners = [Vector2::zeros(); CORNERS_MAX];
            corners[..points.len()].copy_from_slice(points);
            return Self { corners, count: points.len() };
        }
        // One chain per side; each is at most all points, together they share their ends.
        let mut chain = [Vector2::zeros(); 2 * CORNERS_MAX];
        let mut count = 0;
        let mut extend = |range: &mut dyn Iterator<Item = &Vector2<f64>>, count: &mut usize| {
            let start = *count;
            for p in range {
                while *count >= start + 2
                    && cross(&(chain[*count - 1] - chain[*count - 2]), &(p - chain[*count - 2])) <= 0.0
                {
                    *count -= 1;
                }
                chain[*count] = *p;
                *count += 1;
            }
            *count -= 1; // the last point starts the other chain
        };
        extend(&mut sorted.iter(), &mut count);
        extend(&mut sorted.iter().rev(), &mut count);
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
        if corners.len() >= 3 && edges().all(|(a, b)| cross(&(b - a), &(p - a)) >= 0.0) {
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

fn cross(a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
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
        let p = Vector2::new(0.3, 0.4);
        assert_eq!(ConvexPolygon::hull(&[p]).nearest(&Vector2::new(5.0, 5.0)), p);
        assert_eq!(ConvexPolygon::hull(&[]).nearest(&p), p);
        let segment = ConvexPolygon::hull(&[Vector2::zeros(), Vector2::new(1.0, 0.0), Vector2::new(0.5, 0.0)]);
        assert_eq!(segment.corners().len(), 2);
        assert_eq!(segment.nearest(&p), Vector2::new(0.3, 0.0));
    }
}

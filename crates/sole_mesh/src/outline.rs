//! The rectangle a sole stands on.

use crate::Mesh;
use nalgebra::Vector2;
use spatial::Vec3;
use spatial::polygon::convex_hull;

/// What planner and controller need of a sole: they know feet as rectangles about the origin of the sole frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outline {
    /// Length and width of the contact points' bounding rectangle, and the height from the lowest of them to the top (m).
    pub size_m: [f64; 3],
    /// The rectangle that carries (m): the bounding rectangle, shrunk about the origin of the sole frame until its corners lie in the
    /// contact points' convex hull. For a sole with four right corners it is the bounding rectangle itself; rounded ones cost what a
    /// foot on its corner could not carry.
    pub carrying_m: [f64; 2],
    /// Centre of the contact points' bounding rectangle, at the height of the lowest of them, in the frame of the mesh (m). A sole
    /// frame has it at its origin.
    pub centre_m: Vec3,
}

impl Outline {
    /// Of a block: its own edges.
    #[must_use]
    pub fn block(size_m: [f64; 3]) -> Self {
        Self { size_m, carrying_m: [size_m[0], size_m[1]], centre_m: Vec3::zeros() }
    }
}

impl Mesh {
    /// Where the contact points are.
    #[must_use]
    pub fn outline(&self) -> Outline {
        let points = || self.contact.iter().map(|node| self.nodes[*node]);
        let low = points().fold(Vec3::repeat(f64::INFINITY), |low, p| low.inf(&p));
        let high = points().fold(Vec3::repeat(f64::NEG_INFINITY), |high, p| high.sup(&p));
        let [length_m, width_m] = [high.x - low.x, high.y - low.y];
        let hull = convex_hull(points().map(|p| p.xy()));
        // Edge by edge: how far the hull reaches in the outward direction, over how far the rectangle does.
        let share = hull.iter().zip(hull.iter().cycle().skip(1)).fold(1.0_f64, |share, (a, b)| {
            let outward = Vector2::new(b.y - a.y, a.x - b.x);
            let rectangle = 0.5 * (outward.x.abs() * length_m + outward.y.abs() * width_m);
            share.min(outward.dot(a) / rectangle)
        });
        Outline {
            size_m: [length_m, width_m, self.bounds().1.z - low.z],
            carrying_m: [share.max(0.0) * length_m, share.max(0.0) * width_m],
            centre_m: Vec3::new(0.5 * (low.x + high.x), 0.5 * (low.y + high.y), low.z),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_meshed_is_the_block() {
        let size_m = [0.23, 0.13, 0.021];
        let outline = Mesh::kuhn_box(size_m, [12, 7, 3]).expect("a block").outline();
        assert_eq!(outline, Outline::block(size_m));
    }

    #[test]
    fn a_moved_block_says_where_it_is_and_its_rectangle_shrinks_about_the_origin() {
        let mut mesh = Mesh::kuhn_box([0.2, 0.1, 0.02], [2, 2, 1]).expect("a block");
        mesh.nodes.iter_mut().for_each(|p| *p += Vec3::new(0.05, 0.0, 0.01));
        let outline = mesh.outline();
        assert!((outline.centre_m - Vec3::new(0.05, 0.0, 0.01)).norm() < 1e-15);
        // It begins 0.05 m behind the origin, where the centred one would begin at 0.1 m.
        assert!((outline.carrying_m[0] - 0.1).abs() < 1e-15 && (outline.carrying_m[1] - 0.05).abs() < 1e-15);
        assert!((outline.size_m[0] - 0.2).abs() < 1e-15 && (outline.size_m[2] - 0.02).abs() < 1e-15);
    }

    #[test]
    fn a_mesh_that_is_not_over_the_origin_carries_nothing() {
        let mut mesh = Mesh::kuhn_box([0.2, 0.1, 0.02], [2, 2, 1]).expect("a block");
        mesh.nodes.iter_mut().for_each(|p| p.x += 0.15);
        assert_eq!(mesh.outline().carrying_m, [0.0, 0.0]);
    }

    #[test]
    fn an_ellipse_carries_the_rectangle_inscribed_in_it() {
        let mut mesh = Mesh::kuhn_box([1.0, 1.0, 0.02], [8, 8, 1]).expect("a block");
        // Squares about the origin become circles, then the circles ellipses.
        for p in &mut mesh.nodes {
            (p.x, p.y) = (2.0 * p.x, 2.0 * p.y);
            let square = p.x.abs().max(p.y.abs());
            let norm = p.xy().norm().max(f64::MIN_POSITIVE);
            (p.x, p.y) = (0.12 * p.x * square / norm, 0.06 * p.y * square / norm);
        }
        let outline = mesh.outline();
        assert!((outline.size_m[0] - 0.24).abs() < 1e-12 && (outline.size_m[1] - 0.12).abs() < 1e-12);
        // 32 points lie on the ellipse, one of them at each corner of the rectangle sought.
        let inscribed = std::f64::consts::FRAC_1_SQRT_2;
        assert!((outline.carrying_m[0] - 0.24 * inscribed).abs() < 1e-12, "{outline:?}");
        assert!((outline.carrying_m[1] - 0.12 * inscribed).abs() < 1e-12, "{outline:?}");
    }
}

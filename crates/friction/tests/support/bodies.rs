//! Rigid bodies in contact as contact problems: `q = J (v + dt M^-1 f)`, `W = dt J M^-1 J'`, velocities after a step
//! under gravity.

use friction::ContactProblem;
use nalgebra::{DMatrix, DVector, Matrix3, UnitVector3, Vector3};

/// A homogeneous box.
pub struct Body {
    pub centre: Vector3<f64>,
    pub mass: f64,
    pub size: Vector3<f64>,
    pub velocity: Vector3<f64>,
    /// Beside the weight.
    pub force: Vector3<f64>,
}

/// A point where `upper` touches `lower`; none is the ground. The normal points to `upper`.
pub struct Touch {
    pub point: Vector3<f64>,
    pub normal: UnitVector3<f64>,
    pub upper: usize,
    pub lower: Option<usize>,
}

#[derive(Default)]
pub struct Scene {
    pub bodies: Vec<Body>,
    pub touches: Vec<Touch>,
}

const STEP_S: f64 = 1e-3;
const GRAVITY: f64 = 9.81;

impl Scene {
    pub fn add(&mut self, centre: Vector3<f64>, size: Vector3<f64>, density: f64) -> usize {
        let mass = density * size.x * size.y * size.z;
        self.bodies.push(Body { centre, mass, size, velocity: Vector3::zeros(), force: Vector3::zeros() });
        self.bodies.len() - 1
    }

    /// `nx` x `ny` points of a rectangle between two bodies.
    pub fn touch(
        &mut self,
        centre: Vector3<f64>,
        [along, across]: [Vector3<f64>; 2],
        [nx, ny]: [usize; 2],
        upper: usize,
        lower: Option<usize>,
    ) {
        let normal = UnitVector3::new_normalize(along.cross(&across));
        let part = |i: usize, n: usize| if n == 1 { 0.0 } else { i as f64 / (n - 1) as f64 - 0.5 };
        for i in 0..nx {
            for j in 0..ny {
                let point = centre + part(i, nx) * along + part(j, ny) * across;
                self.touches.push(Touch { point, normal, upper, lower });
            }
        }
    }

    pub fn weight_n(&self) -> f64 {
        self.bodies.iter().map(|body| body.mass * GRAVITY).sum()
    }

    pub fn problem(&self, mu: f64) -> ContactProblem {
        let (n, rows) = (self.bodies.len(), 3 * self.touches.len());
        let mut inverse_mass = DMatrix::zeros(6 * n, 6 * n);
        let mut velocity = DVector::zeros(6 * n);
        for (b, body) in self.bodies.iter().enumerate() {
            let s = body.size.component_mul(&body.size);
            let inertia = Vector3::new(s.y + s.z, s.x + s.z, s.x + s.y) * body.mass / 12.0;
            for i in 0..3 {
                inverse_mass[(6 * b + i, 6 * b + i)] = 1.0 / body.mass;
                inverse_mass[(6 * b + 3 + i, 6 * b + 3 + i)] = 1.0 / inertia[i];
            }
            let fall = Vector3::new(0.0, 0.0, -GRAVITY) + body.force / body.mass;
            velocity.fixed_rows_mut::<3>(6 * b).copy_from(&(body.velocity + STEP_S * fall));
        }
        let mut j = DMatrix::zeros(rows, 6 * n);
        for (a, touch) in self.touches.iter().enumerate() {
            let z = touch.normal.into_inner();
            let x = if z.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
            let t2 = z.cross(&x).normalize();
            let frame = Matrix3::from_rows(&[t2.cross(&z).transpose(), t2.transpose(), z.transpose()]);
            for (body, sign) in [(Some(touch.upper), 1.0), (touch.lower, -1.0)] {
                let Some(b) = body else { continue };
                let arm = touch.point - self.bodies[b].centre;
                j.fixed_view_mut::<3, 3>(3 * a, 6 * b).copy_from(&(sign * frame));
                j.fixed_view_mut::<3, 3>(3 * a, 6 * b + 3).copy_from(&(-sign * frame * arm.cross_matrix()));
            }
        }
        let w = &j * inverse_mass * j.transpose() * STEP_S;
        let w = 0.5 * (&w + w.transpose());
        ContactProblem::new(w, &j * velocity, vec![mu; self.touches.len()]).expect("W of rigid bodies is semi-definite")
    }
}

/// Numbers in -1..1, the same ones every time.
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / f64::from(1_u32 << 31) * 2.0 - 1.0
    }
}

/// A box on `k` x `k` points, pushed.
pub fn slab(k: usize, push: Vector3<f64>) -> Scene {
    let mut scene = Scene::default();
    let body = scene.add(Vector3::new(0.0, 0.0, 0.1), Vector3::new(0.6, 0.4, 0.2), 600.0);
    scene.bodies[body].force = push;
    scene.touch(Vector3::zeros(), [Vector3::x() * 0.6, Vector3::y() * 0.4], [k, k], body, None);
    scene
}

/// Boxes on top of each other, a little beside each other, on `k` x `k` points each.
pub fn stack(count: usize, k: usize, seed: u64) -> Scene {
    let mut next = random(seed);
    let mut scene = Scene::default();
    let mut height = 0.0;
    let mut before = Vector3::zeros();
    for i in 0..count {
        let size = Vector3::new(0.5 + 0.1 * next(), 0.4 + 0.1 * next(), 0.2 + 0.05 * next());
        let centre = Vector3::new(0.04 * next(), 0.04 * next(), height + 0.5 * size.z);
        let density = 800.0 * (1.5 * next()).exp();
        let body = scene.add(centre, size, density);
        let push = Vector3::new(next(), next(), 0.2 * next()) * 0.3 * scene.bodies[body].mass * GRAVITY;
        scene.bodies[body].force = push;
        let middle = Vector3::new(0.5 * (centre.x + before.x), 0.5 * (centre.y + before.y), height);
        let lower = i.checked_sub(1);
        scene.touch(middle, [Vector3::x() * 0.4, Vector3::y() * 0.3], [k, k], body, lower);
        before = centre;
        height += size.z;
    }
    scene
}

/// A round arch of blocks between two abutments, four or more points per joint.
pub fn arch(blocks: usize, k: usize, seed: u64) -> Scene {
    let mut next = random(seed);
    let mut scene = Scene::default();
    let (radius, thickness, width) = (2.0, 0.5, 0.6);
    let at = |angle: f64| Vector3::new(-angle.cos(), 0.0, angle.sin()) * radius;
    let step = std::f64::consts::PI / blocks as f64;
    for i in 0..blocks {
        let size = Vector3::new(step * radius, width, thickness);
        let body = scene.add(at(step * (i as f64 + 0.5)), size, 2200.0 * (1.0 + 0.3 * next()));
        scene.bodies[body].force = Vector3::new(next(), next(), next()) * 0.05 * scene.bodies[body].mass * GRAVITY;
    }
    for i in 0..=blocks {
        let angle = step * i as f64;
        let along = at(angle).normalize() * thickness;
        let across = Vector3::y() * width;
        // The joint's normal points along the arch, to the next block; the last joint's to the last block.
        let (upper, lower) = if i < blocks { (i, i.checked_sub(1)) } else { (blocks - 1, None) };
        let sides = if i < blocks { [across, along] } else { [along, across] };
        scene.touch(at(angle), sides, [k, 2], upper, lower);
    }
    scene
}

/// A wall of bricks in running bond.
pub fn wall(courses: usize, bricks: usize, k: usize, seed: u64) -> Scene {
    let mut next = random(seed);
    let mut scene = Scene::default();
    let size = Vector3::new(0.4, 0.2, 0.15);
    for course in 0..courses {
        for i in 0..bricks {
            let x = (i as f64 + 0.5 * (course % 2) as f64) * size.x;
            let body =
                scene.add(Vector3::new(x, 0.0, (course as f64 + 0.5) * size.z), size, 1800.0 * (1.0 + 0.2 * next()));
            scene.bodies[body].force = Vector3::new(next(), next(), next()) * 0.2 * scene.bodies[body].mass * GRAVITY;
            let z = course as f64 * size.z;
            for half in [-1.0, 1.0] {
                let middle = Vector3::new(x + half * 0.25 * size.x, 0.0, z);
                let sides = [Vector3::x() * 0.4 * size.x, Vector3::y() * size.y];
                if course == 0 {
                    scene.touch(middle, sides, [k, k], body, None);
                } else {
                    let below =
                        i as isize + if course % 2 == 0 { (half as isize - 1) / 2 } else { (half as isize + 1) / 2 };
                    if (0..bricks as isize).contains(&below) {
                        scene.touch(middle, sides, [k, k], body, Some((course - 1) * bricks + below as usize));
                    }
                }
            }
        }
    }
    scene
}

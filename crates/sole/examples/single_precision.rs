//! Would single precision pay? `cargo run --profile bench -p sole --example single_precision`.
//!
//! The estimator walks a stance; its contact sets, displacements and forces are kept. The same sequence of landings and lift-offs then
//! updates the stiffness `K_c` of the points in contact in 64 and in 32 bits, as the estimator does, and gives the forces `K_c u` of every tick:
//! the time of the updates, and what their rounding does to forces and pose. A third row mends the forces of the second by one step of
//! iterative refinement, `f += K_c (u - C f)` with the residual in 64 bits. Thread CPU time.
#![allow(clippy::print_stdout)]

#[path = "../tests/suite/walking_stance.rs"]
#[allow(dead_code)]
mod walking_stance;

use nalgebra::{DVector, Matrix3, Vector6};
use sole::{ContactState, EstimatorSettings, Foothold, Level, MeshSource, SoleModel, SoleSettings, StanceEstimator};
use spatial::{Mat6, Transform, Vec3};
use std::sync::Arc;

/// Below this load the pose is that of a foot in the air for all that it matters.
const LOAD_COUNTED_N: f64 = 5.0;
const REPEATS: usize = 10;

fn thread_time_us() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a live timespec; the call writes it and touches nothing else.
    #[allow(unsafe_code)]
    unsafe {
        libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut t);
    }
    1e6 * t.tv_sec as f64 + 1e-3 * t.tv_nsec as f64
}

trait Number: Copy + Default {
    fn of(x: f64) -> Self;
    fn wide(self) -> f64;
    /// `a b + self`
    fn plus(self, a: Self, b: Self) -> Self;
}

macro_rules! number {
    ($t:ty) => {
        #[allow(clippy::cast_possible_truncation, clippy::unnecessary_cast)]
        impl Number for $t {
            fn of(x: f64) -> Self {
                x as $t
            }
            fn wide(self) -> f64 {
                self as f64
            }
            fn plus(self, a: Self, b: Self) -> Self {
                a.mul_add(b, self)
            }
        }
    };
}
number!(f32);
number!(f64);

fn add_three<T: Number>(target: &mut [T], a: &[T], b: &[T], c: &[T], x: [T; 3]) {
    let n = target.len();
    let (a, b, c) = (&a[..n], &b[..n], &c[..n]);
    for i in 0..n {
        target[i] = target[i].plus(x[0], a[i]).plus(x[1], b[i]).plus(x[2], c[i]);
    }
}

/// `K_c` of the points in contact, updated by rank three as in the crate.
struct Stiffness<T> {
    ld: usize,
    points: Vec<usize>,
    k: Vec<T>,
    compliance: Vec<T>,
    column: Vec<T>,
    gain: Vec<T>,
    scaled: Vec<T>,
}

impl<T: Number> Stiffness<T> {
    fn new(model: &SoleModel) -> Self {
        let ld = model.compliance().nrows();
        let narrow = |m: &[f64]| m.iter().map(|x| T::of(*x)).collect();
        Self {
            ld,
            points: (0..ld / 3).collect(),
            k: narrow(model.stiffness().as_slice()),
            compliance: narrow(model.compliance().as_slice()),
            column: vec![T::default(); 3 * ld],
            gain: vec![T::default(); 3 * ld],
            scaled: vec![T::default(); 3 * ld],
        }
    }

    fn gain_times(&mut self, m: usize, inverse: &Matrix3<f64>) {
        let ld = self.ld;
        for axis in 0..3 {
            let target = &mut self.scaled[axis * ld..axis * ld + m];
            target.fill(T::default());
            let x = [0, 1, 2].map(|i| T::of(inverse[(i, axis)]));
            add_three(target, &self.gain[..m], &self.gain[ld..ld + m], &self.gain[2 * ld..2 * ld + m], x);
        }
    }

    fn rank_three(&mut self, m: usize, sign: f64) {
        let ld = self.ld;
        for j in 0..m {
            let x = [0, 1, 2].map(|i| T::of(sign * self.gain[i * ld + j].wide()));
            let h = &self.scaled;
            add_three(&mut self.k[j * ld..j * ld + m], &h[..m], &h[ld..ld + m], &h[2 * ld..2 * ld + m], x);
        }
    }

    fn lift(&mut self, slot: usize) {
        let (ld, m, a) = (self.ld, 3 * self.points.len(), 3 * slot);
        let own = Matrix3::from_fn(|i, j| self.k[(a + j) * ld + a + i].wide());
        for axis in 0..3 {
            let (gain, k) = (&mut self.gain, &self.k);
            gain[axis * ld..axis * ld + m].copy_from_slice(&k[(a + axis) * ld..(a + axis) * ld + m]);
        }
        self.gain_times(m, &own.try_inverse().expect("K is positive definite"));
        self.rank_three(m, -1.0);
        let last = m - 3;
        for axis in 0..3 {
            self.k.copy_within((last + axis) * ld..(last + axis) * ld + m, (a + axis) * ld);
        }
        for j in 0..last {
            self.k.copy_within(j * ld + last..j * ld + m, j * ld + a);
        }
        self.points.swap_remove(slot);
    }

    fn land(&mut self, point: usize) {
        let (ld, m) = (self.ld, 3 * self.points.len());
        self.gain.fill(T::default());
        for axis in 0..3 {
            let source = &self.compliance[(3 * point + axis) * ld..(3 * point + axis + 1) * ld];
            for (slot, other) in self.points.iter().enumerate() {
                self.column[axis * ld + 3 * slot..axis * ld + 3 * slot + 3]
                    .copy_from_slice(&source[3 * other..3 * other + 3]);
            }
        }
        let (g0, rest) = self.gain.split_at_mut(ld);
        let (g1, g2) = rest.split_at_mut(ld);
        for j in 0..m {
            let k = &self.k[j * ld..j * ld + m];
            let x = [0, 1, 2].map(|axis| self.column[axis * ld + j]);
            for i in 0..m {
                g0[i] = g0[i].plus(x[0], k[i]);
                g1[i] = g1[i].plus(x[1], k[i]);
                g2[i] = g2[i].plus(x[2], k[i]);
            }
        }
        let schur = Matrix3::from_fn(|i, j| {
            let (c, g) = (&self.column[i * ld..i * ld + m], &self.gain[j * ld..j * ld + m]);
            let product: f64 = c.iter().zip(g).map(|(c, g)| c.wide() * g.wide()).sum();
            self.compliance[(3 * point + j) * ld + 3 * point + i].wide() - product
        });
        let inverse = schur.try_inverse().expect("C is positive definite");
        self.gain_times(m, &inverse);
        self.rank_three(m, 1.0);
        for axis in 0..3 {
            for i in 0..m {
                let value = T::of(-self.scaled[axis * ld + i].wide());
                self.k[(m + axis) * ld + i] = value;
                self.k[i * ld + m + axis] = value;
            }
            for other in 0..3 {
                self.k[(m + axis) * ld + m + other] = T::of(inverse[(other, axis)]);
            }
        }
        self.points.push(point);
    }

    /// Makes the contact set that of a tick.
    fn follow(&mut self, touches: &[bool]) {
        for slot in (0..self.points.len()).rev() {
            if !touches[self.points[slot]] {
                self.lift(slot);
            }
        }
        for (point, touches) in touches.iter().enumerate() {
            if *touches && !self.points.contains(&point) {
                self.land(point);
            }
        }
    }

    /// `f += K_c u` for the points in contact.
    fn add_forces(&self, u: &DVector<f64>, f: &mut DVector<f64>) {
        let (ld, m) = (self.ld, 3 * self.points.len());
        let mut own = vec![T::default(); m];
        for (slot, point) in self.points.iter().enumerate() {
            let x = [0, 1, 2].map(|axis| T::of(u[3 * point + axis]));
            let k = &self.k[3 * slot * ld..];
            add_three(&mut own, &k[..m], &k[ld..ld + m], &k[2 * ld..2 * ld + m], x);
        }
        for (slot, point) in self.points.iter().enumerate() {
            for axis in 0..3 {
                f[3 * point + axis] += own[3 * slot + axis].wide();
            }
        }
    }
}

struct Tick {
    touches: Vec<bool>,
    /// Forces and displacements in the sole's axes.
    f: DVector<f64>,
    u: DVector<f64>,
    pose: Transform,
    positions: Vec<Vec3>,
    flexibility: Mat6,
    counted: bool,
}

/// A stance, and the mean time of its ticks (us).
fn walk(model: &Arc<SoleModel>) -> (Vec<Tick>, f64) {
    let settings = EstimatorSettings { tolerance: 1e-6, ..EstimatorSettings::default() };
    let mut estimator = StanceEstimator::new(Arc::clone(model), settings);
    let (mut ticks, mut spent_us) = (Vec::new(), 0.0);
    for repeat in 0..=REPEATS {
        estimator.touch_down(Foothold::default());
        for tick in 0..walking_stance::TICKS {
            let reference = walking_stance::reference(tick, false);
            let start = thread_time_us();
            let report = estimator.step(&reference);
            let took_us = thread_time_us() - start;
            if repeat > 0 {
                spent_us += took_us;
                continue;
            }
            let turn = report.sole_pose.rotation.transpose();
            let f = DVector::from_iterator(
                3 * report.node_forces.len(),
                report.node_forces.iter().flat_map(|f| (turn * f).data.0[0]),
            );
            ticks.push(Tick {
                touches: report.node_states.iter().map(|s| *s != ContactState::Open).collect(),
                u: model.compliance() * &f,
                f,
                pose: report.sole_pose,
                positions: report.node_positions.clone(),
                flexibility: report.compliance,
                counted: report.status.is_solved() && reference.force.z > LOAD_COUNTED_N,
            });
        }
    }
    (ticks, spent_us / (REPEATS * walking_stance::TICKS) as f64)
}

/// The stance again: times per tick of updates and of one refinement (us), worst errors of force (relative), position (um), rotation (mrad).
fn again<T: Number>(model: &SoleModel, ticks: &[Tick], refine: bool) -> [f64; 5] {
    let c = model.compliance();
    let (mut update_us, mut refine_us, mut worst) = (0.0, 0.0, [0.0_f64; 3]);
    for _ in 0..REPEATS {
        let mut stiffness = Stiffness::<T>::new(model);
        for tick in ticks {
            let start = thread_time_us();
            stiffness.follow(&tick.touches);
            update_us += thread_time_us() - start;
            let mut f = DVector::zeros(tick.f.len());
            stiffness.add_forces(&tick.u, &mut f);
            if refine {
                let start = thread_time_us();
                let mut left = tick.u.clone();
                for point in &stiffness.points {
                    for axis in 0..3 {
                        left.axpy(-f[3 * point + axis], &c.column(3 * point + axis), 1.0);
                    }
                }
                stiffness.add_forces(&left, &mut f);
                refine_us += thread_time_us() - start;
            }
            if !tick.counted {
                continue;
            }
            let off = &f - &tick.f;
            worst[0] = worst[0].max(off.norm() / tick.f.norm());
            // What a tick would answer instead: the pose that makes up for the wrench that is off.
            let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
            for (point, position) in tick.positions.iter().enumerate() {
                let f: Vec3 = tick.pose.rotation * Vec3::from(off.fixed_rows::<3>(3 * point));
                force += f;
                moment += (position - tick.pose.translation).cross(&f);
            }
            let moved = tick.flexibility * Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z);
            worst[1] = worst[1].max(1e6 * moved.fixed_rows::<3>(0).norm());
            worst[2] = worst[2].max(1e3 * moved.fixed_rows::<3>(3).norm());
        }
    }
    let count = (REPEATS * ticks.len()) as f64;
    [update_us / count, refine_us / count, worst[0], worst[1], worst[2]]
}

fn main() {
    for (name, cells, level) in [
        ("1512 tets, 104 contacts", [12, 7, 3], Level::Fem),
        ("12 x 7 patches of 10764 tets, 104 contacts", [23, 13, 6], Level::Patches { cells: [12, 7] }),
    ] {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells };
        let settings = SoleSettings { mesh, level, ..SoleSettings::default() };
        let model = Arc::new(SoleModel::build(&settings).expect("a sound sole"));
        let (ticks, tick_us) = walk(&model);
        println!("{name}: cond(C) {:.0}, {tick_us:.1} us per tick", model.compliance_condition());
        println!(
            "  {:<26} {:>10} {:>10} {:>12} {:>10} {:>10}",
            "", "updates us", "refine us", "force error", "um", "mrad"
        );
        for (row, [update, refine, force, um, mrad]) in [
            ("64 bits", again::<f64>(&model, &ticks, false)),
            ("32 bits", again::<f32>(&model, &ticks, false)),
            ("32 bits, one refinement", again::<f32>(&model, &ticks, true)),
        ] {
            println!("  {row:<26} {update:>10.1} {refine:>10.1} {force:>12.1e} {um:>10.1e} {mrad:>10.1e}");
        }
    }
}

//! Spatial algebra, written with fused multiply-adds.
//!
//! In world axes about the origin O of the base a composite is a plain sum, so these types have `add` and nothing
//! transforms them. nalgebra's own products are not used in the recursions: Rust never fuses `a * b + c` by itself, and the
//! explicit form is about a quarter faster.

use spatial::{Inertia, Mat3, Transform, Twist, Vec3, Wrench};

/// `a b + c` in one rounding where the target has the instruction; elsewhere the library call would be slow.
#[inline(always)]
pub(crate) fn fma(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) { a.mul_add(b, c) } else { a * b + c }
}

/// `a . b`.
#[inline(always)]
pub(crate) fn dot(a: &Vec3, b: &Vec3) -> f64 {
    fma(a.x, b.x, fma(a.y, b.y, a.z * b.z))
}

/// `a x b`.
#[inline(always)]
pub(crate) fn cross(a: &Vec3, b: &Vec3) -> Vec3 {
    Vec3::new(fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x)))
}

/// `a x b + c`.
#[inline(always)]
pub(crate) fn cross_add(a: &Vec3, b: &Vec3, c: &Vec3) -> Vec3 {
    Vec3::new(
        fma(a.y, b.z, fma(-a.z, b.y, c.x)),
        fma(a.z, b.x, fma(-a.x, b.z, c.y)),
        fma(a.x, b.y, fma(-a.y, b.x, c.z)),
    )
}

/// `a s + c`.
#[inline(always)]
pub(crate) fn scale_add(a: &Vec3, s: f64, c: &Vec3) -> Vec3 {
    Vec3::new(fma(a.x, s, c.x), fma(a.y, s, c.y), fma(a.z, s, c.z))
}

/// `R v`.
#[inline(always)]
pub(crate) fn rotate(r: &Mat3, v: &Vec3) -> Vec3 {
    Vec3::new(
        fma(r.m11, v.x, fma(r.m12, v.y, r.m13 * v.z)),
        fma(r.m21, v.x, fma(r.m22, v.y, r.m23 * v.z)),
        fma(r.m31, v.x, fma(r.m32, v.y, r.m33 * v.z)),
    )
}

/// `R v + c`.
#[inline(always)]
pub(crate) fn rotate_add(r: &Mat3, v: &Vec3, c: &Vec3) -> Vec3 {
    Vec3::new(
        fma(r.m11, v.x, fma(r.m12, v.y, fma(r.m13, v.z, c.x))),
        fma(r.m21, v.x, fma(r.m22, v.y, fma(r.m23, v.z, c.y))),
        fma(r.m31, v.x, fma(r.m32, v.y, fma(r.m33, v.z, c.z))),
    )
}

/// `R' v`.
#[inline(always)]
pub(crate) fn unrotate(r: &Mat3, v: &Vec3) -> Vec3 {
    Vec3::new(
        fma(r.m11, v.x, fma(r.m21, v.y, r.m31 * v.z)),
        fma(r.m12, v.x, fma(r.m22, v.y, r.m32 * v.z)),
        fma(r.m13, v.x, fma(r.m23, v.y, r.m33 * v.z)),
    )
}

/// `A B`.
#[inline(always)]
pub(crate) fn product(a: &Mat3, b: &Mat3) -> Mat3 {
    let column = |x, y, z| rotate(a, &Vec3::new(x, y, z));
    let (x, y, z) = (column(b.m11, b.m21, b.m31), column(b.m12, b.m22, b.m32), column(b.m13, b.m23, b.m33));
    Mat3::new(x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z)
}

/// `R Rz(angle)` from the angle's sine and cosine.
#[inline(always)]
pub(crate) fn turned_about_z(r: &Mat3, (sin, cos): (f64, f64)) -> Mat3 {
    let x = |x: f64, y: f64| fma(x, cos, y * sin);
    let y = |x: f64, y: f64| fma(y, cos, -(x * sin));
    Mat3::new(
        x(r.m11, r.m12),
        y(r.m11, r.m12),
        r.m13,
        x(r.m21, r.m22),
        y(r.m21, r.m22),
        r.m23,
        x(r.m31, r.m32),
        y(r.m31, r.m32),
        r.m33,
    )
}

/// Symmetric 3 x 3 matrix.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Symmetric {
    pub xx: f64,
    pub xy: f64,
    pub xz: f64,
    pub yy: f64,
    pub yz: f64,
    pub zz: f64,
}

impl Symmetric {
    pub fn of(m: &Mat3) -> Self {
        Self { xx: m.m11, xy: m.m12, xz: m.m13, yy: m.m22, yz: m.m23, zz: m.m33 }
    }

    pub fn full(&self) -> Mat3 {
        let Self { xx, xy, xz, yy, yz, zz } = *self;
        Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }

    /// `S v + c`.
    #[inline(always)]
    pub fn times_add(&self, v: &Vec3, c: &Vec3) -> Vec3 {
        Vec3::new(
            fma(self.xx, v.x, fma(self.xy, v.y, fma(self.xz, v.z, c.x))),
            fma(self.xy, v.x, fma(self.yy, v.y, fma(self.yz, v.z, c.y))),
            fma(self.xz, v.x, fma(self.yz, v.y, fma(self.zz, v.z, c.z))),
        )
    }

    /// `R S R'`.
    #[inline(always)]
    pub fn rotated(&self, r: &Mat3) -> Self {
        let a = product(r, &self.full());
        let entry = |x: f64, y: f64, z: f64, rx: f64, ry: f64, rz: f64| fma(x, rx, fma(y, ry, z * rz));
        Self {
            xx: entry(a.m11, a.m12, a.m13, r.m11, r.m12, r.m13),
            xy: entry(a.m11, a.m12, a.m13, r.m21, r.m22, r.m23),
            xz: entry(a.m11, a.m12, a.m13, r.m31, r.m32, r.m33),
            yy: entry(a.m21, a.m22, a.m23, r.m21, r.m22, r.m23),
            yz: entry(a.m21, a.m22, a.m23, r.m31, r.m32, r.m33),
            zz: entry(a.m31, a.m32, a.m33, r.m31, r.m32, r.m33),
        }
    }

    /// `S + m (|c|^2 1 - c c')` with `h = m c`: the same inertia about a point that is `-c` away.
    #[inline(always)]
    pub fn shifted(&self, h: &Vec3, c: &Vec3) -> Self {
        let (x, y, z) = (h.x * c.x, h.y * c.y, h.z * c.z);
        Self {
            xx: self.xx + (y + z),
            yy: self.yy + (x + z),
            zz: self.zz + (x + y),
            xy: fma(-h.x, c.y, self.xy),
            xz: fma(-h.x, c.z, self.xz),
            yz: fma(-h.y, c.z, self.yz),
        }
    }

    /// `S -= a b'`, which is symmetric.
    #[inline(always)]
    pub fn minus(&mut self, a: &Vec3, b: &Vec3) {
        self.xx = fma(-a.x, b.x, self.xx);
        self.xy = fma(-a.x, b.y, self.xy);
        self.xz = fma(-a.x, b.z, self.xz);
        self.yy = fma(-a.y, b.y, self.yy);
        self.yz = fma(-a.y, b.z, self.yz);
        self.zz = fma(-a.z, b.z, self.zz);
    }

    #[inline(always)]
    pub fn add(&mut self, other: &Self) {
        self.xx += other.xx;
        self.xy += other.xy;
        self.xz += other.xz;
        self.yy += other.yy;
        self.yz += other.yz;
        self.zz += other.zz;
    }
}

/// Inertia of one or several bodies about O: momentum = inertia * twist.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct RigidInertia {
    /// Mass (kg).
    pub mass: f64,
    /// Mass times the position of the centre of mass (kg m).
    pub first_moment: Vec3,
    /// Rotational inertia about O (kg m^2).
    pub about_origin: Symmetric,
}

impl RigidInertia {
    /// Of a body whose frame is at `X_OB` (world axes, measured from O).
    #[inline(always)]
    pub fn of(inertia: &Inertia, X_OB: &Transform) -> Self {
        let com = rotate_add(&X_OB.rotation, &inertia.com, &X_OB.translation);
        let first_moment = com * inertia.mass_kg;
        let about_com = Symmetric::of(&inertia.about_com).rotated(&X_OB.rotation);
        Self { mass: inertia.mass_kg, first_moment, about_origin: about_com.shifted(&first_moment, &com) }
    }

    /// Momentum of a body that moves with a twist; also force of an acceleration.
    #[inline(always)]
    pub fn apply(&self, v: &Twist) -> Wrench {
        let h = &self.first_moment;
        Wrench {
            force: cross_add(&v.angular, h, &(v.linear * self.mass)),
            moment: self.about_origin.times_add(&v.angular, &cross(h, &v.linear)),
        }
    }

    #[inline(always)]
    pub fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.first_moment += other.first_moment;
        self.about_origin.add(&other.about_origin);
    }
}

/// `V x S`: how the column `S` of a body turns that moves with `V` (Featherstone's `crm`).
#[inline(always)]
pub(crate) fn cross_motion(v: &Twist, s: &Twist) -> Twist {
    Twist {
        linear: cross_add(&v.angular, &s.linear, &cross(&v.linear, &s.angular)),
        angular: cross(&v.angular, &s.angular),
    }
}

/// `V x* F`: how the momentum `F` of a body turns that moves with `V` (Featherstone's `crf`).
#[inline(always)]
pub(crate) fn cross_force(v: &Twist, f: &Wrench) -> Wrench {
    Wrench { force: cross(&v.angular, &f.force), moment: cross_add(&v.angular, &f.moment, &cross(&v.linear, &f.force)) }
}

/// `s factor + c`.
#[inline(always)]
pub(crate) fn scaled_add(s: &Twist, factor: f64, c: &Twist) -> Twist {
    Twist { linear: scale_add(&s.linear, factor, &c.linear), angular: scale_add(&s.angular, factor, &c.angular) }
}

/// `S . F`: generalised force.
#[inline(always)]
pub(crate) fn power(s: &Twist, f: &Wrench) -> f64 {
    dot(&s.linear, &f.force) + dot(&s.angular, &f.moment)
}

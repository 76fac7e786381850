//! One contact, exactly: closed tests for open and sticking, a bracketed scalar root for sliding.
//!
//! With `b` the displacement without this contact's force, `delta = W_aa F + b`:
//!
//! - *open*: `b_n >= 0`, then `F = 0`;
//! - *stick*: `F = -W_aa^-1 b` if it lies in the cone;
//! - *slide*: `delta_n = 0` and `delta_t = -lambda F_t` with `lambda > 0`. Eliminating `F_n = -(b_n + w . F_t)/W_nn` leaves
//!   `F_t(lambda) = -(A + lambda I)^-1 g`, `A = W_tt - w w'/W_nn`, `g = b_t - w b_n/W_nn`, and one scalar equation
//!   `r(lambda) = mu F_n/|F_t| = 1`. `r < 1` at `lambda = 0` (else it would stick) and
//!   `r >= 1` at `lambda = |g| (1/mu + |w|/W_nn)/n_0`, `n_0 = -b_n/W_nn > 0`: a bracket without a search, so the safeguarded
//!   Newton iteration cannot fail. `r` is linear in `lambda` when `A` is a multiple of the identity: two or three steps do.

use nalgebra::{Matrix3, Vector2, Vector3};

/// What a contact does: the one vocabulary for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ContactState {
    /// No force.
    #[default]
    Open,
    /// Force inside the cone, no motion along the ground.
    Stick,
    /// Force on the cone, motion against it.
    Slip,
}

impl ContactState {
    /// A word for people and files.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Stick => "stick",
            Self::Slip => "slip",
        }
    }
}

/// The constant part of one contact: its own 3 x 3 block of the Delassus operator, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleContact {
    inverse: Matrix3<f64>,
    /// A: xx, xy, yy
    a: [f64; 3],
    /// w / W_nn
    coupling: Vector2<f64>,
    normal_inverse: f64,
    mu: f64,
}

/// Newton and bisection steps before the bracket is as small as rounding allows (each bisection halves it).
const STEPS_MAX: usize = 80;
/// `r = 1` is met to this: a few roundings of the quotient.
const ROOT_TOLERANCE: f64 = 1e-15;

impl SingleContact {
    /// From the diagonal block (t1, t2, n), which must be positive definite.
    #[must_use]
    pub fn new(block: &Matrix3<f64>, mu: f64) -> Option<Self> {
        let inverse = block.try_inverse()?;
        let nn = block[(2, 2)];
        let coupling = Vector2::new(block[(0, 2)], block[(1, 2)]) / nn;
        let a = [
            block[(0, 0)] - coupling.x * coupling.x * nn,
            block[(0, 1)] - coupling.x * coupling.y * nn,
            block[(1, 1)] - coupling.y * coupling.y * nn,
        ];
        let definite = nn > 0.0 && a[0] > 0.0 && a[0] * a[2] - a[1] * a[1] > 0.0;
        (definite && inverse.iter().all(|x| x.is_finite())).then_some(Self {
            inverse,
            a,
            coupling,
            normal_inverse: 1.0 / nn,
            mu,
        })
    }

    /// Force for the displacement `b` that the contact would have without it. `lambda` is the sliding compliance to
    /// start from and is updated.
    #[inline]
    #[must_use]
    pub fn solve(&self, b: &Vector3<f64>, lambda: &mut f64) -> (Vector3<f64>, ContactState) {
        if b.z >= 0.0 {
            return (Vector3::zeros(), ContactState::Open);
        }
        let stick = -(self.inverse * b);
        if stick.x * stick.x + stick.y * stick.y <= self.mu * self.mu * stick.z * stick.z && stick.z >= 0.0 {
            return (stick, ContactState::Stick);
        }
        (self.slide(b, lambda), ContactState::Slip)
    }

    fn slide(&self, b: &Vector3<f64>, lambda: &mut f64) -> Vector3<f64> {
        let n0 = -b.z * self.normal_inverse;
        if self.mu == 0.0 {
            return Vector3::new(0.0, 0.0, n0);
        }
        let g = Vector2::new(b.x - self.coupling.x * b.z, b.y - self.coupling.y * b.z);
        let [axx, axy, ayy] = self.a;
        let (mut low, mut high) = (0.0, g.norm() * (1.0 / self.mu + self.coupling.norm()) / n0);
        let mut at = if *lambda > low && *lambda < high { *lambda } else { 0.0 };
        let mut force = Vector3::zeros();
        for _ in 0..STEPS_MAX {
            let (dxx, dyy) = (axx + at, ayy + at);
            let inverse = 1.0 / (dxx * dyy - axy * axy);
            let x = (axy * g.y - dyy * g.x) * inverse;
            let y = (axy * g.x - dxx * g.y) * inverse;
            let normal = n0 - (self.coupling.x * x + self.coupling.y * y);
            let square = x * x + y * y;
            let ratio = self.mu * normal / square.sqrt();
            force = Vector3::new(x, y, normal);
            if (ratio - 1.0).abs() <= ROOT_TOLERANCE {
                break;
            }
            if ratio < 1.0 {
                low = at;
            } else {
                high = at;
            }
            // F_t' = -(A + lambda)^-1 F_t
            let (xd, yd) = ((axy * y - dyy * x) * inverse, (axy * x - dxx * y) * inverse);
            let normal_rate = -(self.coupling.x * xd + self.coupling.y * yd);
            let slope = ratio * (-(x * xd + y * yd) / square) + self.mu * normal_rate / square.sqrt();
            let newton = at - (ratio - 1.0) / slope;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if next == at || high - low <= f64::EPSILON * high {
                break;
            }
            at = next;
        }
        *lambda = at;
        force
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::natural_map;

    #[test]
    fn closed_forms_of_an_isotropic_contact() {
        let (w, mu) = (2e-4, 0.5);
        let contact = SingleContact::new(&(w * Matrix3::identity()), mu).expect("positive definite");
        let mut lambda = 0.0;
        let (f, state) = contact.solve(&Vector3::new(1e-3, 0.0, 1e-4), &mut lambda);
        assert_eq!((f, state), (Vector3::zeros(), ContactState::Open));
        let b = Vector3::new(1e-4, -5e-5, -1e-3);
        let (f, state) = contact.solve(&b, &mut lambda);
        assert_eq!(state, ContactState::Stick);
        assert!((f + b / w).norm() < 1e-12);
        let b = Vector3::new(3e-3, -4e-3, -1e-3);
        let (f, state) = contact.solve(&b, &mut lambda);
        assert_eq!(state, ContactState::Slip);
        // Normal force 5 N, friction 2.5 N against (3, -4)/5.
        assert!((f - Vector3::new(-1.5, 2.0, 5.0)).norm() < 1e-12, "{f}");
    }

    #[test]
    fn coupled_contacts_are_solved_to_rounding_whatever_the_friction_and_the_start() {
        let mut seed = 12345_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / f64::from(1u32 << 31) * 2.0 - 1.0
        };
        for trial in 0..20000 {
            let m = Matrix3::from_fn(|_, _| random());
            let block = (m * m.transpose() + 1e-3 * Matrix3::identity()) * 1e-4;
            let mu = 1.5 * random().abs();
            let contact = SingleContact::new(&block, mu).expect("positive definite");
            let b = Vector3::new(random(), random(), random()) * 1e-3;
            let mut lambda = 1e-3 * random();
            let (f, _) = contact.solve(&b, &mut lambda);
            let rho = 3.0 / block.trace();
            let r = natural_map(mu, rho, &f, &(block * f + b));
            let scale = f.norm().max(rho * b.norm());
            assert!(r.norm() <= 1e-11 * scale, "trial {trial}: residual {} of {scale}", r.norm());
        }
    }

    #[test]
    fn a_semi_definite_block_is_not_a_contact() {
        assert!(SingleContact::new(&Matrix3::zeros(), 0.5).is_none());
        assert!(SingleContact::new(&Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 1.0)), 0.5).is_none());
    }
}

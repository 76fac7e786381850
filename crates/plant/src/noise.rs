//! Reproducible random numbers for sensor noise: xoshiro256++ (Blackman, Vigna 2021, public domain) seeded by splitmix64.
//!
//! Not a crate's generator on purpose: a recorded run must give the same bits with any later version of any dependency.

use spatial::Vec3;

/// A stream of random numbers that depends on its seed only.
#[derive(Debug, Clone)]
pub struct Noise {
    state: [u64; 4],
}

impl Noise {
    /// The stream of a seed.
    #[must_use]
    pub fn from_seed(seed: u64) -> Self {
        let mut x = seed;
        let mut split_mix = || {
            x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let z = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            z ^ (z >> 31)
        };
        Self { state: [split_mix(), split_mix(), split_mix(), split_mix()] }
    }

    fn next(&mut self) -> u64 {
        let s = &mut self.state;
        let out = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        out
    }

    /// Uniform in `[0, 1)`, 53 random bits.
    pub fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Normal with mean 0 and deviation 1 (Box-Muller; the second value of the pair is not kept, so that the number of
    /// draws per tick does not depend on history).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }

    /// Three independent normal values.
    pub fn normal3(&mut self) -> Vec3 {
        Vec3::new(self.normal(), self.normal(), self.normal())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_values_have_the_moments_of_the_normal_distribution() {
        let mut noise = Noise::from_seed(1);
        let n = 200_000;
        let values: Vec<f64> = (0..n).map(|_| noise.normal()).collect();
        let moment = |k: i32| values.iter().map(|x| x.powi(k)).sum::<f64>() / f64::from(n);
        // Five standard errors of each sample moment.
        let error = 5.0 / f64::from(n).sqrt();
        assert!(moment(1).abs() < error);
        assert!((moment(2) - 1.0).abs() < error * 2f64.sqrt());
        assert!(moment(3).abs() < error * 15f64.sqrt());
        assert!((moment(4) - 3.0).abs() < error * 96f64.sqrt());
    }

    #[test]
    fn the_stream_of_a_seed_never_changes() {
        let mut noise = Noise::from_seed(42);
        let first: Vec<u64> = (0..3).map(|_| noise.next()).collect();
        // Values of the reference implementation (xoshiro256++ seeded with four splitmix64 values of 42).
        assert_eq!(first, [15021278609987233951, 5881210131331364753, 18149643915985481100]);
    }
}

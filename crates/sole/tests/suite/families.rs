//! Seeded random sequences of loads that no smooth walk has, on ordinary soles and on soles at the ends of what there is.

#![allow(dead_code)] // each user needs its part

use nalgebra::Vector2;
use sole::{ContactSet, Level, Material, MeshSource, SoleModel, SoleSettings, StanceReference};
use spatial::Vec3;
use std::sync::Arc;

/// How the loads of a sequence follow each other.
#[derive(Clone, Copy)]
pub enum Kind {
    /// 100 to 500 N, then within one tick to between half of it and 0.05 N, and back.
    Drops,
    /// Light (0.1 to 10 N) and heavy (200 to 500 N) loads in turn, all else at random.
    Alternation,
    /// First ticks of 1 mN to 2 N.
    LightFirst,
    /// A random load between 0.1 and 500 N after the other, as no robot's.
    Random,
    /// A walk's load that loses half of itself or doubles at random ticks.
    Jolts,
}

/// A sole and what it has to carry.
pub struct Family {
    pub name: &'static str,
    kind: Kind,
    contact: ContactSet,
    level: Level,
    cells: [usize; 3],
    young_modulus_pa: f64,
    poisson_ratio: f64,
    friction: f64,
}

const FOAM: Family = Family {
    name: "",
    kind: Kind::Drops,
    contact: ContactSet::Bottom,
    level: Level::Fem,
    cells: [12, 7, 3],
    young_modulus_pa: 0.32e6,
    poisson_ratio: 0.31,
    friction: 0.65,
};
const PATCHES: Family = Family { cells: [23, 13, 6], level: Level::Patches { cells: [6, 5] }, ..FOAM };
const ALL: Family = Family { contact: ContactSet::All, ..FOAM };

pub const FAMILIES: [Family; 22] = [
    Family { name: "drops, 1512 elements", ..FOAM },
    Family { name: "alternation, 1512 elements", kind: Kind::Alternation, ..FOAM },
    Family { name: "light first ticks, 1512 elements", kind: Kind::LightFirst, ..FOAM },
    Family { name: "random, 1512 elements", kind: Kind::Random, ..FOAM },
    Family { name: "jolts, 1512 elements", kind: Kind::Jolts, ..FOAM },
    Family { name: "drops, 6 x 5 patches", ..PATCHES },
    Family { name: "alternation, 6 x 5 patches", kind: Kind::Alternation, ..PATCHES },
    Family { name: "random, 6 x 5 patches", kind: Kind::Random, ..PATCHES },
    Family { name: "drops, quadratic", level: Level::QuadraticFem, ..FOAM },
    Family { name: "alternation, quadratic", level: Level::QuadraticFem, kind: Kind::Alternation, ..FOAM },
    Family { name: "drops, side faces too", ..ALL },
    Family { name: "alternation, side faces too", kind: Kind::Alternation, ..ALL },
    Family { name: "light first ticks, side faces too", kind: Kind::LightFirst, ..ALL },
    Family { name: "alternation, friction 0.1", friction: 0.1, kind: Kind::Alternation, ..FOAM },
    Family { name: "alternation, friction 1.5", friction: 1.5, kind: Kind::Alternation, ..FOAM },
    Family { name: "alternation, nu 0.45", poisson_ratio: 0.45, kind: Kind::Alternation, ..FOAM },
    Family { name: "alternation, nu 0.49", poisson_ratio: 0.49, cells: [6, 4, 2], kind: Kind::Alternation, ..FOAM },
    Family { name: "random, nu 0.499", poisson_ratio: 0.499, cells: [6, 4, 2], kind: Kind::Random, ..FOAM },
    Family { name: "random, nu 0.4999", poisson_ratio: 0.4999, cells: [6, 4, 2], kind: Kind::Random, ..FOAM },
    Family { name: "random, E 1 kPa", young_modulus_pa: 1e3, cells: [6, 4, 2], kind: Kind::Random, ..FOAM },
    Family { name: "alternation, E 50 MPa", young_modulus_pa: 50e6, kind: Kind::Alternation, ..FOAM },
    Family { name: "alternation, nu 0", poisson_ratio: 0.0, kind: Kind::Alternation, ..FOAM },
];

impl Family {
    /// Neither nearly incompressible nor softer than any foam.
    pub fn is_ordinary(&self) -> bool {
        self.poisson_ratio < 0.48 && self.young_modulus_pa > 1e4
    }

    pub fn sole(&self) -> Arc<SoleModel> {
        let settings = SoleSettings {
            mesh: MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: self.cells },
            material: Material { young_modulus_pa: self.young_modulus_pa, poisson_ratio: self.poisson_ratio },
            friction: self.friction,
            contact: self.contact,
            level: self.level,
            ..SoleSettings::default()
        };
        Arc::new(SoleModel::build(&settings).expect("a sound sole"))
    }

    /// The loads of one seed, and whether the foot lands with them.
    pub fn loads(&self, seed: u64) -> Vec<(bool, StanceReference)> {
        let mut random = Random(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(seed + 1));
        let n = 30;
        let mut out = Vec::with_capacity(n);
        // A ZMP and a horizontal part that wander by steps.
        let mut zmp = Vector2::zeros();
        let mut share = Vector2::zeros();
        let mut heavy_n = 383.0;
        for k in 0..n {
            let lands = k == 0 || matches!(self.kind, Kind::LightFirst);
            let anywhere = matches!(self.kind, Kind::Random | Kind::LightFirst);
            let far = if anywhere { 1.0 } else { 0.3 };
            let limit = Vector2::new(0.08, 0.045);
            zmp = Vector2::from_fn(|i, _| {
                (if anywhere { 0.0 } else { zmp[i] } + far * limit[i] * random.signed()).clamp(-limit[i], limit[i])
            });
            let hold = 0.6 * f64::min(self.friction, 1.0);
            share = Vector2::from_fn(|i, _| {
                (if anywhere { 0.0 } else { share[i] } + 0.3 * hold * random.signed()).clamp(-hold, hold)
            });
            let normal_n = match self.kind {
                Kind::Drops if k % 2 == 0 => {
                    heavy_n = random.between(100.0, 500.0);
                    heavy_n
                }
                Kind::Drops => random.between(0.05, 0.5 * heavy_n),
                Kind::Alternation if k % 2 == 0 => random.between(200.0, 500.0),
                Kind::Alternation => random.between(0.1, 10.0),
                Kind::LightFirst => random.between(1e-3, 2.0),
                Kind::Random => random.between(0.1, 500.0),
                Kind::Jolts => {
                    heavy_n *= match (4.0 * random.unit()) as usize {
                        0 => 0.5,
                        1 => f64::min(2.0, 500.0 / heavy_n),
                        _ => 1.0,
                    };
                    heavy_n
                }
            };
            out.push((lands, StanceReference::constant(normal_n * Vec3::new(share.x, share.y, 1.0), zmp)));
        }
        out
    }
}

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Evenly in the logarithm.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.unit())
    }
}

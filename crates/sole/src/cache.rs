//! Condensed soles as bytes, so that processes need not condense again.
//!
//! Layout, little endian: magic, format version (u32), key (u64: hash of what the sole was built from), statistics, ankle, points,
//! friction, upper triangle of the compliance column by column, checksum (u64, FNV-1a of everything before it). A file with another
//! key or checksum is refused: a stale compliance would be a wrong robot.

use crate::model::Statistics;
use crate::{ContactSet, Level, MeshSource, SoleError, SoleModel, SoleSettings};
use nalgebra::DMatrix;
use spatial::Vec3;
use thiserror::Error;

const MAGIC: &[u8; 8] = b"SOLEUS\0c";
/// Increased whenever the layout or the numerics behind it change.
const VERSION: u32 = 2;

/// Why bytes are not the sole that was asked for.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CacheError {
    /// Not written by [`SoleModel::to_bytes`].
    #[error("not a condensed sole")]
    Foreign,
    /// Another layout.
    #[error("format version {found}, this build reads {expected}: condense again")]
    Version {
        /// What this build reads.
        expected: u32,
        /// What the bytes say.
        found: u32,
    },
    /// Built from another mesh, material, friction, level or ankle.
    #[error("condensed from other settings (key {found:016x}, expected {expected:016x}): condense again")]
    Key {
        /// Hash of the settings at hand.
        expected: u64,
        /// Hash in the bytes.
        found: u64,
    },
    /// Cut short or altered.
    #[error("damaged: checksum {found:016x}, expected {expected:016x}")]
    Damaged {
        /// Checksum of the content.
        expected: u64,
        /// Checksum stored.
        found: u64,
    },
    /// Sound bytes, unsound sole.
    #[error(transparent)]
    Sole(#[from] SoleError),
}

/// FNV-1a, 64 bit: stable across machines and compilers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fnv(u64);

impl Fnv {
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    pub(crate) fn bytes(mut self, bytes: &[u8]) -> Self {
        for b in bytes {
            self.0 = (self.0 ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        self
    }

    pub(crate) fn numbers(self, numbers: impl IntoIterator<Item = f64>) -> Self {
        numbers.into_iter().fold(self, |hash, x| hash.bytes(&x.to_le_bytes()))
    }

    pub(crate) fn count(self, count: usize) -> Self {
        self.bytes(&(count as u64).to_le_bytes())
    }
}

impl SoleSettings {
    /// Hash of everything that the model depends on, stable across machines: the key of [`SoleModel::to_bytes`].
    #[must_use]
    pub fn key(&self) -> u64 {
        let hash = Fnv::new().count(VERSION as usize);
        let hash = match &self.mesh {
            MeshSource::Box { size_m, cells } => {
                cells.iter().fold(hash.bytes(b"box").numbers(*size_m), |hash, c| hash.count(*c))
            }
            MeshSource::Mesh(mesh) => {
                let hash = hash.bytes(b"mesh").numbers(mesh.nodes.iter().flat_map(|p| [p.x, p.y, p.z]));
                let indices = mesh.tetrahedra.iter().flatten().chain(&mesh.clamped).chain(&mesh.contact);
                indices.fold(hash.count(mesh.tetrahedra.len()).count(mesh.clamped.len()), |hash, i| hash.count(*i))
            }
        };
        let hash = hash.numbers([self.material.young_modulus_pa, self.material.poisson_ratio, self.friction]);
        let hash = hash.numbers([self.ankle_in_sole_m.x, self.ankle_in_sole_m.y, self.ankle_in_sole_m.z]);
        let hash = hash.count(match self.contact {
            ContactSet::Bottom => 0,
            ContactSet::All => 1,
        });
        match self.level {
            Level::Rigid => hash.count(0),
            Level::Lumped => hash.count(1),
            Level::Winkler { cells } => hash.count(2).count(cells[0]).count(cells[1]),
            Level::Fem => hash.count(3),
            Level::QuadraticFem => hash.count(4),
            Level::Patches { cells } => hash.count(5).count(cells[0]).count(cells[1]),
            Level::QuadraticPatches { cells } => hash.count(6).count(cells[0]).count(cells[1]),
        }
        .0
    }
}

impl SoleModel {
    /// The condensed sole under the key of its settings ([`SoleSettings::key`]). The mesh is not kept.
    #[must_use]
    pub fn to_bytes(&self, key: u64) -> Vec<u8> {
        let n = self.contact_points().len();
        let mut out = Vec::with_capacity(72 + 8 * (7 * n + 3 * n * (3 * n + 1) / 2));
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&VERSION.to_le_bytes());
        out.extend_from_slice(&key.to_le_bytes());
        let s = self.statistics();
        for count in [s.nodes, s.tetrahedra, s.degrees_of_freedom, n] {
            out.extend_from_slice(&(count as u64).to_le_bytes());
        }
        let mut number = |x: f64| out.extend_from_slice(&x.to_le_bytes());
        number(s.worst_quality);
        number(s.thickness_m);
        let ankle = self.ankle_in_sole_m();
        for p in std::iter::once(&ankle).chain(self.contact_points()) {
            p.iter().for_each(|x| number(*x));
        }
        self.friction().iter().for_each(|x| number(*x));
        for column in 0..3 * n {
            for row in 0..=column {
                number(self.compliance()[(row, column)]);
            }
        }
        let checksum = Fnv::new().bytes(&out).0;
        out.extend_from_slice(&checksum.to_le_bytes());
        out
    }

    /// Reads what [`SoleModel::to_bytes`] wrote, if it was written for these settings.
    ///
    /// # Errors
    /// [`CacheError`]: condense again.
    pub fn from_bytes(bytes: &[u8], key: u64) -> Result<Self, CacheError> {
        let mut reader = Reader { bytes };
        if reader.take::<8>() != Some(*MAGIC) {
            return Err(CacheError::Foreign);
        }
        let found = reader.take::<4>().map(u32::from_le_bytes).ok_or(CacheError::Foreign)?;
        if found != VERSION {
            return Err(CacheError::Version { expected: VERSION, found });
        }
        let (content, tail) = bytes.split_at(bytes.len() - 8);
        let expected = Fnv::new().bytes(content).0;
        let found = u64::from_le_bytes(tail.try_into().expect("eight bytes"));
        let damaged = CacheError::Damaged { expected, found };
        if found != expected {
            return Err(damaged);
        }
        let stored = reader.take::<8>().map(u64::from_le_bytes).ok_or(damaged.clone())?;
        if stored != key {
            return Err(CacheError::Key { expected: key, found: stored });
        }
        let mut count = || reader.take::<8>().and_then(|b| usize::try_from(u64::from_le_bytes(b)).ok());
        let (Some(nodes), Some(tetrahedra), Some(degrees_of_freedom), Some(n)) = (count(), count(), count(), count())
        else {
            return Err(damaged);
        };
        let expected_length = n.checked_mul(n).and_then(|nn| nn.checked_mul(72));
        if expected_length.is_none_or(|length| length > 4 * bytes.len()) {
            return Err(damaged);
        }
        let mut number = || reader.take::<8>().map(f64::from_le_bytes).ok_or(damaged.clone());
        let (worst_quality, thickness_m) = (number()?, number()?);
        let mut point = || -> Result<Vec3, CacheError> { Ok(Vec3::new(number()?, number()?, number()?)) };
        let ankle = point()?;
        let points = (0..n).map(|_| point()).collect::<Result<Vec<_>, _>>()?;
        let friction = (0..n).map(|_| number()).collect::<Result<Vec<_>, _>>()?;
        let mut compliance = DMatrix::zeros(3 * n, 3 * n);
        for column in 0..3 * n {
            for row in 0..=column {
                let value = number()?;
                compliance[(row, column)] = value;
                compliance[(column, row)] = value;
            }
        }
        let statistics = Statistics { nodes, tetrahedra, degrees_of_freedom, worst_quality, thickness_m };
        Ok(Self::from_parts(points, compliance, friction, ankle)?.with_statistics(statistics))
    }

    /// [`SoleModel::from_bytes`] when the bytes fit the settings, else [`SoleModel::build`] with the bytes to keep.
    ///
    /// # Errors
    /// [`SoleError`] when the sole cannot be built.
    pub fn cached(settings: &SoleSettings, bytes: Option<&[u8]>) -> Result<(Self, Option<Vec<u8>>), SoleError> {
        let key = settings.key();
        if let Some(model) = bytes.and_then(|bytes| Self::from_bytes(bytes, key).ok()) {
            return Ok((model, None));
        }
        let model = Self::build(settings)?;
        let bytes = model.to_bytes(key);
        Ok((model, Some(bytes)))
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, tail) = self.bytes.split_first_chunk::<N>()?;
        self.bytes = tail;
        Some(*head)
    }
}

//! Condensed soles, kept in a folder between runs.
//!
//! A kept sole must never change a result, so an entry is taken only by **the very executable file that wrote it, on a processor with the
//! same vector instructions, for the same settings**: other code or another rounding would be another compliance. All three are hashed into
//! the key, which is the entry's name and stands inside it, and a checksum covers the whole. What does not fit is condensed again.
//!
//! Reading and writing are two steps: [`Store::condense`] reads, [`Store::write`] writes, so that a process that only checks its
//! configuration leaves nothing behind. Processes may write the same entry at the same time: each writes a file of its own and renames it.

use sole::{CacheError, SoleError, SoleModel, SoleSettings};
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// Environment variable that names the folder.
const FOLDER: &str = "SOLEUS_CACHE";
/// Ending of an entry's name.
const ENDING: &str = "sole";
/// Entries kept in a folder, the latest: each build of a program writes its own, 0.2 to 4 MB each.
const ENTRIES_MAX: usize = 64;

/// Where condensed soles are kept, and what this process found there.
#[derive(Debug, Default)]
pub struct Store {
    folder: Option<PathBuf>,
    build: u64,
    unwritten: Vec<(u64, Vec<u8>)>,
    starts: Vec<Start>,
}

/// How a sole came to be at the start of a process, in words: `sole condensed in 0.31 s`.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// From where.
    pub source: Source,
    /// How long it took.
    pub duration: Duration,
}

/// From where a sole came.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// It was condensed.
    Condensed,
    /// It was kept.
    Kept,
    /// It was condensed, for what was kept cannot be used.
    Refused(CacheError),
}

impl fmt::Display for Start {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time_s = self.duration.as_secs_f64();
        match &self.source {
            Source::Condensed => write!(f, "sole condensed in {time_s:.2} s"),
            Source::Kept => write!(f, "sole read from cache in {time_s:.2} s"),
            Source::Refused(error) => write!(f, "sole condensed in {time_s:.2} s (not read from cache: {error})"),
        }
    }
}

impl Store {
    /// Keeps nothing.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// In the folder that the environment variable `SOLEUS_CACHE` names; without it, or if it is empty, nothing is kept.
    #[must_use]
    pub fn from_environment() -> Self {
        let Some(folder) = std::env::var_os(FOLDER).filter(|folder| !folder.is_empty()) else { return Self::none() };
        match this_build() {
            Ok(build) => Self::in_folder(Path::new(&folder), build),
            // A program that cannot find itself keeps nothing: it could not say what wrote an entry.
            Err(_) => Self::none(),
        }
    }

    /// In a folder; `build` tells programs apart that may round differently.
    #[must_use]
    pub fn in_folder(folder: &Path, build: u64) -> Self {
        Self { folder: Some(folder.to_owned()), build, ..Self::default() }
    }

    /// The sole of these settings: the kept one, else condensed now.
    ///
    /// # Errors
    /// [`SoleError`] when it cannot be built.
    pub fn condense(&mut self, settings: &SoleSettings) -> Result<SoleModel, SoleError> {
        let start = Instant::now();
        let mut source = Source::Condensed;
        let key = self.key(settings);
        let kept = self.folder.as_ref().and_then(|folder| std::fs::read(entry(folder, key)).ok());
        let model = match kept.map(|bytes| SoleModel::from_bytes(&bytes, key)) {
            Some(Ok(model)) => {
                source = Source::Kept;
                model
            }
            refused => {
                if let Some(Err(error)) = refused {
                    source = Source::Refused(error);
                }
                let model = SoleModel::build(settings)?;
                if self.folder.is_some() {
                    self.unwritten.push((key, model.to_bytes(key)));
                }
                model
            }
        };
        self.starts.push(Start { source, duration: start.elapsed() });
        Ok(model)
    }

    /// How the soles asked for so far came to be.
    #[must_use]
    pub fn starts(&self) -> &[Start] {
        &self.starts
    }

    /// Writes what was condensed.
    ///
    /// # Errors
    /// What the system says; the soles at hand are not touched by it.
    pub fn write(&mut self) -> io::Result<()> {
        let Some(folder) = &self.folder else { return Ok(()) };
        for (key, bytes) in std::mem::take(&mut self.unwritten) {
            std::fs::create_dir_all(folder)?;
            let target = entry(folder, key);
            static NUMBER: AtomicU64 = AtomicU64::new(0);
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let own = target.with_extension(format!("{}-{number}.tmp", std::process::id()));
            let written = std::fs::write(&own, bytes).and_then(|()| std::fs::rename(&own, &target));
            if written.is_err() {
                // What is left of it is in nobody's way, but nobody's either.
                let _ = std::fs::remove_file(&own);
            }
            written?;
            forget_the_oldest(folder)?;
        }
        Ok(())
    }

    fn key(&self, settings: &SoleSettings) -> u64 {
        let mut hash = DefaultHasher::new();
        (self.build, settings.key()).hash(&mut hash);
        hash.finish()
    }
}

fn entry(folder: &Path, key: u64) -> PathBuf {
    folder.join(format!("{key:016x}.{ENDING}"))
}

fn forget_the_oldest(folder: &Path) -> io::Result<()> {
    let mut entries: Vec<(SystemTime, PathBuf)> = Vec::new();
    for found in std::fs::read_dir(folder)? {
        let path = found?.path();
        // One that another process has just removed is not there to be removed.
        if let (true, Ok(metadata)) = (path.extension().is_some_and(|ending| ending == ENDING), path.metadata()) {
            entries.push((metadata.modified()?, path));
        }
    }
    entries.sort();
    for (_, path) in entries.iter().rev().skip(ENTRIES_MAX) {
        let _ = std::fs::remove_file(path);
    }
    Ok(())
}

/// Hash of which file the running program is, as it was last changed, and of the vector instructions that its numerics may choose from. (Its
/// content would take longer to read than most soles to condense.)
fn this_build() -> io::Result<u64> {
    // On Linux what runs, even if another file has its name since.
    let program = if cfg!(target_os = "linux") { PathBuf::from("/proc/self/exe") } else { std::env::current_exe()? };
    let file = program.metadata()?;
    let mut hash = DefaultHasher::new();
    (file.dev(), file.ino(), file.size()).hash(&mut hash);
    // The second pair cannot be set by anybody: it moves with every change of the file.
    ((file.mtime(), file.mtime_nsec()), (file.ctime(), file.ctime_nsec())).hash(&mut hash);
    #[cfg(target_arch = "x86_64")]
    for feature in [
        is_x86_feature_detected!("avx"),
        is_x86_feature_detected!("avx2"),
        is_x86_feature_detected!("fma"),
        is_x86_feature_detected!("avx512f"),
        is_x86_feature_detected!("avx512bw"),
        is_x86_feature_detected!("avx512cd"),
        is_x86_feature_detected!("avx512dq"),
        is_x86_feature_detected!("avx512vl"),
    ] {
        feature.hash(&mut hash);
    }
    Ok(hash.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sole::{Level, MeshSource};

    const LEVELS: [Level; 5] = [
        Level::Lumped,
        Level::Winkler { cells: [3, 2] },
        Level::Fem,
        Level::QuadraticFem,
        Level::Patches { cells: [3, 2] },
    ];

    fn settings(level: Level) -> SoleSettings {
        let mesh = MeshSource::Box { size_m: [0.23, 0.13, 0.021], cells: [6, 4, 2] };
        SoleSettings { mesh, level, ..SoleSettings::default() }
    }

    fn entries(folder: &Path) -> Vec<PathBuf> {
        let Ok(found) = std::fs::read_dir(folder) else { return Vec::new() };
        found.map(|entry| entry.expect("a readable folder").path()).collect()
    }

    /// Condenses or reads, and writes.
    fn started(folder: &Path, build: u64, settings: &SoleSettings) -> (SoleModel, Source) {
        let mut store = Store::in_folder(folder, build);
        let model = store.condense(settings).expect("a sole");
        store.write().expect("a writable folder");
        (model, store.starts()[0].source.clone())
    }

    #[test]
    fn a_kept_sole_is_the_condensed_one_to_the_bit_at_every_level() {
        let folder = tempfile::tempdir().expect("a folder");
        for level in LEVELS {
            let settings = settings(level);
            let (condensed, source) = started(folder.path(), 1, &settings);
            assert_eq!(source, Source::Condensed);
            let (kept, source) = started(folder.path(), 1, &settings);
            assert_eq!(source, Source::Kept);
            let bits = |model: &SoleModel| -> Vec<u64> {
                let numbers = model.compliance().iter().chain(model.stiffness()).chain(model.friction());
                let points = model.contact_points().iter().flat_map(|p| p.iter());
                numbers.chain(points).chain(model.ankle_in_sole_m().iter()).map(|x| x.to_bits()).collect()
            };
            assert_eq!(bits(&kept), bits(&condensed), "{level:?}");
            assert_eq!(bits(&kept.mirrored()), bits(&condensed.mirrored()), "{level:?}");
            assert_eq!(kept.statistics(), condensed.statistics(), "{level:?}");
        }
        assert_eq!(entries(folder.path()).len(), LEVELS.len(), "one entry each, and nothing else");
    }

    #[test]
    fn nothing_is_written_before_it_is_asked_for_and_nothing_at_all_without_a_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let below = folder.path().join("soles");
        let mut store = Store::in_folder(&below, 1);
        store.condense(&settings(Level::Fem)).expect("a sole");
        assert!(!below.exists(), "reading makes no folder");
        store.write().expect("a writable folder");
        assert_eq!(entries(&below).len(), 1);
        let mut none = Store::none();
        none.condense(&settings(Level::Fem)).expect("a sole");
        assert_eq!(none.starts()[0].source, Source::Condensed);
        none.write().expect("nothing to write");
    }

    #[test]
    fn another_build_other_settings_and_damaged_entries_are_condensed_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let settings = settings(Level::Fem);
        let (condensed, _) = started(folder.path(), 1, &settings);
        assert_eq!(started(folder.path(), 2, &settings).1, Source::Condensed, "another program");
        let mut softer = settings.clone();
        softer.material.young_modulus_pa *= 0.8;
        assert_eq!(started(folder.path(), 1, &softer).1, Source::Condensed, "another foam");

        let store = Store::in_folder(folder.path(), 1);
        let ours = entry(folder.path(), store.key(&settings));
        // Another sole under this one's name: only the key inside tells.
        std::fs::copy(entry(folder.path(), store.key(&softer)), &ours).expect("a copy");
        let (model, source) = started(folder.path(), 1, &settings);
        assert!(matches!(source, Source::Refused(CacheError::Key { .. })), "{source:?}");
        assert_eq!(model.compliance(), condensed.compliance());
        assert_eq!(started(folder.path(), 1, &settings).1, Source::Kept, "it was replaced");

        for damage in [|bytes: &mut Vec<u8>| bytes.truncate(1000), |bytes: &mut Vec<u8>| bytes[500] ^= 1] {
            let mut bytes = std::fs::read(&ours).expect("an entry");
            damage(&mut bytes);
            std::fs::write(&ours, bytes).expect("an entry");
            let (model, source) = started(folder.path(), 1, &settings);
            assert!(matches!(source, Source::Refused(CacheError::Damaged { .. })), "{source:?}");
            assert_eq!(model.compliance(), condensed.compliance());
        }
        for bytes in [&b""[..], b"SOLEUS\0c", b"SOLEUS\0c\x02\0\0\0", b"not a sole"] {
            std::fs::write(&ours, bytes).expect("an entry");
            assert!(matches!(started(folder.path(), 1, &settings).1, Source::Refused(_)), "{bytes:?}");
        }
    }

    #[test]
    fn many_may_write_the_same_entry_while_others_read_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let settings = settings(Level::Patches { cells: [3, 2] });
        let expected = SoleModel::build(&settings).expect("a sole");
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..10 {
                        let mut store = Store::in_folder(folder.path(), 1);
                        let model = store.condense(&settings).expect("a sole");
                        assert_eq!(model.compliance(), expected.compliance());
                        let source = &store.starts()[0].source;
                        assert!(!matches!(source, Source::Refused(_)), "half an entry was seen: {source:?}");
                        store.write().expect("a writable folder");
                    }
                });
            }
        });
        assert_eq!(entries(folder.path()).len(), 1);
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_said_and_a_full_one_forgets_the_oldest() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("file");
        std::fs::write(&file, "no folder").expect("a file");
        let mut store = Store::in_folder(&file, 1);
        store.condense(&settings(Level::Fem)).expect("the sole is there all the same");
        assert!(store.write().is_err());

        let full = tempfile::tempdir().expect("a folder");
        for key in 0..ENTRIES_MAX as u64 {
            std::fs::write(entry(full.path(), key), "old").expect("an entry");
        }
        std::fs::write(full.path().join("somebody.else"), "").expect("a file");
        started(full.path(), 1, &settings(Level::Fem));
        assert_eq!(entries(full.path()).len(), ENTRIES_MAX + 1, "the latest entries, and the file of somebody else");
        assert_eq!(started(full.path(), 1, &settings(Level::Fem)).1, Source::Kept);
    }

    #[test]
    fn a_program_knows_itself() {
        assert_eq!(this_build().expect("a running program"), this_build().expect("a running program"));
    }
}

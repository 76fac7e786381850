//! Condensed soles, kept in a folder between runs.
//!
//! A kept sole must never change a result, so an entry is taken only by **the very executable file that wrote it, on a processor with the
//! same vector instructions, for the same settings**: other code or another rounding would be another compliance. All three are hashed into
//! the key, which is the entry's name and stands inside it, and a checksum covers the whole. What does not fit is condensed again.
//!
//! Reading and writing are two steps: [`Store::condense`] reads, [`Store::write`] writes, so that a process that only checks its
//! configuration leaves nothing behind. Processes may write the same entry at the same time: each writes a file of its own and renames it.

use sole::{CacheError, SoleError, SoleModel, SoleSettings};
use std::collections::BTreeMap;
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
/// Bytes kept in a folder, the latest entries: each build of a program writes its own. An entry grows with the square of its contact points:
/// hundreds of those that ship fit in, some twenty with 600 points.
const BYTES_MAX: u64 = 256 << 20;
/// From this age on a file that was being written belongs to a process that was stopped meanwhile: entries are written within seconds.
const STALE: Duration = Duration::from_secs(3600);
/// Ending of a file that is being written.
const UNFINISHED: &str = "tmp";

/// Where condensed soles are kept, and what this process found there.
#[derive(Debug, Default)]
pub struct Store {
    folder: Option<PathBuf>,
    /// Soles kept in memory, if any are.
    memory: Option<BTreeMap<u64, SoleModel>>,
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

    /// Keeps soles as long as itself lives: for many walks in one process.
    #[must_use]
    pub fn in_memory() -> Self {
        Self { memory: Some(BTreeMap::new()), ..Self::default() }
    }

    /// In the folder that the environment variable `SOLEUS_CACHE` names; without it, or if it is empty, nothing is kept.
    #[must_use]
    pub fn from_environment() -> Self {
        let Some(folder) = std::env::var_os(FOLDER).filter(|folder| !folder.is_empty()) else { return Self::none() };
        match this_program().and_then(|program| build(&program)) {
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
        if let Some(model) = self.memory.as_ref().and_then(|memory| memory.get(&key)) {
            let model = model.clone();
            self.starts.push(Start { source: Source::Kept, duration: start.elapsed() });
            return Ok(model);
        }
        let kept = self.folder.as_ref().and_then(|folder| files::read(&entry(folder, key), BYTES_MAX).ok());
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
        if let Some(memory) = &mut self.memory {
            memory.insert(key, model.clone());
        }
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
            let own = target.with_extension(format!("{}-{number}.{UNFINISHED}", std::process::id()));
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

/// Keeps the latest entries, the newest in any case, and removes what stopped writers left.
fn forget_the_oldest(folder: &Path) -> io::Result<()> {
    let now = SystemTime::now();
    let mut entries: Vec<(SystemTime, PathBuf, u64)> = Vec::new();
    for found in std::fs::read_dir(folder)? {
        let path = found?.path();
        // One that another process has just removed is not there to be removed.
        let Ok(metadata) = path.metadata() else { continue };
        let modified = metadata.modified()?;
        match path.extension().and_then(|ending| ending.to_str()) {
            Some(ENDING) => entries.push((modified, path, metadata.len())),
            // A time in the future is no age.
            Some(UNFINISHED) if now.duration_since(modified).is_ok_and(|age| age > STALE) => {
                let _ = std::fs::remove_file(path);
            }
            _ => {}
        }
    }
    entries.sort();
    let mut bytes = 0;
    for (kept, (_, path, size)) in entries.iter().rev().enumerate() {
        bytes += size;
        if kept > 0 && bytes > BYTES_MAX {
            let _ = std::fs::remove_file(path);
        }
    }
    Ok(())
}

/// The running program. On Linux what runs, even if another file has its name since.
fn this_program() -> io::Result<PathBuf> {
    if cfg!(target_os = "linux") { Ok(PathBuf::from("/proc/self/exe")) } else { std::env::current_exe() }
}

/// Hash of which file a program is, as it was last changed, and of the vector instructions that its numerics may choose from. (Its
/// content would take longer to read than most soles to condense.)
fn build(program: &Path) -> io::Result<u64> {
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
    use std::io::Write;

    const LEVELS: [Level; 6] = [
        Level::Lumped,
        Level::Winkler { cells: [3, 2] },
        Level::Fem,
        Level::QuadraticFem,
        Level::Patches { cells: [3, 2] },
        Level::QuadraticPatches { cells: [3, 2] },
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
    fn a_store_in_memory_condenses_each_sole_once() {
        let mut store = Store::in_memory();
        let models =
            [Level::Fem, Level::Lumped, Level::Fem].map(|level| store.condense(&settings(level)).expect("a sole"));
        assert_eq!(models[0].compliance(), models[2].compliance());
        let sources: Vec<_> = store.starts().iter().map(|start| &start.source).collect();
        assert_eq!(sources, [&Source::Condensed, &Source::Condensed, &Source::Kept]);
        store.write().expect("nothing to write");
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
        let file = |path: &Path, age_s: u64, bytes: u64| {
            let file = std::fs::File::create(path).expect("a file");
            file.set_len(bytes).expect("a sparse file");
            file.set_modified(SystemTime::now() - Duration::from_secs(age_s)).expect("a file's time");
        };
        // Four quarters of what is kept, the oldest last, and others' files.
        for age in 0..4 {
            file(&entry(full.path(), age), 60 * (1 + age), BYTES_MAX / 4);
        }
        let [writing, stopped, other] = ["1-0.tmp", "2-0.tmp", "somebody.else"].map(|name| full.path().join(name));
        file(&writing, 60, 10);
        file(&stopped, STALE.as_secs() + 60, 10);
        file(&other, STALE.as_secs() + 60, 10);
        started(full.path(), 1, &settings(Level::Fem));
        let there: Vec<bool> = (0..4).map(|age| entry(full.path(), age).exists()).collect();
        assert_eq!(there, [true, true, true, false], "the oldest makes room");
        assert!(writing.exists() && !stopped.exists() && other.exists());
        assert_eq!(started(full.path(), 1, &settings(Level::Fem)).1, Source::Kept);
    }

    #[test]
    fn a_program_is_known_by_its_file_and_not_by_its_content_or_name() {
        let running = build(&this_program().expect("a running program")).expect("readable");
        let named = std::env::current_exe().expect("it has a name");
        assert_eq!(build(&named).expect("readable"), running);
        let folder = tempfile::tempdir().expect("a folder");
        let copied = folder.path().join("copy");
        std::fs::copy(&named, &copied).expect("a copy");
        let copy = build(&copied).expect("readable");
        assert_ne!(copy, running, "the same content, another file");
        std::fs::OpenOptions::new()
            .append(true)
            .open(&copied)
            .and_then(|mut file| file.write_all(b"\0"))
            .expect("writable");
        assert_ne!(build(&copied).expect("readable"), copy, "a file that has changed");
        assert!(build(&folder.path().join("none")).is_err());
    }
}

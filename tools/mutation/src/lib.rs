//! Seeded damage to files, for tests of everything that reads them.
//!
//! A good file is changed in a few places as damage, haste and malice do it: bits flipped, numbers replaced by the
//! largest and smallest ones, pieces cut out, doubled or moved, words of the format put where they do not belong. The
//! same seed makes the same file, so that a case that fails can be run again.

/// Makes damaged files.
#[derive(Debug, Clone)]
pub struct Mutator {
    state: u64,
}

/// Numbers that programs trip over.
const NUMBERS: [u64; 10] =
    [0, 1, 0x7f, 0xff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 0x7fff_ffff_ffff_ffff, u64::MAX, 2_800_000_000_000_000_000];
/// The same as text.
const WORDS: [&str; 16] = [
    "NaN",
    "inf",
    "-inf",
    "1e308",
    "1e-320",
    "-0.0",
    "-1",
    "0",
    "99999999999999999999",
    "4294967296",
    "2147483648",
    "\0",
    "\u{feff}",
    "\"",
    "../../../etc/passwd",
    "/dev/zero",
];

impl Mutator {
    /// With a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { state: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1 }
    }

    /// A random number less than `limit`; zero if that is zero.
    pub fn below(&mut self, limit: usize) -> usize {
        // Xorshift64*: Vigna, An experimental exploration of Marsaglia's xorshift generators, scrambled.
        self.state ^= self.state >> 12;
        self.state ^= self.state << 25;
        self.state ^= self.state >> 27;
        let random = self.state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 16;
        if limit == 0 { 0 } else { (random % limit as u64) as usize }
    }

    /// Damages a file in one to eight places; `words` are those of its format.
    pub fn damage(&mut self, bytes: &mut Vec<u8>, words: &[&str]) {
        for _ in 0..=self.below(8) {
            self.damage_once(bytes, words);
        }
    }

    fn damage_once(&mut self, bytes: &mut Vec<u8>, words: &[&str]) {
        let at = self.below(bytes.len());
        let scale = self.below(12);
        let length = 1 + self.below(1 << scale);
        let range = at..(at + length).min(bytes.len());
        match self.below(9) {
            0 => range.take(1).for_each(|at| bytes[at] ^= 1 << self.below(8)),
            1 => range.take(1).for_each(|at| bytes[at] = self.below(256) as u8),
            2 => {
                let number = NUMBERS[self.below(NUMBERS.len())].to_le_bytes();
                let size = [1, 2, 4, 8][self.below(4)].min(bytes.len() - at);
                bytes[at..at + size].copy_from_slice(&number[..size]);
            }
            3 => drop(bytes.drain(range)),
            4 => {
                let piece = bytes[range].to_vec();
                let to = self.below(bytes.len() + 1);
                drop(bytes.splice(to..to, piece));
            }
            5 if self.below(4) == 0 => bytes.truncate(at),
            6 => bytes[range].fill(self.below(256) as u8),
            _ => {
                let known = WORDS.len() + words.len();
                let index = self.below(known);
                let word = WORDS.get(index).copied().unwrap_or_else(|| words[index - WORDS.len()]);
                // In place of a word, or between two.
                let is_end = |byte: &u8| byte.is_ascii_whitespace() || b"=,\"<>[]{}:".contains(byte);
                let end = at + bytes[at..].iter().take(40).position(is_end).unwrap_or(0);
                drop(bytes.splice(at..end, word.bytes()));
            }
        }
    }
}

/// How many cases a test of damaged files takes: `quick`, or what the environment variable `DAMAGED_FILES` says.
#[must_use]
pub fn cases(quick: u64) -> u64 {
    std::env::var("DAMAGED_FILES").ok().and_then(|text| text.parse().ok()).unwrap_or(quick)
}

/// The most memory this process has had at once (bytes); zero where the system does not say.
#[must_use]
pub fn peak_memory_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}

/// Processor time of this thread so far (s); zero where the system does not say.
#[must_use]
pub fn processor_time_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) * 1e-9
}

/// What a campaign may take: the most memory of the process (bytes), the most processor time of a case (s).
pub const MEMORY_MAX_BYTES: u64 = 512 << 20;
/// See [`MEMORY_MAX_BYTES`].
pub const CASE_MAX_S: f64 = 10.0;

/// Damages a file again and again and hands it to `read`, which must neither panic nor abort; prints a line about the
/// campaign.
///
/// # Panics
/// If memory or processor time go beyond the limits above; a panic of `read` goes through after its seed was printed.
pub fn campaign(name: &str, quick: u64, whole: &[u8], words: &[&str], mut read: impl FnMut(&[u8])) {
    struct Seed(u64);
    impl Drop for Seed {
        fn drop(&mut self) {
            if std::thread::panicking() {
                eprintln!("case with seed {}", self.0);
            }
        }
    }
    let cases = cases(quick);
    let (mut longest_s, mut longest_seed) = (0.0_f64, 0);
    for seed in 0..cases {
        let seed_of_case = Seed(seed);
        let mut bytes = whole.to_vec();
        Mutator::new(seed).damage(&mut bytes, words);
        let start_s = processor_time_s();
        read(&bytes);
        let took_s = processor_time_s() - start_s;
        if took_s > longest_s {
            (longest_s, longest_seed) = (took_s, seed);
        }
        drop(seed_of_case);
    }
    let peak = peak_memory_bytes();
    eprintln!(
        "{name}: {cases} damaged files, longest {longest_s:.3} s of processor time (seed {longest_seed}), at most {} MB",
        peak >> 20
    );
    assert!(longest_s <= CASE_MAX_S, "{name}: {longest_s} s with seed {longest_seed}");
    assert!(peak <= MEMORY_MAX_BYTES, "{name}: {peak} bytes");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_makes_the_same_damage_and_others_other() {
        let whole = vec![b' '; 1000];
        let damaged = |seed| {
            let mut bytes = whole.clone();
            Mutator::new(seed).damage(&mut bytes, &["word"]);
            bytes
        };
        assert_eq!(damaged(7), damaged(7));
        let changed = (0..100).filter(|seed| damaged(*seed) != whole).count();
        assert!(changed > 95, "{changed} of 100");
        Mutator::new(1).damage(&mut Vec::new(), &[]);
    }
}

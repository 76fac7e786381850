//! Raw histograms, in the log format of HdrHistogram: every tool of that family reads them.

use anyhow::Context;
use hdrhistogram::serialization::V2DeflateSerializer;
use hdrhistogram::serialization::interval_log::IntervalLogWriterBuilder;
use lateness::Lateness;
use std::path::Path;
use std::time::Duration;

/// Writes a histogram (ns) that lasted for a while.
pub fn write(path: &Path, name: &str, lateness: &Lateness, lasted: Duration) -> anyhow::Result<()> {
    let mut bytes = Vec::new();
    let mut serializer = V2DeflateSerializer::new();
    let failed = |error: &dyn std::fmt::Debug| anyhow::anyhow!("cannot write the histogram {name}: {error:?}");
    let mut log = IntervalLogWriterBuilder::new()
        .add_comment(&format!("{name}, ns"))
        .begin_log_with(&mut bytes, &mut serializer)
        .map_err(|error| failed(&error))?;
    log.write_histogram(lateness.counts(), Duration::ZERO, lasted, None).map_err(|error| failed(&error))?;
    std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hdrhistogram::Histogram;
    use hdrhistogram::serialization::Deserializer;
    use hdrhistogram::serialization::interval_log::{IntervalLogIterator, LogEntry};

    #[test]
    fn what_is_written_is_read_again_by_the_library() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("woke.hlog");
        let lateness = Lateness::of([30_000, 31_000, 2_000_000]);
        write(&path, "controller woke", &lateness, Duration::from_secs(30)).expect("writable");
        let bytes = std::fs::read(&path).expect("just written");
        let interval = IntervalLogIterator::new(&bytes).find_map(|entry| match entry.expect("well-formed") {
            LogEntry::Interval(interval) => Some(interval),
            _ => None,
        });
        let encoded = interval.expect("one interval").encoded_histogram().to_string();
        let raw = base64_decoded(&encoded);
        let read: Histogram<u64> = Deserializer::new().deserialize(&mut raw.as_slice()).expect("of this library");
        assert_eq!(&read, lateness.counts());
    }

    fn base64_decoded(text: &str) -> Vec<u8> {
        let value = |letter: u8| match letter {
            b'A'..=b'Z' => u32::from(letter - b'A'),
            b'a'..=b'z' => u32::from(letter - b'a') + 26,
            b'0'..=b'9' => u32::from(letter - b'0') + 52,
            b'+' => 62,
            _ => 63,
        };
        let letters: Vec<u8> = text.bytes().filter(|letter| *letter != b'=').collect();
        let mut bytes = Vec::new();
        for four in letters.chunks(4) {
            let bits = four.iter().fold(0, |bits, letter| bits << 6 | value(*letter)) << (6 * (4 - four.len()));
            bytes.extend_from_slice(&bits.to_be_bytes()[1..four.len()]);
        }
        bytes
    }
}

//! Unpacking chunks within limits that are checked before anything is unpacked.

use crate::record::{Broken, Chunk, RATIO_MAX};
use std::io::Read;

/// Largest chunk that is unpacked (bytes); ours have about one megabyte, other programs' a few.
const CHUNK_MAX_BYTES: u64 = 128 << 20;
/// What any file may grow to (bytes).
const GROWN_MIN_BYTES: u64 = 64 << 20;
/// Largest distance that a compressed frame may refer back to: 2^27 bytes, what the format's own program accepts.
const WINDOW_LOG_MAX: u32 = 27;

/// Unpacks the chunks of a file, one after the other, into the same memory.
#[derive(Debug, Default)]
pub(crate) struct Unpacker {
    packed: u64,
    unpacked: u64,
    content: Vec<u8>,
}

impl Unpacker {
    /// The content of the next chunk.
    pub(crate) fn unpack<'a>(&'a mut self, chunk: &Chunk<'a>) -> Result<&'a [u8], Broken> {
        let bytes = chunk.unpacked_bytes;
        if bytes > CHUNK_MAX_BYTES {
            return Err(Broken::TooLarge { what: "a chunk", bytes, max_bytes: CHUNK_MAX_BYTES });
        }
        self.packed += chunk.content.len() as u64;
        self.unpacked += bytes;
        if self.unpacked > GROWN_MIN_BYTES.max(RATIO_MAX * self.packed) {
            return Err(Broken::Ratio { packed: self.packed, unpacked: self.unpacked });
        }
        let broken = |reason: String| Broken::Chunk { reason };
        let content = if chunk.compression.is_empty() {
            chunk.content
        } else {
            let packed = chunk.content;
            self.content.clear();
            // One byte more would show that it is longer than it says.
            let read = match chunk.compression {
                "zstd" => zstd::Decoder::with_buffer(packed).and_then(|mut decoder| {
                    decoder.window_log_max(WINDOW_LOG_MAX)?;
                    decoder.take(bytes + 1).read_to_end(&mut self.content)
                }),
                "lz4" => {
                    lz4::Decoder::new(packed).and_then(|decoder| decoder.take(bytes + 1).read_to_end(&mut self.content))
                }
                other => return Err(broken(format!("compression `{other}` is not known (zstd and lz4 are)"))),
            };
            read.map_err(|error| broken(error.to_string()))?;
            &self.content
        };
        if content.len() as u64 != bytes {
            return Err(broken(format!("it says it has {bytes} bytes and has {}", content.len())));
        }
        if chunk.crc != 0 && chunk.crc != crc32fast::hash(content) {
            return Err(Broken::Checksum { what: "a chunk" });
        }
        Ok(content)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn zeros(megabytes: usize) -> Vec<u8> {
        zstd::encode_all(std::io::repeat(0).take((megabytes << 20) as u64), 1).expect("memory")
    }

    #[test]
    fn what_a_chunk_says_is_checked_before_it_is_unpacked() {
        let content = zstd::encode_all(&b"hello"[..], 1).expect("memory");
        let chunk = |unpacked_bytes, crc| Chunk { unpacked_bytes, crc, compression: "zstd", content: &content };
        let mut unpacker = Unpacker::default();
        assert_eq!(unpacker.unpack(&chunk(5, crc32fast::hash(b"hello"))), Ok(&b"hello"[..]));
        assert_eq!(unpacker.unpack(&chunk(5, 1)), Err(Broken::Checksum { what: "a chunk" }));
        for wrong in [4, 6] {
            assert!(matches!(unpacker.unpack(&chunk(wrong, 0)), Err(Broken::Chunk { .. })), "{wrong}");
        }
        assert!(matches!(unpacker.unpack(&chunk(u64::MAX, 0)), Err(Broken::TooLarge { bytes: u64::MAX, .. })));
        let packed = Chunk { unpacked_bytes: 5, crc: 0, compression: "lz4", content: b"\x04\x22\x4d\x18no" };
        assert!(matches!(unpacker.unpack(&packed), Err(Broken::Chunk { .. })));
        let other = Chunk { unpacked_bytes: 5, crc: 0, compression: "brotli", content: b"" };
        let message = unpacker.unpack(&other).expect_err("not known").to_string();
        assert!(message.ends_with("compression `brotli` is not known (zstd and lz4 are)"), "{message}");
    }

    #[test]
    fn files_that_grow_to_thousands_of_times_their_size_are_not_unpacked() {
        let packed = zeros(60);
        let chunk = || Chunk { unpacked_bytes: 60 << 20, crc: 0, compression: "zstd", content: &packed };
        let mut unpacker = Unpacker::default();
        assert_eq!(unpacker.unpack(&chunk()).expect("small enough").len(), 60 << 20);
        let Err(Broken::Ratio { unpacked, .. }) = unpacker.unpack(&chunk()) else {
            panic!("120 MB of {}", packed.len())
        };
        assert_eq!(unpacked, 120 << 20);
    }
}

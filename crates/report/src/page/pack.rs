//! Columns as text: steps, differences, shuffled bytes, gzip, base64. The browser's own `DecompressionStream` reads them.

use flate2::{Compression, write::GzEncoder};
use serde::Serialize;
use std::io::Write;

/// What stands for a gap.
const GAP: i32 = i32::MIN;

/// How a column is found again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Packed {
    /// Number of values.
    pub n: usize,
    /// What one step is worth.
    pub step: f64,
}

/// Collects columns.
#[derive(Default)]
pub(super) struct Packer {
    bytes: Vec<u8>,
}

impl Packer {
    /// Adds a column in steps of `step`; what is not finite becomes a gap, what is too large the largest.
    pub fn add(&mut self, values: impl ExactSizeIterator<Item = f64>, step: f64) -> Packed {
        let n = values.len();
        let limit = f64::from(i32::MAX);
        let steps = values.map(|value| match value.is_finite() {
            true => (value / step).round().clamp(-limit, limit) as i32,
            false => GAP,
        });
        let mut before = 0i32;
        let differences: Vec<[u8; 4]> = steps
            .map(|now| {
                let difference = now.wrapping_sub(before);
                before = now;
                difference.to_le_bytes()
            })
            .collect();
        // Bytes of one rank together: the high ones are nearly all zero.
        for rank in 0..4 {
            self.bytes.extend(differences.iter().map(|bytes| bytes[rank]));
        }
        Packed { n, step }
    }

    /// All of them as base64 of gzip.
    pub fn finish(self) -> String {
        let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
        // Writing to memory cannot fail.
        gzip.write_all(&self.bytes).expect("memory");
        base64(&gzip.finish().expect("memory"))
    }
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = chunk.iter().enumerate().fold(0u32, |word, (i, byte)| word | u32::from(*byte) << (16 - 8 * i));
        for i in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::io::Read;

    /// What the page does.
    pub fn unpack(text: &str, columns: &[Packed]) -> Vec<Vec<f64>> {
        let value = |letter: u8| match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' => 62,
            _ => 63,
        };
        let letters: Vec<u8> = text.bytes().filter(|letter| *letter != b'=').collect();
        let mut bytes = Vec::new();
        for chunk in letters.chunks(4) {
            let word = chunk
                .iter()
                .enumerate()
                .fold(0u32, |word, (i, letter)| word | u32::from(value(*letter)) << (18 - 6 * i));
            bytes.extend((0..chunk.len() - 1).map(|i| (word >> (16 - 8 * i)) as u8));
        }
        let mut raw = Vec::new();
        flate2::read::GzDecoder::new(bytes.as_slice()).read_to_end(&mut raw).expect("gzip");
        let mut at = 0;
        columns
            .iter()
            .map(|Packed { n, step }| {
                let mut now = 0i32;
                let column = (0..*n).map(|i| {
                    let difference = i32::from_le_bytes([0, 1, 2, 3].map(|rank| raw[at + rank * n + i]));
                    now = now.wrapping_add(difference);
                    if now == GAP { f64::NAN } else { f64::from(now) * step }
                });
                let column = column.collect();
                at += 4 * n;
                column
            })
            .collect()
    }

    #[test]
    fn columns_come_back_within_half_a_step_and_gaps_stay() {
        let values = [0.0, 1.004, -2.5, f64::NAN, f64::INFINITY, 1e300, 7.0];
        let mut packer = Packer::default();
        let columns = [packer.add(values.into_iter(), 0.01), packer.add(std::iter::once(3.0), 1.0)];
        let found = unpack(&packer.finish(), &columns);
        for (a, b) in values[..3].iter().zip(&found[0]) {
            assert!((a - b).abs() <= 0.005, "{a} {b}");
        }
        assert!(found[0][3].is_nan() && found[0][4].is_nan());
        assert!((found[0][5] - f64::from(i32::MAX) * 0.01).abs() < 1.0 && (found[0][6] - 7.0).abs() < 1e-9);
        assert_eq!(found[1], [3.0]);
    }

    #[test]
    fn base64_is_that_of_the_standard() {
        // RFC 4648, section 10.
        for (plain, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(plain.as_bytes()), text);
        }
    }
}

//! Tables as Parquet files: the part of the format that a table of required numbers needs.
//!
//! Written by hand: a row group after the other, a plain zstd page per column, and the footer in Thrift's compact encoding. The
//! `parquet` crate would bring some forty packages for it. Names of fields and numbers are those of `parquet.thrift`
//! (Apache Parquet 2.9). That others read it is tested with Polars and Arrow in `python/tests`.

use std::io::{self, Write};

/// A column of numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its numbers.
    pub kind: Kind,
    /// Where it begins in a row (bytes).
    pub at: usize,
}

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Unsigned, 4 bytes.
    U32,
    /// Unsigned, 8 bytes.
    U64,
    /// Signed, 8 bytes.
    I64,
    /// Floating-point, 8 bytes.
    F64,
}

impl Kind {
    /// Bytes of a number.
    pub fn size(self) -> usize {
        if self == Self::U32 { 4 } else { 8 }
    }

    /// `Type`: INT32, INT64, DOUBLE.
    fn physical(self) -> i64 {
        match self {
            Self::U32 => 1,
            Self::U64 | Self::I64 => 2,
            Self::F64 => 5,
        }
    }

    /// `ConvertedType`: UINT_32, UINT_64.
    fn converted(self) -> Option<i64> {
        match self {
            Self::U32 => Some(13),
            Self::U64 => Some(14),
            Self::I64 | Self::F64 => None,
        }
    }
}

/// Bytes of rows that are gathered before a row group is written.
const GROUP_BYTES: usize = 16 << 20;
/// Level of zstd: its default.
const ZSTD_LEVEL: i32 = 3;
/// `CompressionCodec`: ZSTD.
const CODEC: i64 = 6;
/// `Encoding`: PLAIN, RLE.
const PLAIN: i64 = 0;
const RLE: i64 = 3;
const MAGIC: &[u8] = b"PAR1";

/// A file under way.
pub struct Table<W> {
    out: W,
    written: u64,
    columns: Vec<Column>,
    row_bytes: usize,
    /// Rows of the group at hand, one after the other.
    rows: Vec<u8>,
    groups: Vec<Group>,
}

struct Group {
    rows: u64,
    chunks: Vec<Chunk>,
}

struct Chunk {
    at: u64,
    bytes: u64,
    unpacked_bytes: u64,
}

impl<W: Write> Table<W> {
    /// Begins a table of rows of so many bytes.
    ///
    /// # Errors
    /// Of writing.
    pub fn begin(mut out: W, columns: Vec<Column>, row_bytes: usize) -> io::Result<Self> {
        out.write_all(MAGIC)?;
        Ok(Self { out, written: MAGIC.len() as u64, columns, row_bytes, rows: Vec::new(), groups: Vec::new() })
    }

    /// Adds a row: little-endian numbers, each where its column says.
    ///
    /// # Errors
    /// Of writing.
    pub fn row(&mut self, row: &[u8]) -> io::Result<()> {
        assert_eq!(row.len(), self.row_bytes, "every row is of one message");
        self.rows.extend_from_slice(row);
        if self.rows.len() >= GROUP_BYTES { self.group() } else { Ok(()) }
    }

    fn group(&mut self) -> io::Result<()> {
        let rows = self.rows.len() / self.row_bytes.max(1);
        let mut chunks = Vec::with_capacity(self.columns.len());
        let mut plain = Vec::new();
        for column in &self.columns {
            plain.clear();
            let of_column = self.rows.chunks_exact(self.row_bytes);
            of_column.for_each(|row| plain.extend_from_slice(&row[column.at..column.at + column.kind.size()]));
            let packed = zstd::bulk::compress(&plain, ZSTD_LEVEL)?;
            let head = page_header(plain.len(), packed.len(), rows);
            self.out.write_all(&head)?;
            self.out.write_all(&packed)?;
            let chunk = Chunk {
                at: self.written,
                bytes: (head.len() + packed.len()) as u64,
                unpacked_bytes: (head.len() + plain.len()) as u64,
            };
            self.written += chunk.bytes;
            chunks.push(chunk);
        }
        self.groups.push(Group { rows: rows as u64, chunks });
        self.rows.clear();
        Ok(())
    }

    /// Writes what is left and the footer.
    ///
    /// # Errors
    /// Of writing.
    pub fn finish(mut self, facts: &[(String, String)]) -> io::Result<W> {
        if !self.rows.is_empty() {
            self.group()?;
        }
        let footer = footer(&self.columns, &self.groups, facts);
        self.out.write_all(&footer)?;
        self.out.write_all(&u32::try_from(footer.len()).map_err(io::Error::other)?.to_le_bytes())?;
        self.out.write_all(MAGIC)?;
        self.out.flush()?;
        Ok(self.out)
    }
}

/// `PageHeader` of a data page.
fn page_header(plain_bytes: usize, packed_bytes: usize, numbers: usize) -> Vec<u8> {
    let mut out = Thrift::default();
    out.i32(1, 0);
    out.i32(2, plain_bytes as i64);
    out.i32(3, packed_bytes as i64);
    out.structure(5, |page| {
        page.i32(1, numbers as i64);
        page.i32(2, PLAIN);
        page.i32(3, RLE);
        page.i32(4, RLE);
    });
    out.end()
}

/// `FileMetaData`.
fn footer(columns: &[Column], groups: &[Group], facts: &[(String, String)]) -> Vec<u8> {
    let mut out = Thrift::default();
    out.i32(1, 1);
    out.list(2, STRUCT, columns.len() + 1, |out| {
        out.element(|root| {
            root.text(4, "message");
            root.i32(5, columns.len() as i64);
        });
        for column in columns {
            out.element(|element| {
                element.i32(1, column.kind.physical());
                // Required.
                element.i32(3, 0);
                element.text(4, &column.name);
                column.kind.converted().into_iter().for_each(|converted| element.i32(6, converted));
            });
        }
    });
    out.i64(3, groups.iter().map(|group| group.rows).sum::<u64>() as i64);
    out.list(4, STRUCT, groups.len(), |out| {
        for group in groups {
            out.element(|out| {
                out.list(1, STRUCT, columns.len(), |out| {
                    for (column, chunk) in columns.iter().zip(&group.chunks) {
                        out.element(|out| column_chunk(out, column, chunk, group.rows));
                    }
                });
                out.i64(2, group.chunks.iter().map(|chunk| chunk.unpacked_bytes).sum::<u64>() as i64);
                out.i64(3, group.rows as i64);
            });
        }
    });
    out.list(5, STRUCT, facts.len(), |out| {
        for (key, value) in facts {
            out.element(|fact| {
                fact.text(1, key);
                fact.text(2, value);
            });
        }
    });
    out.text(6, concat!("soleus-inspect ", env!("CARGO_PKG_VERSION")));
    out.end()
}

fn column_chunk(out: &mut Thrift, column: &Column, chunk: &Chunk, rows: u64) {
    out.i64(2, chunk.at as i64);
    out.structure(3, |out| {
        out.i32(1, column.kind.physical());
        out.list(2, I32, 2, |out| [PLAIN, RLE].into_iter().for_each(|encoding| out.number(encoding)));
        out.list(3, BINARY, 1, |out| out.bytes(&column.name));
        out.i32(4, CODEC);
        out.i64(5, rows as i64);
        out.i64(6, chunk.unpacked_bytes as i64);
        out.i64(7, chunk.bytes as i64);
        out.i64(9, chunk.at as i64);
    });
}

const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// Thrift's compact encoding of a struct.
#[derive(Default)]
struct Thrift {
    out: Vec<u8>,
    /// Number of the field before.
    last: u8,
}

impl Thrift {
    fn field(&mut self, number: u8, kind: u8) {
        // Numbers rise by less than sixteen everywhere here.
        self.out.push((number - self.last) << 4 | kind);
        self.last = number;
    }

    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.out.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.out.push(value as u8);
    }

    /// An integer of any size: zigzag.
    fn number(&mut self, value: i64) {
        self.varint((value << 1 ^ value >> 63) as u64);
    }

    fn i32(&mut self, number: u8, value: i64) {
        self.field(number, I32);
        self.number(value);
    }

    fn i64(&mut self, number: u8, value: i64) {
        self.field(number, I64);
        self.number(value);
    }

    fn bytes(&mut self, text: &str) {
        self.varint(text.len() as u64);
        self.out.extend_from_slice(text.as_bytes());
    }

    fn text(&mut self, number: u8, text: &str) {
        self.field(number, BINARY);
        self.bytes(text);
    }

    fn structure(&mut self, number: u8, content: impl FnOnce(&mut Self)) {
        self.field(number, STRUCT);
        self.element(content);
    }

    /// A struct without a number: an element of a list, or what follows one.
    fn element(&mut self, content: impl FnOnce(&mut Self)) {
        let outer = std::mem::take(&mut self.last);
        content(self);
        self.out.push(0);
        self.last = outer;
    }

    fn list(&mut self, number: u8, kind: u8, count: usize, content: impl FnOnce(&mut Self)) {
        self.field(number, LIST);
        match u8::try_from(count) {
            Ok(count) if count < 15 => self.out.push(count << 4 | kind),
            _ => {
                self.out.push(0xf0 | kind);
                self.varint(count as u64);
            }
        }
        content(self);
    }

    fn end(mut self) -> Vec<u8> {
        self.out.push(0);
        self.out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_the_one_the_format_prescribes() {
        let column = |name: &str, kind, at| Column { name: name.to_string(), kind, at };
        let columns = vec![column("a", Kind::U32, 0), column("b.c", Kind::F64, 4)];
        let mut table = Table::begin(Vec::new(), columns, 12).expect("memory takes everything");
        for (a, b) in [(7_u32, 0.5_f64), (8, -1.0)] {
            table.row(&[&a.to_le_bytes()[..], &b.to_le_bytes()].concat()).expect("memory takes everything");
        }
        let file = table.finish(&[("k".to_string(), "v".to_string())]).expect("memory takes everything");
        assert!(file.starts_with(MAGIC) && file.ends_with(MAGIC));
        // The first page: type 0, 8 bytes plain, then how many packed, then the page's own header of two plain numbers.
        assert_eq!(file[4..8], [0x15, 0x00, 0x15, 16]);
        let packed = usize::from(file[9] / 2);
        assert_eq!(file[10..20], [0x2c, 0x15, 4, 0x15, 0, 0x15, 6, 0x15, 6, 0]);
        assert_eq!(file[20], 0, "the header ends");
        let plain = zstd::bulk::decompress(&file[21..21 + packed], 100).expect("zstd");
        assert_eq!(plain, [7, 0, 0, 0, 8, 0, 0, 0]);
        let length = file.len() - 8;
        let footer = u32::from_le_bytes(file[length..length + 4].try_into().expect("four")) as usize;
        let footer = &file[length - footer..length];
        // Version 1; a list of three structs: the root without a type, then the columns.
        assert_eq!(footer[..4], [0x15, 2, 0x19, 0x3c]);
        assert_eq!(footer[4..15], *b"\x48\x07message\x15\x04");
        assert_eq!(footer[16..24], *b"\x15\x02\x25\x00\x18\x01a\x25");
        assert!(footer.windows(3).any(|part| part == b"b.c") && footer.windows(4).any(|part| part == b"\x01k\x18\x01"));
    }

    #[test]
    fn long_lists_and_large_numbers_have_more_bytes() {
        let mut out = Thrift::default();
        out.list(1, I32, 20, |_| {});
        out.i64(2, -300);
        assert_eq!(out.end(), [0x19, 0xf5, 20, 0x16, 0xd7, 0x04, 0]);
    }
}

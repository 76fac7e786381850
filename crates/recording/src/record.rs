//! Records of an MCAP file, taken apart: bytes in, records out, nothing believed.
//!
//! After the [specification of MCAP](https://mcap.dev/spec). The reader of the crate `mcap` is not used because it
//! believes what a file says: an attachment shorter than its head, a record longer than its chunk end it in a panic.

use mcap::records::op;
use std::collections::BTreeMap;

/// What every MCAP file begins and ends with.
pub(crate) use mcap::MAGIC;

/// Bytes in front of each record: what it is, and how long.
pub(crate) const HEAD_BYTES: usize = 9;

/// Largest record outside of a chunk, and largest compressed chunk (bytes); ours have less than one megabyte.
pub(crate) const RECORD_MAX_BYTES: u64 = 64 << 20;

/// How much more than it has a file may grow to. Recordings of walks grow to two or three times their size, those of
/// a robot that stands to twenty.
pub(crate) const RATIO_MAX: u64 = 200;

/// What is wrong with a file from some byte on.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum Broken {
    /// A record or field reaches beyond what holds it.
    #[error("{what} of {bytes} bytes, where {left} are left")]
    Cut {
        /// What.
        what: &'static str,
        /// How long it says it is.
        bytes: u64,
        /// How much there is.
        left: u64,
    },
    /// A record or chunk is longer than any recording needs.
    #[error("{what} of {}: more than {} is not read", files::size_text(*bytes), files::size_text(*max_bytes))]
    TooLarge {
        /// What.
        what: &'static str,
        /// How long it says it is.
        bytes: u64,
        /// The most that is read.
        max_bytes: u64,
    },
    /// The file grows to many times its size.
    #[error(
        "chunks that grow from {} to {}: more than {} times their size is not unpacked",
        files::size_text(*packed), files::size_text(*unpacked), RATIO_MAX
    )]
    Ratio {
        /// Their compressed size, up to here.
        packed: u64,
        /// What they would grow to.
        unpacked: u64,
    },
    /// A chunk does not hold what it says.
    #[error("a chunk that cannot be unpacked: {reason}")]
    Chunk {
        /// Why.
        reason: String,
    },
    /// A checksum is wrong.
    #[error("{what} whose checksum is wrong")]
    Checksum {
        /// What.
        what: &'static str,
    },
    /// A text is not UTF-8, or a map names a key twice.
    #[error("{what} that is no text")]
    Text {
        /// What.
        what: &'static str,
    },
    /// A message belongs to a channel that was not introduced, or a channel to such a schema.
    #[error("{what} {id} that was not introduced before")]
    Unknown {
        /// What.
        what: &'static str,
        /// Its number.
        id: u16,
    },
    /// The end is not where a file ends.
    #[error("bytes after the end of the recording")]
    AfterEnd,
}

/// A record; what a recording needs of it.
#[derive(Debug, PartialEq)]
pub(crate) enum Record<'a> {
    Header {
        profile: &'a str,
        library: &'a str,
    },
    Footer,
    Schema {
        id: u16,
        name: &'a str,
        encoding: &'a str,
        content: &'a [u8],
    },
    Channel {
        id: u16,
        schema: u16,
        topic: &'a str,
        encoding: &'a str,
        metadata: BTreeMap<String, String>,
    },
    Message {
        channel: u16,
        sequence: u32,
        log_time_ns: u64,
        publish_time_ns: u64,
        content: &'a [u8],
    },
    Chunk(Chunk<'a>),
    Attachment(Attachment<'a>),
    Metadata {
        name: &'a str,
        metadata: BTreeMap<String, String>,
    },
    DataEnd,
    /// Indexes and what is of no use here.
    Other,
}

/// A chunk as it lies in the file.
#[derive(Debug, PartialEq)]
pub(crate) struct Chunk<'a> {
    pub(crate) unpacked_bytes: u64,
    pub(crate) crc: u32,
    pub(crate) compression: &'a str,
    pub(crate) content: &'a [u8],
}

/// A file in the file.
#[derive(Debug, PartialEq)]
pub(crate) struct Attachment<'a> {
    pub(crate) log_time_ns: u64,
    pub(crate) create_time_ns: u64,
    pub(crate) name: &'a str,
    pub(crate) media_type: &'a str,
    pub(crate) content: &'a [u8],
}

/// What a record is and how long, out of the bytes in front of it.
pub(crate) fn head(bytes: [u8; HEAD_BYTES]) -> (u8, u64) {
    let [opcode, length @ ..] = bytes;
    (opcode, u64::from_le_bytes(length))
}

/// Takes the next record off the front of a chunk's content; `None` at its end.
pub(crate) fn next_in_chunk<'a>(content: &mut &'a [u8]) -> Result<Option<Record<'a>>, Broken> {
    if content.is_empty() {
        return Ok(None);
    }
    let mut fields = Fields { rest: content, what: "a record in a chunk" };
    let (opcode, length) = head(fields.array()?);
    let body = fields.take(length)?;
    *content = fields.rest;
    Record::parse(opcode, body).map(Some)
}

impl<'a> Record<'a> {
    /// Takes a record apart.
    pub(crate) fn parse(opcode: u8, body: &'a [u8]) -> Result<Self, Broken> {
        let fields = |what| Fields { rest: body, what };
        Ok(match opcode {
            op::HEADER => {
                let mut fields = fields("a field of the file's header");
                Self::Header { profile: fields.text()?, library: fields.text()? }
            }
            op::FOOTER => Self::Footer,
            op::SCHEMA => {
                let mut fields = fields("a field of a schema");
                let (id, name, encoding) = (fields.u16()?, fields.text()?, fields.text()?);
                let length = fields.u32()?;
                Self::Schema { id, name, encoding, content: fields.take(length.into())? }
            }
            op::CHANNEL => {
                let mut fields = fields("a field of a channel");
                let (id, schema, topic, encoding) = (fields.u16()?, fields.u16()?, fields.text()?, fields.text()?);
                Self::Channel { id, schema, topic, encoding, metadata: fields.map()? }
            }
            op::MESSAGE => {
                let mut fields = fields("a field of a message");
                let (channel, sequence) = (fields.u16()?, fields.u32()?);
                let (log_time_ns, publish_time_ns) = (fields.u64()?, fields.u64()?);
                Self::Message { channel, sequence, log_time_ns, publish_time_ns, content: fields.rest }
            }
            op::CHUNK => {
                let mut fields = fields("a field of a chunk");
                let (_first, _last) = (fields.u64()?, fields.u64()?);
                let (unpacked_bytes, crc, compression) = (fields.u64()?, fields.u32()?, fields.text()?);
                let length = fields.u64()?;
                Self::Chunk(Chunk { unpacked_bytes, crc, compression, content: fields.take(length)? })
            }
            op::ATTACHMENT => {
                let mut fields = fields("a field of an attachment");
                let (log_time_ns, create_time_ns) = (fields.u64()?, fields.u64()?);
                let (name, media_type) = (fields.text()?, fields.text()?);
                let length = fields.u64()?;
                let content = fields.take(length)?;
                let covered = body.len() - fields.rest.len();
                let crc = fields.u32()?;
                if crc != 0 && crc != crc32fast::hash(&body[..covered]) {
                    return Err(Broken::Checksum { what: "an attachment" });
                }
                Self::Attachment(Attachment { log_time_ns, create_time_ns, name, media_type, content })
            }
            op::METADATA => {
                let mut fields = fields("a field of metadata");
                Self::Metadata { name: fields.text()?, metadata: fields.map()? }
            }
            op::DATA_END => Self::DataEnd,
            _ => Self::Other,
        })
    }
}

/// What is left of a record; every length is held against it before anything is done with it.
struct Fields<'a> {
    rest: &'a [u8],
    what: &'static str,
}

impl<'a> Fields<'a> {
    fn take(&mut self, bytes: u64) -> Result<&'a [u8], Broken> {
        let cut = || Broken::Cut { what: self.what, bytes, left: self.rest.len() as u64 };
        let count = usize::try_from(bytes).map_err(|_| cut())?;
        let (head, rest) = self.rest.split_at_checked(count).ok_or_else(cut)?;
        self.rest = rest;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Broken> {
        Ok(self.take(N as u64)?.try_into().expect("as many as were taken"))
    }

    fn u16(&mut self) -> Result<u16, Broken> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32, Broken> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Broken> {
        self.array().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Result<&'a str, Broken> {
        let length = self.u32()?;
        std::str::from_utf8(self.take(length.into())?).map_err(|_| Broken::Text { what: self.what })
    }

    fn map(&mut self) -> Result<BTreeMap<String, String>, Broken> {
        let length = self.u32()?;
        let mut entries = Fields { rest: self.take(length.into())?, what: self.what };
        let mut map = BTreeMap::new();
        while !entries.rest.is_empty() {
            let (key, value) = (entries.text()?, entries.text()?);
            if map.insert(key.to_string(), value.to_string()).is_some() {
                return Err(Broken::Text { what: self.what });
            }
        }
        Ok(map)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_beyond_the_end_are_told_not_believed() {
        let mut attachment = vec![0; 16];
        // Name and media type are empty; the content says it has 2.8 EB.
        attachment.extend([0; 8]);
        attachment.extend(2_800_000_000_000_000_000_u64.to_le_bytes());
        let error = Record::parse(op::ATTACHMENT, &attachment).expect_err("there is nothing");
        assert_eq!(error.to_string(), "a field of an attachment of 2800000000000000000 bytes, where 0 are left");
        // No room for its checksum.
        let length = attachment.len() - 8;
        attachment[length..].fill(0);
        assert!(matches!(Record::parse(op::ATTACHMENT, &attachment), Err(Broken::Cut { bytes: 4, left: 0, .. })));
        let mut record = [op::MESSAGE, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1].as_slice();
        assert!(matches!(next_in_chunk(&mut record), Err(Broken::Cut { left: 1, .. })));
        let text = [1_u32.to_le_bytes().as_slice(), &[0xff]].concat();
        assert!(matches!(Record::parse(op::METADATA, &text), Err(Broken::Text { .. })));
    }

    #[test]
    fn every_record_may_end_anywhere() {
        for opcode in 0..=255 {
            for length in 0..64 {
                for fill in [0, 1, 0x7f, 0xff] {
                    // Whatever comes of it: no panic.
                    let _ = Record::parse(opcode, &vec![fill; length]);
                }
            }
        }
    }
}

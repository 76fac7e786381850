//! The records of a file, one at a time: memory holds the largest of them.

use crate::error::ReadError;
use crate::record::{Broken, HEAD_BYTES, MAGIC, RECORD_MAX_BYTES, Record, head};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// A file under inspection. It is a regular one and begins as MCAP does.
pub(crate) struct Source {
    path: PathBuf,
    file: BufReader<File>,
    /// Bytes of the file.
    size: u64,
    /// Where the next record begins.
    at: u64,
    body: Vec<u8>,
}

/// The front of a record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Head {
    pub(crate) opcode: u8,
    pub(crate) length: u64,
    /// Where it begins.
    pub(crate) at: u64,
}

impl Source {
    /// Opens a file.
    pub(crate) fn open(path: &Path) -> Result<Self, ReadError> {
        let failed = |source| ReadError::File { path: path.to_path_buf(), source };
        let (file, size) = files::open(path).map_err(failed)?;
        if size == 0 {
            return Err(ReadError::Empty { path: path.to_path_buf() });
        }
        let mut file = BufReader::with_capacity(1 << 16, file);
        let mut begin = Vec::with_capacity(MAGIC.len());
        file.by_ref().take(MAGIC.len() as u64).read_to_end(&mut begin).map_err(failed)?;
        if begin != MAGIC {
            let begin = begin.escape_ascii().to_string();
            return Err(ReadError::Foreign { path: path.to_path_buf(), begin });
        }
        Ok(Self { path: path.to_path_buf(), file, size, at: MAGIC.len() as u64, body: Vec::new() })
    }

    /// Its size (bytes).
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// Whether the file ends as finished ones do.
    pub(crate) fn is_finished(&mut self) -> Result<bool, ReadError> {
        let least = 2 * MAGIC.len() as u64;
        if self.size < least {
            return Ok(false);
        }
        let mut end = [0; MAGIC.len()];
        let read = self
            .file
            .seek(SeekFrom::End(-(MAGIC.len() as i64)))
            .and_then(|_| self.file.read_exact(&mut end))
            .and_then(|()| self.file.seek(SeekFrom::Start(self.at)));
        read.map_err(|source| self.failed(source))?;
        Ok(end == MAGIC)
    }

    /// The front of the next record; `None` at the end of the file.
    pub(crate) fn next(&mut self) -> Result<Option<Head>, ReadError> {
        let left = self.size - self.at;
        if left == 0 {
            return Ok(None);
        }
        let at = self.at;
        let cut = |bytes, left| Err(self.broken(at, Broken::Cut { what: "a record", bytes, left }));
        let Some(left) = left.checked_sub(HEAD_BYTES as u64) else { return cut(HEAD_BYTES as u64, left) };
        let mut bytes = [0; HEAD_BYTES];
        if let Err(source) = self.file.read_exact(&mut bytes) {
            return Err(self.failed(source));
        }
        let (opcode, length) = head(bytes);
        if length > left {
            return Err(self.broken(at, Broken::Cut { what: "a record", bytes: length, left }));
        }
        self.at += HEAD_BYTES as u64;
        Ok(Some(Head { opcode, length, at }))
    }

    /// Reads the record whose front was the last.
    pub(crate) fn read(&mut self, head: Head) -> Result<Record<'_>, ReadError> {
        if head.length > RECORD_MAX_BYTES {
            let (bytes, max_bytes) = (head.length, RECORD_MAX_BYTES);
            return Err(self.broken(head.at, Broken::TooLarge { what: "a record", bytes, max_bytes }));
        }
        // No more than the file has: that was seen before.
        self.body.resize(head.length as usize, 0);
        if let Err(source) = self.file.read_exact(&mut self.body) {
            return Err(self.failed(source));
        }
        self.at += head.length;
        Record::parse(head.opcode, &self.body).map_err(|source| ReadError::Broken {
            path: self.path.clone(),
            at: head.at,
            source,
        })
    }

    /// Passes over the record whose front was the last.
    pub(crate) fn skip(&mut self, head: Head) -> Result<(), ReadError> {
        let at = self.at + head.length;
        let by = i64::try_from(head.length).expect("no longer than the file");
        self.file.seek_relative(by).map_err(|source| self.failed(source))?;
        self.at = at;
        Ok(())
    }

    /// Goes back to a record whose front was seen before.
    pub(crate) fn back_to(&mut self, head: Head) -> Result<(), ReadError> {
        self.at = head.at + HEAD_BYTES as u64;
        self.file.seek(SeekFrom::Start(self.at)).map(drop).map_err(|source| self.failed(source))
    }

    /// Whether nothing but the closing mark is left.
    pub(crate) fn at_end(&self) -> bool {
        self.size - self.at == MAGIC.len() as u64
    }

    pub(crate) fn broken(&self, at: u64, source: Broken) -> ReadError {
        ReadError::Broken { path: self.path.clone(), at, source }
    }

    fn failed(&self, source: io::Error) -> ReadError {
        ReadError::File { path: self.path.clone(), source }
    }
}

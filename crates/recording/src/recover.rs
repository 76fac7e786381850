//! Finishing what a killed process left unfinished.

use crate::PARTIAL;
use crate::chunk::Unpacker;
use crate::error::{ReadError, RecoverError, WriteError};
use crate::record::{Attachment, Record, next_in_chunk};
use crate::source::Source;
use crate::writer::{METADATA, STARTED, options};
use files::utc;
use mcap::records::{MessageHeader, Metadata, op};
use std::collections::HashMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// A recording that was finished afterwards.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recovered {
    /// The file now.
    pub path: PathBuf,
    /// The file that was not finished.
    pub from: PathBuf,
    /// Messages saved: all up to the last flush.
    pub messages: u64,
}

/// What came of the unfinished recordings in a folder.
#[derive(Debug, Default)]
pub struct Recovery {
    /// Those that are finished now.
    pub recovered: Vec<Recovered>,
    /// Those that could not be, and are as they were.
    pub left: Vec<RecoverError>,
}

/// Ending of a file while it is recovered.
const RECOVERING: &str = "recovering";

/// Finishes every recording in a folder whose name ends in `.mcap.partial` and which nobody writes any more.
///
/// # Errors
/// If the folder cannot be read. What is wrong with a single file is in the answer, and keeps nothing else from being
/// recovered.
pub fn recover(folder: &Path) -> Result<Recovery, WriteError> {
    let failed = |source| WriteError::File { path: folder.to_path_buf(), source };
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        paths.push(entry.map_err(failed)?.path());
    }
    paths.sort();
    let mut recovery = Recovery::default();
    for partial in paths.iter().filter(|path| is_partial(path)) {
        match recover_file(partial) {
            Ok(recovered) => recovery.recovered.push(recovered),
            // Killed before anything was written: there is nothing to be saved.
            Err(RecoverError::Unreadable(ReadError::Empty { .. })) => {
                std::fs::remove_file(partial).map_err(failed)?;
            }
            // Somebody else's, or under way: no business of ours.
            Err(RecoverError::Unreadable(ReadError::Foreign { .. }) | RecoverError::UnderWay { .. }) => {}
            Err(error) => recovery.left.push(error),
        }
    }
    Ok(recovery)
}

fn is_partial(path: &Path) -> bool {
    let ending = |path: &Path| path.extension().map(|ending| ending.to_string_lossy().into_owned());
    ending(path).as_deref() == Some(PARTIAL) && ending(&path.with_extension("")).as_deref() == Some("mcap")
}

/// Finishes a recording: keeps its whole chunks, attachments and metadata, writes the index, and gives it a name of
/// its own that says when it was begun: `walk.mcap.partial` becomes `walk-20261121T214512Z.mcap`. Nothing that exists
/// is replaced. The unfinished file is removed when that has succeeded. Memory holds one chunk.
///
/// # Errors
/// If it cannot be read, is still being written, is no MCAP file, or if the finished one cannot be written.
pub fn recover_file(partial: &Path) -> Result<Recovered, RecoverError> {
    let unwritten = |path: &Path| {
        let path = path.to_path_buf();
        move |source| RecoverError::Unwritten(WriteError::File { path, source })
    };
    let read = |source| ReadError::File { path: partial.to_path_buf(), source };
    // Held until the end: two who recover at once would write the same.
    let (file, _) = files::open(partial).map_err(read)?;
    if let Err(std::fs::TryLockError::WouldBlock) = file.try_lock() {
        return Err(RecoverError::UnderWay { path: partial.to_path_buf() });
    }
    let mut source = Source::open(partial)?;
    let folder = partial.parent().unwrap_or(Path::new("."));
    let name = partial.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let name = name.trim_end_matches(&format!(".{PARTIAL}")).trim_end_matches(".mcap").to_string();
    // Whoever made one before held the lock that is ours now, and came to no end.
    let draft = folder.join(format!("{name}.mcap.{RECOVERING}"));
    let _ = std::fs::remove_file(&draft);
    let out = files::create_new(&draft).map_err(unwritten(&draft))?;
    let copied = copy(&mut source, BufWriter::new(out));
    let copied = copied.inspect_err(|_| {
        // What is left of it is nobody's; what it was made of is still there.
        let _ = std::fs::remove_file(&draft);
    })?;
    let started = copied.started.unwrap_or_else(|| {
        let metadata = partial.metadata();
        let time = metadata.and_then(|metadata| metadata.created().or(metadata.modified()));
        utc::compact(time.unwrap_or(SystemTime::UNIX_EPOCH))
    });
    let path = loop {
        let path = files::free_name(folder, &format!("{name}-{started}"), "mcap");
        match files::replace(&draft, &path, false) {
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            done => break done.map(|()| path).map_err(unwritten(&draft))?,
        }
    };
    std::fs::remove_file(partial).map_err(unwritten(partial))?;
    Ok(Recovered { path, from: partial.to_path_buf(), messages: copied.messages })
}

/// What was copied.
struct Copied {
    messages: u64,
    /// When the recording was begun, if it says so, as names of files have it.
    started: Option<String>,
}

/// Copies everything readable; the first thing that is not is the end.
fn copy(source: &mut Source, out: BufWriter<File>) -> Result<Copied, RecoverError> {
    let mut out = Copy {
        mcap: options().create(out).map_err(WriteError::Mcap)?,
        schemas: HashMap::new(),
        channels: HashMap::new(),
        copied: Copied { messages: 0, started: None },
    };
    let mut unpacker = Unpacker::default();
    // A damaged record is the end; that the disk is full is not.
    'file: while let Ok(Some(head)) = source.next() {
        match head.opcode {
            op::DATA_END | op::FOOTER => break,
            op::CHUNK => {
                let Ok(Record::Chunk(chunk)) = source.read(head) else { break };
                let Ok(mut content) = unpacker.unpack(&chunk) else { break };
                loop {
                    let Ok(record) = next_in_chunk(&mut content) else { break 'file };
                    let Some(record) = record else { break };
                    if !out.put(record)? {
                        break 'file;
                    }
                }
            }
            _ => {
                let Ok(record) = source.read(head) else { break };
                if !out.put(record)? {
                    break;
                }
            }
        }
    }
    out.mcap.finish().map_err(WriteError::Mcap)?;
    let file = out.mcap.into_inner().into_inner().map_err(|error| WriteError::Mcap(error.into_error().into()))?;
    file.sync_all().map_err(|error| WriteError::Mcap(error.into()))?;
    Ok(out.copied)
}

struct Copy {
    mcap: mcap::Writer<BufWriter<File>>,
    schemas: HashMap<u16, u16>,
    channels: HashMap<u16, u16>,
    copied: Copied,
}

impl Copy {
    /// Copies a record; `false` if it cannot be right.
    fn put(&mut self, record: Record) -> Result<bool, WriteError> {
        match record {
            Record::Schema { id, name, encoding, content } => {
                self.schemas.insert(id, self.mcap.add_schema(name, encoding, content)?);
            }
            Record::Channel { id, schema, topic, encoding, metadata } => {
                // Schema 0 is none.
                let schema = if schema == 0 { Some(0) } else { self.schemas.get(&schema).copied() };
                let Some(schema) = schema else { return Ok(false) };
                self.channels.insert(id, self.mcap.add_channel(schema, topic, encoding, &metadata)?);
            }
            Record::Message { channel, sequence, log_time_ns, publish_time_ns, content } => {
                let Some(&channel_id) = self.channels.get(&channel) else { return Ok(false) };
                let (log_time, publish_time) = (log_time_ns, publish_time_ns);
                self.mcap
                    .write_to_known_channel(&MessageHeader { channel_id, sequence, log_time, publish_time }, content)?;
                self.copied.messages += 1;
            }
            Record::Attachment(Attachment { log_time_ns, create_time_ns, name, media_type, content }) => {
                self.mcap.attach(&mcap::Attachment {
                    log_time: log_time_ns,
                    create_time: create_time_ns,
                    name: name.to_string(),
                    media_type: media_type.to_string(),
                    data: content.into(),
                })?;
            }
            Record::Metadata { name, metadata } => {
                if METADATA.contains(&name) {
                    let started = metadata.get(STARTED).map(|time| utc::compact_text(time));
                    self.copied.started = self.copied.started.take().or(started);
                }
                self.mcap.write_metadata(&Metadata { name: name.to_string(), metadata })?;
            }
            _ => {}
        }
        Ok(true)
    }
}

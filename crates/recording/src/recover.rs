//! Finishing what a killed process left unfinished.

use crate::PARTIAL;
use crate::error::WriteError;
use crate::writer::options;
use mcap::read::{ChunkFlattener, Options};
use mcap::records::Record;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// A recording that was finished afterwards.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recovered {
    /// The file now.
    pub path: PathBuf,
    /// Messages saved: all up to the last flush.
    pub messages: u64,
}

/// Finishes every recording in a folder whose name still ends in [`PARTIAL`]: keeps its whole chunks, attachments and metadata,
/// writes the index, and gives it its name. The unfinished file is removed when that has succeeded.
///
/// # Errors
/// If a file cannot be read or written.
pub fn recover(folder: &Path) -> Result<Vec<Recovered>, WriteError> {
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        move |source| WriteError::File { path, source }
    };
    let mut recovered = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed(folder))? {
        let partial = entry.map_err(failed(folder))?.path();
        if partial.extension().is_some_and(|ending| ending == PARTIAL) {
            let bytes = std::fs::read(&partial).map_err(failed(&partial))?;
            let path = partial.with_extension("");
            let draft = path.with_extension("recovering");
            let file = File::create(&draft).map_err(failed(&draft))?;
            let messages = copy(&bytes, BufWriter::new(file))?;
            std::fs::rename(&draft, &path).map_err(failed(&path))?;
            std::fs::remove_file(&partial).map_err(failed(&partial))?;
            recovered.push(Recovered { path, messages });
        }
    }
    Ok(recovered)
}

/// Copies everything readable; the first thing that is not is the end.
fn copy(bytes: &[u8], out: BufWriter<File>) -> Result<u64, WriteError> {
    let mut mcap = options().create(out)?;
    let mut schemas = BTreeMap::new();
    let mut channels = BTreeMap::new();
    let mut messages = 0;
    let Ok(records) = ChunkFlattener::new_with_options(bytes, enumset::EnumSet::only(Options::IgnoreEndMagic)) else {
        mcap.finish()?;
        return Ok(0);
    };
    for record in records {
        match record {
            Err(_) => break,
            Ok(Record::Schema { header, data }) => {
                schemas.insert(header.id, mcap.add_schema(&header.name, &header.encoding, &data)?);
            }
            Ok(Record::Channel(channel)) => {
                // Schema 0 is none.
                let schema = schemas.get(&channel.schema_id).copied().unwrap_or(0);
                let id = mcap.add_channel(schema, &channel.topic, &channel.message_encoding, &channel.metadata)?;
                channels.insert(channel.id, id);
            }
            Ok(Record::Message { mut header, data }) => {
                let Some(id) = channels.get(&header.channel_id) else { break };
                header.channel_id = *id;
                mcap.write_to_known_channel(&header, &data)?;
                messages += 1;
            }
            Ok(Record::Attachment { data, header, .. }) => mcap.attach(&mcap::Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data,
            })?,
            Ok(Record::Metadata(metadata)) => mcap.write_metadata(&metadata)?,
            Ok(_) => {}
        }
    }
    mcap.finish()?;
    Ok(messages)
}

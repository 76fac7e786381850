//! Reading.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// Why a file is not read although the system would.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum Refused {
    /// Remedy: name a regular file.
    #[error("is {found}, not a regular file")]
    NotRegular {
        /// What it is.
        found: &'static str,
    },
    /// Remedy: is it the right file?
    #[error("has {} and more than {} is not read: is it the right file?", size_text(*bytes), size_text(*max_bytes))]
    TooLarge {
        /// Its size, as far as it is known.
        bytes: u64,
        /// The largest that is read.
        max_bytes: u64,
    },
    /// Remedy: save it as UTF-8.
    #[error("is no UTF-8 text at byte {at} ({found}): save it as UTF-8")]
    Encoding {
        /// First byte that does not belong there.
        at: usize,
        /// What it seems to be.
        found: &'static str,
    },
}

/// A number of bytes for people: `4.2 MB`.
#[must_use]
pub fn size_text(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} bytes"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

/// Opens a regular file for reading and says its size; never waits for the other end of a pipe.
///
/// # Errors
/// What the system says, or [`Refused::NotRegular`].
pub fn open(path: &Path) -> io::Result<(File, u64)> {
    // Looked at first because opening a device may already do something.
    regular(&path.metadata()?)?;
    let file = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(path)?;
    // And once more because another file may have taken its place.
    let metadata = file.metadata()?;
    regular(&metadata)?;
    Ok((file, metadata.len()))
}

/// Reads a regular file of at most so many bytes.
///
/// # Errors
/// What the system says, or [`Refused`].
pub fn read(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let (file, bytes) = open(path)?;
    let too_large = |bytes| Err(io::Error::new(io::ErrorKind::FileTooLarge, Refused::TooLarge { bytes, max_bytes }));
    if bytes > max_bytes {
        return too_large(bytes);
    }
    let mut content = Vec::with_capacity(bytes as usize);
    // It may be written while it is read, or be one of those that the system makes up and calls empty.
    file.take(max_bytes + 1).read_to_end(&mut content)?;
    if content.len() as u64 > max_bytes { too_large(content.len() as u64) } else { Ok(content) }
}

/// Reads a text of at most so many bytes.
///
/// # Errors
/// What the system says, or [`Refused`].
pub fn read_text(path: &Path, max_bytes: u64) -> io::Result<String> {
    String::from_utf8(read(path, max_bytes)?).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let bytes = error.into_bytes();
        let found = match bytes[..] {
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "it looks like UTF-16",
            _ if bytes[at..].iter().take(64).any(|byte| *byte < 9) => "it looks like no text at all",
            _ => "it looks like Latin-1 or another old code page",
        };
        io::Error::new(io::ErrorKind::InvalidData, Refused::Encoding { at, found })
    })
}

fn regular(metadata: &std::fs::Metadata) -> io::Result<()> {
    let kind = metadata.file_type();
    let found = match kind {
        _ if kind.is_file() => return Ok(()),
        _ if kind.is_dir() => "a folder",
        _ if kind.is_fifo() => "a named pipe",
        _ if kind.is_socket() => "a socket",
        _ => "a device",
    };
    Err(io::Error::new(io::ErrorKind::InvalidInput, Refused::NotRegular { found }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn only_regular_files_are_read_and_nothing_is_waited_for() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let pipe = folder.path().join("pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status().expect("coreutils").success());
        let socket = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).expect("a socket");
        for (path, word) in [
            (Path::new("/dev/zero"), "is a device"),
            (&pipe, "is a named pipe"),
            (&socket, "is a socket"),
            (folder.path(), "is a folder"),
        ] {
            let message = read(path, 10).expect_err("no regular file").to_string();
            assert!(message.starts_with(word), "{message}");
        }
        // A link to a device is no way round.
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("/dev/zero", &link).expect("a link");
        assert!(read(&link, 10).expect_err("a device").to_string().starts_with("is a device"));
        assert_eq!(read(&folder.path().join("none"), 10).expect_err("none").kind(), io::ErrorKind::NotFound);
    }

    #[test]
    fn files_are_read_up_to_the_size_that_is_believed() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("x");
        std::fs::write(&path, [7; 10]).expect("writable");
        assert_eq!(read(&path, 10).expect("not too large"), [7; 10]);
        let message = read(&path, 9).expect_err("too large").to_string();
        assert_eq!(message, "has 10 bytes and more than 9 bytes is not read: is it the right file?");
        // A file that the system calls empty and that is not.
        assert!(read(Path::new("/proc/self/status"), 10).is_err());
        assert!(read_text(Path::new("/proc/self/status"), 1 << 20).expect("some lines").contains("Name"));
    }

    #[test]
    fn texts_of_other_encodings_are_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("x");
        let said = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("writable");
            read_text(&path, 100).expect_err("no UTF-8").to_string()
        };
        assert!(said(b"\xff\xfea\0b\0").contains("at byte 0 (it looks like UTF-16)"));
        assert!(said(b"Fu\xdf links").contains("at byte 2 (it looks like Latin-1"));
        assert!(said(b"a\xff\0\0\x01").contains("no text at all"));
    }
}

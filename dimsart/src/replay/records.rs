//! Reads the records of an MCAP file sequentially, with memory bounded by its size.
//!
//! A finished file ends with a magic word. A file without it is truncated, for example by a power failure: its last record,
//! which may be an open chunk, is read as far as possible. In any other file an invalid length is damage.

mod chunk;
mod fields;

use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read as _, Seek as _, SeekFrom};
use std::path::Path;

use crc32fast::Hasher;
use mcap::MAGIC;
use mcap::records::op;

use super::ReplayError;
use chunk::Chunk;
use fields::Fields;

/// Opcode and length of a record.
pub(super) const HEAD_BYTES: usize = 9;
/// Footer and magic word at the end of a file.
const TAIL_BYTES: u64 = 37;

/// A record used by a replay.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Record {
    Attachment { name: String, data: Vec<u8> },
    Schema { id: u16, data: Vec<u8> },
    Channel { id: u16, schema: u16, topic: String },
    Message { channel: u16, data: Vec<u8> },
}

/// Why the next record cannot be read.
#[derive(Debug)]
pub(super) enum RecordError {
    File(io::Error),
    NotMcap,
    Damaged { byte: u64, reason: String },
}

impl From<io::Error> for RecordError {
    fn from(error: io::Error) -> Self {
        Self::File(error)
    }
}

impl RecordError {
    pub(super) fn of(self, path: &Path) -> ReplayError {
        let path = path.to_owned();
        match self {
            Self::File(source) => ReplayError::File { path, source },
            Self::NotMcap => ReplayError::NotMcap { path },
            Self::Damaged { byte, reason } => ReplayError::Damaged { path, byte, reason },
        }
    }
}

/// A file that is read to its end, or to its truncation.
pub(super) struct Records {
    file: BufReader<File>,
    bytes: u64,
    /// Start of the next record.
    position: u64,
    /// Whether the file is truncated, and whether its writer did not finish it.
    is_cut: bool,
    is_unfinished: bool,
    is_over: bool,
    crc: Hasher,
    chunk: Option<Chunk>,
}

impl Records {
    pub(super) fn new(mut file: File) -> Result<Self, RecordError> {
        let bytes = file.seek(SeekFrom::End(0))?;
        let tail_bytes = TAIL_BYTES.min(bytes);
        let mut tail = Vec::new();
        file.seek(SeekFrom::Start(bytes - tail_bytes))?;
        file.by_ref().take(tail_bytes).read_to_end(&mut tail)?;
        file.rewind()?;
        let is_cut = bytes < TAIL_BYTES + MAGIC.len() as u64 || !tail.ends_with(MAGIC);
        // The footer starts with the position of the summary; only a finished recording has a summary.
        let has_summary = tail.get(HEAD_BYTES..HEAD_BYTES + 8).is_some_and(|start| start != [0; 8]);
        let (mut file, mut magic) = (BufReader::new(file), [0; MAGIC.len()]);
        match file.read_exact(&mut magic) {
            Err(error) if error.kind() != ErrorKind::UnexpectedEof => return Err(error.into()),
            Ok(()) if magic == *MAGIC => {}
            _ => return Err(RecordError::NotMcap),
        }
        let mut crc = Hasher::new();
        crc.update(MAGIC);
        let (position, is_unfinished) = (MAGIC.len() as u64, is_cut || !has_summary);
        Ok(Self { file, bytes, position, is_cut, is_unfinished, is_over: false, crc, chunk: None })
    }

    /// Returns whether the writer did not finish the file.
    pub(super) const fn is_unfinished(&self) -> bool {
        self.is_unfinished
    }

    /// Reads the next record; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Record>, RecordError> {
        loop {
            if let Some(chunk) = &mut self.chunk {
                match chunk.next()? {
                    Some(record) => return Ok(Some(record)),
                    None => self.chunk = None,
                }
            } else if self.is_over {
                return Ok(None);
            } else if let Some(record) = self.next_of_file()? {
                return Ok(Some(record));
            }
        }
    }

    /// Reads the next record outside of chunks; `None` for an unused record, and for a chunk, which it opens.
    fn next_of_file(&mut self) -> Result<Option<Record>, RecordError> {
        let start = self.position;
        let damaged = |reason: String| RecordError::Damaged { byte: start, reason };
        let left = self.bytes - start;
        let mut head = [0; HEAD_BYTES];
        if left < HEAD_BYTES as u64 {
            self.is_over = true;
            return if self.is_cut {
                Ok(None)
            } else {
                Err(damaged("missing end-of-data record".to_owned()))
            };
        }
        self.file.read_exact(&mut head)?;
        let [opcode, length @ ..] = head;
        let (length, left) = (u64::from_le_bytes(length), left - HEAD_BYTES as u64);
        let is_open = length > left;
        if is_open && !self.is_cut {
            return Err(damaged(format!(
                "record of {length} bytes, but only {left} bytes remain in the file"
            )));
        }
        let mut body = Vec::new();
        self.file.by_ref().take(length).read_to_end(&mut body)?;
        self.position = start + HEAD_BYTES as u64 + body.len() as u64;
        if is_open {
            self.is_over = true;
            if opcode != op::CHUNK {
                return Ok(None);
            }
        }
        if opcode == op::DATA_END {
            self.is_over = true;
            let found = std::mem::take(&mut self.crc).finalize();
            let saved =
                Fields(&body).u32().ok_or_else(|| damaged("truncated end-of-data record".to_owned()))?;
            let is_right = saved == 0 || saved == found;
            return if is_right { Ok(None) } else { Err(damaged("wrong checksum of the data".to_owned())) };
        }
        self.crc.update(&head);
        self.crc.update(&body);
        let record = match opcode {
            op::CHUNK => {
                self.chunk = Some(Chunk::open(start, &body, is_open)?);
                return Ok(None);
            }
            op::ATTACHMENT => fields::attachment(&body).map(Some),
            op::SCHEMA | op::CHANNEL | op::MESSAGE => fields::record(opcode, &body).map(Some),
            op::HEADER | op::MESSAGE_INDEX | op::METADATA => Some(None),
            // A summary follows the data.
            _ => return Err(damaged(format!("unknown record type {opcode:#04x}"))),
        };
        record.ok_or_else(|| damaged(format!("unreadable record of type {opcode:#04x}")))
    }
}

#[cfg(test)]
mod tests;

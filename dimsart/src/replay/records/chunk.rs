//! Records of a chunk.

use std::io::Read as _;

use mcap::records::op;

use super::fields::{self, Fields};
use super::{HEAD_BYTES, Record, RecordError};

/// Maximum compression ratio of LZ4; a chunk that claims more is damaged.
const MAX_EXPANSION: u64 = 256;

/// A chunk in memory.
#[derive(Debug)]
pub(super) struct Chunk {
    /// Start in the file.
    at: u64,
    bytes: Vec<u8>,
    next: usize,
    /// Whether its writer did not close it.
    is_open: bool,
}

impl Chunk {
    /// Reads a chunk from its body; an open chunk has no sizes and contains all decompressible data.
    pub(super) fn open(at: u64, body: &[u8], is_open: bool) -> Result<Self, RecordError> {
        let damaged = |reason: &str| RecordError::Damaged { byte: at, reason: reason.to_owned() };
        let Some((size, crc, compression, data)) = parts(body, is_open) else {
            return match is_open {
                true => Ok(Self { at, bytes: Vec::new(), next: 0, is_open }),
                false => Err(damaged("chunk exceeds its record")),
            };
        };
        let most = MAX_EXPANSION * (data.len() as u64 + 1);
        if !is_open && size > most {
            return Err(damaged(&format!("invalid compression of {size} bytes into {} bytes", data.len())));
        }
        let mut bytes = Vec::new();
        let is_whole = match compression.as_str() {
            "" => {
                bytes.extend_from_slice(data);
                true
            }
            "lz4" => {
                let decoder = lz4::Decoder::new(data).map_err(RecordError::File)?;
                decoder.take(size.min(most)).read_to_end(&mut bytes).is_ok()
            }
            other => return Err(damaged(&format!("unknown compression {other:?}"))),
        };
        let is_size = is_whole && bytes.len() as u64 == size;
        if !is_open && !is_size {
            return Err(damaged("cannot decompress the chunk"));
        }
        if !is_open && crc != 0 && crc != crc32fast::hash(&bytes) {
            return Err(damaged("wrong checksum of the chunk"));
        }
        Ok(Self { at, bytes, next: 0, is_open })
    }

    /// Reads its next record; `None` after the last complete one.
    pub(super) fn next(&mut self) -> Result<Option<Record>, RecordError> {
        loop {
            let mut rest = Fields(self.bytes.get(self.next..).unwrap_or_default());
            let left = rest.0.len();
            if left == 0 {
                return Ok(None);
            }
            let damaged = |reason: &str| {
                let reason = format!("{reason} at byte {} of the chunk", self.next);
                RecordError::Damaged { byte: self.at, reason }
            };
            let opcode = rest.0.split_off_first().copied().unwrap_or_default();
            let Some(body) = rest.u64().and_then(|length| rest.bytes(length)) else {
                return if self.is_open { Ok(None) } else { Err(damaged("truncated record")) };
            };
            let record = match opcode {
                op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                    fields::record(opcode, body).map(Some).ok_or_else(|| damaged("unreadable record"))?
                }
                _ => None,
            };
            self.next += HEAD_BYTES + body.len();
            if record.is_some() {
                return Ok(record);
            }
        }
    }
}

/// Reads size, checksum, compression and compressed records of a chunk.
fn parts(body: &[u8], is_open: bool) -> Option<(u64, u32, String, &[u8])> {
    let mut fields = Fields(body);
    let (_start, _end) = (fields.u64()?, fields.u64()?);
    let (size, crc, compression) = (fields.u64()?, fields.u32()?, fields.text()?);
    let compressed = fields.u64()?;
    let data = if is_open { fields.0 } else { fields.bytes(compressed)? };
    Some((size, crc, compression, data))
}

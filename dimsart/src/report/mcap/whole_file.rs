//! A file that is complete after every flush: a killed writer leaves a file that every MCAP reader accepts.
//!
//! Each flush writes its records and an end of file in one write; the next flush overwrites that end.

use std::fs::File;
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};

use crc32fast::Hasher;
use mcap::MAGIC;

/// Opcode and length of the record that ends the data; its CRC follows.
const DATA_END: [u8; 9] = [0x0F, 4, 0, 0, 0, 0, 0, 0, 0];
/// The footer of a file without a summary.
const FOOTER: [u8; 29] =
    [0x02, 20, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];

/// Buffers records and writes them on flush.
#[derive(Debug)]
pub(super) struct WholeFile<'a> {
    file: &'a File,
    /// Length of the file without its end.
    written: u64,
    pending: Vec<u8>,
    crc: Hasher,
}

impl<'a> WholeFile<'a> {
    pub(super) fn new(file: &'a File) -> Self {
        Self { file, written: 0, pending: Vec::new(), crc: Hasher::new() }
    }

    /// Appends to the written records.
    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(self.written))?;
        self.file.write_all(bytes)
    }

    fn end(&self) -> Vec<u8> {
        let crc = self.crc.clone().finalize().to_le_bytes();
        [&DATA_END, crc.as_slice(), &FOOTER, MAGIC].concat()
    }
}

impl Write for WholeFile<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pending.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.pending.is_empty() {
            return Ok(());
        }
        let mut bytes = std::mem::take(&mut self.pending);
        let (count, before) = (bytes.len(), self.crc.clone());
        self.crc.update(&bytes);
        // A finished recording contains its end.
        if !bytes.ends_with(MAGIC) {
            bytes.extend(self.end());
        }
        if let Err(error) = self.put(&bytes) {
            // A full disk may have taken a part: restore the previous complete file.
            self.crc = before;
            let _ = self.file.set_len(self.written).and_then(|()| self.put(&self.end()));
            return Err(error);
        }
        self.written += count as u64;
        bytes.clear();
        self.pending = bytes;
        Ok(())
    }
}

impl Seek for WholeFile<'_> {
    /// Returns the position of the next record; other positions are not supported.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Current(0) => Ok(self.written + self.pending.len() as u64),
            _ => Err(ErrorKind::Unsupported.into()),
        }
    }
}

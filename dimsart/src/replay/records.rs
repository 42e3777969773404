//! The records of an MCAP file, one after the other, in memory that does not grow with it.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader};

use super::ReplayError;

/// A file that is read to its end, or to where it is cut off.
pub(super) struct Records {
    file: File,
    reader: LinearReader,
    is_cut: bool,
}

/// Why the next record cannot be read.
#[derive(Debug)]
pub(super) enum RecordError {
    File(std::io::Error),
    Mcap(McapError),
}

impl RecordError {
    pub(super) fn of(self, path: &Path) -> ReplayError {
        let path = path.to_owned();
        match self {
            Self::File(source) => ReplayError::File { path, source },
            Self::Mcap(source) => ReplayError::NoMcap { path, source },
        }
    }
}

impl Records {
    pub(super) fn new(file: File) -> Self {
        Self { file, reader: LinearReader::new(), is_cut: false }
    }

    /// Whether the file had no end.
    pub(super) const fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// The next record; none at the end.
    pub(super) fn next(&mut self) -> Result<Option<Record<'static>>, RecordError> {
        while let Some(event) = self.reader.next_event() {
            match event {
                Ok(LinearReadEvent::ReadRequest(bytes)) => {
                    let read = self.file.read(self.reader.insert(bytes)).map_err(RecordError::File)?;
                    self.reader.notify_read(read);
                }
                Ok(LinearReadEvent::Record { data, opcode }) => {
                    let record = mcap::parse_record(opcode, data).map_err(RecordError::Mcap)?;
                    return Ok(Some(record.into_owned()));
                }
                Err(McapError::UnexpectedEof) => {
                    self.is_cut = true;
                    return Ok(None);
                }
                Err(error) => return Err(RecordError::Mcap(error)),
            }
        }
        Ok(None)
    }
}

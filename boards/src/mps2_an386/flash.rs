//! Flash in a file of the host, next to the pipes; its content survives the emulator.

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use semihosting::fs::File;
use semihosting::io::{self, Read, Seek, SeekFrom, Write};

use crate::board::Storage;

/// The same as on an STM32G4.
const PAGE_BYTES: u32 = 2048;
const WORD_BYTES: usize = 8;
const SCHEME_BYTES: u32 = 4 * PAGE_BYTES;
#[cfg(not(feature = "auth"))]
const FLASH_BYTES: u32 = SCHEME_BYTES;
#[cfg(feature = "auth")]
const FLASH_BYTES: u32 = SCHEME_BYTES + 2 * PAGE_BYTES;
const NAME: &core::ffi::CStr = c"flash";

/// The file.
pub struct FileFlash(File);

/// A file error.
#[derive(Debug)]
pub struct Failed;

impl NorFlashError for Failed {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl From<io::Error> for Failed {
    fn from(_: io::Error) -> Self {
        Self
    }
}

/// Opens or creates the file; `None` if the emulator's folder is not writable.
pub(super) fn storage() -> Option<Storage<FileFlash>> {
    let kept = File::options().read(true).write(true).open(NAME).ok().map(FileFlash);
    let flash = kept.or_else(|| {
        let mut options = File::options();
        let file = options.read(true).write(true).create(true).truncate(true).open(NAME);
        let mut flash = FileFlash(file.ok()?);
        flash.fill(0, FLASH_BYTES).ok()?;
        Some(flash)
    });
    flash.map(|flash| Storage {
        flash,
        range: 0..SCHEME_BYTES,
        #[cfg(feature = "auth")]
        keys: SCHEME_BYTES..FLASH_BYTES,
        stalls_tick: false,
    })
}

impl FileFlash {
    fn fill(&mut self, from: u32, to: u32) -> Result<(), Failed> {
        self.0.seek(SeekFrom::Start(from.into()))?;
        for _ in (from..to).step_by(WORD_BYTES) {
            self.0.write_all(&[0xFF; WORD_BYTES])?;
        }
        Ok(())
    }
}

impl ErrorType for FileFlash {
    type Error = Failed;
}

impl ReadNorFlash for FileFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Failed> {
        self.0.seek(SeekFrom::Start(offset.into()))?;
        Ok(self.0.read_exact(bytes)?)
    }

    fn capacity(&self) -> usize {
        FLASH_BYTES as usize
    }
}

impl NorFlash for FileFlash {
    const WRITE_SIZE: usize = WORD_BYTES;
    const ERASE_SIZE: usize = PAGE_BYTES as usize;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Failed> {
        self.0.seek(SeekFrom::Start(offset.into()))?;
        Ok(self.0.write_all(bytes)?)
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Failed> {
        self.fill(from, to)
    }
}

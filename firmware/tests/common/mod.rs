//! A flash whose power can go, and one that says yes to what it does not take.

use std::ops::Range;

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

pub(crate) const WORD: usize = 8;
pub(crate) const PAGE: usize = 2048;
pub(crate) const PAGES: usize = 4;

/// Flash that takes each word once between two erasures, but zeros at any time, as an STM32G4's does; and
/// whose power can go, or that can be deaf.
#[derive(Clone)]
pub(crate) struct Flash {
    pub(crate) bytes: Vec<u8>,
    pub(crate) is_written: Vec<bool>,
    pub(crate) erasures: Vec<u32>,
    /// Words and pages that are still begun to be written or erased; the last one is left half done.
    pub(crate) power: Option<usize>,
    /// Words and pages that were begun to be written or erased since the flash was made.
    pub(crate) begun: usize,
    /// Those of them that are not taken, which nobody is told.
    pub(crate) deaf: Range<usize>,
}

#[derive(Debug)]
pub(crate) struct PowerGone;

impl NorFlashError for PowerGone {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Flash {
    pub(crate) fn new() -> Self {
        Self {
            bytes: vec![0xFF; PAGES * PAGE],
            is_written: vec![false; PAGES * PAGE / WORD],
            erasures: vec![0; PAGES],
            power: None,
            begun: 0,
            deaf: 0..0,
        }
    }

    /// Whether the next word or page is not taken.
    fn is_deaf(&mut self) -> bool {
        self.begun += 1;
        self.deaf.contains(&(self.begun - 1))
    }

    /// Whether there is power for another word or page.
    fn has_power(&mut self) -> Option<bool> {
        match &mut self.power {
            None => Some(true),
            Some(0) => None,
            Some(left) => {
                *left -= 1;
                Some(*left > 0)
            }
        }
    }
}

impl ErrorType for Flash {
    type Error = PowerGone;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerGone> {
        let offset = offset as usize;
        bytes.copy_from_slice(&self.bytes[offset..offset + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerGone> {
        assert!(
            (offset as usize).is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD),
            "not whole words"
        );
        for (word, content) in (offset as usize / WORD..).zip(bytes.chunks(WORD)) {
            if self.is_deaf() {
                continue;
            }
            let is_zero = content.iter().all(|byte| *byte == 0);
            assert!(is_zero || !self.is_written[word], "word {word} is written twice");
            let is_whole = self.has_power().ok_or(PowerGone)?;
            let length = if is_whole { WORD } else { WORD / 2 };
            self.is_written[word] = true;
            self.bytes[word * WORD..][..length].copy_from_slice(&content[..length]);
            if !is_whole {
                return Err(PowerGone);
            }
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerGone> {
        for page in from as usize / PAGE..to as usize / PAGE {
            if self.is_deaf() {
                continue;
            }
            let is_whole = self.has_power().ok_or(PowerGone)?;
            let length = if is_whole { PAGE } else { PAGE / 2 };
            self.bytes[page * PAGE..][..length].fill(0xFF);
            self.is_written[page * PAGE / WORD..][..length / WORD].fill(false);
            self.erasures[page] += 1;
            if !is_whole {
                return Err(PowerGone);
            }
        }
        Ok(())
    }
}

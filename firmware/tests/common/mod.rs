//! A flash with power loss at any byte or with failing writes, and a watchdog.

use std::ops::Range;

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

pub(crate) const WORD: usize = 8;
pub(crate) const PAGE: usize = 2048;
pub(crate) const PAGES: usize = 4;

/// Maximum times of a word and a page in the STM32G4's data sheet.
const WORD_US: u64 = 100;
const PAGE_US: u64 = 25_000;

/// Flash like an STM32G4's: a word is written once between two erasures, except with zeros. Power can fail,
/// and writes can fail silently.
#[derive(Clone)]
pub(crate) struct Flash {
    pub(crate) bytes: Vec<u8>,
    pub(crate) is_written: Vec<bool>,
    pub(crate) erasures: Vec<u32>,
    /// Remaining writes and erasures before the power loss, in eighths of words and pages (bytes of a word).
    pub(crate) power: Option<usize>,
    /// Number of started writes and erasures.
    pub(crate) begun: usize,
    /// Writes and erasures that fail silently.
    pub(crate) deaf: Range<usize>,
    /// Time until the watchdog resets the board, `us`.
    pub(crate) patience_us: u64,
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
        Self::of_pages(PAGES)
    }

    pub(crate) fn of_pages(pages: usize) -> Self {
        Self {
            bytes: vec![0xFF; pages * PAGE],
            is_written: vec![false; pages * PAGE / WORD],
            erasures: vec![0; pages],
            power: None,
            begun: 0,
            deaf: 0..0,
            patience_us: u64::MAX,
        }
    }

    /// Returns whether the next write or erasure fails.
    fn is_deaf(&mut self) -> bool {
        self.begun += 1;
        self.deaf.contains(&(self.begun - 1))
    }

    /// Counts the time of an operation.
    fn pass(&mut self, duration_us: u64) {
        assert!(duration_us <= self.patience_us, "the watchdog resets the board");
        self.patience_us -= duration_us;
    }

    /// Executes as many eighths of the next word or page as power permits.
    fn begin(&mut self, carry_out: impl FnOnce(&mut Self, usize)) -> Result<(), PowerGone> {
        let eighths = self.power.map_or(8, |left| left.min(8));
        self.power = self.power.map(|left| left - eighths);
        carry_out(self, eighths);
        if eighths == 8 { Ok(()) } else { Err(PowerGone) }
    }

    /// Sets this many eighths of a page's bits to one, in a random order.
    pub(crate) fn erase_eighths(&mut self, page: usize, eighths: usize, seed: u64) {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        for byte in &mut self.bytes[page * PAGE..][..PAGE] {
            for bit in 0..8 {
                *byte |= u8::from(random.next_u32() as usize % 8 < eighths) << bit;
            }
        }
        let words = self.bytes[page * PAGE..][..PAGE].chunks(WORD);
        for (is_written, word) in self.is_written[page * PAGE / WORD..].iter_mut().zip(words) {
            *is_written = word.iter().any(|byte| *byte != 0xFF);
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
            self.pass(WORD_US);
            if self.is_deaf() {
                continue;
            }
            let is_zero = content.iter().all(|byte| *byte == 0);
            assert!(is_zero || !self.is_written[word], "word {word} is written twice");
            self.begin(|flash, bytes| {
                flash.is_written[word] |= bytes > 0;
                flash.bytes[word * WORD..][..bytes].copy_from_slice(&content[..bytes]);
            })?;
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerGone> {
        for page in from as usize / PAGE..to as usize / PAGE {
            self.pass(PAGE_US);
            if self.is_deaf() {
                continue;
            }
            self.begin(|flash, eighths| {
                flash.erase_eighths(page, eighths, flash.begun as u64);
                flash.erasures[page] += u32::from(eighths > 0);
            })?;
        }
        Ok(())
    }
}

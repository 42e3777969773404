//! The motor configuration: an item in the storage of the schemes.
//!
//! ```text
//! layout u32 | words u32 ...     little-endian; only the layout 0 after a deletion
//! ```

use dimsart_link::protocol::{MAX_MOTOR_WORDS, MotorFallback, MotorReport};
use embedded_storage_async::nor_flash::NorFlash;

use crate::read_back::StorageError;
use crate::scheme_store::{SPARE_BYTES, SchemeStore};

/// Key of the item.
const MOTOR: u8 = 3;
const MAX_WORDS: usize = 1 + MAX_MOTOR_WORDS;

impl<F: NorFlash> SchemeStore<F> {
    /// Reads the stored configuration without checking its values: whether there is one, and why it could not
    /// be read. Can be called before [`open`](Self::open).
    pub fn motor(&mut self) -> MotorReport {
        let mut report = MotorReport::default();
        let mut bytes = [0; 4 * MAX_WORDS];
        let opened = self.items.open();
        let found = self.items.fetch(MOTOR, &mut bytes);
        let (Ok(()), Ok(bytes)) = (opened, found) else {
            report.fallback = Some(MotorFallback::Storage);
            return report;
        };
        if self.items.may_be_outdated(MOTOR) {
            report.fallback = Some(MotorFallback::Damaged);
        }
        let (words, _) = bytes.unwrap_or_default().as_chunks::<4>();
        if let Some((layout, words)) = words.split_first() {
            report.layout = u16::try_from(u32::from_le_bytes(*layout)).unwrap_or(u16::MAX);
            report.is_stored = report.layout != 0;
            report.words.extend(words.iter().take(MAX_MOTOR_WORDS).map(|word| u32::from_le_bytes(*word)));
        }
        report
    }

    /// Stores a configuration; layout 0 without words deletes it.
    ///
    /// # Errors
    /// [`StorageError`]; the old configuration is still stored.
    pub async fn store_motor(&mut self, layout: u16, words: &[u32]) -> Result<(), StorageError> {
        let mut bytes = [[0; 4]; MAX_WORDS];
        let item = bytes.get_mut(..=words.len()).ok_or(StorageError)?;
        for (bytes, word) in item.iter_mut().zip(core::iter::once(&u32::from(layout)).chain(words)) {
            *bytes = word.to_le_bytes();
        }
        self.items.store(&[(MOTOR, item.as_flattened())], SPARE_BYTES).await
    }
}

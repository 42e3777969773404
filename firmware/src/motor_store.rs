//! The configuration of a board's motor, beside the schemes: one more item of their map, replaced whole or not at all.
//!
//! ```text
//! layout u32 | words u32 ...     little-endian; the layout alone, and 0, where nothing is kept any more
//! ```

use dimsart_core::protocol::{MAX_MOTOR_WORDS, MotorFallback, MotorReport};
use embedded_storage_async::nor_flash::NorFlash;

use crate::scheme_store::{Broken, SchemeStore};

/// Key of the item.
pub(crate) const MOTOR: u8 = 3;
const MOST_BYTES: usize = 4 * (1 + MAX_MOTOR_WORDS);

impl<F: NorFlash> SchemeStore<'_, F> {
    /// The configuration that is kept, with whether there is one, and why it could not be read. What it says is not checked.
    pub async fn motor(&mut self) -> MotorReport {
        let mut report = MotorReport::default();
        let found = self.map.fetch_item::<&[u8]>(self.buffer, &MOTOR).await;
        let Ok(bytes) = found else {
            report.fallback = Some(MotorFallback::Storage);
            return report;
        };
        let (words, _) = bytes.unwrap_or_default().as_chunks::<4>();
        if let Some((layout, words)) = words.split_first() {
            report.layout = u16::try_from(u32::from_le_bytes(*layout)).unwrap_or(u16::MAX);
            report.is_kept = report.layout != 0;
            report.words.extend(words.iter().take(MAX_MOTOR_WORDS).map(|word| u32::from_le_bytes(*word)));
        }
        report
    }

    /// Keeps a configuration; layout 0 and no words are none.
    ///
    /// # Errors
    /// [`Broken`]; what was kept still is.
    pub async fn keep_motor(&mut self, layout: u16, words: &[u32]) -> Result<(), Broken> {
        let mut bytes = heapless::Vec::<u8, MOST_BYTES>::new();
        for word in core::iter::once(&u32::from(layout)).chain(words) {
            bytes.extend_from_slice(&word.to_le_bytes()).map_err(|_| Broken)?;
        }
        self.store_at(|_| MOTOR, &bytes).await
    }
}

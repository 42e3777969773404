//! Flash with verification after every write and erasure.
//!
//! A driver can report success for a failed write: the STM32G4's clears the error flags in its interrupt
//! before it checks them. Only the content counts.

use core::task::Poll;

use embassy_futures::poll_once;
use embedded_storage_async::nor_flash::NorFlash;

/// The storage cannot be read, or does not hold the written data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StorageError;

/// An erased byte.
pub(crate) const ERASED: u8 = 0xFF;
/// Bytes read at a time.
const BLOCK_BYTES: usize = 16;

/// A flash that verifies writes and erasures.
#[derive(Debug)]
pub(crate) struct ReadBack<F>(pub(crate) F);

impl<F: NorFlash> ReadBack<F> {
    /// Reads memory-mapped flash without waiting.
    pub(crate) fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), StorageError> {
        const { assert!(F::READ_SIZE == 1) };
        match poll_once(self.0.read(offset, bytes)) {
            Poll::Ready(Ok(())) => Ok(()),
            Poll::Ready(Err(_)) | Poll::Pending => Err(StorageError),
        }
    }

    pub(crate) async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), StorageError> {
        self.0.write(offset, bytes).await.map_err(|_| StorageError)?;
        self.compare(offset, bytes)
    }

    pub(crate) async fn erase(&mut self, from: u32, to: u32) -> Result<(), StorageError> {
        self.0.erase(from, to).await.map_err(|_| StorageError)?;
        (from..to).step_by(BLOCK_BYTES).try_for_each(|block| self.compare(block, &[ERASED; BLOCK_BYTES]))
    }

    /// Fails unless the flash holds `expected` at `offset`.
    fn compare(&mut self, offset: u32, expected: &[u8]) -> Result<(), StorageError> {
        let mut block = [0; BLOCK_BYTES];
        for (offset, expected) in (offset..).step_by(BLOCK_BYTES).zip(expected.chunks(BLOCK_BYTES)) {
            let found = block.get_mut(..expected.len()).unwrap_or_default();
            self.read(offset, found)?;
            if found != expected {
                return Err(StorageError);
            }
        }
        Ok(())
    }
}

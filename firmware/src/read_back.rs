//! Flash that is read back after every write and every erasure.
//!
//! A driver can say yes to what the flash has not taken: that of the STM32G4 clears the errors in its interrupt before
//! it looks at them. What counts is what is there afterwards.

use core::task::Poll;

use embassy_futures::poll_once;
use embedded_storage_async::nor_flash::NorFlash;

/// The storage cannot be read, or holds something else than was written to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Broken;

/// Of a flash that was erased.
pub(crate) const ERASED: u8 = 0xFF;
/// Read back at once.
const BLOCK_BYTES: usize = 16;

/// A flash whose writes and erasures succeed only if they can be read back.
#[derive(Debug)]
pub(crate) struct ReadBack<F>(pub(crate) F);

impl<F: NorFlash> ReadBack<F> {
    /// Reads what is there: memory, which never has to be waited for.
    pub(crate) fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Broken> {
        const { assert!(F::READ_SIZE == 1) };
        match poll_once(self.0.read(offset, bytes)) {
            Poll::Ready(Ok(())) => Ok(()),
            Poll::Ready(Err(_)) | Poll::Pending => Err(Broken),
        }
    }

    pub(crate) async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Broken> {
        self.0.write(offset, bytes).await.map_err(|_| Broken)?;
        self.compare(offset, bytes)
    }

    pub(crate) async fn erase(&mut self, from: u32, to: u32) -> Result<(), Broken> {
        self.0.erase(from, to).await.map_err(|_| Broken)?;
        (from..to).step_by(BLOCK_BYTES).try_for_each(|block| self.compare(block, &[ERASED; BLOCK_BYTES]))
    }

    /// Fails unless the flash holds `expected` at `offset`.
    fn compare(&mut self, offset: u32, expected: &[u8]) -> Result<(), Broken> {
        let mut block = [0; BLOCK_BYTES];
        for (offset, expected) in (offset..).step_by(BLOCK_BYTES).zip(expected.chunks(BLOCK_BYTES)) {
            let found = block.get_mut(..expected.len()).unwrap_or_default();
            self.read(offset, found)?;
            if found != expected {
                return Err(Broken);
            }
        }
        Ok(())
    }
}

//! Flash that is read back after every write and every erasure.
//!
//! A driver can say yes to what the flash has not taken: that of the STM32G4 clears the errors in its interrupt before
//! it looks at them. What counts is what is there afterwards.

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Of a flash that was erased.
pub(crate) const ERASED: u8 = 0xFF;
/// Read back at once.
const BLOCK_BYTES: usize = 16;

/// A flash whose writes and erasures succeed only if they can be read back.
#[derive(Debug)]
pub(crate) struct ReadBack<F>(pub(crate) F);

/// Why a write or an erasure failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReadBackError<E> {
    /// The flash says so.
    Flash(E),
    /// The flash holds something else than it was told to.
    Different,
}

impl<E: NorFlashError> NorFlashError for ReadBackError<E> {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Flash(error) => error.kind(),
            Self::Different => NorFlashErrorKind::Other,
        }
    }
}

/// Fails unless the flash holds `expected` at `offset`.
async fn compare<F: ReadNorFlash>(
    flash: &mut F,
    offset: u32,
    expected: &[u8],
) -> Result<(), ReadBackError<F::Error>> {
    const { assert!(F::READ_SIZE == 1) };
    let mut block = [0; BLOCK_BYTES];
    for (offset, expected) in (offset..).step_by(BLOCK_BYTES).zip(expected.chunks(BLOCK_BYTES)) {
        let found = block.get_mut(..expected.len()).unwrap_or_default();
        flash.read(offset, found).await.map_err(ReadBackError::Flash)?;
        if found != expected {
            return Err(ReadBackError::Different);
        }
    }
    Ok(())
}

impl<F: ErrorType> ErrorType for ReadBack<F> {
    type Error = ReadBackError<F::Error>;
}

impl<F: NorFlash> ReadNorFlash for ReadBack<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.0.read(offset, bytes).await.map_err(ReadBackError::Flash)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: NorFlash> NorFlash for ReadBack<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    // Not an `async fn`, which keeps its arguments twice.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> impl Future<Output = Result<(), Self::Error>> {
        let flash = &mut self.0;
        async move {
            flash.write(offset, bytes).await.map_err(ReadBackError::Flash)?;
            compare(flash, offset, bytes).await
        }
    }

    fn erase(&mut self, from: u32, to: u32) -> impl Future<Output = Result<(), Self::Error>> {
        let flash = &mut self.0;
        async move {
            flash.erase(from, to).await.map_err(ReadBackError::Flash)?;
            for block in (from..to).step_by(BLOCK_BYTES) {
                compare(flash, block, &[ERASED; BLOCK_BYTES]).await?;
            }
            Ok(())
        }
    }
}

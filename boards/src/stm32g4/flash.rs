//! The chip's flash as storage for schemes.

use core::ops::Range;
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};

use embassy_stm32::flash::{Async, Error, Flash, InterruptHandler};
use embassy_stm32::interrupt::{self, typelevel::Binding};
use embassy_stm32::{Peri, interrupt::InterruptExt as _, peripherals};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

use super::{LINE_PRIORITY, feed_watchdog};
use crate::board::Storage;
#[cfg(feature = "three-phase")]
use crate::{Board as _, Selected};

/// Flash pages reserved by the memory map.
pub struct SchemeFlash {
    flash: Flash<'static, Async>,
    stalls_tick: bool,
}

/// Returns the pages of STORAGE in the memory map.
pub(crate) fn storage(
    flash: Peri<'static, peripherals::FLASH>,
    interrupts: impl Binding<interrupt::typelevel::FLASH, InterruptHandler> + 'static,
    stalls_tick: bool,
) -> Storage<SchemeFlash> {
    interrupt::FLASH.set_priority(LINE_PRIORITY);
    Storage {
        flash: SchemeFlash { flash: Flash::new(flash, interrupts), stalls_tick },
        range: schemes(),
        #[cfg(feature = "auth")]
        keys: keys(),
        stalls_tick,
    }
}

/// Returns the pages of the schemes, as offsets from the start of the flash.
fn schemes() -> Range<u32> {
    #[expect(unsafe_code, reason = "linker symbols; only their addresses are used")]
    // SAFETY: the memory map defines both.
    unsafe extern "C" {
        safe static _storage_start: u8;
        safe static _storage_end: u8;
    }
    offset(&raw const _storage_start)..offset(&raw const _storage_end)
}

/// Returns the pages of the key.
#[cfg(feature = "auth")]
fn keys() -> Range<u32> {
    #[expect(unsafe_code, reason = "linker symbols; only their addresses are used")]
    // SAFETY: the memory map of a board with a key variant defines both.
    unsafe extern "C" {
        safe static _keys_start: u8;
        safe static _keys_end: u8;
    }
    offset(&raw const _keys_start)..offset(&raw const _keys_end)
}

fn offset(symbol: *const u8) -> u32 {
    u32::try_from(symbol.addr().wrapping_sub(embassy_stm32::flash::FLASH_BASE)).unwrap_or(u32::MAX)
}

/// Set during a read of stored data, which may contain a partly written word.
static IS_READ: AtomicBool = AtomicBool::new(false);

impl ErrorType for SchemeFlash {
    type Error = Error;
}

impl ReadNorFlash for SchemeFlash {
    const READ_SIZE: usize = <Flash<'static, Async> as ReadNorFlash>::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        IS_READ.store(true, Relaxed);
        let read = ReadNorFlash::read(&mut self.flash, offset, bytes).await;
        IS_READ.store(false, Relaxed);
        read
    }

    fn capacity(&self) -> usize {
        ReadNorFlash::capacity(&self.flash)
    }
}

impl NorFlash for SchemeFlash {
    const WRITE_SIZE: usize = <Flash<'static, Async> as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <Flash<'static, Async> as NorFlash>::ERASE_SIZE;

    /// Also returns success for a failed write, because the driver's interrupt clears the errors first.
    /// Callers must read back.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> impl Future<Output = Result<(), Error>> {
        #[cfg(feature = "three-phase")]
        Selected::disarm();
        self.flash.write(offset, bytes)
    }

    /// A page takes up to 25 ms. A chip that stalls during an erasure has a longer watchdog timeout, and the watchdog is fed
    /// before each page, as a tick between two pages may come too late. On other chips the ticks feed the watchdog. It must
    /// not be fed before the first tick: its timeout is 512 ms until the first feed, and 10 ms afterwards.
    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        for page in (from..to).step_by(Self::ERASE_SIZE) {
            if self.stalls_tick {
                feed_watchdog();
            }
            #[cfg(feature = "three-phase")]
            Selected::disarm();
            let end = page.saturating_add(u32::try_from(Self::ERASE_SIZE).unwrap_or(u32::MAX));
            self.flash.erase(page, end.min(to)).await?;
        }
        Ok(())
    }
}

#[expect(unsafe_code, reason = "exception handler")]
mod ecc {
    use cortex_m_rt::exception;
    use embassy_stm32::pac::FLASH;

    /// A word whose write was interrupted by a power loss has an uncorrectable ECC error, which raises this
    /// exception. In stored data, the reader's checksum detects it, so the exception is only acknowledged.
    /// Elsewhere the flash contains the program, which can no longer be trusted.
    #[exception]
    unsafe fn NonMaskableInt() {
        let errors = FLASH.eccr().read();
        if !(errors.eccd() || errors.eccd2()) {
            defmt::panic!("clock or supply failure");
        }
        if !super::IS_READ.load(super::Relaxed) {
            defmt::panic!("uncorrectable error in the program's flash: flash the board again");
        }
        // Writing back the set flags clears them.
        FLASH.eccr().write_value(errors);
    }
}

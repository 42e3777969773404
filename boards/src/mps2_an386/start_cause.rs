//! Why the board has started: the part has no register that says so, but memory that a reset leaves as it is.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use dimsart_link::StartCause;

/// Anything else is what the memory holds when the supply comes.
const WATCHDOG: u32 = 0x57D0_6E5D;
const PROGRAM: u32 = 0x9206_4A35;

/// What a reset from here on is by.
#[expect(unsafe_code, reason = "start-up writes nothing there")]
// SAFETY: the section holds nothing else, and any word is one that `take` knows what to make of.
#[unsafe(link_section = ".uninit.NEXT_CAUSE")]
static NEXT_CAUSE: AtomicU32 = AtomicU32::new(0);

/// Why this start came. The next one comes by the watchdog unless [somebody says](say_program) otherwise.
pub(super) fn take() -> StartCause {
    match NEXT_CAUSE.swap(WATCHDOG, Relaxed) {
        WATCHDOG => StartCause::Watchdog,
        PROGRAM => StartCause::Program,
        _ => StartCause::Power,
    }
}

/// The program is about to reset the board itself.
pub(super) fn say_program() {
    NEXT_CAUSE.store(PROGRAM, Relaxed);
}

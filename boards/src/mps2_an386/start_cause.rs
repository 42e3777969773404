//! The cause of the board's start, in memory that survives a reset: the part has no register for it.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use dimsart_link::StartCause;

/// Any other value is random content after power-up.
const WATCHDOG: u32 = 0x57D0_6E5D;
const PROGRAM: u32 = 0x9206_4A35;

/// Cause of the next reset.
#[expect(unsafe_code, reason = "not initialised at start-up")]
// SAFETY: the section holds nothing else, and `take` accepts any word.
#[unsafe(link_section = ".uninit.NEXT_CAUSE")]
static NEXT_CAUSE: AtomicU32 = AtomicU32::new(0);

/// Returns the cause of this start. The next cause is the watchdog unless [set otherwise](say_program).
pub(super) fn take() -> StartCause {
    match NEXT_CAUSE.swap(WATCHDOG, Relaxed) {
        WATCHDOG => StartCause::Watchdog,
        PROGRAM => StartCause::Program,
        _ => StartCause::Power,
    }
}

/// Records that the program resets the board.
pub(super) fn say_program() {
    NEXT_CAUSE.store(PROGRAM, Relaxed);
}

//! The CMSDK's watchdog: brings a board with late ticks to rest and restarts it.
//!
//! It counts the emulator's time, which stops while the firmware waits for its host. The first timeout raises
//! a non-maskable exception; the second one resets the board.

use core::ffi::CStr;

use semihosting::sys::arm_compat::sys_write0;

use super::{Mps2An386, Register};
use crate::CLOCK_HZ;
use crate::board::Board as _;

const LOAD: Register = Register(0x4000_8000);
const CONTROL: Register = Register(0x4000_8008);
const RAW_INTERRUPT: Register = Register(0x4000_8010);
const RAISE_AND_RESET: u32 = 0b11;

/// Timeout: with a timer tick as on nucleo-g474re; in lockstep 488 281 instructions, ten times the most
/// expensive request.
const PATIENCE: u32 = CLOCK_HZ / if cfg!(feature = "timer-tick") { 100 } else { 2 };
/// Until the first feed, as on an STM32G4.
const PATIENCE_AT_START: u32 = CLOCK_HZ / 1000 * 512;

/// Bypasses the log, which may be in the middle of a line.
const LAST_WORDS: &CStr = c"watchdog timeout: ticks were late or communication stalled\n";

/// Starts the watchdog.
pub(super) fn start() {
    LOAD.write(PATIENCE_AT_START);
    CONTROL.write(RAISE_AND_RESET);
}

/// Feeds the watchdog.
pub(super) fn feed() {
    LOAD.write(PATIENCE);
}

/// Returns whether the watchdog stopped the board.
pub(super) fn has_expired() -> bool {
    RAW_INTERRUPT.read() != 0
}

#[expect(unsafe_code, reason = "no stack to be trusted before the first instructions have set one")]
mod exception {
    /// Handles the timeout, which can interrupt anything, including a panic. Resets the stack and never
    /// returns.
    #[unsafe(naked)]
    #[unsafe(no_mangle)]
    unsafe extern "C" fn NonMaskableInt() -> ! {
        core::arch::naked_asm!(
            "ldr r0, =_stack_start",
            "mov sp, r0",
            "b {expired}",
            expired = sym super::expired,
        )
    }
}

/// Does as little as a reset, like other boards' watchdogs: earlier events are in the event log, where one
/// may be half written, and the next start adds its cause.
extern "C" fn expired() -> ! {
    Mps2An386::disarm();
    sys_write0(LAST_WORDS);
    Mps2An386::reset()
}

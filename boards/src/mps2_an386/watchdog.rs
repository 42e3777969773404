//! The CMSDK's watchdog: a board whose ticks do not keep their time is brought to rest and starts over.
//!
//! It counts the emulator's time, which stands still while the firmware waits for its host. The first time that it runs
//! out it raises the exception that nothing masks; the second time it resets the board, whatever that does.

use core::ffi::CStr;

use semihosting::sys::arm_compat::sys_write0;

use super::{Mps2An386, Register};
use crate::CLOCK_HZ;
use crate::board::Board as _;

const LOAD: Register = Register(0x4000_8000);
const CONTROL: Register = Register(0x4000_8008);
const RAW_INTERRUPT: Register = Register(0x4000_8010);
const RAISE_AND_RESET: u32 = 0b11;

/// Time from one feed to the next: as on nucleo-g474re where a timer is the clock. Where the host is, ten times what the
/// dearest request takes, 488 281 instructions.
const PATIENCE: u32 = CLOCK_HZ / if cfg!(feature = "timer-tick") { 100 } else { 2 };
/// Until the first one, as on an STM32G4.
const PATIENCE_AT_START: u32 = CLOCK_HZ / 1000 * 512;

/// Past the log, which may be in the middle of a line.
const LAST_WORDS: &CStr =
    c"stopped by the watchdog: ticks did not keep their time, or the communication stood still\n";

/// From here on the board has to be fed.
pub(super) fn start() {
    LOAD.write(PATIENCE_AT_START);
    CONTROL.write(RAISE_AND_RESET);
}

/// The count begins anew.
pub(super) fn feed() {
    LOAD.write(PATIENCE);
}

/// Whether it is why the board stops.
pub(super) fn has_expired() -> bool {
    RAW_INTERRUPT.read() != 0
}

#[expect(unsafe_code, reason = "no stack to be trusted before the first instructions have set one")]
mod exception {
    /// Comes in the middle of anything, a panic's last words among them. The stack starts anew, nothing returns: it
    /// need not hold this on top of what was interrupted.
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

/// As little as a reset does, which is all that other boards' watchdogs know: what happened before is in the event log,
/// one of whose events may be half written, and the next start adds its cause.
extern "C" fn expired() -> ! {
    Mps2An386::disarm();
    sys_write0(LAST_WORDS);
    Mps2An386::reset()
}

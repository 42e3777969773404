//! Critical sections that do not mask the current loop: they set BASEPRI instead of masking all interrupts.
//!
//! This is sound because the current loop uses nothing that they protect. Its interrupt is the only one of
//! priority 0: `start` lowers all others before they are unmasked, and the boards' tests check the catalogue.
//! It wakes no task, does not log and uses no driver, only its own variables, registers that no other code
//! writes while it runs, and atomics.

#![expect(unsafe_code, reason = "required by the crate")]

use core::sync::atomic::{Ordering::SeqCst, compiler_fence};

use cortex_m::register::{basepri, basepri_max};
use critical_section::RawRestoreState;

/// Priority 1 and lower, in the upper four bits of the register.
const MASKED: u8 = 1 << 4;

struct BelowCurrentLoop;
critical_section::set_impl!(BelowCurrentLoop);

// SAFETY: as described above, nothing that runs in between uses what critical sections protect. Nesting
// works: the mask only becomes stricter, and the previous value is restored.
unsafe impl critical_section::Impl for BelowCurrentLoop {
    unsafe fn acquire() -> RawRestoreState {
        let before = basepri::read();
        basepri_max::write(MASKED);
        // Prevents earlier reads of protected data.
        compiler_fence(SeqCst);
        before
    }

    unsafe fn release(before: RawRestoreState) {
        // SAFETY: the value returned by `acquire`.
        unsafe { basepri::write(before) };
    }
}

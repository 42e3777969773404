//! Critical sections that leave the current loop alone: they mask by BASEPRI all that is less urgent, instead of everything.
//!
//! That is sound as long as what interrupts them uses nothing that they protect. The current loop's interrupt is the only one of
//! priority 0 (`start` gives every other one a lower priority before it is ever unmasked, and the boards' tests hold their
//! catalogue to it). It wakes nobody, logs nothing and asks no driver: it has its own variables, registers that nobody else
//! writes while it runs, and atomics.

#![expect(unsafe_code, reason = "the crate wants it so")]

use core::sync::atomic::{Ordering::SeqCst, compiler_fence};

use cortex_m::register::{basepri, basepri_max};
use critical_section::RawRestoreState;

/// Priority 1 and all that is less urgent, as the processor has it: in the upper four bits.
const MASKED: u8 = 1 << 4;

struct BelowCurrentLoop;
critical_section::set_impl!(BelowCurrentLoop);

// SAFETY: between the two nothing runs that uses what critical sections protect, as said above. They nest: the mask is only ever
// made stricter, and what it was is put back.
unsafe impl critical_section::Impl for BelowCurrentLoop {
    unsafe fn acquire() -> RawRestoreState {
        let before = basepri::read();
        basepri_max::write(MASKED);
        // What is protected is not read before.
        compiler_fence(SeqCst);
        before
    }

    unsafe fn release(before: RawRestoreState) {
        // SAFETY: it is what `acquire` found.
        unsafe { basepri::write(before) };
    }
}

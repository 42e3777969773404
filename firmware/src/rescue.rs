//! The last word: actuators into their safe state, then say why, then start over.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};

use boards::{Board as _, Selected};

/// With the feature `panic-text` it says which panic: the texts and what formats them are 15 KB of flash.
#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    #[cfg(feature = "panic-text")]
    rescue(|| defmt::error!("stopped: {}", defmt::Display2Format(_info)));
    #[cfg(not(feature = "panic-text"))]
    rescue(|| defmt::error!("stopped by a panic: an image built with the feature panic-text says which"))
}

/// What `defmt::panic!` ends in; it has logged its message by then.
#[defmt::panic_handler]
fn logged_panic() -> ! {
    rescue(|| ())
}

#[expect(unsafe_code, reason = "no stack to be trusted before the first instructions have set one")]
mod hard_fault {
    /// The processor's last exception. The stack may be what failed: it starts anew, nothing returns.
    #[unsafe(naked)]
    #[unsafe(no_mangle)]
    unsafe extern "C" fn HardFault() -> ! {
        core::arch::naked_asm!(
            "ldr r0, =_stack_start",
            "mov sp, r0",
            "b {fault}",
            fault = sym super::fault,
        )
    }
}

extern "C" fn fault() -> ! {
    rescue(|| defmt::error!("stopped: a stack overflow, a bad memory access or an unknown instruction"))
}

fn rescue(say_why: impl FnOnce()) -> ! {
    static IS_SAYING_WHY: AtomicBool = AtomicBool::new(false);
    cortex_m::interrupt::disable();
    Selected::disarm();
    // Saying why can fail in its turn; once is enough.
    if !IS_SAYING_WHY.swap(true, Relaxed) {
        say_why();
    }
    Selected::reset()
}

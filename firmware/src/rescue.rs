//! The last word: actuators into their safe state, then say why, then start over.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};

use boards::{Board as _, Selected};
use dimsart_link::{EventKind, EventLog};

/// What happened, also before the last reset.
#[expect(unsafe_code, reason = "start-up writes nothing there")]
// SAFETY: the section holds nothing else, and any words are a log: `restore` finds out which of them are events.
#[unsafe(link_section = ".uninit.EVENTS")]
pub(crate) static EVENTS: EventLog = EventLog::new();

/// Finds what happened before the reset, and adds why it came.
pub(crate) fn restore_events() {
    EVENTS.restore();
    EVENTS.add_start(Selected::start_cause());
}

/// With the feature `panic-text` it says which panic: the texts and what formats them are 15 KB of flash.
#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    #[cfg(feature = "panic-text")]
    rescue(EventKind::Panic, 0, || defmt::error!("stopped: {}", defmt::Display2Format(_info)));
    #[cfg(not(feature = "panic-text"))]
    rescue(EventKind::Panic, 0, || {
        defmt::error!("stopped by a panic: an image built with the feature panic-text says which")
    })
}

/// What `defmt::panic!` ends in; it has logged its message by then.
#[defmt::panic_handler]
fn logged_panic() -> ! {
    rescue(EventKind::Panic, 0, || ())
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
    /// Configurable Fault Status Register (ARMv7-M B3.2.15): which of these it was.
    const CFSR: *const u32 = 0xE000_ED28 as *const u32;
    #[expect(unsafe_code, reason = "a register of the processor itself, which only reads have no effect on")]
    // SAFETY: there on every Cortex-M4.
    let cfsr = unsafe { CFSR.read_volatile() };
    rescue(EventKind::Exception, cfsr, || {
        defmt::error!("stopped: a stack overflow, a bad memory access or an unknown instruction");
    })
}

fn rescue(kind: EventKind, detail: u32, say_why: impl FnOnce()) -> ! {
    static IS_SAYING_WHY: AtomicBool = AtomicBool::new(false);
    cortex_m::interrupt::disable();
    Selected::disarm();
    // Saying why can fail in its turn; once is enough.
    if !IS_SAYING_WHY.swap(true, Relaxed) {
        EVENTS.add_stop(kind, detail);
        say_why();
    }
    Selected::reset()
}

//! Handles panics and exceptions: sets safe outputs, logs the cause, restarts.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};

use boards::{Board as _, Selected};
use dimsart_link::{EventKind, EventLog};

/// Events, including those before the last reset.
#[expect(unsafe_code, reason = "not initialised at start-up")]
// SAFETY: the section holds nothing else, and any content is valid: `restore` finds the events in it.
#[unsafe(link_section = ".uninit.EVENTS")]
pub(crate) static EVENTS: EventLog = EventLog::new();

/// Restores the events before the reset and adds the cause of the start.
pub(crate) fn restore_events() {
    EVENTS.restore();
    EVENTS.add_start(Selected::start_cause());
}

/// The feature `panic-text` adds the text, 15 KB of flash.
#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    #[cfg(feature = "panic-text")]
    rescue(EventKind::Panic, 0, || defmt::error!("stopped: {}", defmt::Display2Format(_info)));
    #[cfg(not(feature = "panic-text"))]
    rescue(EventKind::Panic, 0, || defmt::error!("panic: build with the feature panic-text for details"))
}

/// Runs after `defmt::panic!`, which has logged its message.
#[defmt::panic_handler]
fn logged_panic() -> ! {
    rescue(EventKind::Panic, 0, || ())
}

#[expect(unsafe_code, reason = "no stack to be trusted before the first instructions have set one")]
mod hard_fault {
    /// Handles a hard fault. The stack may have overflowed: it is reset, and the handler never returns.
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
    /// Configurable Fault Status Register (ARMv7-M B3.2.15): the cause.
    const CFSR: *const u32 = 0xE000_ED28 as *const u32;
    #[expect(unsafe_code, reason = "a register of the processor itself, which only reads have no effect on")]
    // SAFETY: present on every Cortex-M4.
    let cfsr = unsafe { CFSR.read_volatile() };
    rescue(EventKind::Exception, cfsr, || {
        defmt::error!("exception: stack overflow, invalid access or undefined instruction");
    })
}

fn rescue(kind: EventKind, detail: u32, say_why: impl FnOnce()) -> ! {
    static IS_SAYING_WHY: AtomicBool = AtomicBool::new(false);
    cortex_m::interrupt::disable();
    Selected::disarm();
    // Logging can fail again; logs only once.
    if !IS_SAYING_WHY.swap(true, Relaxed) {
        EVENTS.add_failure(kind, detail);
        say_why();
    }
    Selected::reset()
}

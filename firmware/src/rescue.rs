//! The last word: actuators into their safe state, then say why, then start over.

use core::panic::PanicInfo;

use boards::{Board as _, Selected};

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    Selected::disarm();
    defmt::error!("panic: {}", defmt::Display2Format(info));
    Selected::reset()
}

/// `defmt::panic!` has logged its message before it comes here.
#[defmt::panic_handler]
fn logged_panic() -> ! {
    cortex_m::interrupt::disable();
    Selected::disarm();
    Selected::reset()
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
    cortex_m::interrupt::disable();
    Selected::disarm();
    defmt::error!("hard fault: a memory access, an instruction or the stack went wrong");
    Selected::reset()
}

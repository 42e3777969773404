//! Panic handler of programs run by a developer: exit status 1.

use core::panic::PanicInfo;

use semihosting::process::exit;

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    exit(1)
}

#[expect(unsafe_code, reason = "the runtime wants it so")]
mod hard_fault {
    #[cortex_m_rt::exception]
    unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
        super::exit(1)
    }
}

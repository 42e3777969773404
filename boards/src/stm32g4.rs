//! What boards with an STM32G4 have in common: clock, executors, watchdog, cycle counter, command line.
//!
//! 170 MHz from the board's crystal; an RC oscillator is too inaccurate for CAN.

pub(crate) mod fdcan;
pub(crate) mod flash;
pub(crate) mod power_stage;

use cortex_m::peripheral::{DCB, DWT, SCB};
use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::interrupt::{self as line, InterruptExt as _, Priority};
use embassy_stm32::pac::IWDG;
use embassy_stm32::pac::iwdg::vals::Key;
use embassy_stm32::rcc::{Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux::Fdcansel};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{BufferedUart, Error};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, Peri, interrupt, peripherals};
use embedded_io_async::{ErrorType, Read, Write};

use crate::board::{CommandPort, Idle};

/// Bits per second of the command line.
pub(crate) const COMMAND_BAUD: u32 = 921_600;
/// Time the watchdog waits, `us`. Longer than loading the built-in scheme takes before the first tick.
const WATCHDOG_US: u32 = 50_000;

/// Executors run in two interrupts whose peripherals no board uses.
static TICK: InterruptExecutor = InterruptExecutor::new();
static BACKGROUND: InterruptExecutor = InterruptExecutor::new();

/// Smaller is more urgent; the time driver has the most urgent one of all.
const TICK_PRIORITY: Priority = Priority::P2;
/// Of the UART and the CAN controller: their load must not reach the tick.
pub(crate) const LINE_PRIORITY: Priority = Priority::P4;
const BACKGROUND_PRIORITY: Priority = Priority::P6;

#[interrupt]
fn CORDIC() {
    #[expect(unsafe_code, reason = "an executor polls in its own interrupt")]
    // SAFETY: this executor's interrupt, which its start unmasks.
    unsafe {
        TICK.on_interrupt();
    }
}

#[interrupt]
fn FMAC() {
    #[expect(unsafe_code, reason = "an executor polls in its own interrupt")]
    // SAFETY: this executor's interrupt, which its start unmasks.
    unsafe {
        BACKGROUND.on_interrupt();
    }
}

/// Settings for 170 MHz from a crystal of `crystal`, which `divider` brings down to 4 MHz.
pub(crate) fn config(crystal: Hertz, divider: PllPreDiv) -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse { freq: crystal, mode: HseMode::Oscillator });
    config.rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: divider,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config.rcc.boost = true;
    config.rcc.mux.fdcansel = Fdcansel::PCLK1;
    config
}

/// Starts the executors: the tick's and the background's.
pub(crate) fn start_executors() -> (SendSpawner, SendSpawner) {
    line::CORDIC.set_priority(TICK_PRIORITY);
    line::FMAC.set_priority(BACKGROUND_PRIORITY);
    (TICK.start(line::CORDIC), BACKGROUND.start(line::FMAC))
}

/// Starts the counter of the processor's cycles.
pub(crate) fn start_cycle_counter(mut debug: DCB, mut counter: DWT) {
    debug.enable_trace();
    counter.set_cycle_count(0);
    counter.enable_cycle_counter();
}

/// Starts the independent watchdog: it runs on its own oscillator and nothing but a reset stops it.
pub(crate) fn start_watchdog(watchdog: Peri<'static, peripherals::IWDG>) {
    IndependentWatchdog::new(watchdog, WATCHDOG_US).unleash();
}

pub(crate) fn feed_watchdog() {
    IWDG.kr().write(|key| key.set_key(Key::RESET));
}

pub(crate) fn cycles() -> Option<u32> {
    Some(DWT::cycle_count())
}

pub(crate) fn reset() -> ! {
    SCB::sys_reset()
}

/// The processor sleeps until the next interrupt.
pub struct Sleep;

impl Idle for Sleep {
    fn run(self) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}

/// The command line over a UART.
pub struct UartPort(pub(crate) BufferedUart<'static>);

impl CommandPort for UartPort {}

impl ErrorType for UartPort {
    type Error = Error;
}

impl Read for UartPort {
    /// A damaged or lost byte is one error; what follows is read as if nothing had been.
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Error> {
        Read::read(&mut self.0, bytes).await
    }
}

impl Write for UartPort {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Error> {
        Write::write(&mut self.0, bytes).await
    }

    async fn flush(&mut self) -> Result<(), Error> {
        Write::flush(&mut self.0).await
    }
}

//! Common code of the STM32G4 boards: clock, executors, watchdog, cycle counter, command line.
//!
//! The clock is 168 MHz (170 with feature `moteus`) from the board's crystal, set by [`clock_switch`]: an RC
//! oscillator is too inaccurate for CAN. If the crystal does not start, the board keeps its outputs off, logs
//! the error and restarts repeatedly.
//!
//! A debugger that halts the processor also stops timer 1, which turns off its outputs, and the watchdog.
//! When the processor continues, the board powers its motors again.

#[cfg(feature = "three-phase")]
pub(crate) mod bridge;
mod ccm;
mod clock;
mod critical_section;
#[cfg(feature = "three-phase")]
pub(crate) mod current_loop;
#[cfg(feature = "three-phase")]
pub(crate) mod current_sensing;
#[cfg(not(feature = "uart-link"))]
pub(crate) mod fdcan;
#[cfg(any(feature = "moteus", not(feature = "uart-link")))]
pub(crate) mod fdcan_registers;
pub(crate) mod flash;
#[cfg(feature = "three-phase")]
pub(crate) mod half_bridges;
#[cfg(feature = "ihm08m1")]
pub(crate) mod i2c_encoder;
#[cfg(feature = "moteus")]
pub(crate) mod moteus_bus;
#[cfg(not(any(feature = "three-phase", feature = "moteus")))]
pub(crate) mod power_stage;
#[cfg(feature = "three-phase")]
pub(crate) mod quadrature;
#[cfg(feature = "ihm08m1")]
pub(crate) mod spi_encoder;
#[cfg(feature = "three-phase")]
pub(crate) mod three_phase_joint;
pub(crate) mod uart;
#[cfg(feature = "uart-link")]
pub(crate) mod uart_link;

#[cfg(all(feature = "auth", feature = "classic-can"))]
compile_error!("boards do not support authentication on classic CAN: disable `auth` or `classic-can`");

use core::ptr::with_exposed_provenance_mut;
use core::sync::atomic::AtomicU32;

use cortex_m::peripheral::{MPU, SCB};
use defmt_rtt as _;
use dimsart_core::{Counter, Word};
#[cfg(not(any(feature = "three-phase", feature = "moteus")))]
use dimsart_core::{DataType, types};
use dimsart_link::StartCause;
use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::interrupt::{self as line, InterruptExt as _, Priority};
use embassy_stm32::pac::iwdg::vals::Key;
use embassy_stm32::pac::{DBGMCU, IWDG, RCC};
use embassy_stm32::rcc::{Hse, HseMode, Sysclk, mux::Fdcansel};
use embassy_stm32::time::Hertz;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, Peri, Peripherals, interrupt, peripherals};

use self::flash::SchemeFlash;
use self::uart::UartPort;
use crate::board::{Axes, Board, BoardParts, Idle, Storage};
use crate::clock_switch;

/// Polls of the crystal, a few cycles of 16 MHz each: more than 0.2 s in total; a crystal starts within 20
/// ms.
const CRYSTAL_PATIENCE: u32 = 1_000_000;
/// Watchdog timeout, `us`; longer if erasing a flash page (up to 25 ms) stalls the tick.
const WATCHDOG_US: u32 = 10_000;
const PATIENT_WATCHDOG_US: u32 = 50_000;

/// The executors run in the interrupts of two unused peripherals.
static TICK: InterruptExecutor = InterruptExecutor::new();
static BACKGROUND: InterruptExecutor = InterruptExecutor::new();

/// Lower numbers have higher priority; the highest is reserved for the current loop (see `critical_section`).
const TIME_PRIORITY: Priority = Priority::P1;
const TICK_PRIORITY: Priority = Priority::P2;
/// Priority of UARTs, their DMA and CAN: below the tick.
const LINE_PRIORITY: Priority = Priority::P4;
const BACKGROUND_PRIORITY: Priority = Priority::P6;

#[interrupt]
fn CORDIC() {
    #[expect(unsafe_code, reason = "an executor polls in its own interrupt")]
    // SAFETY: this executor's interrupt, unmasked by its start.
    unsafe {
        TICK.on_interrupt();
    }
}

#[interrupt]
fn FMAC() {
    #[expect(unsafe_code, reason = "an executor polls in its own interrupt")]
    // SAFETY: this executor's interrupt, unmasked by its start.
    unsafe {
        BACKGROUND.on_interrupt();
    }
}

/// Starts the chip at [`CLOCK_HZ`](crate::CLOCK_HZ) from a crystal of `crystal`, and the cycle counter. Call
/// once.
pub(crate) fn start(crystal: Hertz) -> Peripherals {
    let Some(mut core) = cortex_m::Peripherals::take() else { defmt::panic!("board started twice") };
    guard_stack(&core.MPU);
    // Lowers all interrupts below the current loop's priority, the default after reset.
    for interrupt in 0..core.NVIC.ipr.len() {
        #[expect(unsafe_code, reason = "a priority that changes in a critical section would break it")]
        // SAFETY: no critical section is active, and all interrupts are masked.
        unsafe {
            if let Some(priority) = core.NVIC.ipr.get(interrupt) {
                priority.write(TIME_PRIORITY.into());
            }
        }
    }
    // Checked here, because the library waits forever.
    RCC.cr().modify(|clocks| clocks.set_hseon(true));
    if !(0..CRYSTAL_PATIENCE).any(|_| RCC.cr().read().hserdy()) {
        defmt::panic!("crystal does not start");
    }
    let chip = embassy_stm32::init(config());
    clock_switch::switch_clock(&mut clock::Chip, crystal.0, crate::CLOCK_HZ);
    DBGMCU.apb1lfzr().modify(|frozen| frozen.set_iwdg(true));
    DBGMCU.apb2fzr().modify(|frozen| frozen.set_tim1(true));
    core.DCB.enable_trace();
    core.DWT.set_cycle_count(0);
    core.DWT.enable_cycle_counter();
    chip
}

/// Protects the 32 KiB below the SRAM, where the stack would overflow to, by the MPU (ARMv7-M, B3.5). Costs
/// no RAM.
fn guard_stack(protection: &MPU) {
    const BELOW: u32 = 0x1FFF_8000;
    const IS_REGION_0: u32 = 1 << 4;
    const NO_CODE: u32 = 1 << 28;
    /// 2^(14 + 1) bytes, without access.
    const SIZE: u32 = 14 << 1;
    const ALL_ELSE_AS_BEFORE: u32 = 1 << 2;
    const ENABLED: u32 = 1;
    #[expect(unsafe_code, reason = "the processor's own memory protection")]
    // SAFETY: the program uses nothing in this region; the default map applies elsewhere.
    unsafe {
        protection.rbar.write(BELOW | IS_REGION_0);
        protection.rasr.write(NO_CODE | SIZE | ENABLED);
        protection.ctrl.write(ALL_ELSE_AS_BEFORE | ENABLED);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// The library receives the frequency set by [`clock_switch`], because it computes dividers from it. It
/// switches to the crystal, treats this frequency as the crystal's, and leaves the PLL off.
fn config() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse { freq: Hertz(crate::CLOCK_HZ), mode: HseMode::Oscillator });
    config.rcc.sys = Sysclk::HSE;
    config.rcc.mux.fdcansel = Fdcansel::PCLK1;
    config.bdma_interrupt_priority = LINE_PRIORITY;
    config
}

/// The board's measurements, the timing of its ticks last.
#[cfg(not(any(feature = "three-phase", feature = "moteus")))]
pub(crate) const OUTPUTS: &[&DataType] = &{
    let [cycles, mean, max, late, overruns, period] = types::TIMING;
    [types::POSITION, types::CAN_REJOINS, cycles, mean, max, late, overruns, period]
};

/// Fills in the measurements other than the axes' angles.
pub(crate) fn measure(rest: Option<&mut [Word]>) {
    if let Some([rejoins, ..]) = rest {
        *rejoins = Word(rejoins_of_can());
    }
}

fn rejoins_of_can() -> u32 {
    #[cfg(not(feature = "uart-link"))]
    return fdcan::rejoins();
    #[cfg(feature = "moteus")]
    return moteus_bus::rejoins();
    #[cfg(all(feature = "uart-link", not(feature = "moteus")))]
    0
}

/// Returns the parts of a board with rotary axes. Call last: it starts the watchdog, which only a reset
/// stops. Until the first feed its timeout is 512 ms, the reset value (RM0440, 42.3.2), also if an option
/// byte started it, because the rest of the start may erase flash.
pub(crate) fn parts<B>(
    axes: Axes,
    joints: B::Joints,
    command_port: UartPort,
    (link_in, link_out): (B::LinkIn, B::LinkOut),
    storage: Storage<SchemeFlash>,
    watchdog: Peri<'static, peripherals::IWDG>,
) -> BoardParts<B>
where
    B: Board<CommandPort = UartPort, Flash = SchemeFlash, Idle = Sleep>,
{
    let (tick, background) = start_executors();
    let patience_us = if storage.stalls_tick { PATIENT_WATCHDOG_US } else { WATCHDOG_US };
    IndependentWatchdog::new(watchdog, patience_us).unleash();
    let storage = Some(storage);
    BoardParts { axes, tick, background, joints, command_port, link_in, link_out, storage, idle: Sleep }
}

fn start_executors() -> (SendSpawner, SendSpawner) {
    line::CORDIC.set_priority(TICK_PRIORITY);
    line::FMAC.set_priority(BACKGROUND_PRIORITY);
    (TICK.start(line::CORDIC), BACKGROUND.start(line::FMAC))
}

pub(crate) fn feed_watchdog() {
    IWDG.kr().write(|key| key.set_key(Key::RESET));
}

#[expect(unsafe_code, reason = "the processor changes the register, so it is read as an atomic")]
pub(crate) fn counter() -> Counter {
    const CYCCNT: usize = 0xE000_1004;
    // SAFETY: a processor register that always exists and is read as a word of memory; it is never written.
    Counter::counting_up(unsafe { AtomicU32::from_ptr(with_exposed_provenance_mut(CYCCNT)) })
}

/// Reads and clears the flags of `RCC_CSR` (RM0440, 7.4.28). Every internal reset also sets the reset pin's
/// flag: the pin was the cause only if no other flag is set.
pub(crate) fn start_cause() -> StartCause {
    let flags = RCC.csr().read();
    RCC.csr().modify(|flags| flags.set_rmvf(true));
    if flags.iwdgrstf() || flags.wwdgrstf() {
        StartCause::Watchdog
    } else if flags.sftrstf() {
        StartCause::Program
    } else if flags.borrstf() {
        StartCause::Power
    } else if flags.pinrstf() {
        StartCause::Pin
    } else {
        StartCause::Unknown
    }
}

pub(crate) fn reset() -> ! {
    SCB::sys_reset()
}

/// Sleeps until the next interrupt.
pub struct Sleep;

impl Idle for Sleep {
    fn run(self) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}

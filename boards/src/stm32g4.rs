//! What boards with an STM32G4 have in common: clock, executors, watchdog, cycle counter, command line.
//!
//! 168 MHz (with feature `moteus` 170) from the board's crystal, by [`clock_switch`]: an RC oscillator is too inaccurate for CAN. A board whose
//! crystal does not swing keeps its outputs off, says so in its log and starts over, again and again.
//!
//! A debugger that halts the processor stops timer 1 too, which switches its outputs off, and then the watchdog.
//! Going on, the board powers its motors as before.

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
compile_error!("packets over classic CAN have no tags on a board: leave `auth` or `classic-can` out");

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
use crate::board::{Axes, Board, Idle, Parts, Storage};
use crate::clock_switch;

/// Looks at a crystal that does not swing yet, a few cycles of 16 MHz each: more than 0.2 s in all, and no crystal
/// takes longer than 20 ms.
const CRYSTAL_PATIENCE: u32 = 1_000_000;
/// Time the watchdog waits from one feed to the next, `us`; and where erasing a page of flash, which takes up to 25 ms,
/// holds up the tick.
const WATCHDOG_US: u32 = 10_000;
const PATIENT_WATCHDOG_US: u32 = 50_000;

/// Executors run in two interrupts whose peripherals no board uses.
static TICK: InterruptExecutor = InterruptExecutor::new();
static BACKGROUND: InterruptExecutor = InterruptExecutor::new();

/// Smaller is more urgent; the most urgent one of all is the current loop's alone: see `critical_section`.
const TIME_PRIORITY: Priority = Priority::P1;
const TICK_PRIORITY: Priority = Priority::P2;
/// Of the UARTs, their DMA and the CAN controller: their load must not reach the tick.
const LINE_PRIORITY: Priority = Priority::P4;
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

/// Starts the chip, once: [`CLOCK_HZ`](crate::CLOCK_HZ) from a crystal of `crystal`, and the counter of the processor's
/// cycles.
pub(crate) fn start(crystal: Hertz) -> Peripherals {
    let Some(mut core) = cortex_m::Peripherals::take() else { defmt::panic!("the board was started twice") };
    guard_stack(&core.MPU);
    // Until each has its own, none is as urgent as the current loop: all of them would be.
    for interrupt in 0..core.NVIC.ipr.len() {
        #[expect(unsafe_code, reason = "a priority that changes in a critical section would break it")]
        // SAFETY: there is none, and all interrupts are still masked.
        unsafe {
            if let Some(priority) = core.NVIC.ipr.get(interrupt) {
                priority.write(TIME_PRIORITY.into());
            }
        }
    }
    // Before the library waits for it, which it does for ever.
    RCC.cr().modify(|clocks| clocks.set_hseon(true));
    if !(0..CRYSTAL_PATIENCE).any(|_| RCC.cr().read().hserdy()) {
        defmt::panic!("the board's crystal does not swing");
    }
    let chip = embassy_stm32::init(config());
    clock_switch::switch(&mut clock::Chip, crystal.0, crate::CLOCK_HZ);
    DBGMCU.apb1lfzr().modify(|frozen| frozen.set_iwdg(true));
    DBGMCU.apb2fzr().modify(|frozen| frozen.set_tim1(true));
    core.DCB.enable_trace();
    core.DWT.set_cycle_count(0);
    core.DWT.enable_cycle_counter();
    chip
}

/// Whoever gets at the 32 KiB below the SRAM, which begins with the stack, is stopped there and then (ARMv7-M, B3.5): no RAM is
/// lost for it, and the program has nothing there.
fn guard_stack(protection: &MPU) {
    const BELOW: u32 = 0x1FFF_8000;
    const IS_REGION_0: u32 = 1 << 4;
    const NO_CODE: u32 = 1 << 28;
    /// 2^(14 + 1) bytes. Without more, they are nobody's.
    const SIZE: u32 = 14 << 1;
    const ALL_ELSE_AS_BEFORE: u32 = 1 << 2;
    const ENABLED: u32 = 1;
    #[expect(unsafe_code, reason = "the processor's own memory protection")]
    // SAFETY: nothing that the program reads or writes is in this region; all else stays as it is.
    unsafe {
        protection.rbar.write(BELOW | IS_REGION_0);
        protection.rasr.write(NO_CODE | SIZE | ENABLED);
        protection.ctrl.write(ALL_ELSE_AS_BEFORE | ENABLED);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// The library is told of the clock that [`clock_switch`] makes behind it: what it sets up divides that frequency. It
/// switches to the crystal itself, takes this frequency for the crystal's, and leaves the PLL alone.
fn config() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse { freq: Hertz(crate::CLOCK_HZ), mode: HseMode::Oscillator });
    config.rcc.sys = Sysclk::HSE;
    config.rcc.mux.fdcansel = Fdcansel::PCLK1;
    config.bdma_interrupt_priority = LINE_PRIORITY;
    config
}

/// What a board measures, its own ticks last.
#[cfg(not(any(feature = "three-phase", feature = "moteus")))]
pub(crate) const OUTPUTS: &[&DataType] = &{
    let [cycles, mean, max, late, overruns, period] = types::TIMING;
    [types::POSITION, types::CAN_REJOINS, cycles, mean, max, late, overruns, period]
};

/// Fills in what a board measures beside its axes' angles.
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

/// The parts of a board whose axes turn and measure their angle. Last of all that is started: the watchdog
/// runs from here on, on its own oscillator, and only a reset stops it. Until it is first fed, it waits for 512 ms, the time of
/// its reset values (RM0440, 42.3.2), also where an option byte has started it: the rest of the start may erase flash.
pub(crate) fn parts<B>(
    axes: Axes,
    joints: B::Joints,
    command_port: UartPort,
    (link_in, link_out): (B::LinkIn, B::LinkOut),
    storage: Storage<SchemeFlash>,
    watchdog: Peri<'static, peripherals::IWDG>,
) -> Parts<B>
where
    B: Board<CommandPort = UartPort, Flash = SchemeFlash, Idle = Sleep>,
{
    let (tick, background) = start_executors();
    let patience_us = if storage.stalls_tick { PATIENT_WATCHDOG_US } else { WATCHDOG_US };
    IndependentWatchdog::new(watchdog, patience_us).unleash();
    let storage = Some(storage);
    Parts { axes, tick, background, joints, command_port, link_in, link_out, storage, idle: Sleep }
}

fn start_executors() -> (SendSpawner, SendSpawner) {
    line::CORDIC.set_priority(TICK_PRIORITY);
    line::FMAC.set_priority(BACKGROUND_PRIORITY);
    (TICK.start(line::CORDIC), BACKGROUND.start(line::FMAC))
}

pub(crate) fn feed_watchdog() {
    IWDG.kr().write(|key| key.set_key(Key::RESET));
}

#[expect(unsafe_code, reason = "the processor counts in it by itself, which nobody but an atomic can show")]
pub(crate) fn counter() -> Counter {
    const CYCCNT: usize = 0xE000_1004;
    // SAFETY: a register of the processor that is always there and is read as a word of memory is; nobody writes to it.
    Counter::up(unsafe { AtomicU32::from_ptr(with_exposed_provenance_mut(CYCCNT)) })
}

/// From the flags of `RCC_CSR` (RM0440, 7.4.28), which it clears. Every reset inside the chip pulls the reset pin, too: the
/// pin's flag alone says that it came from outside.
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

/// The processor sleeps until the next interrupt.
pub struct Sleep;

impl Idle for Sleep {
    fn run(self) -> ! {
        loop {
            cortex_m::asm::wfi();
        }
    }
}

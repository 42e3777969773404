//! ARM's MPS2 with a Cortex-M4F (application note 386), emulated by QEMU.
//!
//! The host simulates the device: it exchanges one [frame](dimsart_link::exchange) per tick over the pipes
//! `to-board` and `from-board` in the emulator's working folder. By default the exchange is in lockstep: each
//! frame advances time by one tick, there are no asynchronous interrupts, and runs are reproducible bit by
//! bit and instruction by instruction. With the feature `timer-tick`, a timer's interrupt is the clock,
//! commands use UART 0, the device stands still without a host, and the board measures its ticks. Schemes are
//! stored in the file `flash` in the same folder.
//!
//! If the firmware stops, it notifies its host. With `timer-tick` the board restarts; in lockstep the
//! emulator exits. Without `-icount`, a machine that is busy for 10 ms triggers the watchdog.

mod bytes;
mod clock;
mod flash;
mod host;
mod start_cause;
mod uart;
mod watchdog;

use core::ptr::{read_volatile, with_exposed_provenance, with_exposed_provenance_mut, write_volatile};
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{MPU, Peripherals, SCB, SYST};
use defmt_semihosting as _;
use dimsart_core::limits::Capacities;
use dimsart_core::{Counter, DataType, TickResult, Word};
use dimsart_link::StartCause;
use dimsart_link::exchange::MAX_PACKETS;
use embassy_executor::InterruptExecutor;

use crate::board::{Board, BoardParts, Joints};
use crate::catalogue::mps2_an386::TOOLING;

/// The board with its host.
pub struct Mps2An386;

/// Interrupts in use. The executors use two without a peripheral.
#[derive(Clone, Copy)]
#[repr(u16)]
enum Interrupt {
    Uart0Receive = 0,
    Uart0Send = 1,
    Timer0 = 8,
    Tick = 27,
    Background = 28,
}

const INTERRUPTS: usize = 32;

// SAFETY: each number is the interrupt's index in the table below, less than INTERRUPTS.
#[expect(unsafe_code, reason = "the numbers are the hardware's")]
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

/// Lower numbers have higher priority.
const PRIORITIES: [(Interrupt, u8); 5] = [
    (Interrupt::Timer0, 0x20),
    (Interrupt::Tick, 0x40),
    (Interrupt::Background, 0x80),
    (Interrupt::Uart0Receive, 0x80),
    (Interrupt::Uart0Send, 0x80),
];

static TICK: InterruptExecutor = InterruptExecutor::new();
static BACKGROUND: InterruptExecutor = InterruptExecutor::new();

#[expect(unsafe_code, reason = "an executor polls in its own interrupt")]
extern "C" fn run_tick() {
    // SAFETY: called only from this executor's interrupt, unmasked by `start`.
    unsafe { TICK.on_interrupt() }
}

#[expect(unsafe_code, reason = "an executor polls in its own interrupt")]
extern "C" fn run_background() {
    // SAFETY: called only from this executor's interrupt, unmasked by `start`.
    unsafe { BACKGROUND.on_interrupt() }
}

#[expect(clippy::panic, reason = "the panic handler sets safe outputs and logs the error")]
extern "C" fn unexpected() {
    panic!("unexpected interrupt");
}

type Handler = extern "C" fn();

#[expect(unsafe_code, reason = "the processor reads the table at this place")]
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [Handler; INTERRUPTS] = {
    let mut table: [Handler; INTERRUPTS] = [unexpected; INTERRUPTS];
    let [receive, send, _, _, _, _, _, _, timer, .., tick, background, _, _, _] = &mut table;
    *receive = uart::received;
    *send = uart::sent;
    *timer = clock::timer_interrupt;
    *tick = run_tick;
    *background = run_background;
    table
};

impl Board for Mps2An386 {
    const NAME: &'static str = "mps2-an386";
    const SIZES: Capacities = TOOLING.sizes;
    const OUTPUTS: &'static [&'static DataType] = host::OUTPUTS;
    const PACKETS_PER_TICK: usize = MAX_PACKETS;

    type Joints = SimulatedJoints;
    type CommandPort = uart::CommandPort;
    type LinkIn = host::HostReceiver;
    type LinkOut = host::HostSender;
    type Flash = flash::FileFlash;
    type Idle = host::Host;

    fn outputs() -> &'static [&'static DataType] {
        host::outputs()
    }

    #[expect(clippy::panic, reason = "the panic handler sets safe outputs and logs the error")]
    fn start() -> BoardParts<Self> {
        let Some(mut peripherals) = Peripherals::take() else { panic!("board started twice") };
        guard_below_stack(&mut peripherals.MPU);
        // Counts instructions if the emulator runs with `-icount`; CYCCNT reads 0 there.
        peripherals.SYST.set_clock_source(SystClkSource::Core);
        peripherals.SYST.set_reload(CYCLE_MASK);
        peripherals.SYST.clear_current();
        peripherals.SYST.enable_counter();
        for (interrupt, priority) in PRIORITIES {
            #[expect(unsafe_code, reason = "sets interrupt priorities")]
            // SAFETY: all interrupts are masked, and no mask by priority is in use.
            unsafe {
                peripherals.NVIC.set_priority(interrupt, priority);
            }
        }
        // First: after the greeting the host may delete its folder.
        let storage = flash::storage();
        let (idle, axes, link_in, link_out) = host::connect();
        let parts = BoardParts {
            axes,
            tick: TICK.start(Interrupt::Tick),
            background: BACKGROUND.start(Interrupt::Background),
            joints: SimulatedJoints,
            command_port: uart::CommandPort,
            link_in,
            link_out,
            storage,
            idle,
        };
        if cfg!(feature = "timer-tick") {
            uart::start();
            clock::start_timer();
        }
        watchdog::start();
        parts
    }

    fn disarm() {
        host::COMMANDED.clear();
    }

    #[expect(unsafe_code, reason = "the processor changes the register, so it is read as an atomic")]
    fn counter() -> Counter {
        const SYST_CVR: usize = 0xE000_E018;
        // SAFETY: a processor register that always exists and is read as a word of memory; it is not written
        // after the start.
        Counter::counting_down(
            unsafe { AtomicU32::from_ptr(with_exposed_provenance_mut(SYST_CVR)) },
            CYCLE_BITS,
        )
        .with_counts_per_cycle(COUNTS_PER_CYCLE)
    }

    fn counts_per_1024_instructions() -> u32 {
        let counts = |turns: u32| {
            cortex_m::interrupt::free(|_| {
                let start = SYST::get_current();
                #[expect(unsafe_code, reason = "a loop whose instructions are known")]
                // SAFETY: changes only its own register and the flags.
                unsafe {
                    core::arch::asm!("2:", "subs {0}, #1", "bne 2b", inout(reg) turns => _, options(nomem, nostack));
                }
                start.wrapping_sub(SYST::get_current()) & CYCLE_MASK
            })
        };
        // Two instructions per iteration.
        counts(1024).wrapping_sub(counts(512))
    }

    fn show(revision: u32, words: impl Iterator<Item = u32>) {
        host::show(revision, words);
    }

    fn feed_watchdog() {
        watchdog::feed();
    }

    fn start_cause() -> StartCause {
        start_cause::take()
    }

    /// Reports the final outputs to the host.
    fn reset() -> ! {
        host::say_stopped();
        if !watchdog::has_expired() {
            start_cause::say_program();
        }
        if cfg!(feature = "timer-tick") {
            SCB::sys_reset()
        }
        semihosting::process::exit(EXIT_RESET)
    }
}

/// Makes every access below the stack trap: the emulated board ignores writes there.
fn guard_below_stack(mpu: &mut MPU) {
    const BASE_OF_256_MIB: u32 = 0x1000_0000;
    const NO_ACCESS_256_MIB: u32 = 1 << 28 | 27 << 1 | 1;
    const ENABLE_WITH_DEFAULT_MAP: u32 = 0b101;
    #[expect(unsafe_code, reason = "access to the registers of the memory protection unit")]
    // SAFETY: the region ends where RAM begins, and the image uses nothing in it.
    unsafe {
        mpu.rnr.write(0);
        mpu.rbar.write(BASE_OF_256_MIB);
        mpu.rasr.write(NO_ACCESS_256_MIB);
        mpu.ctrl.write(ENABLE_WITH_DEFAULT_MAP);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

const CYCLE_BITS: u32 = 24;
/// Counts of the emulator's 25 MHz clock per cycle. An instruction takes 1024 ns and at least one cycle.
const COUNTS_PER_CYCLE: u32 = 26;
const CYCLE_MASK: u32 = (1 << CYCLE_BITS) - 1;
/// The emulator's exit code instead of a reset: after a panic, an exception or a watchdog timeout.
const EXIT_RESET: i32 = 101;

/// The device simulated by the host.
pub struct SimulatedJoints;

impl Joints for SimulatedJoints {
    fn read(&mut self, measured: &mut [Word]) {
        host::STAMPS.set(0, Some(Mps2An386::counter().now()));
        host::MEASURED.copy_to(measured);
    }

    fn write(&mut self, tick: TickResult, commanded: &[Word]) {
        host::COMMANDED.fill(commanded);
        host::set_outcome(tick);
        host::STAMPS.set(1, Some(Mps2An386::counter().now()));
    }
}

/// Words written by one side and read by the other, never during a tick.
struct SharedWords<const N: usize>([AtomicU32; N]);

impl<const N: usize> SharedWords<N> {
    const fn new() -> Self {
        Self([const { AtomicU32::new(0) }; N])
    }

    fn fill(&self, words: &[Word]) {
        for (shared, word) in self.0.iter().zip(words) {
            shared.store(word.0, Relaxed);
        }
    }

    fn clear(&self) {
        for shared in &self.0 {
            shared.store(0, Relaxed);
        }
    }

    /// Decodes words from bytes.
    fn fill_from_bytes(&self, bytes: &[u8]) {
        let (words, _) = bytes.as_chunks::<4>();
        for (shared, word) in self.0.iter().zip(words) {
            shared.store(u32::from_le_bytes(*word), Relaxed);
        }
    }

    /// Encodes as many words as fit.
    fn copy_to_bytes(&self, bytes: &mut [u8]) {
        let (words, _) = bytes.as_chunks_mut::<4>();
        for (word, shared) in words.iter_mut().zip(&self.0) {
            *word = shared.load(Relaxed).to_le_bytes();
        }
    }

    fn copy_to(&self, words: &mut [Word]) {
        for (word, shared) in words.iter_mut().zip(&self.0) {
            *word = Word(shared.load(Relaxed));
        }
    }

    fn set(&self, index: usize, value: Option<u32>) {
        if let Some(shared) = self.0.get(index) {
            shared.store(value.unwrap_or_default(), Relaxed);
        }
    }
}

/// A register of one of the board's peripherals.
#[derive(Clone, Copy)]
struct Register(usize);

#[expect(unsafe_code, reason = "register access")]
impl Register {
    fn read(self) -> u32 {
        // SAFETY: every Register of this board is a word-aligned register in the AN386's memory map.
        unsafe { read_volatile(with_exposed_provenance(self.0)) }
    }

    fn write(self, value: u32) {
        // SAFETY: as above; writing these registers does not affect memory used by Rust.
        unsafe { write_volatile(with_exposed_provenance_mut(self.0), value) }
    }
}

#[expect(unsafe_code, reason = "unmasks an interrupt after its initialisation")]
fn unmask(interrupt: Interrupt) {
    // SAFETY: no critical section relies on masking single interrupts.
    unsafe { cortex_m::peripheral::NVIC::unmask(interrupt) }
}

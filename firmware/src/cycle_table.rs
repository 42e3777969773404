//! Checks the cycle table of the crate `cycles` on a chip: measures the sequence of every row.
//!
//! Starts no clock: after reset a chip is slow enough to run flash without wait states, as the table assumes.
//! If the cycle counter does not count, as in QEMU, counts instructions by `SysTick` instead, which checks
//! the sequences but not their cycles.
#![no_std]
#![no_main]

mod stopping;

// For its interrupt table and log transport.
use boards as _;
use cortex_m::Peripherals;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{DWT, SYST};
use cortex_m_rt::entry;
use semihosting::process::exit;
use sequences::{NOPS, SEQUENCES, cycle_empty, cycle_nops};

/// Calls of each sequence.
const CALLS: u32 = 1 << 8;
/// `SysTick` has 24 bits.
const SYSTICK_MASK: u32 = 0x00FF_FFFF;

/// A sequence as described by `cycles::sequences`. Three floats, so that no division is by zero.
type Code = unsafe extern "C" fn(&mut [u64; 8], u32, u32, u32, f32, f32, f32);

struct Sequence {
    row: &'static str,
    text: &'static str,
    code: Code,
    instructions: u32,
    typical: u32,
    upper: u32,
}

#[expect(unsafe_code, reason = "code that was written as numbers")]
mod sequences {
    use super::Sequence;

    /// Functions of a [`Code`](super::Code)'s signature.
    macro_rules! code {
        ($($name:ident)*) => {
            unsafe extern "C" {
                $(pub(super) fn $name(buffer: &mut [u64; 8], _: u32, _: u32, _: u32, _: f32, _: f32, _: f32);)*
            }
        };
    }

    include!(concat!(env!("OUT_DIR"), "/cycle_table.rs"));
}

/// A clock that counts up.
type Clock = fn() -> u32;

#[entry]
fn main() -> ! {
    cortex_m::interrupt::disable();
    let Some(mut peripherals) = Peripherals::take() else { exit(1) };
    peripherals.DCB.enable_trace();
    peripherals.DWT.enable_cycle_counter();
    peripherals.SYST.set_clock_source(SystClkSource::Core);
    peripherals.SYST.set_reload(SYSTICK_MASK);
    peripherals.SYST.clear_current();
    peripherals.SYST.enable_counter();

    let before = DWT::cycle_count();
    cortex_m::asm::delay(100);
    let wrong = if DWT::cycle_count() == before { count_instructions() } else { measure_cycles() };
    match wrong {
        0 => defmt::println!("{=usize} sequences, 0 differ", SEQUENCES.len()),
        _ => defmt::println!("{=usize} sequences, {=u32} differ", SEQUENCES.len(), wrong),
    }
    exit(i32::from(wrong > 0))
}

/// Measures all sequences; returns how many exceed the model's upper bound.
fn measure_cycles() -> u32 {
    let clock: Clock = DWT::cycle_count;
    let empty = total(clock, u32::MAX, cycle_empty);
    let measure = |code| (total(clock, u32::MAX, code).wrapping_sub(empty) + CALLS / 2) / CALLS;
    let nops = measure(cycle_nops);
    if nops > NOPS {
        defmt::println!(
            "{=u32} NOP take {=u32} cycles: memory wait states, which the table excludes",
            NOPS,
            nops
        );
    }
    defmt::println!("| row | measured | typical | upper | | sequence |");
    let mut above = 0;
    for sequence in SEQUENCES {
        let measured = measure(sequence.code);
        let verdict = match measured {
            _ if measured == sequence.typical => "ok",
            _ if measured > sequence.upper => "DIFFERS: above the upper bound",
            _ if measured < sequence.typical => "differs: faster",
            _ => "within",
        };
        above += u32::from(measured > sequence.upper);
        defmt::println!(
            "| {=str} | {=u32} | {=u32} | {=u32} | {=str} | {=str} |",
            sequence.row,
            measured,
            sequence.typical,
            sequence.upper,
            verdict,
            sequence.text
        );
    }
    above
}

/// Counts the instructions of all sequences; returns how many differ.
fn count_instructions() -> u32 {
    defmt::println!("the cycle counter is stopped, as in an emulator: instructions are counted instead");
    let clock: Clock = || SYSTICK_MASK - SYST::get_current();
    let empty = total(clock, SYSTICK_MASK, cycle_empty);
    let ticks = |code| total(clock, SYSTICK_MASK, code).wrapping_sub(empty) & SYSTICK_MASK;
    let per_instruction = (ticks(cycle_nops) / NOPS).max(1);
    defmt::println!("| row | counted | instructions | | sequence |");
    let mut wrong = 0;
    for sequence in SEQUENCES {
        let counted = (ticks(sequence.code) + per_instruction / 2) / per_instruction;
        let is_right = counted == sequence.instructions;
        wrong += u32::from(!is_right);
        let verdict = if is_right { "ok" } else { "DIFFERS" };
        defmt::println!(
            "| {=str} | {=u32} | {=u32} | {=str} | {=str} |",
            sequence.row,
            counted,
            sequence.instructions,
            verdict,
            sequence.text
        );
    }
    wrong
}

/// Returns the ticks of the clock for all calls of a sequence, including the loop.
#[inline(never)]
fn total(clock: Clock, mask: u32, code: Code) -> u32 {
    let mut buffer = [0; 8];
    let begin = clock();
    for _ in 0..CALLS {
        #[expect(unsafe_code, reason = "code that was written as numbers")]
        // SAFETY: sequences are functions of this signature that use only the buffer and caller-saved
        // registers (`cycles::sequences`).
        unsafe {
            code(&mut buffer, 0, u32::MAX, 1, 1.0, 2.0, 3.0);
        }
    }
    clock().wrapping_sub(begin) & mask
}

//! The current loop's interrupt, the most urgent one, once per period of timer 1.
//!
//! It alone writes duty cycles and closes switches. The others can open them at any time, and it closes them again only for a
//! torque that the tick has given since, or not long before.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{self as line, InterruptExt as _, Priority};

use super::bridge::{Encoder as _, ThreePhase};
use super::current_sensing;
use super::half_bridges::{HalfBridges, switch_off};
use crate::Selected;
use crate::current_loop::{CurrentLoop, Exchange};

const PRIORITY: Priority = Priority::P0;
pub(crate) const TICK_S: f32 = 1.0 / crate::TICK_HZ as f32;

static EXCHANGE: Exchange = Exchange::new();

/// What the interrupt works with.
struct Kept {
    current_loop: CurrentLoop,
    bridges: HalfBridges,
    encoder: <Selected as ThreePhase>::Encoder,
}

/// Written before the interrupt is unmasked, and from then on the interrupt's alone.
struct Own(UnsafeCell<MaybeUninit<Kept>>);

#[expect(unsafe_code, reason = "one interrupt's variables")]
// SAFETY: only one context at a time has it, as said above.
unsafe impl Sync for Own {}

static KEPT: Own = Own(UnsafeCell::new(MaybeUninit::uninit()));

/// Begins, with the bridge off. Called once.
pub(crate) fn start(
    current_loop: CurrentLoop,
    bridges: HalfBridges,
    encoder: <Selected as ThreePhase>::Encoder,
) {
    #[expect(unsafe_code, reason = "the interrupt is still masked")]
    // SAFETY: the only one who has it: the interrupt is unmasked below, and this is called once, by whoever has all pins.
    unsafe {
        (*KEPT.0.get()).write(Kept { current_loop, bridges, encoder });
    }
    line::ADC1_2.set_priority(PRIORITY);
    line::ADC1_2.unpend();
    #[expect(unsafe_code, reason = "its handler is there")]
    // SAFETY: no critical section is broken by it: it uses nothing that they protect.
    unsafe {
        line::ADC1_2.enable();
    }
}

/// What tick and loop hand each other.
pub(crate) fn exchange() -> &'static Exchange {
    &EXCHANGE
}

/// Opens all switches, and has them open until the tick gives a torque again. At any time, from any priority.
pub(crate) fn disarm() {
    EXCHANGE.want(None);
    switch_off();
}

#[interrupt]
fn ADC1_2() {
    period();
}

/// In a function of its own, by whose name the linker's script puts it into fast memory.
#[expect(unsafe_code, reason = "the name is for the linker's script alone")]
#[unsafe(export_name = "dimsart_current_loop")]
#[inline(never)]
extern "C" fn period() {
    #[expect(unsafe_code, reason = "one interrupt's variables")]
    // SAFETY: the interrupt is unmasked only when they are there, and nobody else has them since. It does not interrupt itself.
    let kept = unsafe { (*KEPT.0.get()).assume_init_mut() };
    let rotor = kept.encoder.rotor();
    let counts = current_sensing::take();
    let duties = kept.current_loop.period(counts, rotor, &EXCHANGE);
    kept.bridges.apply(duties);
    kept.encoder.end();
}

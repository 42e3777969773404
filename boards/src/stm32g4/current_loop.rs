//! The interrupt of the current loop, at the highest priority, once per period of timer 1.
//!
//! Only this interrupt writes duty cycles and turns switches on. Other code can turn them off at any time;
//! the interrupt turns them on again only for a recent torque command of the tick.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{self as line, InterruptExt as _, Priority};

use super::bridge::{Encoder as _, ThreePhase};
use super::current_sensing;
use super::half_bridges::{HalfBridges, switch_off};
use crate::Selected;
use crate::current_loop::{CurrentLoop, LoopExchange};

const PRIORITY: Priority = Priority::P0;
pub(crate) const TICK_S: f32 = 1.0 / crate::TICK_HZ as f32;

static EXCHANGE: LoopExchange = LoopExchange::new();

/// State of the interrupt.
struct Kept {
    current_loop: CurrentLoop,
    bridges: HalfBridges,
    encoder: <Selected as ThreePhase>::Encoder,
}

/// Written before the interrupt is unmasked, and then used only by the interrupt.
struct Own(UnsafeCell<MaybeUninit<Kept>>);

#[expect(unsafe_code, reason = "one interrupt's variables")]
// SAFETY: used by one context at a time, as described above.
unsafe impl Sync for Own {}

static KEPT: Own = Own(UnsafeCell::new(MaybeUninit::uninit()));

/// Starts the loop with the bridge off. Call once.
pub(crate) fn start(
    current_loop: CurrentLoop,
    bridges: HalfBridges,
    encoder: <Selected as ThreePhase>::Encoder,
) {
    #[expect(unsafe_code, reason = "the interrupt is still masked")]
    // SAFETY: exclusive: the interrupt is unmasked below, and the caller owns the pins, so this runs once.
    unsafe {
        (*KEPT.0.get()).write(Kept { current_loop, bridges, encoder });
    }
    line::ADC1_2.set_priority(PRIORITY);
    line::ADC1_2.unpend();
    #[expect(unsafe_code, reason = "its handler exists")]
    // SAFETY: breaks no critical section: the interrupt uses nothing that they protect.
    unsafe {
        line::ADC1_2.enable();
    }
}

/// Returns the exchange between tick and loop.
pub(crate) fn exchange() -> &'static LoopExchange {
    &EXCHANGE
}

/// Turns off all switches until the tick's next torque command. Callable at any time and priority.
pub(crate) fn disarm() {
    EXCHANGE.command(None);
    switch_off();
}

#[interrupt]
fn ADC1_2() {
    period();
}

/// A separate function, placed in fast memory by name.
#[expect(unsafe_code, reason = "section name for the linker script")]
#[unsafe(export_name = "dimsart_current_loop")]
#[inline(never)]
extern "C" fn period() {
    #[expect(unsafe_code, reason = "one interrupt's variables")]
    // SAFETY: the state exists when the interrupt is unmasked, and only the interrupt uses it, which does not
    // nest.
    let kept = unsafe { (*KEPT.0.get()).assume_init_mut() };
    let rotor = kept.encoder.rotor();
    let counts = current_sensing::take();
    let duties = kept.current_loop.run_period(counts, rotor, &EXCHANGE);
    kept.bridges.apply(duties);
    kept.encoder.end();
}

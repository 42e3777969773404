//! ADC 1 and 2, by registers (RM0440, 21).
//!
//! Timer 1 starts a sequence on both at the middle of the low-side on-time:
//!
//! ```text
//!   converter 1   U ▏ W ▏ temperature ▏      its end triggers the current loop
//!   converter 2   V ▏ supply ▏
//! ```
//! U and V are sampled simultaneously, W 0.45 us later. Both ADCs run at a quarter of the bus clock, 42 MHz.

use embassy_stm32::pac;
use embassy_stm32::pac::adc::Adc;
use embassy_stm32::pac::adc::vals::{Adcaldif, Exten, SampleTime};
use embassy_stm32::pac::adccommon::vals::Ckmode;

use crate::current_loop::AdcCounts;

/// Timer 1's second trigger output as the injected trigger (RM0440, 21.4.18, table of injected triggers of
/// ADC1 and ADC2).
const TIMER_1: u8 = 8;
/// Start-up time of the ADC regulator in processor cycles: 20 us plus a 50 % margin.
const REGULATOR_CYCLES: u32 = 30 * 168;
/// Polls of an ADC that is not ready: more than its calibration takes.
const PATIENCE: u32 = 100_000;
/// Sampling time of the phases: 0.15 us. Signals with a source resistance of some kOhm need 1.1 us.
const OF_PHASES: SampleTime = SampleTime::CYCLES6_5;
const OF_DIVIDERS: SampleTime = SampleTime::CYCLES47_5;

/// ADC channels of a board's measurements.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Channels {
    /// On ADC 1.
    pub(crate) u: u8,
    /// On ADC 1.
    pub(crate) w: u8,
    /// On ADC 1.
    pub(crate) temperature: u8,
    /// On ADC 2.
    pub(crate) v: u8,
    /// On ADC 2.
    pub(crate) bus: u8,
}

/// Calibrates the ADCs and arms them for timer 1.
pub(crate) fn start_converters(channels: &Channels) {
    pac::RCC.ahb2enr().modify(|clocks| clocks.set_adc12en(true));
    let _ = pac::RCC.ahb2enr().read();
    pac::ADC12_COMMON.ccr().modify(|clock| clock.set_ckmode(Ckmode::SYNC_DIV4));
    let Channels { u, w, temperature, v, bus } = *channels;
    for (converter, sequence) in [(pac::ADC1, &[u, w, temperature][..]), (pac::ADC2, &[v, bus])] {
        enable(converter);
        let phases = sequence.len() - 1;
        converter.jsqr().write(|order| {
            order.set_jl(u8::try_from(phases).unwrap_or_default());
            order.set_jextsel(TIMER_1);
            order.set_jexten(Exten::RISING_EDGE);
            for (place, channel) in sequence.iter().enumerate() {
                order.set_jsq(place, *channel);
            }
        });
        for (place, channel) in sequence.iter().enumerate() {
            let time = if place < phases { OF_PHASES } else { OF_DIVIDERS };
            match usize::from(*channel) {
                channel @ 0..=9 => converter.smpr().modify(|times| times.set_smp(channel, time)),
                channel => converter.smpr2().modify(|times| times.set_smp(channel - 10, time)),
            }
        }
        if let [first, ..] = sequence {
            convert_once(converter, *first);
        }
    }
    pac::ADC1.ier().write(|interrupts| interrupts.set_jeosie(true));
    pac::ADC2.cr().modify(|control| control.set_jadstart(true));
    pac::ADC1.cr().modify(|control| control.set_jadstart(true));
}

/// Wakes, calibrates and enables an ADC (RM0440, 21.4.6, 21.4.8, 21.4.9).
fn enable(converter: Adc) {
    converter.cr().modify(|control| control.set_deeppwd(false));
    converter.cr().modify(|control| control.set_advregen(true));
    cortex_m::asm::delay(REGULATOR_CYCLES);
    converter.cr().modify(|control| control.set_adcaldif(Adcaldif::SINGLE_ENDED));
    converter.cr().modify(|control| control.set_adcal(true));
    wait(|| !converter.cr().read().adcal());
    // Repeated, because the bit is ignored right after a calibration.
    wait(|| {
        converter.cr().modify(|control| control.set_aden(true));
        converter.isr().read().adrdy()
    });
}

/// Discards the first conversion, which may use channel 0 (ST ES0431, 2.5.8).
fn convert_once(converter: Adc, channel: u8) {
    converter.sqr1().write(|order| order.set_sq(0, channel));
    converter.cr().modify(|control| control.set_adstart(true));
    wait(|| converter.isr().read().eoc());
    let _ = converter.dr().read();
}

fn wait(mut is_done: impl FnMut() -> bool) {
    if !(0..PATIENCE).any(|_| is_done()) {
        defmt::panic!("an ADC does not start");
    }
}

/// Returns the counts of both ADCs and acknowledges their interrupt.
#[inline]
pub(crate) fn take() -> AdcCounts {
    // Writing 1 clears a flag.
    pac::ADC1.isr().write(|flags| {
        flags.set_jeos(true);
        flags.set_jeoc(true);
    });
    // Unrolled: with a variable index the register library checks bounds.
    let [u, w, temperature] =
        [pac::ADC1.jdr(0), pac::ADC1.jdr(1), pac::ADC1.jdr(2)].map(|data| data.read().jdata());
    let [v, bus] = [pac::ADC2.jdr(0), pac::ADC2.jdr(1)].map(|data| data.read().jdata());
    AdcCounts { phases: [u, v, w], bus, temperature }
}

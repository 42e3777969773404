//! Timer 4 as the counter of an incremental encoder with two channels, by its registers (RM0440, 29): the library's driver has
//! no filter, and reads a count as a number of its own.

use drive::{Angle, Rotor};
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, FilterValue, Sms};
use embassy_stm32::pac::{RCC, TIM4};

/// Starts it with `counts_per_turn`, 2 to 65 536, all four edges counted. An edge counts when it has lasted for 8 samples
/// of every fourth cycle of 168 MHz: 0.19 us.
pub(crate) fn start(counts_per_turn: u32) {
    RCC.apb1enr1().modify(|clocks| clocks.set_tim4en(true));
    let _ = RCC.apb1enr1().read();
    TIM4.arr().write(|reload| reload.set_arr(u16::try_from(counts_per_turn - 1).unwrap_or(u16::MAX)));
    TIM4.ccmr_input(0).modify(|channels| {
        for channel in 0..2 {
            channels.set_ccs(channel, CcmrInputCcs::TI4);
            channels.set_icf(channel, FilterValue::FDTS_DIV4_N8);
        }
    });
    TIM4.smcr().modify(|mode| mode.set_sms(Sms::ENCODER_MODE_3));
    TIM4.cr1().modify(|control| control.set_cen(true));
}

/// Where the rotor is. Such an encoder does not say when it is gone.
#[inline]
pub(crate) fn rotor(counts_per_turn: u32) -> Rotor {
    // Once around is 2³²; the rest of the division is less than the last bit of a count.
    let per_count = (u32::MAX / counts_per_turn).wrapping_add(u32::from(counts_per_turn.is_power_of_two()));
    Rotor::At(Angle(u32::from(TIM4.cnt().read().cnt()).wrapping_mul(per_count)))
}

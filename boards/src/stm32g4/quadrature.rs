//! A timer as the counter of an incremental encoder with two channels, by registers (RM0440, 29): the
//! library's driver has no filter.

use drive::{Angle, Rotor};
use embassy_stm32::pac::timer::TimGp16;
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, FilterValue, Sms};

use super::bridge::{Encoder, ThreePhase};
use crate::Selected;

const TIMER: TimGp16 = <Selected as ThreePhase>::COUNTER;

/// The encoder.
pub(crate) struct Quadrature {
    /// Angle per count in 2⁻³² of a turn; the rounding error is below the last bit of a count.
    per_count: u32,
}

impl Quadrature {
    /// Starts the counter with `counts_per_turn`, 2 to 65 536 (all four edges counted), on the board's timer,
    /// whose clock is on. The filter passes edges after 8 samples at every fourth cycle of 168 MHz: 0.19 us.
    pub(crate) fn start(counts_per_turn: u32) -> Self {
        TIMER.arr().write(|reload| reload.set_arr(u16::try_from(counts_per_turn - 1).unwrap_or(u16::MAX)));
        TIMER.ccmr_input(0).modify(|channels| {
            for channel in 0..2 {
                channels.set_ccs(channel, CcmrInputCcs::TI4);
                channels.set_icf(channel, FilterValue::FDTS_DIV4_N8);
            }
        });
        TIMER.smcr().modify(|mode| mode.set_sms(Sms::ENCODER_MODE_3));
        TIMER.cr1().modify(|control| control.set_cen(true));
        let is_whole = counts_per_turn.is_power_of_two();
        Self { per_count: (u32::MAX / counts_per_turn).wrapping_add(u32::from(is_whole)) }
    }
}

impl Encoder for Quadrature {
    /// Cannot detect a disconnected encoder.
    #[inline]
    fn rotor(&mut self) -> Rotor {
        Rotor::Angle(Angle(u32::from(TIMER.cnt().read().cnt()).wrapping_mul(self.per_count)))
    }

    #[inline]
    fn end(&mut self) {}
}

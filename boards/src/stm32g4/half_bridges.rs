//! Timer 1 as the modulator of three half bridges, by registers (RM0440, 28): the library's driver cannot
//! select the update event.
//!
//! ```text
//!   counter    0 ───▶ 4200 ───▶ 0      25 us each way
//!   upper on   ▔▔▔▔▏          ▕▔▔▔▔    below the compare value
//!   lower on        ▕▔▔▔▔▔▔▔▔▏         and there, in its middle, at the top:
//!                        ▲             new duty cycles are loaded, and the phases are sampled
//! ```
//! The master output enable switches all six outputs: when it is off, hardware holds them at the level that
//! turns the switches off.

use embassy_stm32::pac::timer::vals::{Cms, Dir, Mms2, Ocm, Ossi, Ossr, Urs};
use embassy_stm32::pac::{RCC, TIM1};

use super::bridge::ThreePhase;
use crate::Selected;

const CHANNELS: usize = 3;
/// Polls of the timer until it must have reversed: five periods of a few cycles each.
const PATIENCE: u32 = 5 * 8_400;
/// Attempts to load duty cycles at the top: the second one succeeds.
const TRIES: u8 = 8;

/// Three half bridges, initially off.
pub(crate) struct HalfBridges {
    top: u16,
    /// Whether the loaded duty cycles belong to the current on-time.
    is_loaded: bool,
}

impl HalfBridges {
    /// Sets up the timer with `top` cycles each way and the encoded `dead_time` (RM0440, 28.6.20). Its second
    /// trigger output starts the sampling. Pins connected afterwards keep the switches off.
    pub(crate) fn start(top: u16, dead_time: u8) -> Self {
        RCC.apb2enr().modify(|clocks| clocks.set_tim1en(true));
        // The clock is on after this read (RM0440, 7.2.17).
        let _ = RCC.apb2enr().read();
        TIM1.cr1().write(|control| {
            control.set_cms(Cms::CENTER_ALIGNED1);
            control.set_arpe(true);
            control.set_urs(Urs::COUNTER_ONLY);
        });
        TIM1.arr().write(|reload| reload.set_arr(top));
        if <Selected as ThreePhase>::IS_LOW_SIDE_INVERTED {
            // Before the outputs are enabled: sets idle levels and polarity.
            TIM1.cr2().modify(|levels| (0..CHANNELS).for_each(|channel| levels.set_oisn(channel, true)));
            TIM1.ccer().modify(|outputs| (0..CHANNELS).for_each(|channel| outputs.set_ccnp(channel, true)));
        }
        for channel in 0..CHANNELS {
            TIM1.ccmr_output(channel / 2).modify(|mode| {
                mode.set_ocm(channel % 2, Ocm::PWM_MODE1);
                mode.set_ocpe(channel % 2, true);
            });
            TIM1.ccer().modify(|outputs| {
                outputs.set_cce(channel, true);
                outputs.set_ccne(channel, true);
            });
        }
        TIM1.bdtr().write(|switch| {
            switch.set_dtg(dead_time);
            switch.set_ossr(Ossr::IDLE_LEVEL);
            switch.set_ossi(Ossi::IDLE_LEVEL);
        });
        TIM1.egr().write(|event| event.set_ug(true));
        TIM1.cr1().modify(|control| control.set_cen(true));
        take_at_top(top);
        TIM1.cr2().modify(|control| control.set_mms2(Mms2::UPDATE));
        Self { top, is_loaded: false }
    }

    /// Sets the duty cycles of the next period, 0 to 1, or turns off all switches at once. Switches turn on
    /// only when the timer has loaded new duty cycles, so that old ones are never used.
    #[inline]
    pub(crate) fn apply(&mut self, duties: Option<[f32; 3]>) {
        let Some([u, v, w]) = duties else {
            self.is_loaded = false;
            return switch_off();
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "casts saturate, NaN gives 0"
        )]
        let compare = |duty: f32| (duty * f32::from(self.top)) as u16;
        TIM1.ccr(0).write(|value| value.set_ccr(compare(u)));
        TIM1.ccr(1).write(|value| value.set_ccr(compare(v)));
        TIM1.ccr(2).write(|value| value.set_ccr(compare(w)));
        if self.is_loaded {
            TIM1.bdtr().modify(|switch| switch.set_moe(true));
        }
        self.is_loaded = true;
    }
}

/// Turns off all six switches, at any time.
#[inline]
pub(crate) fn switch_off() {
    TIM1.bdtr().modify(|switch| switch.set_moe(false));
}

/// Makes the repetition counter, which skips every second update, skip the one at the bottom. Which one it
/// skips depends on the time of writing (RM0440, 28.3.3); one extra update changes it.
fn take_at_top(top: u16) {
    TIM1.rcr().write(|counter| counter.set_rep(1));
    wait_for_update();
    for _ in 0..TRIES {
        wait_for_update();
        let is_down = TIM1.cr1().read().dir() == Dir::DOWN;
        if is_down && TIM1.cnt().read().cnt() > top / 2 {
            return;
        }
        TIM1.rcr().write(|counter| counter.set_rep(0));
        wait_for_update();
        TIM1.rcr().write(|counter| counter.set_rep(1));
        wait_for_update();
    }
    defmt::panic!("timer 1 does not load duty cycles at the top");
}

/// Waits for the next update.
fn wait_for_update() {
    TIM1.sr().write(|flags| {
        *flags = embassy_stm32::pac::timer::regs::SrAdv(u32::MAX);
        flags.set_uif(false);
    });
    if !(0..PATIENCE).any(|_| TIM1.sr().read().uif()) {
        defmt::panic!("timer 1 does not count");
    }
}

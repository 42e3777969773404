//! Timer 1 as the source of up to three duty cycles with a common enable.
//!
//! The enable is the timer's master output enable: when it is off, hardware holds every output at its
//! inactive level regardless of the duty cycles.

use embassy_stm32::pac;
use embassy_stm32::peripherals::TIM1;
use embassy_stm32::timer::Channel;
use embassy_stm32::timer::complementary_pwm::{ComplementaryPwm, Ossi, Ossr};

const CHANNELS: [Channel; 3] = [Channel::Ch1, Channel::Ch2, Channel::Ch3];

/// Three duty cycles, initially off.
pub(crate) struct PowerStage {
    pwm: ComplementaryPwm<'static, TIM1>,
}

impl PowerStage {
    /// Takes over the timer; `dead_time` is in timer cycles and applies to complementary outputs only.
    pub(crate) fn new(mut pwm: ComplementaryPwm<'static, TIM1>, dead_time: u16) -> Self {
        pwm.set_master_output_enable(false);
        pwm.set_off_state_selection_idle(Ossi::IDLE_LEVEL);
        pwm.set_off_state_selection_run(Ossr::IDLE_LEVEL);
        pwm.set_dead_time(dead_time);
        for channel in CHANNELS {
            pwm.set_duty(channel, 0);
            pwm.enable(channel);
        }
        Self { pwm }
    }

    /// Sets the duty cycles, 0 to 1, and turns the outputs on.
    pub(crate) fn drive(&mut self, duties: [f32; 3]) {
        let full = self.pwm.get_max_duty();
        for (channel, duty) in CHANNELS.into_iter().zip(duties) {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "casts saturate, NaN gives 0"
            )]
            let compare = (duty * full as f32) as u32;
            self.pwm.set_duty(channel, compare.min(full));
        }
        self.pwm.set_master_output_enable(true);
    }
}

/// Turns every output off, at any time and without the [`PowerStage`], and resets the duty cycles to 0.
pub(crate) fn switch_off() {
    pac::TIM1.bdtr().modify(|outputs| outputs.set_moe(false));
    for channel in CHANNELS {
        pac::TIM1.ccr(channel.index()).write(|compare| compare.set_ccr(0));
    }
}

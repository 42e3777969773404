//! Brushed motors on PWM + direction drivers, with encoders.

use dimsart_core::{DataType, InputLimits, OutputLimits, Scalar as _, TickResult, Word};
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, OutputType, Pull, Speed};
use embassy_stm32::pac;
use embassy_stm32::peripherals::{
    PA0, PA1, PA6, PA7, PA8, PA9, PA10, PB6, PB7, PC0, PC1, PC2, PC3, TIM1, TIM2, TIM3, TIM4,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::complementary_pwm::ComplementaryPwm;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::timer::simple_pwm::PwmPin;

use super::AXES;
use crate::board::needs_power_stage;
use crate::catalogue::nucleo_g474re::MOTOR;
use crate::encoder::Encoder;
use crate::motor::Motor;
use crate::stm32g4;
use crate::stm32g4::power_stage::{self, PowerStage};

const MOTORS: [Motor; AXES] = [MOTOR; AXES];
const PWM_FREQUENCY: Hertz = Hertz(20_000);
/// On port C.
const ENABLE_PIN: usize = 3;

pub(super) const OUTPUTS: &[&DataType] = stm32g4::OUTPUTS;
pub(super) const LIMITS: &[&[InputLimits]] = &[&[MOTOR.limits()]];
pub(super) const OUTPUT_LIMITS: &[OutputLimits] = &[MOTOR.position_limits()];

/// A timer in encoder mode and its two pins.
type EncoderPins<T, A, B> = (Peri<'static, T>, Peri<'static, A>, Peri<'static, B>);

/// Wiring of the joints.
pub(super) struct Wiring {
    pub(super) first: EncoderPins<TIM2, PA0, PA1>,
    pub(super) second: EncoderPins<TIM3, PA6, PA7>,
    pub(super) third: EncoderPins<TIM4, PB6, PB7>,
    pub(super) timer: Peri<'static, TIM1>,
    pub(super) pwm: (Peri<'static, PA8>, Peri<'static, PA9>, Peri<'static, PA10>),
    pub(super) directions: (Peri<'static, PC0>, Peri<'static, PC1>, Peri<'static, PC2>),
    pub(super) enable: Peri<'static, PC3>,
}

pub(super) fn start(wiring: Wiring) -> Joints {
    let Wiring { first, second, third, timer, pwm, directions, enable } = wiring;
    let enable = Output::new(enable, Level::Low, Speed::Low);
    let pull_ups = || qei::Config { ch1_pull: Pull::Up, ch2_pull: Pull::Up, ..qei::Config::default() };
    let counters = Counters(
        Qei::new(first.0, first.1, first.2, pull_ups()),
        Qei::new(second.0, second.1, second.2, pull_ups()),
        Qei::new(third.0, third.1, third.2, pull_ups()),
    );
    let pwm = ComplementaryPwm::new(
        timer,
        Some(PwmPin::new(pwm.0, OutputType::PushPull)),
        None,
        Some(PwmPin::new(pwm.1, OutputType::PushPull)),
        None,
        Some(PwmPin::new(pwm.2, OutputType::PushPull)),
        None,
        None,
        None,
        PWM_FREQUENCY,
        CountingMode::CenterAlignedBothInterrupts,
    );
    Joints {
        counters,
        encoders: MOTORS.map(|motor| Encoder::new(0, motor.counts_per_turn)),
        power_stage: PowerStage::new(pwm, 0),
        directions: [
            Output::new(directions.0, Level::Low, Speed::Low),
            Output::new(directions.1, Level::Low, Speed::Low),
            Output::new(directions.2, Level::Low, Speed::Low),
        ],
        enable,
    }
}

pub(super) fn disarm() {
    power_stage::switch_off();
    pac::GPIOC.bsrr().write(|pins| pins.set_br(ENABLE_PIN, true));
}

struct Counters(Qei<'static, TIM2>, Qei<'static, TIM3>, Qei<'static, TIM4>);

impl Counters {
    fn read(&self) -> [u16; AXES] {
        [self.0.count(), self.1.count(), self.2.count()]
    }
}

/// Brushed motors with encoders.
pub struct Joints {
    counters: Counters,
    encoders: [Encoder; AXES],
    power_stage: PowerStage,
    directions: [Output<'static>; AXES],
    enable: Output<'static>,
}

impl crate::board::Joints for Joints {
    fn read(&mut self, measured: &mut [Word]) {
        let counted = self.encoders.iter_mut().zip(self.counters.read());
        for (word, (encoder, count)) in measured.iter_mut().zip(counted) {
            encoder.update(count);
            *word = encoder.angle_rad().into_word();
        }
        stm32g4::measure(measured.get_mut(AXES..));
    }

    fn write(&mut self, tick: TickResult, commanded: &[Word]) {
        if !needs_power_stage(tick, commanded) {
            disarm();
            return;
        }
        let mut duties = [0.0; AXES];
        let axes = duties.iter_mut().zip(&mut self.directions).zip(MOTORS).zip(commanded);
        for (((duty, direction), motor), word) in axes {
            let drive = motor.voltage_share(f32::from_word(*word));
            direction.set_level(Level::from(drive >= 0.0));
            *duty = drive.abs();
        }
        self.power_stage.drive(duties);
        self.enable.set_high();
    }
}

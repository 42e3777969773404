//! ST's NUCLEO-G474RE with up to three brushed motors behind drivers of the PWM + direction kind.
//!
//! Complete, linked, and never yet run on silicon.
//!
//! | What | Axis 1 | Axis 2 | Axis 3 |
//! |---|---|---|---|
//! | Encoder A, B (pull-ups on) | PA0, PA1: timer 2 | PA6, PA7: timer 3 | PB6, PB7: timer 4 |
//! | PWM, 20 kHz: timer 1 | PA8 | PA9 | PA10 |
//! | Direction, high when the torque is positive | PC0 | PC1 | PC2 |
//!
//! | What | Pins |
//! |---|---|
//! | Enable of all drivers, high when on; give it a pull-down, it floats during a reset | PC3 |
//! | Command line: LPUART 1 at 921 600 baud, the ST-LINK's virtual serial port | PA2 out, PA3 in |
//! | Link 0: FDCAN 1, CAN FD at 1 and 4 Mbit/s, needs a transceiver | PA11 in, PA12 out |
//! | Link 0 with feature `uart-link`: USART 3 at 921 600 baud instead | PC10 out, PC11 in |
//! | Crystal | 24 MHz |
//!
//! The motors' data are in `catalogue/nucleo_g474re.rs`. Before a motor is powered: `docs/first-start.md` finds an
//! encoder or a motor that is wired backwards.
//!
//! An axis with nothing connected stays at 0. Timer 5 is the time driver. The log goes out over RTT.

#[cfg(not(feature = "uart-link"))]
mod can_link;
#[cfg(feature = "uart-link")]
mod uart_link;

use dimsart_core::{
    AxisKind, Counter, DataType, InputLimits, OutputLimits, Scalar as _, StartCause, Tick, Word,
};
use embassy_stm32::gpio::{Level, Output, OutputType, Pull, Speed};
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH2, LPUART1, TIM2, TIM3, TIM4};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::complementary_pwm::ComplementaryPwm;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::timer::simple_pwm::PwmPin;
use embassy_stm32::{bind_interrupts, dma, pac, usart};
use static_cell::ConstStaticCell;

#[cfg(not(feature = "uart-link"))]
use self::can_link as link;
#[cfg(feature = "uart-link")]
use self::uart_link as link;
use crate::board::{Axes, Board, Joints, Parts, is_driven};
use crate::catalogue::nucleo_g474re::{MOTOR, TOOLING};
use crate::encoder::Encoder;
use crate::motor::Motor;
use crate::stm32g4::flash::{self, SchemeFlash};
use crate::stm32g4::power_stage::{self, PowerStage};
use crate::stm32g4::uart::{self, UartPort};
use crate::stm32g4::{self, Sleep};

const AXES: usize = TOOLING.axes;
const MOTORS: [Motor; AXES] = [MOTOR; AXES];
const PWM_FREQUENCY: Hertz = Hertz(20_000);
const CRYSTAL: Hertz = Hertz(24_000_000);
/// Of port C.
const ENABLE_PIN: usize = 3;

bind_interrupts!(struct Interrupts {
    LPUART1 => usart::InterruptHandler<LPUART1>;
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<DMA1_CH2>;
    FLASH => embassy_stm32::flash::InterruptHandler;
});

/// The board.
pub struct NucleoG474re;

impl Board for NucleoG474re {
    const NAME: &'static str = "nucleo-g474re";
    const WORDS: usize = TOOLING.words;
    const OUTPUTS: &'static [&'static DataType] = stm32g4::OUTPUTS;
    const LIMITS: &'static [&'static [InputLimits]] = &[&[MOTOR.limits()]];
    const OUTPUT_LIMITS: &'static [OutputLimits] = &[MOTOR.position_limits()];

    type Joints = BrushedMotors;
    type CommandPort = UartPort;
    type LinkIn = link::LinkIn;
    type LinkOut = link::LinkOut;
    type Flash = SchemeFlash;
    type Idle = Sleep;

    fn start() -> Parts<Self> {
        let chip = stm32g4::start(CRYSTAL);
        let enable = Output::new(chip.PC3, Level::Low, Speed::Low);

        let pull_ups = || qei::Config { ch1_pull: Pull::Up, ch2_pull: Pull::Up, ..qei::Config::default() };
        let counters = Counters(
            Qei::new(chip.TIM2, chip.PA0, chip.PA1, pull_ups()),
            Qei::new(chip.TIM3, chip.PA6, chip.PA7, pull_ups()),
            Qei::new(chip.TIM4, chip.PB6, chip.PB7, pull_ups()),
        );
        let pwm = ComplementaryPwm::new(
            chip.TIM1,
            Some(PwmPin::new(chip.PA8, OutputType::PushPull)),
            None,
            Some(PwmPin::new(chip.PA9, OutputType::PushPull)),
            None,
            Some(PwmPin::new(chip.PA10, OutputType::PushPull)),
            None,
            None,
            None,
            PWM_FREQUENCY,
            CountingMode::CenterAlignedBothInterrupts,
        );
        let joints = BrushedMotors {
            counters,
            encoders: MOTORS.map(|motor| Encoder::new(0, motor.counts_per_turn)),
            power_stage: PowerStage::new(pwm, 0),
            directions: [
                Output::new(chip.PC0, Level::Low, Speed::Low),
                Output::new(chip.PC1, Level::Low, Speed::Low),
                Output::new(chip.PC2, Level::Low, Speed::Low),
            ],
            enable,
        };

        static RING: ConstStaticCell<[u8; uart::RING_BYTES]> = ConstStaticCell::new([0; uart::RING_BYTES]);
        let (receive, send) = ((chip.PA3, chip.DMA1_CH1), (chip.PA2, chip.DMA1_CH2));
        let (receive, send) = uart::open(chip.LPUART1, receive, send, Interrupts, RING.take());
        let command_port = UartPort { receive, send };
        // The image lies in the flash's first bank and the schemes in its second: one is read while the other is written,
        // unless the option bytes make one bank of the two.
        let stalls_tick = !pac::FLASH.optr().read().dbank();
        let storage = flash::storage(chip.FLASH, Interrupts, stalls_tick);
        #[cfg(not(feature = "uart-link"))]
        let links = link::start(chip.FDCAN1, chip.PA11, chip.PA12);
        #[cfg(feature = "uart-link")]
        let links = link::start(chip.USART3, (chip.PC11, chip.DMA1_CH3), (chip.PC10, chip.DMA1_CH4));
        stm32g4::parts(
            Axes::from_array([AxisKind::Rotary; AXES]),
            joints,
            command_port,
            links,
            storage,
            chip.IWDG,
        )
    }

    fn disarm() {
        power_stage::switch_off();
        pac::GPIOC.bsrr().write(|pins| pins.set_br(ENABLE_PIN, true));
    }

    fn counter() -> Counter {
        stm32g4::counter()
    }

    fn feed_watchdog() {
        stm32g4::feed_watchdog();
    }

    fn start_cause() -> StartCause {
        stm32g4::start_cause()
    }

    fn reset() -> ! {
        stm32g4::reset()
    }
}

struct Counters(Qei<'static, TIM2>, Qei<'static, TIM3>, Qei<'static, TIM4>);

impl Counters {
    fn read(&self) -> [u16; AXES] {
        [self.0.count(), self.1.count(), self.2.count()]
    }
}

/// Brushed motors with encoders.
pub struct BrushedMotors {
    counters: Counters,
    encoders: [Encoder; AXES],
    power_stage: PowerStage,
    directions: [Output<'static>; AXES],
    enable: Output<'static>,
}

impl Joints for BrushedMotors {
    fn read(&mut self, measured: &mut [Word]) {
        let counted = self.encoders.iter_mut().zip(self.counters.read());
        for (word, (encoder, count)) in measured.iter_mut().zip(counted) {
            encoder.update(count);
            *word = encoder.angle_rad().into_word();
        }
        stm32g4::measure(measured.get_mut(AXES..));
    }

    fn write(&mut self, tick: Tick, commanded: &[Word]) {
        if !is_driven(tick, commanded) {
            NucleoG474re::disarm();
            return;
        }
        let mut duties = [0.0; AXES];
        let axes = duties.iter_mut().zip(&mut self.directions).zip(MOTORS).zip(commanded);
        for (((duty, direction), motor), word) in axes {
            let drive = motor.drive(f32::from_word(*word));
            direction.set_level(Level::from(drive >= 0.0));
            *duty = drive.abs();
        }
        self.power_stage.drive(duties);
        self.enable.set_high();
    }
}

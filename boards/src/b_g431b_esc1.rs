//! ST's B-G431B-ESC1: one three-phase motor, its inverter, CAN transceiver and ST-LINK on one board.
//!
//! Complete, linked, and never yet run on silicon.
//!
//! | What | Pins |
//! |---|---|
//! | Half bridges U, V, W, 20 kHz, 0.8 us dead time: timer 1 | high PA8, PA9, PA10; low PC13, PA12, PB15 |
//! | Encoder A, B (pull-ups on): timer 4 | PB6, PB7 |
//! | Command line: USART 2 at 921 600 baud, the ST-LINK's virtual serial port and J3 | PB3 out, PB4 in |
//! | Link 0: FDCAN 1, CAN FD at 1 and 4 Mbit/s | PA11 in, PB9 out |
//! | CAN transceiver's shutdown, low when on | PC11 |
//! | Crystal | 8 MHz |
//!
//! The half bridges have no enable pin: both transistors of each are held off by timer 1 instead. Timer 3
//! is the time driver. The log goes out over RTT.
//!
//! The motor's data are in `catalogue/b_g431b_esc1.rs`. Before it is powered: `docs/first-start.md` finds an encoder or
//! a phase that is wired backwards.
//!
//! The motor is driven by voltage (see [`motor`](crate::motor)): the current sensors are not used, and with
//! an incremental encoder the rotor has to be aligned. That is done once, in the first half second that the
//! power stage is on: the shaft turns to the next magnet, by up to half a pole pair, and commands have no
//! effect meanwhile. Its angle is 0 where the board was started.

use dimsart_core::{
    AxisKind, Counter, DataType, InputLimits, OutputLimits, Scalar as _, StartCause, Tick, Word,
};
use embassy_stm32::can::{CanConfigurator, IT0InterruptHandler, IT1InterruptHandler};
use embassy_stm32::gpio::{Level, Output, OutputType, Pull, Speed};
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH2, FDCAN1, TIM4, USART2};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::complementary_pwm::{ComplementaryPwm, ComplementaryPwmPin};
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::timer::simple_pwm::PwmPin;
use embassy_stm32::{bind_interrupts, dma, usart};
use static_cell::ConstStaticCell;

use crate::board::{Axes, Board, Joints, Parts, is_driven};
use crate::catalogue::b_g431b_esc1::{MOTOR, TOOLING};
use crate::encoder::Encoder;
use crate::motor::{ALIGNING_ANGLE_RAD, Ramp, phase_duties};
use crate::stm32g4::flash::{self, SchemeFlash};
use crate::stm32g4::power_stage::{self, PowerStage};
use crate::stm32g4::uart::{self, UartPort};
use crate::stm32g4::{self, Sleep, fdcan};

/// Torque that aligning the rotor pulls with at most, `N·m`.
const ALIGNING_TORQUE_NM: f32 = 0.1;
/// Ticks that aligning takes.
const ALIGNING_TICKS: u32 = crate::TICK_HZ / 2;
const PWM_FREQUENCY: Hertz = Hertz(20_000);
/// Cycles of 168 MHz.
const DEAD_TIME: u16 = 134;
const CRYSTAL: Hertz = Hertz(8_000_000);

/// The flash has one bank: while it is written, no instruction can be read from it.
const STALLS_TICK: bool = true;

bind_interrupts!(struct Interrupts {
    USART2 => usart::InterruptHandler<USART2>;
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<DMA1_CH2>;
    FDCAN1_IT0 => IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
    FLASH => embassy_stm32::flash::InterruptHandler;
});

/// The board.
pub struct BG431bEsc1;

impl Board for BG431bEsc1 {
    const NAME: &'static str = "b-g431b-esc1";
    /// What the memory holds beside 16 modules, the queues, the log and the stack.
    const WORDS: usize = TOOLING.words;
    const OUTPUTS: &'static [&'static DataType] = stm32g4::OUTPUTS;
    const LIMITS: &'static [&'static [InputLimits]] = &[&[MOTOR.limits()]];
    const OUTPUT_LIMITS: &'static [OutputLimits] = &[MOTOR.position_limits()];

    type Joints = ThreePhaseMotor;
    type CommandPort = UartPort;
    type LinkIn = fdcan::FromCan;
    type LinkOut = fdcan::ToCan;
    type Flash = SchemeFlash;
    type Idle = Sleep;

    fn start() -> Parts<Self> {
        let chip = stm32g4::start(CRYSTAL);

        let pull_ups = qei::Config { ch1_pull: Pull::Up, ch2_pull: Pull::Up, ..qei::Config::default() };
        let pwm = ComplementaryPwm::new(
            chip.TIM1,
            Some(PwmPin::new(chip.PA8, OutputType::PushPull)),
            Some(ComplementaryPwmPin::new(chip.PC13, OutputType::PushPull)),
            Some(PwmPin::new(chip.PA9, OutputType::PushPull)),
            Some(ComplementaryPwmPin::new(chip.PA12, OutputType::PushPull)),
            Some(PwmPin::new(chip.PA10, OutputType::PushPull)),
            Some(ComplementaryPwmPin::new(chip.PB15, OutputType::PushPull)),
            None,
            None,
            PWM_FREQUENCY,
            CountingMode::CenterAlignedBothInterrupts,
        );
        let joints = ThreePhaseMotor {
            counter: Qei::new(chip.TIM4, chip.PB6, chip.PB7, pull_ups),
            shaft: Encoder::new(0, MOTOR.counts_per_turn),
            rotor: Encoder::new(0, MOTOR.counts_per_turn),
            aligned_ticks: 0,
            ramp: Ramp::default(),
            power_stage: PowerStage::new(pwm, DEAD_TIME),
        };

        static RING: ConstStaticCell<[u8; uart::RING_BYTES]> = ConstStaticCell::new([0; uart::RING_BYTES]);
        let (receive, send) = ((chip.PB4, chip.DMA1_CH1), (chip.PB3, chip.DMA1_CH2));
        let (receive, send) = uart::open(chip.USART2, receive, send, Interrupts, RING.take());
        let command_port = UartPort { receive, send };
        let shutdown = Output::new(chip.PC11, Level::Low, Speed::Low);
        // Stays low for good: the pin would float if its owner went away.
        core::mem::forget(shutdown);
        let can = CanConfigurator::new(chip.FDCAN1, chip.PA11, chip.PB9, Interrupts);
        let storage = flash::storage(chip.FLASH, Interrupts, STALLS_TICK);
        let links = fdcan::start(can, 0);
        stm32g4::parts(
            Axes::from_array([AxisKind::Rotary; TOOLING.axes]),
            joints,
            command_port,
            links,
            storage,
            chip.IWDG,
        )
    }

    fn disarm() {
        power_stage::switch_off();
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

/// A three-phase motor with permanent magnets and an encoder, driven by voltage.
pub struct ThreePhaseMotor {
    counter: Qei<'static, TIM4>,
    /// Angle that is measured.
    shaft: Encoder,
    /// Angle that the magnets are at, once they were aligned.
    rotor: Encoder,
    aligned_ticks: u32,
    /// From the end of the aligning on.
    ramp: Ramp,
    power_stage: PowerStage,
}

impl Joints for ThreePhaseMotor {
    fn read(&mut self, measured: &mut [Word]) {
        let count = self.counter.count();
        self.shaft.update(count);
        self.rotor.update(count);
        if let Some(word) = measured.first_mut() {
            *word = self.shaft.angle_rad().into_word();
        }
        stm32g4::measure(measured.get_mut(1..));
    }

    fn write(&mut self, tick: Tick, commanded: &[Word]) {
        let is_aligned = self.aligned_ticks >= ALIGNING_TICKS;
        if !is_driven(tick, commanded) || tick != Tick::Ran && !is_aligned {
            BG431bEsc1::disarm();
            self.ramp.begin();
            if !is_aligned {
                self.aligned_ticks = 0;
            }
        } else if is_aligned {
            let wanted_nm = commanded.first().map_or(0.0, |word| f32::from_word(*word));
            let torque_nm = self.ramp.follow(wanted_nm, &MOTOR.limits(), 1.0 / crate::TICK_HZ as f32);
            let angle = self.rotor.electrical_angle_rad(MOTOR.pole_pairs);
            self.power_stage.drive(phase_duties(MOTOR.drive(torque_nm), angle));
        } else {
            self.aligned_ticks += 1;
            self.rotor.set_zero();
            self.power_stage.drive(phase_duties(MOTOR.drive(ALIGNING_TORQUE_NM), ALIGNING_ANGLE_RAD));
        }
    }
}

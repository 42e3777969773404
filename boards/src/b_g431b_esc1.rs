//! ST's B-G431B-ESC1: one three-phase motor, its inverter, CAN transceiver and ST-LINK on one board.
//!
//! Complete, linked, and never yet run on silicon.
//!
//! Its pins are in `catalogue/b_g431b_esc1.rs`; `cargo xtask book` draws them. The command line is USART 2 at 921 600 baud, the
//! ST-LINK's virtual serial port and J3. Link 0 is FDCAN 1, CAN FD frames at 1 Mbit/s, data too: the transceiver carries no more.
//! The crystal has 8 MHz.
//!
//! The half bridges have no enable pin: both transistors of each are held off by timer 1 instead. Timer 3
//! is the time driver. The log goes out over RTT.
//!
//! Motor, encoder and limits are in `catalogue/b_g431b_esc1.rs`. Before it is powered: `docs/first-start.md` finds an encoder
//! or a phase that is wired backwards.
//!
//! The torque is made by field-oriented control ([`current_loop`](crate::current_loop)), 20 000 times a second above the tick.
//! With an incremental encoder the rotor has to be aligned: that is done once, in the first 8 seconds that motion is allowed. The
//! shaft turns by up to one and a quarter of an electrical turn and back, with a bounded current, and commands have no effect
//! meanwhile. Its angle is 0 where the board was started.

mod amplifiers;

use dimsart_core::limits::Sizes;
use dimsart_core::{AxisKind, Counter, DataType, InputLimits, OutputLimits};
use dimsart_link::StartCause;
use drive::{Checked, Encoder};
use embassy_stm32::can::{CanConfigurator, IT0InterruptHandler, IT1InterruptHandler};
use embassy_stm32::gpio::{AfType, Flex, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::TimGp16;
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH2, FDCAN1, USART2};
use embassy_stm32::time::Hertz;
use embassy_stm32::{bind_interrupts, dma, usart};
use static_cell::ConstStaticCell;

use crate::board::{Axes, Board, Parts};
use crate::catalogue::ThreePhaseDrive;
use crate::catalogue::b_g431b_esc1::{DRIVE, TOOLING};
use crate::stm32g4::bridge::ThreePhase;
use crate::stm32g4::current_loop;
use crate::stm32g4::current_sensing::Channels;
use crate::stm32g4::flash::{self, SchemeFlash};
use crate::stm32g4::half_bridges::HalfBridges;
use crate::stm32g4::quadrature::Quadrature;
use crate::stm32g4::three_phase_joint::{self, Joint, keep_as};
use crate::stm32g4::uart::{self, UartPort};
use crate::stm32g4::{self, Sleep, fdcan};
use crate::three_phase;

/// Of timer 1 at 168 MHz, up and down in a period of 50 us.
const PWM_TOP: u16 = 4_200;
/// 0.8 us: (64 + 3) times 2 cycles, as the timer has it.
const DEAD_TIME: u8 = 0b1000_0011;
const CRYSTAL: Hertz = Hertz(8_000_000);

const CHECKED: Checked = match DRIVE.configuration.checked() {
    Ok(checked) => checked,
    Err(_) => panic!("a value of the motor's configuration is out of its range"),
};

/// Of the amplifiers' outputs, the thermistor and the divider.
const CHANNELS: Channels = Channels { u: 3, v: 3, w: 12, temperature: 5, bus: 1 };

/// Whether the board's resistor of 120 ohm ends the CAN bus: true at both of the bus' ends, and nowhere else. Change it to where
/// the board is.
const IS_TERMINATED: bool = true;

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
    /// What the memory holds beside the queues, the log and the stack.
    const SIZES: Sizes = TOOLING.sizes;
    /// What its ticks take is not among it, for which there would be no room: `dimsart connect` shows it all the same.
    const OUTPUTS: &'static [&'static DataType] = three_phase_joint::OUTPUTS;
    const LIMITS: &'static [&'static [InputLimits]] = &[&[three_phase::torque_limits(&DRIVE.configuration)]];
    const OUTPUT_LIMITS: &'static [OutputLimits] = &[three_phase::position_limits(&DRIVE.configuration)];

    /// Two of the current loop's periods, too: a call of more than 50 us is no module's.
    const SPARE_CYCLES: u32 = 7_000;

    type Joints = Joint;
    type CommandPort = UartPort;
    type LinkIn = fdcan::FromCan;
    type LinkOut = fdcan::ToCan;
    type Flash = SchemeFlash;
    type Idle = Sleep;

    fn start() -> Parts<Self> {
        let chip = stm32g4::start(CRYSTAL);

        let outputs = AfType::output(OutputType::PushPull, Speed::High);
        for (pin, function) in [
            (Flex::new(chip.PA8), 6),
            (Flex::new(chip.PA9), 6),
            (Flex::new(chip.PA10), 6),
            (Flex::new(chip.PC13), 4),
            (Flex::new(chip.PA12), 6),
            (Flex::new(chip.PB15), 4),
        ] {
            keep_as(pin, function, outputs);
        }
        let bridges = HalfBridges::start(PWM_TOP, DEAD_TIME);
        for pin in [Flex::new(chip.PB6), Flex::new(chip.PB7)] {
            keep_as(pin, 2, AfType::input(Pull::Up));
        }
        pac::RCC.apb1enr1().modify(|clocks| clocks.set_tim4en(true));
        let _ = pac::RCC.apb1enr1().read();
        // Their pins are analog ones from the reset on.
        amplifiers::start();

        static RING: ConstStaticCell<[u8; uart::RING_BYTES]> = ConstStaticCell::new([0; uart::RING_BYTES]);
        let (receive, send) = ((chip.PB4, chip.DMA1_CH1), (chip.PB3, chip.DMA1_CH2));
        let (receive, send) = uart::open(chip.USART2, receive, send, Interrupts, RING.take());
        let command_port = UartPort { receive, send };
        let shutdown = Output::new(chip.PC11, Level::Low, Speed::Low);
        let termination = Output::new(chip.PC14, Level::from(IS_TERMINATED), Speed::Low);
        // They stay for good: a pin floats when its owner goes away.
        core::mem::forget((shutdown, termination));
        let can = CanConfigurator::new(chip.FDCAN1, chip.PA11, chip.PB9, Interrupts);
        let storage = flash::storage(chip.FLASH, Interrupts, STALLS_TICK);
        let links = fdcan::start(can, 0);
        stm32g4::parts(
            Axes::from_array([AxisKind::Rotary; TOOLING.axes]),
            Joint::new(bridges, ()),
            command_port,
            links,
            storage,
            chip.IWDG,
        )
    }

    fn disarm() {
        current_loop::disarm();
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

impl ThreePhase for BG431bEsc1 {
    const DRIVE: ThreePhaseDrive = DRIVE;
    const CHANNELS: Channels = CHANNELS;
    const COUNTER: TimGp16 = pac::TIM4;
    const IS_LOW_SIDE_INVERTED: bool = false;

    type Encoder = Quadrature;
    type EncoderPins = ();

    fn image() -> Checked {
        CHECKED
    }

    fn reads(encoder: Encoder) -> bool {
        !encoder.is_absolute()
    }

    fn start_encoder((): (), encoder: Encoder) -> Quadrature {
        Quadrature::start(encoder.counts_per_turn())
    }
}

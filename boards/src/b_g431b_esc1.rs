//! ST's B-G431B-ESC1: one three-phase motor, its inverter, CAN transceiver and ST-LINK on one board.
//!
//! Complete and linked, but not yet run on silicon.
//!
//! Pins: `catalogue/b_g431b_esc1.rs`, drawn by `cargo xtask book`. The command line is USART 2 at 921 600
//! baud: the ST-LINK's virtual serial port and J3. Link 0 is FDCAN 1 with CAN FD at 1 Mbit/s for header and
//! data, the limit of the transceiver. The crystal has 8 MHz.
//!
//! The half bridges have no enable pin: timer 1 turns off both transistors of each. Timer 3 is the time
//! driver. The log uses RTT.
//!
//! Set motor, encoder and limits in `catalogue/b_g431b_esc1.rs`. Before powering the motor, follow
//! `docs/first-start.md` to find a reversed encoder or swapped phases.
//!
//! Torque is controlled by field-oriented control ([`current_loop`](crate::current_loop)) at 20 kHz, above
//! the tick. With an incremental encoder the rotor is aligned once, within the first 8 seconds after motion
//! is enabled: the shaft turns by up to 1.25 electrical turns and back with limited current, and ignores
//! commands meanwhile. Its angle is 0 at the position at start.

mod amplifiers;

use dimsart_core::limits::Capacities;
use dimsart_core::{AxisKind, Counter, DataType, InputLimits, OutputLimits};
use dimsart_link::StartCause;
use drive::{Encoder, ValidConfiguration};
use embassy_stm32::can::{CanConfigurator, IT0InterruptHandler, IT1InterruptHandler};
use embassy_stm32::gpio::{AfType, Flex, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::TimGp16;
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH2, FDCAN1, USART2};
use embassy_stm32::time::Hertz;
use embassy_stm32::{bind_interrupts, dma, usart};
use static_cell::ConstStaticCell;

use crate::board::{Axes, Board, BoardParts};
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

/// Timer 1 at 168 MHz counts up and down in a period of 50 us.
const PWM_TOP: u16 = 4_200;
/// 0.8 us: (64 + 3) times 2 cycles, in the timer's encoding.
const DEAD_TIME: u8 = 0b1000_0011;
const CRYSTAL: Hertz = Hertz(8_000_000);

const CHECKED: ValidConfiguration = match DRIVE.configuration.checked() {
    Ok(checked) => checked,
    Err(_) => panic!("value in the motor configuration out of range"),
};

/// ADC channels of the amplifiers, thermistor and supply divider.
const CHANNELS: Channels = Channels { u: 3, v: 3, w: 12, temperature: 5, bus: 1 };

/// Whether the board's 120 ohm resistor terminates the CAN bus. Set it to true only at the two ends of the
/// bus.
const IS_TERMINATED: bool = true;

/// The flash has one bank: no instruction can be fetched while it is written.
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
    /// Capacity in addition to queues, log and stack.
    const SIZES: Capacities = TOOLING.sizes;
    /// Without the timing of ticks, for lack of memory; `dimsart connect` shows it.
    const OUTPUTS: &'static [&'static DataType] = three_phase_joint::OUTPUTS;
    const LIMITS: &'static [&'static [InputLimits]] = &[&[three_phase::torque_limits(&DRIVE.configuration)]];
    const OUTPUT_LIMITS: &'static [OutputLimits] = &[three_phase::position_limits(&DRIVE.configuration)];

    /// Includes two periods of the current loop: a module call takes less than 50 us.
    const SPARE_CYCLES: u32 = 7_000;

    type Joints = Joint;
    type CommandPort = UartPort;
    type LinkIn = fdcan::CanReceiver;
    type LinkOut = fdcan::CanSender;
    type Flash = SchemeFlash;
    type Idle = Sleep;

    fn start() -> BoardParts<Self> {
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
        // Their pins are analog after reset.
        amplifiers::start();

        static RING: ConstStaticCell<[u8; uart::RING_BYTES]> = ConstStaticCell::new([0; uart::RING_BYTES]);
        let (receive, send) = ((chip.PB4, chip.DMA1_CH1), (chip.PB3, chip.DMA1_CH2));
        let (receive, send) = uart::open(chip.USART2, receive, send, Interrupts, RING.take());
        let command_port = UartPort { receive, send };
        let shutdown = Output::new(chip.PC11, Level::Low, Speed::Low);
        let termination = Output::new(chip.PC14, Level::from(IS_TERMINATED), Speed::Low);
        // Never dropped: a dropped pin floats.
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

    fn image() -> ValidConfiguration {
        CHECKED
    }

    fn reads(encoder: Encoder) -> bool {
        !encoder.is_absolute()
    }

    fn start_encoder((): (), encoder: Encoder) -> Quadrature {
        Quadrature::start(encoder.counts_per_turn())
    }
}

//! ST's NUCLEO-G474RE with up to three brushed motors on PWM + direction drivers.
//!
//! Complete and linked, but not yet run on silicon.
//!
//! Pins: `catalogue/nucleo_g474re.rs`, drawn by `cargo xtask book`. Pull-ups of the encoder inputs are on.
//! The drivers' enable pin needs a pull-down: it floats during reset. The command line is LPUART 1 at 921 600
//! baud, the ST-LINK's virtual serial port. Link 0 is FDCAN 1 with CAN FD at 1 and 4 Mbit/s and needs a
//! transceiver; with feature `uart-link` it is USART 3 at 921 600 baud. The crystal has 24 MHz.
//!
//! With feature `moteus` the joints are moteus drives on FDCAN 1 at 1 and 5 Mbit/s, and the clock is 170 MHz
//! (`docs/moteus.md`). Link 0 is then USART 3, and the pins of motors and encoders are free.
//!
//! With feature `ihm08m1` the joint is a three-phase motor on ST's shield X-NUCLEO-IHM08M1
//! (`nucleo_g474re/ihm08m1.rs`).
//!
//! Set the data of motors and drives in `catalogue/nucleo_g474re.rs`. Before powering a motor, follow
//! `docs/first-start.md` to find a reversed encoder or motor.
//!
//! An unconnected axis stays at 0. Timer 5 is the time driver. The log uses RTT.

#[cfg(not(any(feature = "ihm08m1", feature = "moteus")))]
mod brushed;
#[cfg(not(feature = "uart-link"))]
mod can_link;
#[cfg(feature = "moteus")]
mod drives;
#[cfg(feature = "ihm08m1")]
mod ihm08m1;
#[cfg(feature = "uart-link")]
mod uart_link;

use dimsart_core::limits::Capacities;
use dimsart_core::{AxisKind, Counter, DataType, InputLimits, OutputLimits};
use dimsart_link::StartCause;
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH2, LPUART1};
use embassy_stm32::time::Hertz;
use embassy_stm32::{bind_interrupts, dma, pac, usart};
use static_cell::ConstStaticCell;

#[cfg(not(any(feature = "ihm08m1", feature = "moteus")))]
use self::brushed as joints;
#[cfg(not(feature = "uart-link"))]
use self::can_link as link;
#[cfg(feature = "moteus")]
use self::drives as joints;
#[cfg(feature = "ihm08m1")]
use self::ihm08m1 as joints;
#[cfg(feature = "uart-link")]
use self::uart_link as link;
use crate::board::{Axes, Board, BoardParts};
use crate::catalogue::nucleo_g474re::TOOLING;
use crate::stm32g4::flash::{self, SchemeFlash};
use crate::stm32g4::uart::{self, UartPort};
use crate::stm32g4::{self, Sleep};

#[cfg(all(feature = "ihm08m1", feature = "uart-link"))]
compile_error!("the shield's encoder and the UART link use the same pins: disable `uart-link` or `ihm08m1`");

const AXES: usize = if cfg!(feature = "ihm08m1") { 1 } else { TOOLING.axes };
const CRYSTAL: Hertz = Hertz(24_000_000);

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
    const SIZES: Capacities = TOOLING.sizes;
    const OUTPUTS: &'static [&'static DataType] = joints::OUTPUTS;
    const LIMITS: &'static [&'static [InputLimits]] = joints::LIMITS;
    const OUTPUT_LIMITS: &'static [OutputLimits] = joints::OUTPUT_LIMITS;

    type Joints = joints::Joints;
    type CommandPort = UartPort;
    type LinkIn = link::LinkIn;
    type LinkOut = link::LinkOut;
    type Flash = SchemeFlash;
    type Idle = Sleep;

    fn start() -> BoardParts<Self> {
        let chip = stm32g4::start(CRYSTAL);
        #[cfg(not(any(feature = "ihm08m1", feature = "moteus")))]
        let joints = joints::start(joints::Wiring {
            first: (chip.TIM2, chip.PA0, chip.PA1),
            second: (chip.TIM3, chip.PA6, chip.PA7),
            third: (chip.TIM4, chip.PB6, chip.PB7),
            timer: chip.TIM1,
            pwm: (chip.PA8, chip.PA9, chip.PA10),
            directions: (chip.PC0, chip.PC1, chip.PC2),
            enable: chip.PC3,
        });
        #[cfg(feature = "ihm08m1")]
        let joints = joints::start(joints::Wiring {
            high: (chip.PA8, chip.PA9, chip.PA10),
            low: (chip.PA7, chip.PB0, chip.PB1),
            encoder: joints::EncoderPins {
                incremental: (chip.PA15, chip.PB3),
                spi: (chip.PC10, chip.PC11, chip.PC12),
                select: chip.PD2,
                i2c: (chip.PC6, chip.PC7),
            },
        });
        #[cfg(feature = "moteus")]
        let joints = joints::start(chip.FDCAN1, chip.PA11, chip.PA12);

        static RING: ConstStaticCell<[u8; uart::RING_BYTES]> = ConstStaticCell::new([0; uart::RING_BYTES]);
        let (receive, send) = ((chip.PA3, chip.DMA1_CH1), (chip.PA2, chip.DMA1_CH2));
        let (receive, send) = uart::open(chip.LPUART1, receive, send, Interrupts, RING.take());
        let command_port = UartPort { receive, send };
        // The image is in the flash's first bank and the schemes are in the second: one can be read while the
        // other is written, unless the option bytes select a single bank.
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
        joints::disarm();
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

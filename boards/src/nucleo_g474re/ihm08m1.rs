//! A three-phase motor on ST's shield X-NUCLEO-IHM08M1: gate drivers L6398, three shunts, amplifiers.
//!
//! | Function | Pins | Connector |
//! |---|---|---|
//! | High-side switches U, V, W, active high: timer 1, 20 kHz, 0.8 us dead time | PA8, PA9, PA10 | CN10-23, 21, 33 |
//! | Low-side switches U, V, W, active **low** | PA7, PB0, PB1 | CN10-15, CN7-34, CN10-24 |
//! | Currents of U, V, W, amplified | PA0, PC1, PC0 | CN7-28, 36, 38 |
//! | Supply, divider of 169 and 9.31 kOhm | PA1 | CN7-30 |
//! | Temperature of the bridge | PC2 | CN7-35 |
//! | Incremental encoder A, B (pull-ups on): timer 2 | PA15, PB3 | CN7-17, CN10-31; J3 |
//! | or an AS5047P or MT6701 on SPI 3: clock, its output, its input, select | PC10, PC11 (pull-up on), PC12, PD2 | CN7-1, 2, 3, 4 |
//! | or an AS5600 on I²C 4: clock, data, with 2.2 kOhm to 3.3 V each | PC6, PC7 (pull-ups on) | CN10-4, 19 |
//!
//! The configuration selects the encoder. Set the shield's jumpers for field-oriented control (ST UM1996,
//! 2.2.1): JP1 and JP2 closed, J5 and J6 on three shunts, JP3 closed, C3, C5, C7 removed; J9 open above 12 V.
//!
//! **PA11 and PA12 are used for CAN**, but the shield connects overcurrent comparator outputs to them: remove
//! R73 and R52. PB14 and PB15 are connected to shield signals that use other pins, and stay analog. The
//! shield's hardware shutdown of timer 1 at 30 A (PA6) is not used.
//!
//! # Sources
//!
//! | Fact | Sources |
//! |---|---|
//! | pins of timer 1, currents, supply, encoder, PA6; pins of SPI 3 and I²C 4 are free | oxifoc (its `docs/hw/nucleo-g474re-ihm08m1.md`, from ST's UM1996, UM2505 and the shield's schematic); `invpend_BLDC`, which runs the shield on a NUCLEO-F401RE |
//! | temperature's pin, connectors, jumpers, R52, R73, PB14, PB15 | oxifoc only |
//! | low-side switches are active low | `NuttX` (`stm32_ihm08m1.c`: complementary outputs have to be inverted for the L6398); a project of ST's motor control SDK for its power board 4, which is this shield (`L_ACTIVE_LOW`); ST's forum; a student's project on this very pair, seen with a logic analyser |
//! | all switches are open at undriven pins | L6398's data sheet: `LIN` draws its current when low, `HIN` when high. That project saw upper inputs high there: measure PA8 to PA10 while the board is held in reset, before there is a supply |
//! | shunts of 10 mOhm, gain 5.18 | `NuttX` (current into the motor lowers the voltage, as here); oxifoc, from the schematic: 680 Ohm, 6.8 kOhm to 3.3 V, 1 kOhm, 4.7 kOhm |
//! | 1.71 V at zero current | oxifoc; ST's forum |
//! | supply divider of 19.15 | `NuttX`; oxifoc |
//! | thermistor above a resistor, 1.055 V at 25 °C | that project for power board 4, whose amplifiers and divider are its own. oxifoc has it the other way round, not measured: a shield at 25 °C that shows 46 °C has it so |
//! | the thermistor's 10 kOhm and B 3425 K, its 4.7 kOhm | those of b-g431b-esc1, which has the same 1.055 V; no source for the shield |
//!
//! Not yet tested on a shield.

use dimsart_core::{InputLimits, OutputLimits};
use drive::{Configuration, Encoder as Kind, Rotor, ValidConfiguration};
use embassy_stm32::gpio::{AfType, Flex, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::pac::timer::TimGp16;
use embassy_stm32::peripherals::{PA7, PA8, PA9, PA10, PA15, PB0, PB1, PB3, PC6, PC7, PC10, PC11, PC12, PD2};
use embassy_stm32::{Peri, pac};

use super::NucleoG474re;
use crate::catalogue::ThreePhaseDrive;
use crate::catalogue::ihm08m1::DRIVE;
use crate::stm32g4::bridge::{Encoder, ThreePhase};
use crate::stm32g4::current_sensing::Channels;
use crate::stm32g4::half_bridges::HalfBridges;
use crate::stm32g4::i2c_encoder::{self, I2cEncoder};
use crate::stm32g4::quadrature::Quadrature;
use crate::stm32g4::spi_encoder::SpiEncoder;
use crate::stm32g4::three_phase_joint::{Joint, keep_as};
use crate::three_phase;

pub(super) use crate::stm32g4::current_loop::disarm;
pub(super) use crate::stm32g4::three_phase_joint::{Joint as Joints, OUTPUTS};

/// Timer 1 at 168 MHz counts up and down in a period of 50 us.
const PWM_TOP: u16 = 4_200;
/// 0.8 us: (64 + 3) times 2 cycles, in the timer's encoding. Above 0.32 us the L6398 adds no dead time of its
/// own.
const DEAD_TIME: u8 = 0b1000_0011;
const CHANNELS: Channels = Channels { u: 1, v: 7, w: 6, temperature: 8, bus: 2 };

/// The compiled configuration, used if the stamped one is invalid.
const CHECKED: ValidConfiguration = match DRIVE.configuration.checked() {
    Ok(checked) => checked,
    Err(_) => panic!("value in the motor configuration out of range"),
};

pub(super) const LIMITS: &[&[InputLimits]] = &[&[three_phase::torque_limits(&DRIVE.configuration)]];
pub(super) const OUTPUT_LIMITS: &[OutputLimits] = &[three_phase::position_limits(&DRIVE.configuration)];

/// The image's configuration.
#[used]
#[expect(unsafe_code, reason = "a host tool finds it by name and changes it in the image")]
#[unsafe(export_name = "dimsart_drive")]
static CONFIGURATION: Configuration = DRIVE.configuration;
static PLACE: &Configuration = &CONFIGURATION;

/// Wiring of the joint.
pub(super) struct Wiring {
    pub(super) high: (Peri<'static, PA8>, Peri<'static, PA9>, Peri<'static, PA10>),
    pub(super) low: (Peri<'static, PA7>, Peri<'static, PB0>, Peri<'static, PB1>),
    pub(super) encoder: EncoderPins,
}

/// Wiring of the encoder.
pub(crate) struct EncoderPins {
    pub(super) incremental: (Peri<'static, PA15>, Peri<'static, PB3>),
    pub(super) spi: (Peri<'static, PC10>, Peri<'static, PC11>, Peri<'static, PC12>),
    pub(super) select: Peri<'static, PD2>,
    pub(super) i2c: (Peri<'static, PC6>, Peri<'static, PC7>),
}

pub(super) fn start(wiring: Wiring) -> Joint {
    let Wiring { high, low, encoder } = wiring;
    let bridges = HalfBridges::start(PWM_TOP, DEAD_TIME);
    // Configured last: until here the gate drivers' resistors keep all switches open.
    let outputs = AfType::output(OutputType::PushPull, Speed::High);
    for pin in [
        Flex::new(high.0),
        Flex::new(high.1),
        Flex::new(high.2),
        Flex::new(low.0),
        Flex::new(low.1),
        Flex::new(low.2),
    ] {
        keep_as(pin, 6, outputs);
    }
    Joint::new(bridges, encoder)
}

impl ThreePhase for NucleoG474re {
    const DRIVE: ThreePhaseDrive = DRIVE;
    const CHANNELS: Channels = CHANNELS;
    #[expect(unsafe_code, reason = "the register library has it as a 32-bit timer")]
    // SAFETY: the timer has all registers of a 16-bit timer at the same addresses.
    const COUNTER: TimGp16 = unsafe { TimGp16::from_ptr(pac::TIM2.as_ptr()) };
    /// The L6398's low-side inputs are inverted.
    const IS_LOW_SIDE_INVERTED: bool = true;

    type Encoder = ShieldEncoder;
    type EncoderPins = EncoderPins;

    fn image() -> ValidConfiguration {
        #[expect(unsafe_code, reason = "volatile, because a host tool may have changed it")]
        // SAFETY: always a valid reference.
        let configuration = unsafe { (&raw const PLACE).read_volatile() };
        configuration.checked().unwrap_or(CHECKED)
    }

    fn reads(_: Kind) -> bool {
        true
    }

    fn start_encoder(pins: EncoderPins, encoder: Kind) -> ShieldEncoder {
        let outputs = AfType::output(OutputType::PushPull, Speed::High);
        let EncoderPins { incremental, spi, select, i2c } = pins;
        match encoder {
            Kind::Incremental { counts_per_turn } => {
                for pin in [Flex::new(incremental.0), Flex::new(incremental.1)] {
                    keep_as(pin, 1, AfType::input(Pull::Up));
                }
                pac::RCC.apb1enr1().modify(|clocks| clocks.set_tim2en(true));
                let _ = pac::RCC.apb1enr1().read();
                ShieldEncoder::Incremental(Quadrature::start(counts_per_turn))
            }
            Kind::As5600 => {
                let (mut clock, mut data) = (Flex::new(i2c.0), Flex::new(i2c.1));
                i2c_encoder::free(&mut clock, &mut data);
                for pin in [clock, data] {
                    // A missing encoder must not acknowledge.
                    keep_as(pin, 8, AfType::output_pull(OutputType::OpenDrain, Speed::High, Pull::Up));
                }
                ShieldEncoder::I2c(I2cEncoder::start())
            }
            Kind::As5047p | Kind::Mt6701 => {
                // Never dropped: a dropped pin floats.
                core::mem::forget(Output::new(select, Level::High, Speed::High));
                keep_as(Flex::new(spi.0), 6, outputs);
                // A missing encoder must read as ones.
                keep_as(Flex::new(spi.1), 6, AfType::input(Pull::Up));
                keep_as(Flex::new(spi.2), 6, outputs);
                ShieldEncoder::Spi(match encoder {
                    Kind::As5047p => SpiEncoder::as5047p(),
                    _ => SpiEncoder::mt6701(),
                })
            }
        }
    }
}

/// The configured encoder.
pub(crate) enum ShieldEncoder {
    Incremental(Quadrature),
    Spi(SpiEncoder),
    I2c(I2cEncoder),
}

impl Encoder for ShieldEncoder {
    #[inline]
    fn rotor(&mut self) -> Rotor {
        match self {
            Self::Incremental(encoder) => encoder.rotor(),
            Self::Spi(encoder) => encoder.rotor(),
            Self::I2c(encoder) => encoder.rotor(),
        }
    }

    #[inline]
    fn end(&mut self) {
        match self {
            Self::Incremental(encoder) => encoder.end(),
            Self::Spi(encoder) => encoder.end(),
            Self::I2c(encoder) => encoder.end(),
        }
    }
}

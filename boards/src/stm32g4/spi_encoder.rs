//! Absolute encoders on SPI 3, by registers (RM0440, 39): a period's frames are read in the next period,
//! without blocking the current loop.
//!
//! ```text
//!               ▏ rotor()               end()                        ▏ rotor()
//!   AS5047P     ▏ ask for the angle ▏       ▏ its answer; ask for its state ▏ ...
//!   MT6701      ▏                           ▏ angle, state, sum             ▏
//!                                           ▲ both capture the angle here
//! ```
//! The encoders need up to 0.35 us between select and clock, and between release and select: the remaining
//! time is waited for, at most 1.4 us per period.

use cortex_m::peripheral::DWT;
use drive::{As5047p, Mt6701, Rotor};
use embassy_stm32::pac::spi::vals::{Br, Cpha, Cpol, Ds, Frxth, Mstr};
use embassy_stm32::pac::{GPIOD, RCC, SPI3};

use super::bridge::Encoder;

/// Select pin on port D, active low.
const SELECT_PIN: usize = 2;
/// 5.25 MHz from the bus clock. Half the divider would be too fast for both.
const CLOCK: Br = Br::DIV32;
const CLOCK_HZ: u32 = crate::CLOCK_HZ / 32;
const _: () = assert!(CLOCK_HZ <= As5047p::MAX_CLOCK_HZ && CLOCK_HZ <= Mt6701::MAX_CLOCK_HZ);
/// Select time of the slower encoder in cycles, rounded up.
const SELECT_CYCLES: u32 = (As5047p::MIN_SELECT_NS * (crate::CLOCK_HZ / 1_000_000)).div_ceil(1_000);
const _: () = assert!(As5047p::MIN_SELECT_NS >= Mt6701::MIN_SELECT_NS);

/// SPI 3 and its select pin.
struct Wires {
    /// Cycle of the last select or release.
    since: u32,
}

impl Wires {
    /// Starts with this frame length. The pins are connected and the device is not selected.
    fn start(bits: Ds) -> Self {
        RCC.apb1enr1().modify(|clocks| clocks.set_spi3en(true));
        // The clock is on after this read (RM0440, 7.2.17).
        let _ = RCC.apb1enr1().read();
        SPI3.cr2().write(|control| {
            control.set_ds(bits);
            control.set_frxth(Frxth::HALF);
        });
        SPI3.cr1().write(|control| {
            control.set_mstr(Mstr::MASTER);
            control.set_ssm(true);
            control.set_ssi(true);
            control.set_cpol(Cpol::IDLE_LOW);
            control.set_cpha(Cpha::SECOND_EDGE);
            control.set_br(CLOCK);
        });
        SPI3.cr1().modify(|control| control.set_spe(true));
        Self { since: DWT::cycle_count() }
    }

    /// Waits for the rest of the required time.
    #[inline]
    fn settle(&mut self) {
        while DWT::cycle_count().wrapping_sub(self.since) < SELECT_CYCLES {}
    }

    #[inline]
    fn select(&mut self) {
        self.settle();
        GPIOD.bsrr().write(|pins| pins.set_br(SELECT_PIN, true));
        self.since = DWT::cycle_count();
        self.settle();
    }

    #[inline]
    fn release(&mut self) {
        GPIOD.bsrr().write(|pins| pins.set_bs(SELECT_PIN, true));
        self.since = DWT::cycle_count();
    }

    #[inline]
    fn send(&self, frame: u16) {
        SPI3.dr16().write_value(frame);
    }

    /// Returns the last received frame; a late frame precedes it.
    #[inline]
    fn receive_last(&self) -> Option<u16> {
        let first = self.receive();
        self.receive().or(first)
    }

    /// Returns a received frame, if any.
    #[inline]
    fn receive(&self) -> Option<u16> {
        SPI3.sr().read().rxne().then(|| SPI3.dr16().read())
    }
}

struct Frames {
    angle: u16,
    diagnosis: u16,
    errors: u16,
}

/// Frames of an AS5047P: angle, magnet diagnosis and errors.
const FRAMES: Frames = {
    let [angle, diagnosis, errors] = As5047p::REQUEST;
    Frames {
        angle: u16::from_be_bytes(angle),
        diagnosis: u16::from_be_bytes(diagnosis),
        errors: u16::from_be_bytes(errors),
    }
};
/// The encoder.
pub(crate) struct SpiEncoder {
    wires: Wires,
    part: Part,
}

enum Part {
    /// Each frame is answered in the next one: a period's first answer is the diagnosis, the second the
    /// angle.
    As5047p {
        /// Last magnet diagnosis.
        diagnosis: [u8; 2],
        /// Request in the second frame of the last period.
        asked: u16,
    },
    Mt6701,
}

impl SpiEncoder {
    /// Creates an AS5047P without a reading.
    pub(crate) fn as5047p() -> Self {
        Self {
            wires: Wires::start(Ds::BITS16),
            part: Part::As5047p { diagnosis: [0; 2], asked: FRAMES.errors },
        }
    }

    /// Creates an MT6701.
    pub(crate) fn mt6701() -> Self {
        Self { wires: Wires::start(Ds::BITS12), part: Part::Mt6701 }
    }
}

impl Encoder for SpiEncoder {
    #[inline]
    fn rotor(&mut self) -> Rotor {
        let Self { wires, part } = self;
        match part {
            Part::As5047p { diagnosis, .. } => {
                let angle = wires.receive_last();
                wires.release();
                wires.select();
                wires.send(FRAMES.angle);
                angle.map_or(Rotor::Lost, |angle| As5047p::decode([[0; 2], angle.to_be_bytes(), *diagnosis]))
            }
            Part::Mt6701 => {
                let (high, low) = (wires.receive(), wires.receive());
                wires.release();
                let Some((high, low)) = high.zip(low) else { return Rotor::Lost };
                let [_, bytes @ ..] = (u32::from(high) << 12 | u32::from(low)).to_be_bytes();
                Mt6701::decode(bytes)
            }
        }
    }

    #[inline]
    fn end(&mut self) {
        let Self { wires, part } = self;
        match part {
            Part::As5047p { diagnosis, asked } => {
                let state = wires.receive_last();
                wires.release();
                if *asked == FRAMES.diagnosis {
                    // No answer: clears the diagnosis.
                    *diagnosis = state.unwrap_or_default().to_be_bytes();
                }
                *asked = if *asked == FRAMES.diagnosis { FRAMES.errors } else { FRAMES.diagnosis };
                wires.select();
                wires.send(*asked);
            }
            Part::Mt6701 => {
                wires.select();
                wires.send(0);
                wires.send(0);
            }
        }
    }
}

//! An AS5600 on I²C 4, by registers (RM0440, 41): a reading takes two periods, without blocking the current
//! loop.
//!
//! ```text
//!   end()                 ▏ rotor()             end() ▏            end()        ▏ rotor()
//!   write the register's  ▏ start again; the DMA      ▏   all is there;         ▏ the angle
//!   number, 28 us         ▏ takes 3 bytes, 55 us      ▏   write the number ...  ▏
//!                             ▲ the angle is taken here
//! ```
//! The times are maxima and leave at least a fifth of a period. A line with a rise time above 120 ns slows
//! the clock: use 2.2 kOhm pull-ups and short wires.

use core::sync::atomic::AtomicU8;
use core::sync::atomic::Ordering::Relaxed;

use drive::{As5600, Rotor};
use embassy_stm32::gpio::{Flex, Speed};
use embassy_stm32::pac::bdma::vals::Size;
use embassy_stm32::pac::i2c::vals::{Autoend, Dir};
use embassy_stm32::pac::{DMA1, DMAMUX1, I2C4, RCC};

use super::bridge::Encoder;

/// DMA 1 channel, from 0; the command line uses the earlier ones.
const CHANNEL: usize = 2;
/// DMA request of I²C 4 RX (RM0440, 13.3.2).
const REQUEST: u8 = 22;
/// Maximum periods of a reading before it is aborted; it takes two.
const MAX_PERIODS: u8 = 3;

/// Prescaler of the bus clock.
const PRESCALER: u8 = 4;
const LOW: u8 = 22;
const HIGH: u8 = 15;
const SETUP: u8 = 8;
/// Minimum detection time of both edges of a bit, `ns`: analog filter (data sheet) and 2 cycles.
const FASTEST_EDGES_NS: u32 = 2 * (50 + 11);
const fn ns(counts: u8) -> u32 {
    counts as u32 * PRESCALER as u32 * 1_000_000 / (crate::CLOCK_HZ / 1_000)
}
const _: () = {
    let [low_ns, high_ns, setup_ns] = As5600::MIN_I2C_TIMES_NS;
    assert!(ns(LOW) >= low_ns && ns(HIGH) >= high_ns && ns(SETUP) >= setup_ns);
    assert!(ns(LOW + HIGH) + FASTEST_EDGES_NS >= 1_000_000_000 / As5600::MAX_CLOCK_HZ);
};

/// DMA buffer.
static BYTES: [AtomicU8; COUNT as usize] = [const { AtomicU8::new(0) }; COUNT as usize];
const COUNT: u8 = 3;

/// The encoder.
pub(crate) struct I2cEncoder {
    stage: Stage,
    /// Periods since the start of the transfer.
    periods: u8,
    /// The reading, until it is returned.
    reading: Rotor,
}

enum Stage {
    SettingUp,
    Asking,
    Reading,
}

/// Frees the data line if the encoder holds it, for example after a reset: clocks out the byte and sends a
/// STOP. Leaves both lines to their pull-ups.
pub(crate) fn free<'a>(clock: &mut Flex<'a>, data: &mut Flex<'a>) {
    // 5 us, slower than any device requires.
    let wait = || cortex_m::asm::delay(crate::CLOCK_HZ / 200_000);
    for line in [&mut *clock, &mut *data] {
        line.set_high();
        line.set_as_input_output(Speed::High);
    }
    for _ in 0..9 {
        clock.set_low();
        wait();
        clock.set_high();
        wait();
    }
    data.set_low();
    wait();
    data.set_high();
    wait();
}

impl I2cEncoder {
    /// Creates the encoder without a reading. Its pins are already connected.
    #[expect(clippy::cast_possible_truncation, reason = "addresses have 32 bits")]
    pub(crate) fn start() -> Self {
        RCC.apb1enr2().modify(|clocks| clocks.set_i2c4en(true));
        RCC.ahb1enr().modify(|clocks| {
            clocks.set_dma1en(true);
            clocks.set_dmamux1en(true);
        });
        let _ = RCC.ahb1enr().read();
        I2C4.timingr().write(|timing| {
            timing.set_presc(PRESCALER - 1);
            timing.set_scll(LOW - 1);
            timing.set_sclh(HIGH - 1);
            timing.set_scldel(SETUP - 1);
        });
        DMAMUX1.ccr(CHANNEL).write(|request| request.set_dmareq_id(REQUEST));
        let channel = DMA1.ch(CHANNEL);
        channel.par().write_value(I2C4.rxdr().as_ptr().addr() as u32);
        channel.mar().write_value(BYTES.as_ptr().addr() as u32);
        let mut encoder = Self { stage: Stage::SettingUp, periods: 0, reading: Rotor::NotSampled };
        encoder.set_up();
        encoder
    }

    /// Resets the transfer.
    #[cold]
    fn set_up(&mut self) {
        I2C4.cr1().write(|_| ());
        // Must be off for 3 bus cycles.
        let _ = I2C4.cr1().read();
        I2C4.cr1().write(|control| {
            control.set_rxdmaen(true);
            control.set_pe(true);
        });
        let [register, _] = As5600::SETUP;
        self.stage = Stage::SettingUp;
        self.write(register, 2, Autoend::AUTOMATIC);
    }

    #[inline]
    fn ask(&mut self) {
        I2C4.icr().write(|flags| flags.set_stopcf(true));
        let [register] = As5600::REQUEST;
        self.stage = Stage::Asking;
        self.write(register, 1, Autoend::SOFTWARE);
    }

    /// Starts a write; the first byte is already in the transmit register.
    #[inline]
    fn write(&mut self, first: u8, bytes: u8, end: Autoend) {
        self.periods = 0;
        I2C4.txdr().write(|data| data.set_txdata(first));
        transfer(Dir::WRITE, bytes, end);
    }

    #[inline]
    fn read(&mut self) {
        let channel = DMA1.ch(CHANNEL);
        channel.cr().write(|_| ());
        channel.ndtr().write(|count| count.set_ndt(COUNT.into()));
        channel.cr().write(|control| {
            control.set_msize(Size::BITS8);
            control.set_psize(Size::BITS8);
            control.set_minc(true);
            control.set_en(true);
        });
        self.stage = Stage::Reading;
        transfer(Dir::READ, COUNT, Autoend::AUTOMATIC);
    }
}

#[inline]
fn transfer(direction: Dir, bytes: u8, end: Autoend) {
    I2C4.cr2().write(|transfer| {
        transfer.set_sadd(u16::from(As5600::ADDRESS) << 1);
        transfer.set_dir(direction);
        transfer.set_nbytes(bytes);
        transfer.set_autoend(end);
        transfer.set_start(true);
    });
}

impl Encoder for I2cEncoder {
    #[inline]
    fn rotor(&mut self) -> Rotor {
        if matches!(self.stage, Stage::Asking) && I2C4.isr().read().tc() {
            self.read();
        }
        core::mem::replace(&mut self.reading, Rotor::NotSampled)
    }

    #[inline]
    fn end(&mut self) {
        let flags = I2C4.isr().read();
        self.periods += 1;
        if flags.nackf() || flags.arlo() || self.periods > MAX_PERIODS {
            self.reading = Rotor::Lost;
            return self.set_up();
        }
        match self.stage {
            Stage::SettingUp if flags.txis() => {
                let [_, value] = As5600::SETUP;
                I2C4.txdr().write(|data| data.set_txdata(value));
            }
            Stage::SettingUp if flags.stopf() => self.ask(),
            Stage::Reading if flags.stopf() => {
                self.reading = As5600::decode(BYTES.each_ref().map(|byte| byte.load(Relaxed)));
                self.ask();
            }
            _ => {}
        }
    }
}

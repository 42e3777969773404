//! An AS5600 on I²C 4, by its registers (RM0440, 41): a reading takes two periods, and the current loop waits for none of it.
//!
//! ```text
//!   end()                 ▏ rotor()             end() ▏            end()        ▏ rotor()
//!   write the register's  ▏ start again; the DMA      ▏   all is there;         ▏ the angle
//!   number, 28 us         ▏ takes 3 bytes, 55 us      ▏   write the number ...  ▏
//!                             ▲ the angle is taken here
//! ```
//! The times are the longest ones, for both of which there are a fifth of a period more at least. A line that does not rise
//! within 120 ns slows the clock: pull-ups of 2.2 kOhm, and short wires.

use core::sync::atomic::AtomicU8;
use core::sync::atomic::Ordering::Relaxed;

use drive::{As5600, Rotor};
use embassy_stm32::gpio::{Flex, Speed};
use embassy_stm32::pac::bdma::vals::Size;
use embassy_stm32::pac::i2c::vals::{Autoend, Dir};
use embassy_stm32::pac::{DMA1, DMAMUX1, I2C4, RCC};

use super::bridge::Encoder;

/// Of DMA 1, from 0 on; the ones before are the command line's.
const CHANNEL: usize = 2;
/// Of the multiplexer: what I²C 4 has received (RM0440, 13.3.2).
const REQUEST: u8 = 22;
/// Periods that a reading may take before it is given up; it takes two.
const MOST_PERIODS: u8 = 3;

/// Cycles of the bus clock that the prescaler makes one of.
const PRESCALER: u8 = 4;
const LOW: u8 = 22;
const HIGH: u8 = 15;
const SETUP: u8 = 8;
/// In which an edge is seen at least, twice per bit, `ns`: through the analog filter (data sheet), and after 2 cycles.
const FASTEST_EDGES_NS: u32 = 2 * (50 + 11);
const fn ns(counts: u8) -> u32 {
    counts as u32 * PRESCALER as u32 * 1_000_000 / (crate::CLOCK_HZ / 1_000)
}
const _: () = {
    let [low_ns, high_ns, setup_ns] = As5600::LEAST_NS;
    assert!(ns(LOW) >= low_ns && ns(HIGH) >= high_ns && ns(SETUP) >= setup_ns);
    assert!(ns(LOW + HIGH) + FASTEST_EDGES_NS >= 1_000_000_000 / As5600::MOST_CLOCK_HZ);
};

/// What the DMA writes.
static BYTES: [AtomicU8; COUNT as usize] = [const { AtomicU8::new(0) }; COUNT as usize];
const COUNT: u8 = 3;

/// Such an encoder.
pub(crate) struct I2cEncoder {
    stage: Stage,
    /// Since the transfer began.
    periods: u8,
    /// What was read and not told yet.
    reading: Rotor,
}

enum Stage {
    SettingUp,
    Asking,
    Reading,
}

/// Has an encoder let go of the data line that was left while it sent, as by a reset: it sends to the end of its byte, and sees
/// a STOP. Leaves both lines to their pull-ups.
pub(crate) fn free<'a>(clock: &mut Flex<'a>, data: &mut Flex<'a>) {
    // 5 us, slower than any device wants.
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
    /// One that has said nothing yet. Its pins are connected already.
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
        let mut encoder = Self { stage: Stage::SettingUp, periods: 0, reading: Rotor::Awaited };
        encoder.set_up();
        encoder
    }

    /// From the begin, whatever was going on.
    #[cold]
    fn set_up(&mut self) {
        I2C4.cr1().write(|_| ());
        // It is to be off for 3 cycles of the bus.
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

    /// Begins to write bytes, of which the first one waits where it is sent from.
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
        core::mem::replace(&mut self.reading, Rotor::Awaited)
    }

    #[inline]
    fn end(&mut self) {
        let flags = I2C4.isr().read();
        self.periods += 1;
        if flags.nackf() || flags.arlo() || self.periods > MOST_PERIODS {
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

//! A node of a CAN FD bus that a host speaks through: a chip that runs no program and whose FDCAN is set up from outside.

use std::collections::VecDeque;
use std::sync::Arc;

use cycles::AccessError;
use cycles::image::{Image, Segment};
use cycles::machine::{MachineError, Stop};

use crate::stm32g4::fdcan::LENGTHS;
use crate::{Bench, Board};

const CAN: u32 = 0x4000_6400;
const RAM: u32 = 0x4000_A400;
const RCC: u32 = 0x4002_1000;
const PORT_A: u32 = 0x4800_0000;

const DBTP: u32 = CAN + 0x0C;
const CCCR: u32 = CAN + 0x18;
const NBTP: u32 = CAN + 0x1C;
const TDCR: u32 = CAN + 0x48;
const RXF0S: u32 = CAN + 0x90;
const RXF0A: u32 = CAN + 0x94;
const TXFQS: u32 = CAN + 0xC4;
const TXBAR: u32 = CAN + 0xCC;

/// Bytes of a frame in message RAM before its data.
const HEAD_BYTES: u32 = 8;
const ELEMENT_BYTES: u32 = 72;
const FIFO: u32 = RAM + 0xB0;
const BUFFERS: u32 = RAM + 0x278;
/// FD, with the switch of the rate.
const FD: u32 = 0b11 << 20;
const EXTENDED: u32 = 1 << 30;

/// Frames that wait for room in the controller.
#[derive(Debug, Default)]
pub struct CanAdapter {
    waiting: VecDeque<(u32, Vec<u8>)>,
}

impl CanAdapter {
    /// The adapter's chip, for the bus.
    ///
    /// # Errors
    /// As [`Bench::new`].
    pub fn bench(board: &'static Board) -> Result<Bench, MachineError> {
        // Stack, reset vector, and a branch to itself.
        let bytes = vec![0, 0x10, 0, 0x20, 9, 0, 0, 8, 0xFE, 0xE7, 0, 0];
        let segment = Segment { address: 0x0800_0000, flashed_at: 0x0800_0000, bytes, is_writable: false };
        Bench::new(board, Arc::new(Image { segments: vec![segment], ..Image::default() }))
    }

    /// The bit timing of a board that has set up its controller, at 170 MHz: nominal, of data, delay of its transceiver.
    ///
    /// # Errors
    /// As [`Bench::read_word`].
    pub fn timing(board: &mut Bench) -> Result<[u32; 3], AccessError> {
        Ok([board.read_word(NBTP)?, board.read_word(DBTP)?, board.read_word(TDCR)?])
    }

    /// Joins the bus with that timing. Every frame goes to FIFO 0.
    ///
    /// # Errors
    /// As [`Bench::run_for`].
    pub fn join(bench: &mut Bench, [nominal, data, delay]: [u32; 3]) -> Result<(), MachineError> {
        // Crystal beside the oscillator that runs it, PLL from 24 to 170 MHz for the controller, clocks of port A and of it.
        write(bench, &[(RCC, 1 << 16 | 1 << 8)])?;
        bench.run_for(10e-3)?;
        write(bench, &[(RCC + 0x0C, 1 << 20 | 85 << 8 | 5 << 4 | 3), (RCC, 1 << 24 | 1 << 16 | 1 << 8)])?;
        bench.run_for(1e-3)?;
        write(
            bench,
            &[
                (RCC + 0x58, 1 << 25),
                (RCC + 0x4C, 1),
                (RCC + 0x88, 1 << 24),
                (PORT_A + 0x24, 9 << 12 | 9 << 16),
                (PORT_A, 0xAABF_FFFF),
                (CCCR, 1),
                (CCCR, 0b11),
                (NBTP, nominal),
                (DBTP, data),
                (TDCR, delay),
                (CCCR, 0b11 | 0b11 << 8),
                (CCCR, 0b11 << 8),
            ],
        )
    }

    /// Takes the oldest received frame: identifier and data.
    ///
    /// # Errors
    /// As [`Bench::read_word`].
    pub fn take(bench: &mut Bench) -> Result<Option<(u32, Vec<u8>)>, AccessError> {
        let state = bench.read_word(RXF0S)?;
        if state & 0xF == 0 {
            return Ok(None);
        }
        let place = state >> 8 & 3;
        let begin = FIFO + ELEMENT_BYTES * place;
        let [first, second] = [bench.read_word(begin)?, bench.read_word(begin + 4)?];
        let code = usize::from((second >> 16).to_le_bytes()[0] & 0xF);
        let length = LENGTHS.get(code).copied().unwrap_or_default();
        let mut bytes = Vec::with_capacity(64);
        for word in 0..16 {
            bytes.extend(bench.read_word(begin + HEAD_BYTES + 4 * word)?.to_le_bytes());
        }
        bytes.truncate(length);
        bench.write_word(RXF0A, place)?;
        let identifier = if first & EXTENDED == 0 { first >> 18 & 0x7FF } else { first & 0x1FFF_FFFF };
        Ok(Some((identifier, bytes)))
    }

    /// Has a frame with a 29-bit identifier sent as soon as there is room. Data of a length that CAN FD does not have
    /// is filled up with zeros, and cut at 64 bytes.
    pub fn send(&mut self, identifier: u32, bytes: Vec<u8>) {
        self.waiting.push_back((identifier, bytes));
    }

    /// Gives the controller as many frames as it has room for.
    ///
    /// # Errors
    /// As [`Bench::write_word`].
    pub fn flush(&mut self, bench: &mut Bench) -> Result<(), AccessError> {
        while bench.read_word(TXFQS)? & 0b111 != 0
            && let Some((identifier, mut bytes)) = self.waiting.pop_front()
        {
            let place = bench.read_word(TXFQS)? >> 16 & 3;
            let begin = BUFFERS + ELEMENT_BYTES * place;
            let fits = (0..).zip(LENGTHS).find(|(_, length)| *length >= bytes.len());
            let (code, length) = fits.unwrap_or((15, 64));
            bytes.resize(length, 0);
            bench.write_word(begin, identifier | EXTENDED)?;
            bench.write_word(begin + 4, FD | code << 16)?;
            for (chunk, offset) in bytes.chunks(4).zip((HEAD_BYTES..).step_by(4)) {
                let word = chunk.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
                bench.write_word(begin + offset, word)?;
            }
            bench.write_word(TXBAR, 1 << place)?;
        }
        Ok(())
    }
}

fn write(bench: &mut Bench, words: &[(u32, u32)]) -> Result<(), MachineError> {
    for (address, word) in words {
        let stopped = |error: AccessError| MachineError::Stopped {
            address: *address,
            place: "set-up of the CAN adapter".to_owned(),
            stop: Stop::from(error),
        };
        bench.write_word(*address, *word).map_err(stopped)?;
    }
    Ok(())
}

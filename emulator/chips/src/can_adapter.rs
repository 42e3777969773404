//! A host's CAN FD adapter: a chip without a program, whose FDCAN is configured by register writes from
//! outside.

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

/// Header bytes of a frame in message RAM.
const HEAD_BYTES: u32 = 8;
const ELEMENT_BYTES: u32 = 72;
const FIFO: u32 = RAM + 0xB0;
const BUFFERS: u32 = RAM + 0x278;
/// FD frame with bit rate switch.
const FD: u32 = 0b11 << 20;
const EXTENDED: u32 = 1 << 30;

/// Frames that wait for a free TX buffer of the adapter's controller.
#[derive(Debug, Default)]
pub struct CanAdapter {
    waiting: VecDeque<(u32, Vec<u8>)>,
}

impl CanAdapter {
    /// Returns the adapter's chip, for the bus.
    ///
    /// # Errors
    /// As [`Bench::new`].
    pub fn bench(board: &'static Board) -> Result<Bench, MachineError> {
        // Stack, reset vector, and a branch to itself.
        let bytes = vec![0, 0x10, 0, 0x20, 9, 0, 0, 8, 0xFE, 0xE7, 0, 0];
        let segment = Segment { address: 0x0800_0000, load_address: 0x0800_0000, bytes, is_writable: false };
        Bench::new(board, Arc::new(Image { segments: vec![segment], ..Image::default() }))
    }

    /// Returns the bit timing of a board with a configured controller at 170 MHz: nominal, data, transceiver
    /// delay.
    ///
    /// # Errors
    /// As [`Bench::read_word`].
    pub fn timing(board: &mut Bench) -> Result<[u32; 3], AccessError> {
        Ok([board.read_word(NBTP)?, board.read_word(DBTP)?, board.read_word(TDCR)?])
    }

    /// Joins the bus with this bit timing. FIFO 0 receives all frames.
    ///
    /// # Errors
    /// As [`Bench::run_for`].
    pub fn join(bench: &mut Bench, [nominal, data, delay]: [u32; 3]) -> Result<(), MachineError> {
        // Start the crystal (the processor stays on HSI), the PLL from 24 to 170 MHz for the controller, and
        // the clocks of port A and the controller.
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

    /// Queues a frame with a 29-bit identifier. Data is padded with zeros to the next CAN FD length and
    /// truncated at 64 bytes.
    pub fn send(&mut self, identifier: u32, bytes: Vec<u8>) {
        self.waiting.push_back((identifier, bytes));
    }

    /// Moves queued frames to the free TX buffers of the controller.
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
            place: "setup of the CAN adapter".to_owned(),
            stop: Stop::from(error),
        };
        bench.write_word(*address, *word).map_err(stopped)?;
    }
    Ok(())
}

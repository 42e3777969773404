//! A node on a bus that a test speaks through: a chip that runs nothing, and whose CAN controller is set up from outside.

use std::collections::VecDeque;
use std::sync::Arc;

use chips::{Bench, Board};
use cycles::image::{Image, Segment};
use cycles::instruction::Width;
use cycles::processor::{At, Bus as _};

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

/// What of a frame in message RAM is before its data.
const HEAD_BYTES: u32 = 8;
const ELEMENT_BYTES: u32 = 72;
const FIFO: u32 = RAM + 0xB0;
const BUFFERS: u32 = RAM + 0x278;
const LENGTHS: [usize; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];
/// FD, with the switch of the rate.
const FD: u32 = 0b11 << 20;
const EXTENDED: u32 = 1 << 30;

/// What is to be sent still.
#[derive(Debug, Default)]
pub(crate) struct CanAdapter {
    waiting: VecDeque<(u32, Vec<u8>)>,
}

impl CanAdapter {
    /// Its chip, for the bus.
    pub(crate) fn bench(board: &'static Board) -> Bench {
        // Stack, reset vector, and a branch to itself.
        let bytes = vec![0, 0x10, 0, 0x20, 9, 0, 0, 8, 0xFE, 0xE7, 0, 0];
        let segment = Segment { address: 0x0800_0000, flashed_at: 0x0800_0000, bytes, is_writable: false };
        Bench::new(board, Arc::new(Image { segments: vec![segment], ..Image::default() })).unwrap()
    }

    /// The bit timing of a board that has set up its controller, at 170 MHz: nominal, of data, delay of its transceiver.
    pub(crate) fn timing(board: &mut Bench) -> [u32; 3] {
        [NBTP, DBTP, TDCR].map(|register| load(board, register))
    }

    /// Joins the bus with that timing. Every frame goes to FIFO 0.
    pub(crate) fn join(bench: &mut Bench, [nominal, data, delay]: [u32; 3]) {
        // Crystal, PLL from 24 to 170 MHz for the controller, clocks of port A and of the controller.
        store(bench, RCC, 1 << 16);
        bench.run_for(10e-3).unwrap();
        store(bench, RCC + 0x0C, 1 << 20 | 85 << 8 | 5 << 4 | 3);
        store(bench, RCC, 1 << 24 | 1 << 16);
        bench.run_for(1e-3).unwrap();
        store(bench, RCC + 0x58, 1 << 25);
        store(bench, RCC + 0x4C, 1);
        store(bench, RCC + 0x88, 1 << 24);
        store(bench, PORT_A + 0x24, 9 << 12 | 9 << 16);
        store(bench, PORT_A, 0xAABF_FFFF);
        for (register, value) in [
            (CCCR, 1),
            (CCCR, 0b11),
            (NBTP, nominal),
            (DBTP, data),
            (TDCR, delay),
            (CCCR, 0b11 | 0b11 << 8),
            (CCCR, 0b11 << 8),
        ] {
            store(bench, register, value);
        }
    }

    /// The oldest frame that came in: identifier and data.
    pub(crate) fn take(bench: &mut Bench) -> Option<(u32, Vec<u8>)> {
        let state = load(bench, RXF0S);
        if state & 0xF == 0 {
            return None;
        }
        let place = state >> 8 & 3;
        let begin = FIFO + ELEMENT_BYTES * place;
        let [first, second] = [0, 4].map(|offset| load(bench, begin + offset));
        let length = LENGTHS[(second >> 16 & 0xF) as usize];
        let words = (0..16).flat_map(|word| load(bench, begin + HEAD_BYTES + 4 * word).to_le_bytes());
        let bytes = words.take(length).collect();
        store(bench, RXF0A, place);
        let identifier = if first & EXTENDED == 0 { first >> 18 & 0x7FF } else { first & 0x1FFF_FFFF };
        Some((identifier, bytes))
    }

    /// Has a frame sent as soon as there is room.
    pub(crate) fn send(&mut self, identifier: u32, bytes: Vec<u8>) {
        self.waiting.push_back((identifier, bytes));
    }

    /// Gives the controller what it has room for.
    pub(crate) fn flush(&mut self, bench: &mut Bench) {
        while load(bench, TXFQS) & 0b111 != 0
            && let Some((identifier, bytes)) = self.waiting.pop_front()
        {
            let place = load(bench, TXFQS) >> 16 & 3;
            let begin = BUFFERS + ELEMENT_BYTES * place;
            let code = LENGTHS.iter().position(|length| *length == bytes.len()).unwrap();
            store(bench, begin, identifier | EXTENDED);
            store(bench, begin + 4, FD | u32::try_from(code).unwrap() << 16);
            for (chunk, offset) in bytes.chunks(4).zip((HEAD_BYTES..).step_by(4)) {
                let word = chunk.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
                store(bench, begin + offset, word);
            }
            store(bench, TXBAR, 1 << place);
        }
    }
}

fn at(bench: &Bench) -> At {
    At { cycle: bench.processor.cycles(), code: 0 }
}

fn store(bench: &mut Bench, address: u32, value: u32) {
    let at = at(bench);
    bench.processor.bus.store(address, Width::Word, value, at).unwrap();
    bench.processor.look_again();
}

fn load(bench: &mut Bench, address: u32) -> u32 {
    let at = at(bench);
    bench.processor.bus.load(address, Width::Word, at).unwrap()
}

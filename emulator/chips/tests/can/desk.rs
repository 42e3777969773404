//! Boards on a bus.

use std::sync::Arc;

use chips::{Bench, Board, CanBus};
use cycles::image::{Image, Segment};
use cycles::instruction::Width;
use cycles::processor::{AccessPoint, Bus as _};

pub(crate) const CAN: u32 = 0x4000_6400;
const RAM: u32 = 0x4000_A400;
const RCC: u32 = 0x4002_1000;

pub(crate) const DBTP: u32 = 0x0C;
pub(crate) const CCCR: u32 = 0x18;
pub(crate) const NBTP: u32 = 0x1C;
pub(crate) const ECR: u32 = 0x40;
pub(crate) const PSR: u32 = 0x44;
pub(crate) const IR: u32 = 0x50;
pub(crate) const IE: u32 = 0x54;
pub(crate) const ILS: u32 = 0x58;
pub(crate) const ILE: u32 = 0x5C;
pub(crate) const RXGFC: u32 = 0x80;
pub(crate) const RXF0S: u32 = 0x90;
pub(crate) const RXF0A: u32 = 0x94;
pub(crate) const RXF1S: u32 = 0x98;
pub(crate) const TXBC: u32 = 0xC0;
pub(crate) const TXFQS: u32 = 0xC4;
pub(crate) const TXBRP: u32 = 0xC8;
pub(crate) const TXBAR: u32 = 0xCC;
pub(crate) const TXBCR: u32 = 0xD0;
pub(crate) const TXBTO: u32 = 0xD4;
pub(crate) const TXBCF: u32 = 0xD8;
pub(crate) const TXEFS: u32 = 0xE4;

/// 16 quanta at 16 MHz, sample point after 13: 1 Mbit/s.
pub(crate) const ONE_MBIT: u32 = 2 << 25 | 11 << 8 | 2;
/// 8 quanta: 2 Mbit/s.
pub(crate) const TWO_MBIT_DATA: u32 = 4 << 8 | 1 << 4 | 1;

/// Setup of a controller.
#[derive(Clone, Copy)]
pub(crate) struct Setup {
    pub(crate) nominal: u32,
    pub(crate) data: u32,
    /// Bits of CCCR other than INIT and CCE.
    pub(crate) control: u32,
    pub(crate) filters: u32,
    pub(crate) is_queue: bool,
}

/// FD with bit rate switch; FIFO 0 receives all frames.
pub(crate) const PLAIN: Setup =
    Setup { nominal: ONE_MBIT, data: TWO_MBIT_DATA, control: 1 << 8 | 1 << 9, filters: 0, is_queue: false };

pub(crate) struct Desk(pub(crate) CanBus);

/// A frame with an 11-bit identifier or, with bit 30 of `first` set, a 29-bit identifier.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a> {
    pub(crate) first: u32,
    pub(crate) flags: u32,
    pub(crate) code: u32,
    pub(crate) data: &'a [u8],
}

pub(crate) const FD: u32 = 0b11 << 20;
pub(crate) const EVENT: u32 = 1 << 23;

pub(crate) fn standard(identifier: u32, data: &[u8]) -> Frame<'_> {
    Frame { first: identifier << 18, flags: 0, code: u32::try_from(data.len()).unwrap(), data }
}

pub(crate) fn extended(identifier: u32, data: &[u8]) -> Frame<'_> {
    Frame { first: identifier | 1 << 30, flags: 0, code: u32::try_from(data.len()).unwrap(), data }
}

/// A board whose processor has no program.
fn idle(name: &str) -> Bench {
    let bytes = vec![0, 0x10, 0, 0x20, 9, 0, 0, 8, 0, 0, 0, 0];
    let segment = Segment { address: 0x0800_0000, load_address: 0x0800_0000, bytes, is_writable: false };
    let image = Image { segments: vec![segment], ..Image::default() };
    Bench::new(Board::find(name).unwrap(), Arc::new(image)).unwrap()
}

impl Desk {
    /// This number of boards, without setup.
    pub(crate) fn new(boards: usize) -> Self {
        Self::of(&vec!["nucleo-g474re"; boards])
    }

    pub(crate) fn of(names: &[&str]) -> Self {
        Self(CanBus::new(names.iter().map(|name| idle(name)).collect()))
    }

    /// This number of boards with the same setup, on the bus.
    pub(crate) fn joined(boards: usize, setup: Setup) -> Self {
        let mut desk = Self::new(boards);
        (0..boards).for_each(|board| desk.start(board, setup));
        desk.run_us(50.0);
        desk
    }

    pub(crate) fn run_us(&mut self, duration_us: f64) {
        self.0.run_for(duration_us * 1e-6).unwrap();
    }

    pub(crate) fn bench(&mut self, board: usize) -> &mut Bench {
        self.0.bench(board).unwrap()
    }

    fn at(&mut self, board: usize) -> AccessPoint {
        AccessPoint { cycle: self.bench(board).processor.cycles(), code: 0 }
    }

    pub(crate) fn store(&mut self, board: usize, address: u32, value: u32) {
        let at = self.at(board);
        let processor = &mut self.bench(board).processor;
        processor.bus.store(address, Width::Word, value, at).unwrap();
        processor.update_after_external_change();
    }

    pub(crate) fn load(&mut self, board: usize, address: u32) -> u32 {
        let at = self.at(board);
        self.bench(board).processor.bus.load(address, Width::Word, at).unwrap()
    }

    pub(crate) fn write(&mut self, board: usize, register: u32, value: u32) {
        self.store(board, CAN + register, value);
    }

    pub(crate) fn read(&mut self, board: usize, register: u32) -> u32 {
        self.load(board, CAN + register)
    }

    pub(crate) fn ram(&mut self, board: usize, offset: u32) -> u32 {
        self.load(board, RAM + offset)
    }

    pub(crate) fn set_ram(&mut self, board: usize, offset: u32, value: u32) {
        self.store(board, RAM + offset, value);
    }

    /// Enables clocks, pins and, on the ESC, the transceiver. FDCAN runs at the initial 16 MHz.
    pub(crate) fn power(&mut self, board: usize) {
        self.store(board, RCC + 0x58, 1 << 25 | 1 << 10);
        self.store(board, RCC + 0x4C, 0b111);
        self.store(board, RCC + 0x88, 2 << 24);
        let is_esc = self.bench(board).board.name == "b-g431b-esc1";
        self.store(board, 0x4800_0024, if is_esc { 9 << 12 } else { 9 << 12 | 9 << 16 });
        let moder = if is_esc { 0xAB3F_FFFF } else { 0xAABF_FFFF };
        self.store(board, 0x4800_0000, moder & !(3 << 22) | 2 << 22);
        if is_esc {
            self.store(board, 0x4800_0424, 9 << 4);
            self.store(board, 0x4800_0400, 0xFFFF_FEBF & !(3 << 18) | 2 << 18);
            self.store(board, 0x4800_0800, !(3 << 22) | 1 << 22);
        }
    }

    pub(crate) fn configure(&mut self, board: usize, setup: Setup) {
        self.write(board, CCCR, 1);
        self.write(board, CCCR, 0b11);
        self.write(board, NBTP, setup.nominal);
        self.write(board, DBTP, setup.data);
        self.write(board, RXGFC, setup.filters);
        self.write(board, TXBC, u32::from(setup.is_queue) << 24);
        self.write(board, CCCR, 0b11 | setup.control);
    }

    pub(crate) fn start(&mut self, board: usize, setup: Setup) {
        self.power(board);
        self.configure(board, setup);
        self.write(board, CCCR, setup.control);
    }

    pub(crate) fn put(&mut self, board: usize, buffer: u32, frame: Frame<'_>) {
        let begin = 0x278 + 72 * buffer;
        self.set_ram(board, begin, frame.first);
        self.set_ram(board, begin + 4, frame.flags | frame.code << 16);
        for (chunk, place) in frame.data.chunks(4).zip(2..) {
            let word = chunk.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
            self.set_ram(board, begin + 4 * place, word);
        }
    }

    /// Puts a frame into a buffer and requests its transmission.
    pub(crate) fn send(&mut self, board: usize, buffer: u32, frame: Frame<'_>) {
        self.put(board, buffer, frame);
        self.write(board, TXBAR, 1 << buffer);
    }

    /// Identifiers of the acknowledged frames, in order.
    pub(crate) fn passed(&mut self) -> Vec<u32> {
        let passed = self.0.take_frames().into_iter();
        passed
            .filter(|frame| frame.result == chips::FrameResult::Acknowledged)
            .map(|frame| frame.message.identifier)
            .collect()
    }

    /// Takes the oldest frame of FIFO 0: its two header words and its data.
    pub(crate) fn take(&mut self, board: usize) -> Option<(u32, u32, Vec<u8>)> {
        let state = self.read(board, RXF0S);
        if state & 0xF == 0 {
            return None;
        }
        let place = state >> 8 & 3;
        let begin = 0xB0 + 72 * place;
        let words: Vec<u32> = (0..18).map(|word| self.ram(board, begin + 4 * word)).collect();
        self.write(board, RXF0A, place);
        let lengths = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];
        let bytes = words[2..].iter().flat_map(|word| word.to_le_bytes());
        let length = lengths[(words[1] >> 16 & 0xF) as usize];
        Some((words[0], words[1], bytes.take(length).collect()))
    }
}

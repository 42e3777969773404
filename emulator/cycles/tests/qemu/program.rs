//! Random programs: every instruction, with all kinds of operands.
//!
//! A program repeats its body, each time with other words from a pool. R8 points into RAM, R10 into the pool,
//! and R11 counts the runs; R0 to R7, R12 and LR are free.

use std::ops::Range;

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::encode::{constant, float_unit_on};
use crate::patterns::{CLEAR_EXCLUSIVE, CORE, EXCLUSIVE, FLOAT, FOUR_FLOATS, MEMORY};
use crate::words::words;

/// Start of the code: after the vector table, with space for loads relative to the program counter.
pub(crate) const CODE: u32 = 0x2000;
/// Start and size (in words) of the pool.
const POOL: u32 = 0x10_0000;
const POOL_WORDS: usize = 0x2_0000;
/// Offset in the pool, in bytes, between two runs of the body.
const POOL_STEP: u32 = 0x1A4;
/// RAM that programs write to.
pub(crate) const RAM: Range<u32> = 0x2000_2000..0x2001_0000;
/// Address in R8.
const WINDOW: u32 = 0x2000_5000;
/// Initial SP; memory above it is used too.
pub(crate) const STACK: u32 = 0x2000_F000;

/// A program and its data, starting at address 0.
pub(crate) struct Program {
    /// Contents of memory.
    pub(crate) bytes: Vec<u8>,
    /// Address of the first instruction after the preamble.
    pub(crate) begin: u32,
    /// Ranges of code, without the tables in between.
    pub(crate) code: Vec<Range<u32>>,
}

/// A program under construction.
pub(crate) struct Writer {
    pub(crate) random: Pcg64Mcg,
    halves: Vec<u16>,
    /// Tables within the code.
    tables: Vec<Range<u32>>,
    pool_bytes: u32,
}

impl Program {
    /// A body of `snippets` snippets that runs `runs` times.
    pub(crate) fn random(seed: u64, snippets: usize, runs: u16) -> Self {
        let random = Pcg64Mcg::seed_from_u64(seed);
        let mut writer = Writer { random, halves: Vec::new(), tables: Vec::new(), pool_bytes: 0 };
        writer.put(&float_unit_on());
        let begin = writer.address();
        writer.load_constant(0, STACK);
        writer.put(&[0x4685]); // mov sp, r0
        writer.load_constant(11, u32::from(runs));
        let start = writer.address();
        writer.load_constant(10, POOL);
        writer.load_constant(0, POOL_STEP);
        writer.put(&[0xFB0B, 0xAA00]); // mla r10, r11, r0, r10
        writer.load_constant(8, WINDOW);
        for _ in 0..snippets {
            writer.snippet();
        }
        writer.put(&[0xF1BB, 0x0B01]); // subs r11, r11, #1
        writer.put(&[0xD001]); // beq over the next instruction
        writer.branch_back(start);
        writer.read_ram();
        writer.leave();
        let end = writer.address();
        let used = writer.pool_bytes + POOL_STEP * u32::from(runs) + 128;
        assert!(used < 4 * POOL_WORDS as u32, "the pool is too small: {used}");
        assert!(end + 0x1100 < POOL, "the code overlaps the pool: {end:#x}");
        writer.finish(begin, end)
    }
}

impl Writer {
    pub(crate) fn address(&self) -> u32 {
        CODE + 2 * self.halves.len() as u32
    }

    pub(crate) fn put(&mut self, halves: &[u16]) {
        self.halves.extend_from_slice(halves);
    }

    /// Replaces an existing halfword.
    pub(crate) fn patch(&mut self, address: u32, half: u16) {
        self.halves[((address - CODE) / 2) as usize] = half;
    }

    /// Reserves a halfword, in code or in a table, that is set later.
    pub(crate) fn hole(&mut self) -> u32 {
        let address = self.address();
        self.put(&[0]);
        address
    }

    /// A table of halfwords.
    pub(crate) fn table(&mut self, halves: usize) -> u32 {
        let address = self.address();
        self.halves.resize(self.halves.len() + halves, 0);
        self.tables.push(address..self.address());
        address
    }

    /// A number below `limit`.
    pub(crate) fn below(&mut self, limit: u32) -> u32 {
        self.random.next_u32() % limit
    }

    /// R0 to R7.
    pub(crate) fn low_register(&mut self) -> u16 {
        self.below(8) as u16
    }

    pub(crate) fn load_constant(&mut self, register: u16, value: u32) {
        self.put(&constant(register, value));
    }

    /// Reads all of the written RAM.
    fn read_ram(&mut self) {
        self.load_constant(0, RAM.start);
        self.load_constant(1, RAM.end);
        self.put(&[0xF850, 0x3B04, 0x4288, 0xD1FB]); // ldr r3, [r0], #4; cmp r0, r1; bne back
    }

    /// Exits the emulator through semihosting.
    fn leave(&mut self) {
        self.load_constant(0, 0x18);
        self.load_constant(1, 0x0002_0026);
        self.put(&[0xBEAB]);
    }

    fn finish(mut self, begin: u32, end: u32) -> Program {
        let mut bytes = vec![0; (POOL as usize) + 4 * POOL_WORDS];
        let mut fill = |address: u32, content: &[u8]| {
            bytes[address as usize..][..content.len()].copy_from_slice(content);
        };
        fill(0, &STACK.to_le_bytes());
        fill(4, &(CODE | 1).to_le_bytes());
        fill(CODE, &self.halves.iter().flat_map(|half| half.to_le_bytes()).collect::<Vec<_>>());
        fill(POOL, &words(&mut self.random, POOL_WORDS));
        let mut code = Vec::new();
        let mut from = CODE;
        for table in self.tables {
            code.push(from..table.start);
            from = table.end;
        }
        code.push(from..end);
        Program { bytes, begin, code }
    }

    /// A few instructions.
    fn snippet(&mut self) {
        match self.below(100) {
            0..70 => self.simple(),
            70..80 => self.four_floats(),
            80..88 => self.if_then(),
            88..91 => self.exclusive(),
            91 => self.float_status(),
            _ => self.control(),
        }
    }

    /// Instructions other than jumps.
    pub(crate) fn simple(&mut self) {
        match self.below(20) {
            0..9 => self.one_of(CORE, &[]),
            9..15 => self.one_of(FLOAT, &[]),
            15..18 => self.one_of(MEMORY, &[]),
            18 => self.new_words(),
            _ => self.new_floats(),
        }
    }

    /// Instructions without memory access.
    pub(crate) fn plain(&mut self) {
        match self.below(2) {
            0 => self.one_of(CORE, &[]),
            _ => self.one_of(FLOAT, &[]),
        }
    }

    fn one_of(&mut self, patterns: &[&str], kept: &[u16]) {
        let pattern = patterns[self.below(patterns.len() as u32) as usize];
        let (base, index) = self.base_and_index();
        let instruction = self.drawn(pattern, &[], (base, index), kept);
        if pattern.contains('b') {
            self.point(base, index);
        }
        self.put(&instruction);
    }

    /// `IT` and its block; a load or store only as the last instruction.
    fn if_then(&mut self) {
        let (base, index) = self.base_and_index();
        self.point(base, index);
        let length = 1 + self.below(4);
        // The lowest set bit encodes the length, the bits above it select the inverse condition.
        let lowest = 4 - length;
        let condition = if length == 1 { self.below(15) } else { self.below(14) };
        let inverses = if condition == 14 { 0 } else { self.below(16) };
        let mask = (inverses & !((2 << lowest) - 1) | 1 << lowest) & 0xF;
        let mut block = vec![0xBF00 | (condition << 4 | mask) as u16];
        for place in 1..=length {
            let patterns = match self.below(4) {
                0 if place == length => MEMORY,
                0 | 1 => FLOAT,
                _ => CORE,
            };
            let pattern = loop {
                let pattern = patterns[self.below(patterns.len() as u32) as usize];
                // CPS is not allowed in any block.
                if !pattern.starts_with("10110110011") {
                    break pattern;
                }
            };
            let kept = if place == length { vec![] } else { vec![base, index] };
            let instruction = self.drawn(pattern, &block, (base, index), &kept);
            block.extend(instruction);
        }
        self.put(&block);
    }

    /// An exclusive load, and a store that succeeds or fails.
    fn exclusive(&mut self) {
        let (load, store) = EXCLUSIVE[self.below(EXCLUSIVE.len() as u32) as usize];
        let (base, index) = self.base_and_index();
        self.point(base, index);
        let load = self.drawn(load, &[], (base, index), &[base]);
        let store = self.drawn(store, &[], (base, index), &[]);
        let clear = self.drawn(CLEAR_EXCLUSIVE, &[], (base, index), &[]);
        if self.below(8) > 0 {
            self.put(&load);
        }
        self.one_of(FLOAT_ONLY, &[]);
        if self.below(4) == 0 {
            self.put(&clear);
        }
        self.put(&store);
    }

    /// Sets the flags of the float unit from a register.
    fn float_status(&mut self) {
        let register = self.low_register();
        self.put(&[0xF000 | register, 0x4070 | register << 8]); // and register, register, #0xF0000000
        self.put(&[0xEEE1, register << 12 | 0x0A10]); // vmsr fpscr, register
    }

    /// Loads words from the pool.
    fn new_words(&mut self) {
        let list = (self.random.next_u32() & 0x50FF | 0x11) as u16;
        self.put(&[0xE8BA, list]); // ldmia r10!, {...}
        self.pool_bytes += 4 * list.count_ones();
    }

    fn new_floats(&mut self) {
        let first = self.below(28) as u16;
        let count = 1 + self.below(8.min(32 - u32::from(first))) as u16;
        self.load_floats(first, count);
    }

    /// Arithmetic on operands that are adjacent in the pool, so that pairs of special values occur.
    fn four_floats(&mut self) {
        self.load_floats(0, 4);
        for _ in 0..3 {
            self.one_of(FOUR_FLOATS, &[]);
        }
    }

    fn load_floats(&mut self, first: u16, count: u16) {
        self.put(&[0xECBA | (first & 1) << 6, (first >> 1) << 12 | 0x0A00 | count]); // vldmia r10!, {...}
        self.pool_bytes += 4 * u32::from(count);
    }
}

/// Instructions between an exclusive load and its store: they do not write core registers or memory.
const FLOAT_ONLY: &[&str] = &["111011100x11xxxxxxxx1010xxx0xxxx", "1011111100000000"];

//! Loads and stores.

use super::{ExecuteError, Execution, Flow};
use crate::domain::Domain;
use crate::instruction::{Address, AddressMode, FloatRegister, Offset, PC, Register, Shift, Width};
use crate::state::{AccessError, Memory};

const WORD_BYTES: i32 = 4;

/// A word of the domain, or an error.
type Fallible<T> = Result<T, ExecuteError>;

impl<D: Domain, M: Memory<D>> Execution<'_, D, M> {
    /// Address of the access, and the new value of the base register.
    fn address(&mut self, address: Address) -> (D::Word, Option<D::Word>) {
        let base = self.read_base(address.base);
        let moved = match address.offset {
            Offset::Immediate(bytes) => self.displaced(base, bytes),
            Offset::Register(m, amount) => {
                let offset = self.read(m);
                let offset = self.shifted(offset, Shift::Left, amount);
                self.sum(base, offset)
            }
        };
        match address.mode {
            AddressMode::Offset => (moved, None),
            AddressMode::PreIndexed => (moved, Some(moved)),
            AddressMode::PostIndexed => (base, Some(moved)),
        }
    }

    fn write_back(&mut self, register: Register, value: Option<D::Word>) {
        if let Some(value) = value {
            self.write(register, value);
        }
    }

    /// Checks an address that must be aligned. The memory checks an unknown address.
    fn aligned(&self, address: D::Word, width: Width) -> Fallible<D::Word> {
        match self.domain.known(address) {
            Some(address) if !address.is_multiple_of(width.bytes().into()) => {
                Err(AccessError::Unaligned { address }.into())
            }
            _ => Ok(address),
        }
    }

    fn load_word(&mut self, address: D::Word) -> Fallible<D::Word> {
        Ok(self.memory.load(self.domain, address, Width::Word)?)
    }

    fn store_word(&mut self, address: D::Word, value: D::Word) -> Fallible<()> {
        Ok(self.memory.store(self.domain, address, Width::Word, value)?)
    }

    pub(super) fn load(
        &mut self,
        t: Register,
        address: Address,
        width: Width,
        is_signed: bool,
    ) -> Fallible<Flow<D>> {
        let (at, after) = self.address(address);
        let value = self.memory.load(self.domain, at, width)?;
        let value = match width {
            Width::Byte if is_signed => self.sign_extended(value, 8),
            Width::Half if is_signed => self.sign_extended(value, 16),
            _ => value,
        };
        self.write_back(address.base, after);
        if t == PC {
            return Ok(Flow::Indirect(value));
        }
        self.write(t, value);
        Ok(Flow::Next)
    }

    pub(super) fn store(&mut self, t: Register, address: Address, width: Width) -> Fallible<()> {
        let (at, after) = self.address(address);
        let value = self.read(t);
        self.memory.store(self.domain, at, width, value)?;
        self.write_back(address.base, after);
        Ok(())
    }

    pub(super) fn load_pair(&mut self, (t, t2): (Register, Register), address: Address) -> Fallible<()> {
        let (at, after) = self.address(address);
        let at = self.aligned(at, Width::Word)?;
        let value = self.load_word(at)?;
        let second = self.displaced(at, WORD_BYTES);
        let second = self.load_word(second)?;
        self.write_back(address.base, after);
        self.write(t, value);
        self.write(t2, second);
        Ok(())
    }

    pub(super) fn store_pair(&mut self, (t, t2): (Register, Register), address: Address) -> Fallible<()> {
        let (at, after) = self.address(address);
        let at = self.aligned(at, Width::Word)?;
        let (value, second) = (self.read(t), self.read(t2));
        self.store_word(at, value)?;
        let at = self.displaced(at, WORD_BYTES);
        self.store_word(at, second)?;
        self.write_back(address.base, after);
        Ok(())
    }

    /// Lowest address of a block of words at a base register, and the new value of that register.
    fn block(&mut self, n: Register, count: u32, down: bool) -> Fallible<(D::Word, D::Word)> {
        let base = self.read(n);
        let base = self.aligned(base, Width::Word)?;
        let bytes = WORD_BYTES * i32::try_from(count).map_err(|_| ExecuteError::Unmodelled)?;
        let end = self.displaced(base, if down { -bytes } else { bytes });
        Ok(if down { (end, end) } else { (base, end) })
    }

    pub(super) fn load_multiple(
        &mut self,
        n: Register,
        registers: u16,
        writes_back: bool,
        down: bool,
    ) -> Fallible<Flow<D>> {
        let (mut at, end) = self.block(n, registers.count_ones(), down)?;
        if writes_back {
            self.write(n, end);
        }
        let mut flow = Flow::Next;
        for t in listed(registers) {
            let value = self.load_word(at)?;
            if t == PC {
                flow = Flow::Indirect(value);
            } else {
                self.write(t, value);
                at = self.displaced(at, WORD_BYTES);
            }
        }
        Ok(flow)
    }

    pub(super) fn store_multiple(
        &mut self,
        n: Register,
        registers: u16,
        writes_back: bool,
        down: bool,
    ) -> Fallible<()> {
        let (mut at, end) = self.block(n, registers.count_ones(), down)?;
        for t in listed(registers) {
            let value = self.read(t);
            self.store_word(at, value)?;
            at = self.displaced(at, WORD_BYTES);
        }
        self.write_back(n, writes_back.then_some(end));
        Ok(())
    }

    pub(super) fn load_exclusive(
        &mut self,
        t: Register,
        (n, offset): (Register, u32),
        width: Width,
    ) -> Fallible<()> {
        let at = self.exclusive_address(n, offset, width)?;
        let value = self.memory.load(self.domain, at, width)?;
        self.registers.exclusive = self.domain.bit(true);
        self.write(t, value);
        Ok(())
    }

    /// Without an interrupt in between, a store after an exclusive load succeeds.
    pub(super) fn store_exclusive(
        &mut self,
        d: Register,
        t: Register,
        (n, offset): (Register, u32),
        width: Width,
    ) -> Fallible<()> {
        let at = self.exclusive_address(n, offset, width)?;
        let succeeds = self.domain.known_bit(self.registers.exclusive).ok_or(ExecuteError::Unmodelled)?;
        if succeeds {
            let value = self.read(t);
            self.memory.store(self.domain, at, width, value)?;
        }
        self.registers.exclusive = self.domain.bit(false);
        let status = self.domain.constant(u32::from(!succeeds));
        self.write(d, status);
        Ok(())
    }

    fn exclusive_address(&mut self, n: Register, offset: u32, width: Width) -> Fallible<D::Word> {
        let (base, offset) = (self.read(n), self.domain.constant(offset));
        let at = self.sum(base, offset);
        self.aligned(at, width)
    }

    fn float_address(&mut self, base: Register, offset: i32) -> Fallible<D::Word> {
        let base = self.read_base(base);
        let at = self.displaced(base, offset);
        self.aligned(at, Width::Word)
    }

    pub(super) fn float_load(
        &mut self,
        d: FloatRegister,
        is_double: bool,
        base: Register,
        offset: i32,
    ) -> Fallible<()> {
        let at = self.float_address(base, offset)?;
        self.load_floats(at, d, 1 + u8::from(is_double))
    }

    pub(super) fn float_store(
        &mut self,
        d: FloatRegister,
        is_double: bool,
        base: Register,
        offset: i32,
    ) -> Fallible<()> {
        let at = self.float_address(base, offset)?;
        self.store_floats(at, d, 1 + u8::from(is_double))
    }

    pub(super) fn float_load_multiple(
        &mut self,
        n: Register,
        (d, count): (FloatRegister, u8),
        writes_back: bool,
        down: bool,
    ) -> Fallible<()> {
        let (at, end) = self.block(n, u32::from(count), down)?;
        self.load_floats(at, d, count)?;
        self.write_back(n, writes_back.then_some(end));
        Ok(())
    }

    pub(super) fn float_store_multiple(
        &mut self,
        n: Register,
        (d, count): (FloatRegister, u8),
        writes_back: bool,
        down: bool,
    ) -> Fallible<()> {
        let (at, end) = self.block(n, u32::from(count), down)?;
        self.store_floats(at, d, count)?;
        self.write_back(n, writes_back.then_some(end));
        Ok(())
    }

    fn load_floats(&mut self, mut at: D::Word, d: FloatRegister, count: u8) -> Fallible<()> {
        for d in d..d.saturating_add(count) {
            let value = self.load_word(at)?;
            self.registers.write_float(d, value);
            at = self.displaced(at, WORD_BYTES);
        }
        Ok(())
    }

    fn store_floats(&mut self, mut at: D::Word, d: FloatRegister, count: u8) -> Fallible<()> {
        for d in d..d.saturating_add(count) {
            self.store_word(at, self.registers.read_float(d))?;
            at = self.displaced(at, WORD_BYTES);
        }
        Ok(())
    }
}

/// Registers of a list, lowest first.
fn listed(mut registers: u16) -> impl Iterator<Item = Register> {
    std::iter::from_fn(move || {
        let lowest = registers.trailing_zeros();
        registers &= registers.wrapping_sub(1);
        u8::try_from(lowest).ok().filter(|lowest| *lowest < 16)
    })
}

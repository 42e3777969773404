//! Exception entry and return (DDI 0403E B1.5.6 to B1.5.8).

use super::system::{HARD_FAULT, System};
use super::{Bus, Fault, Processor, State};
use crate::concrete::Flags;
use crate::instruction::{LR, SP, Width};
use crate::machine::Stop;
use crate::state::AccessError;
use crate::timing::Pipeline;

/// From an interrupt to the first instruction of its handler, with memory without wait states (Arm 100166,
/// "Exception handling").
const ENTRY_CYCLES: u64 = 12;
/// From a handler to the interrupted code.
const RETURN_CYCLES: u64 = 10;
/// From one handler to the next.
const TAIL_CHAIN_CYCLES: u64 = 6;

/// R0 to R3, R12, LR, the return address and xPSR.
const BASIC_FRAME: u32 = 0x20;
/// The same, plus S0 to S15 and FPSCR.
const FLOAT_FRAME: u32 = 0x68;
const FLOATS: u8 = 16;

// `EXC_RETURN`: the target mode, and the kind of frame.
const TO_HANDLER: u32 = 0xFFFF_FFF1;
const TO_THREAD: u32 = 0xFFFF_FFF9;
const HAS_BASIC_FRAME: u32 = 1 << 4;

// Fields of xPSR.
const THUMB: u32 = 1 << 24;
const REALIGNED: u32 = 1 << 9;
const EXCEPTION: u32 = 0x1FF;

impl<B: Bus> Processor<B> {
    /// Enters the handler of the most urgent interrupt if it may run now. Otherwise, wakes a sleeping
    /// processor if the interrupt wakes it.
    pub(super) fn take_interrupt(&mut self) {
        if let Some(exception) = self.system.next_exception(&self.registers) {
            self.state = match self.state {
                State::LockedUp => State::LockedUp,
                _ => State::Running,
            };
            if self.state == State::Running {
                let has_float = self.system.uses_float;
                match self.push_frame(has_float) {
                    Ok(()) => self.go(exception, has_float),
                    Err(error) => self.derive(error, has_float),
                }
            }
        } else if self.state == State::Sleeping && self.system.wakes(&self.registers) {
            self.state = State::Running;
        }
    }

    /// Returns false if no handler or no stack is available.
    pub(super) fn enter_hard_fault(&mut self) -> bool {
        self.faulted_at = self.address;
        !self.system.is_faulting() && self.enter(HARD_FAULT).is_ok()
    }

    pub(super) fn place_of_fault(&self) -> String {
        self.image.location(self.faulted_at)
    }

    /// A failed write of a frame is a separate fault. Its handler runs first, at the SP below that frame; the
    /// original exception stays pending (DDI 0403E B1.5.11, derived exceptions).
    fn derive(&mut self, error: AccessError, has_float: bool) {
        self.faulted_at = self.address;
        let locks_up = self.system.is_faulting();
        if locks_up {
            self.state = State::LockedUp;
        } else {
            self.go(HARD_FAULT, has_float);
        }
        self.faults.push(Fault {
            cycle: self.cycles,
            place: self.place_of_fault(),
            cause: error.into(),
            locks_up,
        });
    }

    fn enter(&mut self, exception: u8) -> Result<(), AccessError> {
        let has_float = self.system.uses_float;
        self.push_frame(has_float)?;
        self.go(exception, has_float);
        Ok(())
    }

    fn go(&mut self, exception: u8, has_float: bool) {
        let mode = if self.system.current() == 0 { TO_THREAD } else { TO_HANDLER };
        let link = if has_float { mode & !HAS_BASIC_FRAME } else { mode };
        self.registers.write(LR, link);
        self.system.enter(exception, has_float);
        self.jump_to_handler(exception, ENTRY_CYCLES);
    }

    fn jump_to_handler(&mut self, exception: u8, cycles: u64) {
        self.cycles += cycles;
        self.cycles += self.bus.wait(self.system.vectors(), self.cycles);
        self.address = self.vector(exception) & !1;
        self.pipeline = Pipeline::default();
        self.registers.exclusive = false;
    }

    /// Returns according to `EXC_RETURN`, or enters the next handler.
    pub(super) fn leave(&mut self, exc_return: u32) -> Result<(), Stop> {
        self.system.leave(self.bus.lines());
        self.registers.faultmask = 0;
        self.registers.exclusive = false;
        if let Some(exception) = self.system.next_exception(&self.registers) {
            self.system.chain(exception);
            self.registers.write(LR, exc_return);
            self.jump_to_handler(exception, TAIL_CHAIN_CYCLES);
            return Ok(());
        }
        self.cycles += RETURN_CYCLES;
        self.pop_frame(exc_return).or_else(|error| self.fault(error.into()))
    }

    fn push_frame(&mut self, has_float: bool) -> Result<(), AccessError> {
        let before = self.registers.read(SP);
        let realigned = before & 4 != 0;
        let bytes = if has_float { FLOAT_FRAME } else { BASIC_FRAME };
        let frame = before.wrapping_sub(bytes) & !7;
        let status = self.registers.flags.to_word()
            | self.registers.dsp_flags
            | THUMB
            | u32::from(self.system.current())
            | if realigned { REALIGNED } else { 0 };
        let core = [0, 1, 2, 3, 12, LR].map(|register| self.registers.read(register));
        let mut words = core.to_vec();
        words.extend([self.address, status]);
        if has_float {
            words.extend((0..FLOATS).map(|register| self.registers.read_float(register)));
            words.push(self.registers.float_flags.to_word());
        }
        let at = self.at();
        self.registers.write(SP, frame);
        let mut address = frame;
        for word in words {
            self.protection.check(address, true)?;
            self.bus.store(address, Width::Word, word, at)?;
            address = address.wrapping_add(4);
        }
        Ok(())
    }

    fn pop_frame(&mut self, exc_return: u32) -> Result<(), AccessError> {
        let frame = self.registers.read(SP);
        let has_float = exc_return & HAS_BASIC_FRAME == 0;
        let bytes = if has_float { FLOAT_FRAME } else { BASIC_FRAME };
        let mut address = frame;
        let at = self.at();
        let mut next = |bus: &mut B| {
            let word = bus.load(address, Width::Word, at);
            address = address.wrapping_add(4);
            word
        };
        for register in [0, 1, 2, 3, 12, LR] {
            let word = next(&mut self.bus)?;
            self.registers.write(register, word);
        }
        let target = next(&mut self.bus)?;
        let status = next(&mut self.bus)?;
        if has_float {
            for register in 0..FLOATS {
                let word = next(&mut self.bus)?;
                self.registers.write_float(register, word);
            }
            self.registers.float_flags = Flags::from_word(next(&mut self.bus)?);
        }
        self.registers.flags = Flags::from_word(status);
        self.registers.dsp_flags = status & 0x080F_0000;
        let realigned = if status & REALIGNED != 0 { 4 } else { 0 };
        self.registers.write(SP, frame.wrapping_add(bytes) | realigned);
        self.system.returned(u8::try_from(status & EXCEPTION).unwrap_or(0), has_float);
        self.address = target & !1;
        self.pipeline = Pipeline::default();
        Ok(())
    }
}

impl System {
    /// Whether a further fault could not be handled.
    fn is_faulting(&self) -> bool {
        self.is_active(HARD_FAULT)
    }
}

//! A Cortex-M4F that boots an image, with exceptions, interrupts and sleep, inside a chip.
//!
//! ```text
//! Image ──▶ Processor::step ──▶ execute ──▶ View ──▶ System: NVIC, SCB, DWT   0xE000_0000 and above
//!               ▲                             └────▶ Bus: the chip            everything else
//!               └── interrupt lines, time of the next event ──┘
//! ```
//!
//! The processor contains no memory and no peripherals: a [`Bus`] provides them. Time is counted in processor
//! clock cycles, including sleep. Instructions come from the image and are decoded once: code that a program
//! itself generates in RAM is not supported, but code that it copies to its linked address is.
//!
//! Modelled after the Armv7-M Architecture Reference Manual (DDI 0403E), chapter B1: one stack, all code
//! privileged, priorities without subgroups. Not modelled, and either an error or without effect: PSP,
//! `SysTick`, a debugger. The float registers are stacked immediately; their cycles are counted when a
//! handler first uses the float unit, like the processor's lazy stacking.

mod exceptions;
mod memory_protection;
mod system;
mod view;

use std::sync::Arc;

use self::memory_protection::MemoryProtection;
use self::system::System;
use self::view::View;
use crate::code::Code;
use crate::concrete::Concrete;
use crate::execute::{ExecuteError, Flow, execute};
use crate::image::Image;
use crate::instruction::{LR, Operation, SP, Width};
use crate::machine::{MachineError, Stop};
use crate::state::{AccessError, Registers};
use crate::timing::{Access, Caches, KnownOperands, Outcome, Pipeline, Price, Timing};

/// Values from here on are not addresses but exception returns.
const EXCEPTION_RETURN: u32 = 0xF000_0000;
/// `SYSm` numbers of special registers that the processor itself reads.
const IPSR: u8 = 5;
const CONTROL: u8 = 20;

/// Time and address of an access.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AccessPoint {
    /// Cycles since the creation of the processor.
    pub cycle: u64,
    /// Address of the instruction.
    pub code: u32,
}

/// The chip around the processor: its memory, peripherals and interrupt lines. `now` is in processor cycles.
pub trait Bus {
    /// Reads an address below `0xE000_0000`; the upper bits are zero.
    ///
    /// # Errors
    /// [`AccessError`]: causes a fault.
    fn load(&mut self, address: u32, width: Width, at: AccessPoint) -> Result<u32, AccessError>;

    /// Writes the lower bits.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    fn store(&mut self, address: u32, width: Width, value: u32, at: AccessPoint) -> Result<(), AccessError>;

    /// Wait cycles of a code access to `address` because its memory is busy.
    fn wait(&self, address: u32, now: u64) -> u64;

    /// Processes all events up to `now`.
    fn advance(&mut self, now: u64);

    /// The cycle of the next event.
    fn next_event(&self) -> u64;

    /// Active interrupt lines; bit 0 is interrupt 0.
    fn lines(&self) -> u128;

    /// Whether the chip requests a reset; [`reset`](Self::reset) is then called.
    fn wants_reset(&self, now: u64) -> bool;

    /// Resets everything except the processor; memory keeps its contents.
    fn reset(&mut self, cause: Reset, now: u64);
}

/// Cause of a reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reset {
    /// The program (`AIRCR.SYSRESETREQ`).
    Program,
    /// The chip, such as its watchdog.
    Chip,
    /// The reset pin.
    Pin,
}

/// A fault that called the program's handler or locked up the processor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Time in cycles.
    pub cycle: u64,
    /// The function and the offset from its start.
    pub place: String,
    /// Cause.
    pub cause: Stop,
    /// Whether no handler could be called: the processor then requires a reset.
    pub locks_up: bool,
}

/// State of the processor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It executes instructions.
    Running,
    /// It waits for an interrupt.
    Sleeping,
    /// It has stopped after a fault without a callable handler.
    LockedUp,
}

/// A processor in a chip.
#[derive(Debug, Clone)]
pub struct Processor<B> {
    image: Arc<Image>,
    code: Arc<Code>,
    /// Index in `code` of the last instruction.
    last: usize,
    /// Registers of the core and of the float unit.
    pub registers: Registers<Concrete>,
    /// The chip.
    pub bus: B,
    address: u32,
    /// Address of the last fault.
    faulted_at: u32,
    system: System,
    protection: MemoryProtection,
    state: State,
    faults: Vec<Fault>,
    timing: Timing,
    pipeline: Pipeline,
    caches: Caches,
    cycles: u64,
    instructions: u64,
    next_event: u64,
    masking: Masking,
}

/// Time that the program masked interrupts with PRIMASK.
#[derive(Debug, Clone, Copy, Default)]
struct Masking {
    since: Option<u64>,
    longest: u64,
    /// Address at which the longest masked period ended.
    ended_at: u32,
}

impl<B: Bus> Processor<B> {
    /// Creates a processor after reset, in a chip with the image in its memory.
    ///
    /// # Errors
    /// [`MachineError::NoSymbol`] if the image has no vector table.
    pub fn new(image: Arc<Image>, bus: B, timing: Timing) -> Result<Self, MachineError> {
        let name = "__vector_table";
        let vectors = image.symbols.get(name).or_else(|| image.symbols.get("__vector_table.0")).copied();
        let vectors = vectors
            .or_else(|| image.segments.first().map(|segment| segment.address))
            .ok_or(MachineError::NoSymbol { name })?;
        let mut processor = Self {
            code: Arc::new(Code::new(image.code.values(), &timing)),
            last: usize::MAX,
            image,
            registers: Registers::new(&mut Concrete),
            bus,
            address: 0,
            faulted_at: 0,
            system: System::new(vectors),
            protection: MemoryProtection::default(),
            state: State::Running,
            faults: Vec::new(),
            timing,
            pipeline: Pipeline::default(),
            caches: Caches::default(),
            cycles: 0,
            instructions: 0,
            next_event: 0,
            masking: Masking::default(),
        };
        processor.start();
        Ok(processor)
    }

    /// The image.
    #[must_use]
    pub fn image(&self) -> &Arc<Image> {
        &self.image
    }

    /// Cycles since creation, including sleep and the time before a reset.
    #[must_use]
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// Instructions since creation.
    #[must_use]
    pub fn instructions(&self) -> u64 {
        self.instructions
    }

    /// State of the processor.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// All faults since creation.
    #[must_use]
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// Address of the next instruction.
    #[must_use]
    pub fn address(&self) -> u32 {
        self.address
    }

    /// The current location, for display.
    #[must_use]
    pub fn location(&self) -> String {
        self.image.location(self.address)
    }

    /// The longest time that PRIMASK masked interrupts since the last call of this function, in cycles, and
    /// the location of its end.
    pub fn take_max_masked_cycles(&mut self) -> (u64, String) {
        let Masking { longest, ended_at, .. } = std::mem::take(&mut self.masking);
        (longest, self.image.location(ended_at))
    }

    /// Runs until `cycle` has passed.
    ///
    /// # Errors
    /// [`MachineError::Stopped`] if the program does something that is not modelled.
    pub fn run_until(&mut self, cycle: u64) -> Result<(), MachineError> {
        let code = Arc::clone(&self.code);
        while self.cycles < cycle {
            self.step_in(&code, cycle)?;
        }
        Ok(())
    }

    /// Executes the next instruction, enters an exception, or sleeps until the next event or `limit`.
    ///
    /// # Errors
    /// [`MachineError::Stopped`].
    pub fn step(&mut self, limit: u64) -> Result<(), MachineError> {
        self.step_in(&Arc::clone(&self.code), limit)
    }

    /// Like [`step`](Self::step). A separate reference to the code saves a copy of each instruction.
    fn step_in(&mut self, code: &Code, limit: u64) -> Result<(), MachineError> {
        if self.cycles >= self.next_event {
            self.let_time_pass();
        }
        if self.system.has_pending() {
            self.take_interrupt();
        }
        match self.state {
            State::Running => self.instruction(code).map_err(|stop| self.stopped(stop)),
            State::Sleeping | State::LockedUp => {
                self.cycles = self.next_event.min(limit).max(self.cycles + 1);
                Ok(())
            }
        }
    }

    /// Updates the processor after an external change of the chip.
    pub fn update_after_external_change(&mut self) {
        self.look_at_bus();
    }

    fn let_time_pass(&mut self) {
        self.bus.advance(self.cycles);
        self.look_at_bus();
    }

    /// Handles the chip's requests after an access or after time has passed.
    fn look_at_bus(&mut self) {
        if self.bus.wants_reset(self.cycles) {
            self.reset(Reset::Chip);
        }
        self.system.see_lines(self.bus.lines());
        self.next_event = self.bus.next_event();
    }

    /// Resets the chip and the processor.
    pub fn reset(&mut self, cause: Reset) {
        self.bus.reset(cause, self.cycles);
        self.start();
        self.next_event = self.bus.next_event();
    }

    /// State after a reset (DDI 0403E B1.5.5): the first two words of the vector table are the initial SP and
    /// the entry.
    fn start(&mut self) {
        self.registers = Registers::new(&mut Concrete);
        self.registers.write(LR, u32::MAX);
        self.system.reset(self.cycles);
        self.protection = MemoryProtection::default();
        self.state = State::Running;
        self.pipeline = Pipeline::default();
        self.masking.since = None;
        let (stack, entry) = (self.vector(0), self.vector(1));
        self.registers.write(SP, stack & !3);
        self.address = entry & !1;
    }

    fn at(&self) -> AccessPoint {
        AccessPoint { cycle: self.cycles, code: self.address }
    }

    fn vector(&mut self, exception: u8) -> u32 {
        let address = self.system.vectors().wrapping_add(u32::from(exception) * 4);
        self.bus.load(address, Width::Word, self.at()).unwrap_or(0)
    }

    fn instruction(&mut self, code: &Code) -> Result<(), Stop> {
        let Some((instruction, price)) = code.at_behind(&mut self.last, self.address) else {
            return self.fault(Stop::NoCode);
        };
        self.cycles += self.bus.wait(self.address, self.cycles);
        self.instructions += 1;
        if !self.registers.flags.satisfy(instruction.condition) {
            self.count(price, Outcome::Skipped, KnownOperands::default());
            self.address = instruction.next();
            return Ok(());
        }
        match instruction.operation {
            Operation::Wait => {
                self.count(price, Outcome::Done, KnownOperands::default());
                self.address = instruction.next();
                if !self.system.wakes(&self.registers) {
                    self.state = State::Sleeping;
                }
                return Ok(());
            }
            Operation::ReadSpecial { d, special: special @ (IPSR | CONTROL) } => {
                let value = if special == IPSR {
                    self.system.current().into()
                } else {
                    u32::from(self.system.uses_float) << 2
                };
                self.registers.write(d, value);
                self.count(price, Outcome::Done, KnownOperands::default());
                self.address = instruction.next();
                return Ok(());
            }
            _ => {}
        }
        if instruction.operation.is_float() && !self.begin_float() {
            return self.fault(Stop::Trap { operation: instruction.operation });
        }
        let division = match instruction.operation {
            Operation::Divide { n, m, .. } => Some((self.registers.read(n), self.registers.read(m))),
            _ => None,
        };
        let mut view = View::new(
            &mut self.bus,
            &mut self.system,
            &mut self.protection,
            AccessPoint { cycle: self.cycles, code: self.address },
        );
        let flow = match execute(&mut Concrete, &mut self.registers, &mut view, instruction) {
            Ok(flow) => flow,
            Err(ExecuteError::Access(error)) => return self.fault(error.into()),
            Err(error) => return Err(error.into()),
        };
        let (first_access, touches_chip) = (view.first_access, view.touches_chip);
        let target = match flow {
            Flow::Next | Flow::Branch { taken: false, .. } => None,
            Flow::Jump(target) | Flow::Branch { target, taken: true } => Some(target),
            Flow::Indirect(target) if target >= EXCEPTION_RETURN && self.system.current() != 0 => {
                let access = first_access.map(Access::at_address);
                self.count(price, Outcome::Taken, KnownOperands { access, ..KnownOperands::default() });
                return self.leave(target);
            }
            Flow::Indirect(target) if target & 1 == 1 => Some(target & !1),
            Flow::Indirect(target) => return self.fault(Stop::NotThumb { target }),
            Flow::Trap => return self.fault(Stop::Trap { operation: instruction.operation }),
        };
        let outcome = if target.is_some() { Outcome::Taken } else { Outcome::Done };
        self.count(price, outcome, KnownOperands { division, access: first_access.map(Access::at_address) });
        self.address = target.unwrap_or_else(|| instruction.next());
        if touches_chip {
            if std::mem::take(&mut self.system.wants_reset) {
                self.reset(Reset::Program);
            } else {
                self.look_at_bus();
            }
        }
        if matches!(instruction.operation, Operation::ChangeState { .. } | Operation::WriteSpecial { .. }) {
            self.see_mask();
        }
        Ok(())
    }

    /// Starts a use of the float unit. Returns false if it is disabled.
    fn begin_float(&mut self) -> bool {
        if !self.system.has_float() {
            return false;
        }
        self.cycles += self.system.begin_float();
        true
    }

    fn see_mask(&mut self) {
        match (self.registers.primask & 1 == 1, self.masking.since) {
            (true, None) => self.masking.since = Some(self.cycles),
            (false, Some(since)) => {
                self.masking.since = None;
                let masked = self.cycles - since;
                if masked > self.masking.longest {
                    (self.masking.longest, self.masking.ended_at) = (masked, self.address);
                }
            }
            _ => {}
        }
    }

    fn count(&mut self, price: &Price, outcome: Outcome, known: KnownOperands) {
        let (pipeline, caches) = (&mut self.pipeline, &mut self.caches);
        let cycles = self.timing.cached_cycles_of(pipeline, caches, price, outcome, known);
        self.cycles += u64::from(cycles);
    }

    /// Handles a fault (failed access, missing code or faulting instruction): calls the program's handler.
    fn fault(&mut self, why: Stop) -> Result<(), Stop> {
        let locks_up = !self.enter_hard_fault();
        if locks_up {
            self.state = State::LockedUp;
        }
        let place = self.place_of_fault();
        self.faults.push(Fault { cycle: self.cycles, place, cause: why, locks_up });
        Ok(())
    }

    fn stopped(&self, stop: Stop) -> MachineError {
        MachineError::Stopped { address: self.address, place: self.location(), stop }
    }

    /// Reads memory like a debugger; whether peripherals see side effects depends on the bus.
    ///
    /// # Errors
    /// [`AccessError`].
    pub fn read_word(&mut self, address: u32) -> Result<u32, AccessError> {
        self.bus.load(address, Width::Word, self.at())
    }
}

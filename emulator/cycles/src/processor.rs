//! A Cortex-M4F that boots an image: exceptions, interrupts and sleep, with a chip around it.
//!
//! ```text
//! Image ──▶ Processor::step ──▶ execute ──▶ View ──▶ System: NVIC, SCB, DWT   0xE000_0000 and above
//!               ▲                             └────▶ Bus: the chip            everything else
//!               └── interrupt lines, time of the next event ──┘
//! ```
//!
//! The processor knows no memory and no peripheral: a [`Bus`] has them. Time is counted in cycles of the processor's
//! clock, also while it sleeps. Instructions are those of the image, decoded once: code that a program writes into RAM
//! by itself is not run, but what it copies there for the linker's sake is.
//!
//! Modelled after the Armv7-M Architecture Reference Manual (DDI 0403E), chapter B1: one stack, all code privileged,
//! priorities without subgroups. Not modelled, and an error or without effect: PSP, `SysTick`, a debugger.
//! The float registers are put on the stack at once; the cycles of it are counted when a handler first uses the float
//! unit, as the processor does with its lazy stacking.

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
use crate::timing::{Access, Caches, Known, Outcome, Pipeline, Price, Timing};

/// Words that are no address: where a handler returns to.
const EXCEPTION_RETURN: u32 = 0xF000_0000;
/// What PRIMASK, FAULTMASK and BASEPRI are changed by.
const IPSR: u8 = 5;
const CONTROL: u8 = 20;

/// When and from where a program accesses something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct At {
    /// Cycles of the processor since it was made.
    pub cycle: u64,
    /// Address of the instruction.
    pub code: u32,
}

/// A chip around the processor: its memory, peripherals and interrupt lines. `now` is in cycles of the processor.
pub trait Bus {
    /// Reads below `0xE000_0000`, the upper bits zero.
    ///
    /// # Errors
    /// [`AccessError`]: the processor takes a fault.
    fn load(&mut self, address: u32, width: Width, at: At) -> Result<u32, AccessError>;

    /// Writes the lower bits.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    fn store(&mut self, address: u32, width: Width, value: u32, at: At) -> Result<(), AccessError>;

    /// Cycles that an access to code at `address` waits because its memory is busy.
    fn wait(&self, address: u32, now: u64) -> u64;

    /// Lets happen what happens by itself up to `now`.
    fn advance(&mut self, now: u64);

    /// The cycle in which something happens next by itself.
    fn next_event(&self) -> u64;

    /// Interrupt lines that are active, bit 0 that of interrupt 0.
    fn lines(&self) -> u128;

    /// Whether the chip wants to be reset; it is [`reset`](Self::reset) then.
    fn wants_reset(&self, now: u64) -> bool;

    /// Resets everything but the processor; memory stays as it is.
    fn reset(&mut self, cause: Reset, now: u64);
}

/// What resets a processor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reset {
    /// The program asked for it (`AIRCR.SYSRESETREQ`).
    Program,
    /// The chip did, such as its watchdog.
    Chip,
    /// Somebody pulled its pin.
    Pin,
}

/// A fault that the program's handler was called for, or that locked the processor up.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// When, in cycles.
    pub cycle: u64,
    /// The function and the distance from its begin.
    pub place: String,
    /// Why.
    pub why: Stop,
    /// Whether no handler could be called: only a reset helps then.
    pub locks_up: bool,
}

/// What the processor does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It executes instructions.
    Running,
    /// It waits for an interrupt.
    Sleeping,
    /// It stands still after a fault that no handler could be called for.
    LockedUp,
}

/// A processor in a chip.
#[derive(Debug, Clone)]
pub struct Processor<B> {
    image: Arc<Image>,
    code: Arc<Code>,
    /// Place in `code` of the last instruction.
    last: usize,
    /// Registers of the core and of the float unit.
    pub registers: Registers<Concrete>,
    /// The chip.
    pub bus: B,
    address: u32,
    /// Where the last fault was.
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

/// For how long the program kept interrupts out, by PRIMASK.
#[derive(Debug, Clone, Copy, Default)]
struct Masking {
    since: Option<u64>,
    longest: u64,
    /// Where the longest began to end.
    ended_at: u32,
}

impl<B: Bus> Processor<B> {
    /// A processor that was just reset, in a chip that has the image in its memory.
    ///
    /// # Errors
    /// [`MachineError::NoSymbol`] when the image has no vector table.
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

    /// The image that it runs.
    #[must_use]
    pub fn image(&self) -> &Arc<Image> {
        &self.image
    }

    /// Cycles since it was made, those asleep and before a reset, too.
    #[must_use]
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// Instructions since it was made.
    #[must_use]
    pub fn instructions(&self) -> u64 {
        self.instructions
    }

    /// What it does.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// Every fault since it was made.
    #[must_use]
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// Address of the next instruction.
    #[must_use]
    pub fn address(&self) -> u32 {
        self.address
    }

    /// Where it is, for people.
    #[must_use]
    pub fn place(&self) -> String {
        self.image.place(self.address)
    }

    /// The longest that PRIMASK kept interrupts out since this was last asked, in cycles, and where it ended.
    pub fn take_longest_masked(&mut self) -> (u64, String) {
        let Masking { longest, ended_at, .. } = std::mem::take(&mut self.masking);
        (longest, self.image.place(ended_at))
    }

    /// Runs until `cycle` has passed.
    ///
    /// # Errors
    /// [`MachineError::Stopped`] where the program does what is not modelled.
    pub fn run_until(&mut self, cycle: u64) -> Result<(), MachineError> {
        while self.cycles < cycle {
            self.step(cycle)?;
        }
        Ok(())
    }

    /// The next instruction, or an exception's entry, or sleep until the next event, up to `limit`.
    ///
    /// # Errors
    /// [`MachineError::Stopped`].
    pub fn step(&mut self, limit: u64) -> Result<(), MachineError> {
        if self.cycles >= self.next_event {
            self.let_time_pass();
        }
        if self.system.has_pending() {
            self.take_interrupt();
        }
        match self.state {
            State::Running => self.instruction().map_err(|stop| self.stopped(stop)),
            State::Sleeping | State::LockedUp => {
                self.cycles = self.next_event.min(limit).max(self.cycles + 1);
                Ok(())
            }
        }
    }

    /// Has the processor look at its chip again, behind something that came from outside.
    pub fn look_again(&mut self) {
        self.look_at_bus();
    }

    fn let_time_pass(&mut self) {
        self.bus.advance(self.cycles);
        self.look_at_bus();
    }

    /// What the chip wants after it was touched, or after time has passed.
    fn look_at_bus(&mut self) {
        if self.bus.wants_reset(self.cycles) {
            self.reset(Reset::Chip);
        }
        self.system.see_lines(self.bus.lines());
        self.next_event = self.bus.next_event();
    }

    /// Resets chip and processor.
    pub fn reset(&mut self, cause: Reset) {
        self.bus.reset(cause, self.cycles);
        self.start();
        self.next_event = self.bus.next_event();
    }

    /// As after a reset (DDI 0403E B1.5.5): the first two words of the vector table say where stack and program begin.
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

    fn at(&self) -> At {
        At { cycle: self.cycles, code: self.address }
    }

    fn vector(&mut self, exception: u8) -> u32 {
        let address = self.system.vectors().wrapping_add(u32::from(exception) * 4);
        self.bus.load(address, Width::Word, self.at()).unwrap_or(0)
    }

    fn instruction(&mut self) -> Result<(), Stop> {
        let Some((instruction, price)) = &self.code.at_behind(&mut self.last, self.address).copied() else {
            return self.fault(Stop::NoCode);
        };
        self.cycles += self.bus.wait(self.address, self.cycles);
        self.instructions += 1;
        if !self.registers.flags.hold(instruction.condition) {
            self.count(price, Outcome::Skipped, Known::default());
            self.address = instruction.next();
            return Ok(());
        }
        match instruction.operation {
            Operation::Wait => {
                self.count(price, Outcome::Done, Known::default());
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
                self.count(price, Outcome::Done, Known::default());
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
            At { cycle: self.cycles, code: self.address },
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
                let access = first_access.map(Access::at);
                self.count(price, Outcome::Taken, Known { access, ..Known::default() });
                return self.leave(target);
            }
            Flow::Indirect(target) if target & 1 == 1 => Some(target & !1),
            Flow::Indirect(target) => return self.fault(Stop::NotThumb { target }),
            Flow::Trap => return self.fault(Stop::Trap { operation: instruction.operation }),
        };
        let outcome = if target.is_some() { Outcome::Taken } else { Outcome::Done };
        self.count(price, outcome, Known { division, access: first_access.map(Access::at) });
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

    /// Lets the float unit be used; false when it is switched off.
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

    fn count(&mut self, price: &Price, outcome: Outcome, known: Known) {
        let (pipeline, caches) = (&mut self.pipeline, &mut self.caches);
        let cycles = self.timing.cached_cycles_of(pipeline, caches, price, outcome, known);
        self.cycles += u64::from(cycles);
    }

    /// A fault of an access, of code that is not there or of an instruction: the program's handler is called.
    fn fault(&mut self, why: Stop) -> Result<(), Stop> {
        let locks_up = !self.enter_hard_fault();
        if locks_up {
            self.state = State::LockedUp;
        }
        let place = self.place_of_fault();
        self.faults.push(Fault { cycle: self.cycles, place, why, locks_up });
        Ok(())
    }

    fn stopped(&self, stop: Stop) -> MachineError {
        MachineError::Stopped { address: self.address, place: self.place(), stop }
    }

    /// Reads memory as a debugger would, without effects on peripherals where the bus has none.
    ///
    /// # Errors
    /// [`AccessError`].
    pub fn read_word(&mut self, address: u32) -> Result<u32, AccessError> {
        self.bus.load(address, Width::Word, self.at())
    }
}

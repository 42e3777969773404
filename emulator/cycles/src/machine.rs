//! A processor that runs functions of an image and counts their cycles and stack.

mod calls;
mod error;
mod memory;
mod stack;

use std::sync::Arc;

pub use calls::Call;
pub use error::{MachineError, Stop};

use self::calls::{Calls, Moment};
use self::memory::Regions;
use self::stack::Stack;
use crate::code::Code;
use crate::concrete::Concrete;
use crate::execute::{Flow, execute};
use crate::image::Image;
use crate::instruction::{Instruction, LR, Operation, SP};
use crate::state::{AccessError, Registers};
use crate::timing::{Access, Caches, KnownOperands, Outcome, Pipeline, Price, Timing};

/// Return address of a called function: no memory is mapped there.
const RETURN: u32 = 0xF000_0000;
/// Default maximum number of instructions of a call.
const STEP_LIMIT: u64 = 1_000_000_000;

/// Result and cost of a call, from its first instruction to its return, including the return.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Run {
    /// R0 at the end.
    pub result: u32,
    /// Cycles of the timing model.
    pub cycles: u64,
    /// Number of instructions, including those skipped in an IT block.
    pub instructions: u64,
    /// Maximum bytes of stack reserved.
    pub stack_bytes: u32,
    /// Bytes of stack down to the lowest byte written.
    pub stack_written_bytes: u32,
    /// Calls of marked functions, in the order of their starts.
    pub calls: Vec<Call>,
}

/// A Cortex-M4F with the memory of an image: flash contents from the file, initialised variables and code
/// that is copied at startup in place, other variables zero. It has no interrupts and no peripherals: an
/// access to any other address is an error, unless [`map`](Self::map) added plain memory there.
///
/// A clone is an independent machine in the same state.
#[derive(Debug, Clone)]
pub struct Machine {
    image: Arc<Image>,
    code: Arc<Code>,
    /// Index in `code` of the last instruction.
    last: usize,
    memory: Regions,
    /// Registers of the core and of the float unit.
    pub registers: Registers<Concrete>,
    /// Address of the next instruction.
    address: u32,
    stack: Stack,
    calls: Calls,
    timing: Timing,
    pipeline: Pipeline,
    caches: Caches,
    cycles: u64,
    instructions: u64,
    step_limit: u64,
}

impl Machine {
    /// Creates a machine whose RAM is the stack and variables of the image's linker script.
    ///
    /// # Errors
    /// [`MachineError::NoSymbol`] if the image does not define the location of its RAM.
    pub fn new(image: Arc<Image>, timing: Timing) -> Result<Self, MachineError> {
        let symbol =
            |name: &'static str| image.symbols.get(name).copied().ok_or(MachineError::NoSymbol { name });
        let stack = symbol("_stack_end")?..symbol("_stack_start")?;
        let variables = symbol("__sdata")?..symbol("__euninit")?;
        let ram = stack.start.min(variables.start)..stack.end.max(variables.end);
        Ok(Self {
            code: Arc::new(Code::new(image.code.values(), &timing)),
            last: usize::MAX,
            memory: Regions::new(ram, &image),
            image,
            registers: Registers::new(&mut Concrete),
            address: RETURN,
            stack: Stack::new(stack),
            calls: Calls::default(),
            timing,
            pipeline: Pipeline::default(),
            caches: Caches::default(),
            cycles: 0,
            instructions: 0,
            step_limit: STEP_LIMIT,
        })
    }

    /// The image.
    #[must_use]
    pub fn image(&self) -> &Arc<Image> {
        &self.image
    }

    /// Makes [`call`](Self::call) report calls of these functions (addresses).
    pub fn record_calls_of(&mut self, functions: impl IntoIterator<Item = u32>) {
        self.calls.mark(functions);
    }

    /// Sets the maximum number of instructions of a call; the default is 10^9.
    pub fn set_max_instructions(&mut self, instructions: u64) {
        self.step_limit = instructions;
    }

    /// Adds plain, zeroed memory where the image has none: for arguments of calls, or in place of a
    /// peripheral.
    pub fn map(&mut self, address: u32, bytes: u32) {
        self.memory.map(address, bytes);
    }

    /// Writable memory: addresses and contents.
    pub fn writable_memory(&self) -> impl Iterator<Item = (u32, &[u8])> {
        self.memory.writable()
    }

    /// Reads memory.
    ///
    /// # Errors
    /// [`AccessError::Unmapped`]; `bytes` is then unchanged.
    pub fn read(&self, address: u32, bytes: &mut [u8]) -> Result<(), AccessError> {
        self.memory.read(address, bytes)
    }

    /// Writes memory.
    ///
    /// # Errors
    /// [`AccessError::Unmapped`], [`AccessError::ReadOnly`]; memory is then unchanged.
    pub fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), AccessError> {
        self.memory.write(address, bytes)
    }

    /// Runs a function until it returns. R0 to R3 are its arguments; the stack is empty at the start. All
    /// other state persists from the previous call.
    ///
    /// # Errors
    /// [`MachineError::Stopped`] if the function does something that is not modelled; memory and registers
    /// keep their state at that point.
    pub fn call(&mut self, address: u32, arguments: [u32; 4]) -> Result<Run, MachineError> {
        self.begin(address, arguments);
        self.stack.paint(&mut self.memory);
        while self.address != RETURN {
            self.step()?;
        }
        Ok(Run {
            result: self.registers.read(0),
            cycles: self.cycles,
            instructions: self.instructions,
            stack_bytes: self.stack.depth_bytes(),
            stack_written_bytes: self.stack.written_bytes(&self.memory),
            calls: self.calls.take(),
        })
    }

    /// Goes to the first instruction of a function, like [`call`](Self::call), for execution with
    /// [`step`](Self::step).
    pub fn begin(&mut self, address: u32, arguments: [u32; 4]) {
        let [r0, r1, r2, r3, ..] = &mut self.registers.core;
        [*r0, *r1, *r2, *r3] = arguments;
        self.registers.write(SP, self.stack.top());
        self.registers.write(LR, RETURN | 1);
        self.address = address & !1;
        self.pipeline = Pipeline::default();
        (self.cycles, self.instructions) = (0, 0);
        self.stack.begin();
        self.calls.begin();
        self.calls.jumped(self.address, &self.registers, &mut self.stack, Moment::default());
    }

    /// The next instruction; `None` after the end of the function and at an address without code.
    #[must_use]
    pub fn next(&self) -> Option<&Instruction> {
        self.code.at(self.address).map(|(instruction, _)| instruction)
    }

    /// Executes the next instruction, or skips it if its condition does not hold.
    ///
    /// # Errors
    /// [`MachineError::Stopped`].
    #[inline]
    pub fn step(&mut self) -> Result<(), MachineError> {
        self.advance().map_err(|stop| self.stopped(stop))
    }

    #[inline]
    fn advance(&mut self) -> Result<(), Stop> {
        let (instruction, price) =
            &self.code.at_behind(&mut self.last, self.address).copied().ok_or(Stop::NoCode)?;
        if self.instructions >= self.step_limit {
            return Err(Stop::StepLimit { instructions: self.step_limit });
        }
        self.instructions += 1;
        if !self.registers.flags.satisfy(instruction.condition) {
            self.count(price, Outcome::Skipped, KnownOperands::default());
            self.address = instruction.next();
            return Ok(());
        }
        let division = match instruction.operation {
            Operation::Divide { n, m, .. } => Some((self.registers.read(n), self.registers.read(m))),
            _ => None,
        };
        self.memory.first_access = None;
        let flow = execute(&mut Concrete, &mut self.registers, &mut self.memory, instruction)?;
        let target = match flow {
            Flow::Next | Flow::Branch { taken: false, .. } => None,
            Flow::Jump(target) | Flow::Branch { target, taken: true } => Some(target),
            Flow::Indirect(target) if target & 1 == 1 => Some(target & !1),
            Flow::Indirect(target) => return Err(Stop::NotThumb { target }),
            Flow::Trap => return Err(Stop::Trap { operation: instruction.operation }),
        };
        let outcome = if target.is_some() { Outcome::Taken } else { Outcome::Done };
        let access = self.memory.first_access.map(Access::at_address);
        self.count(price, outcome, KnownOperands { division, access });
        self.stack.at(self.registers.read(SP))?;
        self.address = target.unwrap_or_else(|| instruction.next());
        if target.is_some() {
            let at = Moment { cycles: self.cycles, instructions: self.instructions };
            self.calls.jumped(self.address, &self.registers, &mut self.stack, at);
        }
        Ok(())
    }

    #[inline]
    fn count(&mut self, price: &Price, outcome: Outcome, known: KnownOperands) {
        let (pipeline, caches) = (&mut self.pipeline, &mut self.caches);
        let cycles = self.timing.cached_cycles_of(pipeline, caches, price, outcome, known);
        self.cycles += u64::from(cycles);
    }

    /// An error with the address and the function, for display.
    fn stopped(&self, stop: Stop) -> MachineError {
        MachineError::Stopped { address: self.address, place: self.image.location(self.address), stop }
    }
}

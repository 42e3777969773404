//! Semantics of instructions, generic over the domain of values.
//!
//! Follows the pseudocode of the Armv7-M Architecture Reference Manual (DDI 0403E), chapter A7. Each kind of
//! instruction has its own file; this file selects the operation and returns the next address.

mod arithmetic;
mod bits;
mod branch;
mod float;
mod float_arithmetic;
mod float_convert;
mod multiply;
mod operand;
mod parallel;
mod special;
mod transfer;

use crate::domain::Domain;
use crate::instruction::{Instruction, Operation};
use crate::state::{AccessError, Memory, Registers};

/// The next address.
#[derive(Debug)]
pub(crate) enum Flow<D: Domain> {
    /// The next instruction.
    Next,
    /// An address encoded in the instruction. For a call, LR is already set.
    Jump(u32),
    /// An address from a register or memory. A clear bit 0 is a fault, because the processor supports only
    /// Thumb. For instructions that ignore this bit, it is set here.
    Indirect(D::Word),
    /// An address encoded in the instruction, if the condition holds (`CBZ`, `CBNZ`).
    Branch {
        /// Target address.
        target: u32,
        /// Condition.
        taken: D::Bit,
    },
    /// A request to the environment: supervisor call, breakpoint (semihosting), wait, undefined instruction.
    /// The operation selects which.
    Trap,
}

/// Reason that an instruction cannot be executed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ExecuteError {
    /// A failed memory access.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// The effect is not modelled.
    #[error("instruction not modelled")]
    Unmodelled,
}

/// Executes an instruction whose condition holds.
///
/// Returns an error for operations that are not modelled: reading the float status into a core register (its
/// sticky exception bits are not kept), rounding modes other than to nearest, special registers except APSR,
/// MSP, PRIMASK, FAULTMASK and BASEPRI, and an exclusive store whose success is unknown. If the instruction
/// requires alignment, an address that is certainly not divisible by four is [`AccessError::Unaligned`].
///
/// # Errors
/// [`ExecuteError`]; registers and memory may then have changed in part, as on the processor.
#[inline]
pub(crate) fn execute<D: Domain, M: Memory<D>>(
    domain: &mut D,
    registers: &mut Registers<D>,
    memory: &mut M,
    instruction: &Instruction,
) -> Result<Flow<D>, ExecuteError> {
    Execution { domain, registers, memory, instruction }.run()
}

/// The instruction in execution.
struct Execution<'a, D: Domain, M> {
    domain: &'a mut D,
    registers: &'a mut Registers<D>,
    memory: &'a mut M,
    instruction: &'a Instruction,
}

impl<D: Domain, M: Memory<D>> Execution<'_, D, M> {
    #[inline]
    fn run(&mut self) -> Result<Flow<D>, ExecuteError> {
        match self.instruction.operation {
            Operation::Move { d, operand, inverted, sets_flags } => {
                return Ok(self.move_operand(d, operand, inverted, sets_flags));
            }
            Operation::MoveTop { d, value } => self.move_top(d, value),
            Operation::Arithmetic { operator, d, n, operand, sets_flags } => {
                return Ok(self.arithmetic(operator, d, n, operand, sets_flags));
            }
            Operation::Multiply { d, n, m, a, subtracts, sets_flags } => {
                self.multiply(d, (n, m), a, subtracts, sets_flags);
            }
            Operation::MultiplyLong { kind, low, high, n, m } => {
                self.multiply_long(kind, (low, high), (n, m))
            }
            Operation::MultiplyHalves { d, n, m, a } => self.multiply_halves(d, n, m, a),
            Operation::MultiplyWide { d, n, m, a } => self.multiply_wide(d, n, m, a),
            Operation::MultiplyTop { d, n, m, a, subtracts, rounds } => {
                self.multiply_top(d, (n, m), a, subtracts, rounds);
            }
            Operation::Divide { d, n, m, is_signed } => self.divide(d, n, m, is_signed),
            Operation::Extend { kind, d, n, m, rotation } => self.extend(kind, d, n, m, rotation),
            Operation::ExtractField { d, n, min_bit, width, is_signed } => {
                self.extract_field(d, n, (min_bit, width), is_signed);
            }
            Operation::InsertField { d, n, min_bit, width } => self.insert_field(d, n, (min_bit, width)),
            Operation::Bits { kind, d, m } => self.bits(kind, d, m),
            Operation::Saturate { d, bits, is_signed, n, shift, amount } => {
                self.saturate(d, (bits, is_signed), n, (shift, amount));
            }
            Operation::Pack { d, n, m, amount, top_first } => self.pack(d, n, (m, amount), top_first),
            Operation::Parallel { kind, d, n, m } => self.parallel(kind, d, n, m),
            Operation::Load { t, address, width, is_signed } => {
                return self.load(t, address, width, is_signed);
            }
            Operation::Store { t, address, width } => self.store(t, address, width)?,
            Operation::LoadPair { t, t2, address } => self.load_pair((t, t2), address)?,
            Operation::StorePair { t, t2, address } => self.store_pair((t, t2), address)?,
            Operation::LoadMultiple { n, registers, writes_back, down } => {
                return self.load_multiple(n, registers, writes_back, down);
            }
            Operation::StoreMultiple { n, registers, writes_back, down } => {
                self.store_multiple(n, registers, writes_back, down)?;
            }
            Operation::LoadExclusive { t, n, offset, width } => self.load_exclusive(t, (n, offset), width)?,
            Operation::StoreExclusive { d, t, n, offset, width } => {
                self.store_exclusive(d, t, (n, offset), width)?;
            }
            Operation::ClearExclusive => self.registers.exclusive = self.domain.bit(false),
            Operation::Branch { target } => return Ok(Flow::Jump(target)),
            Operation::BranchLink { target } => return Ok(self.branch_link(target)),
            Operation::BranchRegister { m } => return Ok(Flow::Indirect(self.read(m))),
            Operation::BranchLinkRegister { m } => return Ok(self.branch_link_register(m)),
            Operation::CompareBranch { n, on_nonzero, target } => {
                return Ok(self.compare_branch(n, on_nonzero, target));
            }
            Operation::TableBranch { n, m, half } => return self.table_branch(n, m, half),
            // The instructions after IT carry their conditions themselves.
            Operation::IfThen { .. } | Operation::Hint | Operation::Barrier => {}
            Operation::Wait
            | Operation::SupervisorCall(_)
            | Operation::Breakpoint(_)
            | Operation::Undefined(_) => {
                return Ok(Flow::Trap);
            }
            Operation::ChangeState { disables, faults } => self.change_state(disables, faults),
            Operation::ReadSpecial { d, special } => self.read_special(d, special)?,
            Operation::WriteSpecial { n, special } => self.write_special(n, special)?,
            Operation::Float { operator, d, n, m } => self.float(operator, d, n, m),
            Operation::FloatUnary { operator, d, m } => self.float_unary(operator, d, m),
            Operation::FloatImmediate { d, bits } => {
                let value = self.domain.constant(bits);
                self.registers.write_float(d, value);
            }
            Operation::FloatCompare { d, m, quiet_signals: _ } => self.float_compare(d, m),
            Operation::FloatConvert { kind, d, m } => self.float_convert(kind, d, m),
            Operation::FloatLoad { d, is_double, base, offset } => {
                self.float_load(d, is_double, base, offset)?
            }
            Operation::FloatStore { d, is_double, base, offset } => {
                self.float_store(d, is_double, base, offset)?
            }
            Operation::FloatLoadMultiple { n, d, count, writes_back, down } => {
                self.float_load_multiple(n, (d, count), writes_back, down)?;
            }
            Operation::FloatStoreMultiple { n, d, count, writes_back, down } => {
                self.float_store_multiple(n, (d, count), writes_back, down)?;
            }
            Operation::FloatFromCore { d, t } => {
                let value = self.read(t);
                self.registers.write_float(d, value);
            }
            Operation::FloatToCore { t, m } => {
                let value = self.registers.read_float(m);
                self.write(t, value);
            }
            Operation::FloatPairFromCore { d, t, t2 } => {
                let values = (self.read(t), self.read(t2));
                self.registers.write_float(d, values.0);
                self.registers.write_float(d + 1, values.1);
            }
            Operation::FloatPairToCore { t, t2, m } => {
                let values = (self.registers.read_float(m), self.registers.read_float(m + 1));
                self.write(t, values.0);
                self.write(t2, values.1);
            }
            Operation::FloatStatusRead { t } => self.float_status_read(t)?,
            Operation::FloatStatusWrite { t } => self.float_status_write(t)?,
        }
        Ok(Flow::Next)
    }
}
